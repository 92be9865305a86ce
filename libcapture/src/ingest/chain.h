#pragma once

// The heaviest chain of pairs that increases in pictures and in shots, and how much worse each other pair is.

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace lumihull::capture {

/// A picture that may be a shot's, by clock `clock`, and what that is worth above leaving both out.
struct Pair {
  std::size_t picture = 0, shot = 0, clock = 0;
  double gain = 0;
};

struct Chains {
  double best = 0;                ///< weight of the heaviest chain
  std::vector<std::size_t> path;  ///< its pairs, as indices, in order
  std::vector<double> through;    ///< for each pair: weight of the heaviest chain that contains it
};

/// pairs: sorted by picture. A step from clock a to clock b costs cost[a * clocks + b]; cost[a * clocks + a] = 0.
/// A heaviest increasing subsequence with a Fenwick tree of maxima for each clock: O(pairs · clocks · log shots).
Chains heaviest_chains(std::span<const Pair> pairs, std::size_t shots, std::size_t clocks,
                       std::span<const double> cost);

}  // namespace lumihull::capture
