#pragma once

#include <lumihull/base/error.h>
#include <lumihull/capture/mechanism.h>

#include <string>

// What the functions of a mechanism at a pose share.

namespace lumihull::capture::internal {

inline constexpr double kShortest_m = 1e-6;  ///< a shorter cable has no direction

/// Error{invalid_argument} where fixed-size results could not hold the cables, or a pose is not finite.
inline void need_usable(const Mechanism& mechanism, const Pose& pose) {
  if (mechanism.cables.empty() || mechanism.cables.size() > 12)
    throw Error(ErrorCode::invalid_argument, "expected 1 to 12 cables, not " + std::to_string(mechanism.cables.size()),
                mechanism.name);
  if (!pose.translation.allFinite() || !pose.rotation.coeffs().allFinite())
    throw Error(ErrorCode::invalid_argument, "expected a finite pose of the platform", mechanism.name);
}

/// Cables of one point: they can't cross there.
inline bool same_point(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).squaredNorm() < kShortest_m * kShortest_m;
}

[[noreturn]] inline void fail_without_direction(const Cable& cable) {
  throw Error(ErrorCode::degenerate, "the cable has no length at this pose", "cable " + cable.name);
}

}  // namespace lumihull::capture::internal
