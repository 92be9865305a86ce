#include "clock_vote.h"

#include <algorithm>
#include <cmath>

namespace lumihull::capture {

std::vector<ClockOffset> vote_offsets(std::span<const double> pictures, std::span<const double> shots,
                                      std::size_t most) {
  if (pictures.empty() || shots.empty()) return {};
  const std::size_t stride = 1 + pictures.size() * shots.size() / kMostVotes;
  std::vector<double> votes;
  votes.reserve(pictures.size() * (shots.size() / stride + 1));
  for (std::size_t j = 0; j < shots.size(); j += stride)
    for (const double p : pictures) votes.push_back(p - shots[j]);
  std::sort(votes.begin(), votes.end());

  struct Window {
    std::size_t first, count;
  };
  std::vector<Window> windows;
  std::size_t fullest = 0;
  const auto each_window = [&](const auto& visit) {
    for (std::size_t first = 0, end = 0; first < votes.size(); ++first) {
      while (end < votes.size() && votes[end] - votes[first] <= kVoteWindow_s) ++end;
      visit(first, end - first);
    }
  };
  each_window([&](std::size_t, std::size_t count) { fullest = std::max(fullest, count); });
  const std::size_t least = std::max<std::size_t>(pictures.size() == 1 || shots.size() == 1 ? 1 : 2, fullest / 10);
  each_window([&](std::size_t first, std::size_t count) {
    if (count >= least) windows.push_back({first, count});
  });
  std::stable_sort(windows.begin(), windows.end(), [](const Window& a, const Window& b) { return a.count > b.count; });

  std::vector<ClockOffset> out;
  for (const Window& w : windows) {
    if (out.size() == most) break;
    const double offset = votes[w.first + w.count / 2];
    const bool overlaps = std::any_of(
        out.begin(), out.end(), [&](const ClockOffset& o) { return std::abs(o.offset_s - offset) < kVoteWindow_s; });
    if (!overlaps) out.push_back({offset, w.count});
  }
  return out;
}

}  // namespace lumihull::capture
