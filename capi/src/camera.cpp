#include <lumihull/base/camera.h>

#include <limits>

#include "arguments.h"
#include "context.h"

using namespace lumihull;
using namespace lumihull::capi;

namespace {
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using RowMajor23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;
}  // namespace

lh_status lh_camera_project(lh_context* ctx, const lh_camera* camera, const double* points, size_t n, double* pixels,
                            double* jacobians) {
  return guarded(ctx, [&] {
    const Camera c = camera_from(camera, "camera");
    array(points, n, 3, "points");
    array(pixels, n, 2, "pixels");
    for (size_t i = 0; i < n; ++i) {
      Matrix23d jacobian = Matrix23d::Constant(kNaN);
      const auto pixel = c.project(Eigen::Map<const Eigen::Vector3d>(points + 3 * i), jacobians ? &jacobian : nullptr);
      Eigen::Map<Eigen::Vector2d>(pixels + 2 * i) = pixel.value_or(Eigen::Vector2d::Constant(kNaN));
      if (!pixel) jacobian.setConstant(kNaN);
      if (jacobians) Eigen::Map<RowMajor23>(jacobians + 6 * i) = jacobian;
    }
  });
}

lh_status lh_camera_unproject(lh_context* ctx, const lh_camera* camera, const double* pixels, size_t n, double* rays) {
  return guarded(ctx, [&] {
    const Camera c = camera_from(camera, "camera");
    array(pixels, n, 2, "pixels");
    array(rays, n, 3, "rays");
    for (size_t i = 0; i < n; ++i)
      Eigen::Map<Eigen::Vector3d>(rays + 3 * i) =
          c.ray(Eigen::Map<const Eigen::Vector2d>(pixels + 2 * i)).value_or(Eigen::Vector3d::Constant(kNaN));
  });
}

lh_status lh_pose_look_at(lh_context* ctx, const double eye[3], const double target[3], const double up[3],
                          double cam_from_world[12]) {
  return guarded(ctx, [&] {
    const Eigen::Map<const Eigen::Vector3d> e(&given(eye, "eye")), t(&given(target, "target")), u(&given(up, "up"));
    given(cam_from_world, "cam_from_world");
    const Eigen::Vector3d forward = t - e;
    const double sine = forward.cross(u).norm() / (forward.norm() * u.norm());
    if (!e.allFinite() || !t.allFinite() || !(sine > 1e-9))  // not finite, no length, or parallel
      invalid("expected finite vectors, eye and target apart, up not parallel to the line of sight", "up");
    pose_to(look_at(e, t, u), cam_from_world);
  });
}
