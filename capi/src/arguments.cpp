#include "arguments.h"

#include <Eigen/LU>
#include <cmath>

namespace lumihull::capi {

namespace {
constexpr double kRotationTolerance = 1e-6;
}

void give_text(std::string_view text, char* buffer, std::size_t size, std::size_t* needed) {
  if (!buffer && !needed) invalid("expected a buffer or `needed`, found NULL for both", "buffer");
  if (buffer && size < text.size() + 1)
    invalid("expected at least " + std::to_string(text.size() + 1) + " bytes, found " + std::to_string(size), "buffer");
  if (buffer) {
    std::copy(text.begin(), text.end(), buffer);
    buffer[text.size()] = '\0';
  }
  if (needed) *needed = text.size() + 1;
}

Camera camera_from(const lh_camera* user, const char* name) {
  given(user, name);
  const lh_camera c = read_struct(user, name);
  Camera camera;
  camera.width = c.width, camera.height = c.height;
  camera.f = c.f, camera.s = c.s, camera.skew = c.skew, camera.u0 = c.u0, camera.v0 = c.v0;
  camera.k1 = c.k1, camera.k2 = c.k2, camera.k3 = c.k3, camera.p1 = c.p1, camera.p2 = c.p2;
  try {
    camera.validate();
  } catch (const Error& e) {  // from a file it is bad input; here it is the caller's argument
    throw Error(ErrorCode::invalid_argument, e.message(), e.subject().empty() ? name : e.subject());
  }
  return camera;
}

lh_camera camera_to(const Camera& c) {
  return {sizeof(lh_camera), c.width, c.height, c.f, c.s, c.skew, c.u0, c.v0, c.k1, c.k2, c.k3, c.p1, c.p2};
}

Pose pose_from(const double* matrix, const char* name) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(&given(matrix, name));
  if (!m.allFinite()) invalid("expected finite numbers", name);
  const Eigen::Matrix3d r = m.leftCols<3>();
  // A negation, so that what overflows fails as well.
  if (!((r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= kRotationTolerance))
    invalid("expected a rotation matrix to within 1e-6 in columns 0 to 2 (row-major, 3 x 4)", name);
  if (r.determinant() < 0) invalid("expected a rotation, found a reflection (determinant -1)", name);
  return Pose::from_matrix(r, m.col(3));
}

void pose_to(const Pose& pose, double* matrix) {
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(matrix, 3, 4) = pose.matrix();
}

}  // namespace lumihull::capi
