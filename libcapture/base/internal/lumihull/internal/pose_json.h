#pragma once

// A pose's fields in JSON, the same wherever Lumihull's own files hold poses: {"q": [w, x, y, z], "t": [x, y, z]}.

#include <lumihull/base/pose.h>
#include <lumihull/internal/json.h>

#include <cmath>

namespace lumihull::internal {

inline Pose read_pose(const JsonReader& json) {
  const JsonReader q = json.at("q"), t = json.at("t");
  if (q.array_size(4) != 4) q.fail("four numbers w, x, y, z");
  if (t.array_size(3) != 3) t.fail("three numbers");
  Pose pose;
  pose.rotation =
      Eigen::Quaterniond(q.at(0).number(-2, 2), q.at(1).number(-2, 2), q.at(2).number(-2, 2), q.at(3).number(-2, 2));
  if (std::abs(pose.rotation.norm() - 1) > 1e-6) q.fail("a quaternion of length 1");
  // Normalising what is already normalised to rounding would change the last digit at each round trip.
  if (std::abs(pose.rotation.norm() - 1) > 1e-14) pose.rotation.normalize();
  for (std::size_t k = 0; k < 3; ++k) pose.translation[Eigen::Index(k)] = t.at(k).number();
  return pose;
}

inline Json print_pose(const Pose& pose) {
  const auto& q = pose.rotation;
  const auto& t = pose.translation;
  return {{"q", {q.w(), q.x(), q.y(), q.z()}}, {"t", {t.x(), t.y(), t.z()}}};
}

}  // namespace lumihull::internal
