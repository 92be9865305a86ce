#pragma once

// Which offsets of a camera's clock the times speak for.

#include <cstddef>
#include <span>
#include <vector>

namespace lumihull::capture {

struct ClockOffset {
  double offset_s = 0;    ///< median of its votes
  std::size_t votes = 0;  ///< pairs of a picture and a shot
};

/// Every pair votes for the difference of its times; the offsets are the fullest windows of kVoteWindow_s, no two of
/// them overlapping, at most `most`, each with at least a tenth of the first one's votes and two.
/// Beyond kMostVotes pairs only every n-th shot votes.
inline constexpr double kVoteWindow_s = 1.6;
inline constexpr std::size_t kMostVotes = 8'000'000;
std::vector<ClockOffset> vote_offsets(std::span<const double> pictures, std::span<const double> shots,
                                      std::size_t most);

}  // namespace lumihull::capture
