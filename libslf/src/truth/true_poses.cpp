// Poses against the true ones, and whether their covariances say how good they are.
#include <lumihull/base/error.h>

#include <Eigen/Dense>
#include <map>
#include <numbers>
#include <set>

#include "parts.h"
#include "spread.h"

namespace lumihull::slf::truth {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix67d = Eigen::Matrix<double, 6, 7>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// The small motion (rotation vector, translation) after `truth` that makes `found` of it.
Vector6d motion_between(const Pose& truth, const Pose& found) {
  const Pose d = found * truth.inverse();
  const Eigen::AngleAxisd turn(d.rotation);
  Vector6d e;
  e << turn.angle() * turn.axis(), d.translation;
  return e;
}

/// The information of a stated covariance; nullopt where there is none or it says that something is known exactly.
std::optional<Matrix6d> information(const Capture& capture, std::size_t shot) {
  const auto& quality = capture.shots[shot].pose_quality;
  if (!quality) return std::nullopt;
  const Eigen::LLT<Matrix6d> llt(quality->covariance);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return llt.solve(Matrix6d::Identity());
}

/// How the motion after cam_from_world changes with a turn, a shift and a growth of the world:
/// (R ω, -R ω x t + R τ - σ t).
Matrix67d by_world(const Pose& cam_from_world) {
  const Eigen::Matrix3d r = cam_from_world.rotation.toRotationMatrix();
  Matrix67d j = Matrix67d::Zero();
  j.block<3, 3>(0, 0) = r;
  j.block<3, 3>(3, 0) = cross_matrix(cam_from_world.translation) * r;
  j.block<3, 3>(3, 3) = r;
  j.block<3, 1>(3, 6) = -cam_from_world.translation;
  return j;
}

struct Known {
  std::size_t index = 0;  // into pairs
  Pose found;
  Vector6d error;
  Matrix6d information;
};

/// Removes from the errors what a motion of the world (with `scale`: a growth, too) takes off, by least squares.
void take_off_gauge(std::vector<Known>& known, bool scale) {
  const int n = scale ? 7 : 6;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (const Known& k : known) {
    const Eigen::MatrixXd j = by_world(k.found).leftCols(n);
    normal += j.transpose() * k.information * j;
    right += j.transpose() * k.information * k.error;
  }
  const Eigen::VectorXd gauge = normal.ldlt().solve(right);
  for (Known& k : known) k.error -= by_world(k.found).leftCols(n) * gauge;
}

}  // namespace

std::vector<Pair> paired_shots(const Capture& capture, const TrueCameras& cameras, PoseTruth& poses) {
  std::vector<Pair> pairs;
  std::set<std::string> names;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    const Shot& shot = capture.shots[i];
    names.insert(shot.name);
    const auto truth = cameras.views.find(shot.name);
    if (truth == cameras.views.end())
      poses.not_in_truth.push_back(shot.name);
    else if (!shot.cam_from_world)
      poses.not_placed.push_back(shot.name);
    else
      pairs.push_back({i, truth->second});
  }
  for (const std::string& name : cameras.names)
    if (!names.contains(name)) poses.not_in_capture.push_back(name);
  return pairs;
}

void compare_poses(const Capture& capture, std::span<const Pair> pairs, const CameraAlignment& alignment,
                   const std::optional<Similarity>& by_targets, PoseTruth& poses) {
  const Similarity& s = alignment.truth_from_capture;
  poses.scale = s.scale;
  poses.motion = s.motion;
  poses.aligned_by_rotations = alignment.by_rotations;
  std::vector<double> centers, rotations;
  std::vector<Known> known;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Pose& found = *capture.shots[pairs[i].shot].cam_from_world;
    PoseTruth::Shot& shot = poses.shots.emplace_back();
    shot.name = capture.shots[pairs[i].shot].name;
    shot.center_mm = 1000 * (s * found.center() - pairs[i].truth.center()).norm();
    shot.rotation_deg =
        180 / std::numbers::pi * found.rotation.angularDistance(s.in_capture(pairs[i].truth.cam_from_world).rotation);
    centers.push_back(shot.center_mm);
    rotations.push_back(shot.rotation_deg);
    if (const auto info = information(capture, pairs[i].shot)) {
      const Similarity& datum = by_targets ? *by_targets : s;
      known.push_back({i, found, motion_between(datum.in_capture(pairs[i].truth.cam_from_world), found), *info});
    }
  }
  poses.center_mm = spread_of(centers);
  poses.rotation_deg = spread_of(rotations);
  if (capture.unit == Unit::metres && !alignment.by_rotations) {
    std::vector<Pose> found, truth;
    for (const Pair& p : pairs) {
      found.push_back(*capture.shots[p.shot].cam_from_world);
      truth.push_back(p.truth.cam_from_world);
    }
    if (const auto free = align_cameras(found, truth, false))
      poses.scale_error_ppm = 1e6 * (1 / free->truth_from_capture.scale - 1);
  }
  const bool scale = capture.unit != Unit::metres;
  const int gauge = by_targets ? 0 : scale ? 7 : 6;
  if (6 * known.size() <= std::size_t(gauge)) return;
  if (!by_targets) take_off_gauge(known, scale);
  double sum = 0;
  for (const Known& k : known) {
    const double m2 = k.error.dot(k.information * k.error);
    poses.shots[k.index].mahalanobis2 = m2;
    sum += m2;
  }
  poses.consistency = sum / double(6 * known.size() - std::size_t(gauge));
  poses.consistency_by_targets = by_targets.has_value();
}

}  // namespace lumihull::slf::truth
