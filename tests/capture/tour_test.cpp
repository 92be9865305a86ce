// Paths by local search against the exact answer by dynamic programming (Held & Karp 1962).
#include "plan/tour.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "support.h"

namespace lumihull::capture::internal {
namespace {

double unit(std::mt19937_64& random) { return double(random() >> 11) * 0x1p-53; }

/// Points in a square; some lines between them are blocked, which is known only when asked for the true cost.
struct Field {
  std::vector<Eigen::Vector2d> points;
  std::set<std::pair<int, int>> blocked;
  std::map<std::pair<int, int>, double> known;
  int asked = 0;

  Field(int n, double share_blocked, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    for (int i = 0; i < n; ++i) points.emplace_back(unit(random), unit(random));
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j)
        if (unit(random) < share_blocked) blocked.insert({i, j});
  }
  double straight(int a, int b) const { return (points[std::size_t(a)] - points[std::size_t(b)]).norm(); }
  double truth(int a, int b) const { return straight(a, b) * (blocked.contains(std::minmax(a, b)) ? 3 : 1); }

  PathProblem problem(int before, int after) {
    PathProblem p;
    for (int i = 0; i < int(points.size()); ++i)
      if (i != before && i != after) p.places.push_back(i);
    p.before = before, p.after = after;
    p.cost = [this](int a, int b) {
      const auto at = known.find(std::minmax(a, b));
      return at != known.end() ? at->second : straight(a, b);
    };
    p.true_cost = [this](int a, int b) {
      ++asked;
      return known[std::minmax(a, b)] = truth(a, b);
    };
    p.distance = [this](int a, int b) { return straight(a, b); };
    return p;
  }
};

double true_length(const Field& field, const PathProblem& p, const std::vector<int>& order) {
  double total = 0;
  for (std::size_t i = 1; i < order.size(); ++i) total += field.truth(order[i - 1], order[i]);
  if (p.before >= 0) total += field.truth(p.before, order.front());
  if (p.after >= 0) total += field.truth(order.back(), p.after);
  return total;
}

double exact(const Field& field, const PathProblem& p) {
  const int n = int(p.places.size());
  const std::size_t sets = std::size_t(1) << n;
  std::vector<double> best(sets * std::size_t(n), std::numeric_limits<double>::infinity());
  const auto at = [&](std::size_t set, int last) -> double& { return best[set * std::size_t(n) + std::size_t(last)]; };
  for (int i = 0; i < n; ++i)
    at(std::size_t(1) << i, i) = p.before >= 0 ? field.truth(p.before, p.places[std::size_t(i)]) : 0;
  for (std::size_t set = 1; set < sets; ++set)
    for (int i = 0; i < n; ++i) {
      const double so_far = at(set, i);
      if (!std::isfinite(so_far)) continue;
      for (int j = 0; j < n; ++j) {
        if (set >> j & 1) continue;
        double& next = at(set | std::size_t(1) << j, j);
        next = std::min(next, so_far + field.truth(p.places[std::size_t(i)], p.places[std::size_t(j)]));
      }
    }
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < n; ++i)
    least = std::min(least, at(sets - 1, i) + (p.after >= 0 ? field.truth(p.places[std::size_t(i)], p.after) : 0));
  return least;
}

TEST(Tour, FindsTheShortestPathThroughFewPlaces) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const int n = 4 + int(seed % 8);
    Field field(n, seed % 2 ? 0.3 : 0, seed);
    const PathProblem p = field.problem(seed % 3 ? 0 : -1, seed % 5 ? 1 : -1);
    Job job;
    const std::vector<int> order = short_path(p, 300, 1, job);
    std::vector<int> sorted = order, all = p.places;
    std::sort(sorted.begin(), sorted.end());
    std::sort(all.begin(), all.end());
    EXPECT_EQ(sorted, all);
    EXPECT_NEAR(true_length(field, p, order), exact(field, p), 1e-9);
    EXPECT_NEAR(path_cost(p, order), true_length(field, p, order), 1e-9) << "each line of it was checked";
  }
}

TEST(Tour, FewPlacesNeedNoSearch) {
  Job job;
  Field field(3, 0, 1);
  PathProblem p = field.problem(0, 1);
  EXPECT_EQ(short_path(p, 10, 1, job), std::vector<int>{2});
  p.places.clear();
  EXPECT_TRUE(short_path(p, 10, 1, job).empty());
}

TEST(Tour, OfManyPlacesIsNearTheExpectedLength) {
  // Shortest paths through n random points in a unit square tend to 0.7124 sqrt(n) (Johnson & McGeoch 1996), with a
  // boundary's share of about 0.33 / 0.7124 / n more.
  Field field(1000, 0, 7);
  const PathProblem p = field.problem(-1, -1);
  Job job;
  const double length = true_length(field, p, short_path(p, 3000, 1, job));
  EXPECT_LT(length, 0.7124 * std::sqrt(1000.0) * 1.12);
  EXPECT_GT(length, 0.7124 * std::sqrt(1000.0) * 0.97);
  EXPECT_LT(field.asked, 60000) << "only what is used is checked, not all 500,000 lines";
}

TEST(Tour, DependsOnTheSeedAlone) {
  Job job;
  std::vector<int> orders[3];
  for (int i = 0; i < 3; ++i) {
    Field field(80, 0.2, 3);
    orders[i] = short_path(field.problem(-1, -1), 200, i < 2 ? 5 : 6, job);
  }
  EXPECT_EQ(orders[0], orders[1]);
  EXPECT_NE(orders[0], orders[2]);
}

TEST(Tour, CanBeCancelled) {
  Field field(50, 0, 3);
  Job job;
  job.cancel();
  EXPECT_EQ(test::expect_error([&] { short_path(field.problem(-1, -1), 200, 1, job); }).code(), ErrorCode::cancelled);
}

}  // namespace
}  // namespace lumihull::capture::internal
