#include <lumihull/calib/resect.h>

#include <vector>

#include "arguments.h"
#include "context.h"

using namespace lumihull;
using namespace lumihull::capi;

lh_status lh_resect(lh_context* ctx, const lh_camera* camera, const double* pixels, const double* world, size_t n,
                    const lh_resect_options* options, double cam_from_world[12], lh_resection* result,
                    uint8_t* outlier) {
  return guarded(ctx, [&] {
    const Camera c = camera_from(camera, "camera");
    const auto px = array(pixels, n, 2, "pixels"), xyz = array(world, n, 3, "world");
    const auto o = read_struct(options, "options");
    given(cam_from_world, "cam_from_world");
    if (result) checked_struct_size(result->struct_size, "result");
    if (o.radii) given(o.normals, "options.normals");

    std::vector<calib::PointMatch> matches(n);
    for (size_t i = 0; i < n; ++i) {
      calib::PointMatch& m = matches[i];
      m.pixel = Eigen::Map<const Eigen::Vector2d>(&px[2 * i]);
      m.world = Eigen::Map<const Eigen::Vector3d>(&xyz[3 * i]);
      if (o.covariances) m.covariance = Eigen::Map<const Eigen::Matrix2d>(o.covariances + 4 * i);
      if (o.radii) m.radius = o.radii[i], m.normal = Eigen::Map<const Eigen::Vector3d>(o.normals + 3 * i);
    }
    calib::ResectOptions settings;
    settings.robust = o.not_robust == 0;
    settings.outlier_sigma = or_default(o.outlier_sigma, settings.outlier_sigma);
    settings.max_iterations = or_default(o.max_iterations, std::int32_t(settings.max_iterations));
    settings.seed = or_default(o.seed, settings.seed);
    const calib::Resection r = calib::resect(c, matches, settings);

    pose_to(r.cam_from_world, cam_from_world);
    if (result) {
      lh_resection out{};
      Eigen::Map<Eigen::Matrix<double, 6, 6>>(out.covariance) = r.covariance;  // symmetric
      out.rms_px = r.rms_px, out.sigma0 = r.sigma0;
      out.outliers = r.outliers.size(), out.iterations = r.iterations;
      if (r.alternative) {
        out.has_alternative = 1;
        pose_to(*r.alternative, out.alternative);
        out.alternative_chi2_ratio = r.alternative_chi2_ratio;
      }
      write_struct(result, out, "result");
    }
    if (outlier) {
      std::fill(outlier, outlier + n, std::uint8_t(0));
      for (const std::uint32_t i : r.outliers) outlier[i] = 1;
    }
  });
}
