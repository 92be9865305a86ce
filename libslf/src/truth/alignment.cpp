#include "alignment.h"

#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>

namespace lumihull::slf::truth {
namespace {

constexpr double kLine = 1e-3;  // centres whose second principal axis is shorter than this share lie on a line

struct Moments {
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = from;            // means
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero(), spread = product;  // Σ (y - ȳ)(x - x̄)ᵀ, Σ (x - x̄)(x - x̄)ᵀ
};

Moments moments_of(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to) {
  Moments m;
  for (std::size_t i = 0; i < from.size(); ++i) m.from += from[i], m.to += to[i];
  m.from /= double(from.size());
  m.to /= double(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    m.product += (to[i] - m.to) * (from[i] - m.from).transpose();
    m.spread += (from[i] - m.from) * (from[i] - m.from).transpose();
  }
  return m;
}

Similarity with_rotation(const Eigen::Matrix3d& rotation, const Moments& m, bool rigid) {
  Similarity s;
  const double square = m.spread.trace();
  if (!rigid && square > 0) s.scale = (rotation.transpose() * m.product).trace() / square;
  s.motion = Pose::from_matrix(rotation, m.to - s.scale * (rotation * m.from));
  return s;
}

}  // namespace

Similarity align_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to, bool rigid) {
  const Moments m = moments_of(from, to);
  return with_rotation(internal::nearest_rotation(m.product).rotation, m, rigid);
}

std::optional<CameraAlignment> align_cameras(std::span<const Pose> cam_from_capture,
                                             std::span<const Pose> cam_from_truth, bool rigid) {
  std::vector<Eigen::Vector3d> from, to;
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < cam_from_capture.size(); ++i) {
    from.push_back(cam_from_capture[i].center());
    to.push_back(cam_from_truth[i].center());
    turns += (cam_from_truth[i].rotation.conjugate() * cam_from_capture[i].rotation).toRotationMatrix();
  }
  if (from.empty()) return std::nullopt;
  const Moments m = moments_of(from, to);
  const Eigen::Vector3d axes = internal::symmetric_axes(m.spread).values.cwiseMax(0).cwiseSqrt();
  if (!rigid && !(axes[2] > 0)) return std::nullopt;
  CameraAlignment a;
  a.by_rotations = from.size() < 3 || !(axes[1] > kLine * axes[2]);
  a.truth_from_capture =
      with_rotation(internal::nearest_rotation(a.by_rotations ? turns : m.product).rotation, m, rigid);
  if (!(a.truth_from_capture.scale > 0)) return std::nullopt;
  return a;
}

}  // namespace lumihull::slf::truth
