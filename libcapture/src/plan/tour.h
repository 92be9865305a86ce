#pragma once

// The shortest path through places, both ends given or free: a local search, and the exact answer for few places.

#include <lumihull/base/job.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace lumihull::capture::internal {

/// Places are numbers of the caller's. Costs are symmetric.
struct PathProblem {
  std::vector<int> places;               ///< to be visited, each once
  int before = -1, after = -1;           ///< where the path comes from and goes to; -1: anywhere, at no cost
  std::function<double(int, int)> cost;  ///< as far as it is known: never more than the true one
  /// The true cost, from now on `cost`'s answer, too. Asked only for what the path would use.
  std::function<double(int, int)> true_cost;
  std::function<double(int, int)> distance;  ///< cheap, for neighbour lists
  std::vector<std::vector<int>> starts;      ///< orders to begin with, beside the nearest neighbour's
};

/// Sum along a path with its ends, by `cost`.
double path_cost(const PathProblem& problem, const std::vector<int>& order);

/// 2-opt and Or-opt, then `kicks` double bridges. Deterministic for a seed.
std::vector<int> short_path(const PathProblem& problem, int kicks, std::uint64_t seed, Job& job);

}  // namespace lumihull::capture::internal
