#pragma once

#include "lens/pose_fit.h"

namespace lumihull::calib {

struct PoseCandidate {
  LocalPose pose;
  Score score;
};

/// Poses from samples of three points, best first, at most `keep` that differ; none where no sample has an answer.
///
/// Scores are truncated squared residuals at `limit` standard deviations (MSAC: Torr & Zisserman 2000). Each new best
/// is improved on its inliers (LO-RANSAC: Chum, Matas & Kittler 2003), and samples end once an all-good one was drawn
/// with a probability of 1 - 1e-5 at the share of inliers that is known. Few points: all triples. Circles: the sampled
/// ellipses' centres are met, not the projected ones.
std::vector<PoseCandidate> search_pose(ResectionPoints& points, double limit, std::uint64_t seed, std::size_t keep);

}  // namespace lumihull::calib
