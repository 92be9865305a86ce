#include <lumihull/base/error.h>
#include <lumihull/base/pose.h>

namespace lumihull {

Pose look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up) {
  const Eigen::Vector3d z = (target - eye).normalized();
  Eigen::Vector3d x = z.cross(up);
  if (!(x.norm() > 1e-9 * up.norm())) x = z.unitOrthogonal();  // looking along `up`: any roll will do
  x.normalize();
  Eigen::Matrix3d r;
  r << x.transpose(), z.cross(x).transpose(), z.transpose();
  return Pose::from_matrix(r, -(r * eye));
}

}  // namespace lumihull
