// bench_planner: travel of plans against the paper's raster, and against lower bounds: no order is shorter than the sum
// of the bearings' one-trees (Held & Karp 1970), whose edges are moves without regard to winches and obstacles.
#include <lumihull/capture/planner.h>
#include <lumihull/capture/workspace.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

using namespace lumihull;
using namespace lumihull::capture;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// No path through all places from the first to the last is shorter: spanning trees with prices on places, raised
/// where a place has more than two lines and lowered where it has one (subgradients).
double path_bound(const std::vector<std::vector<double>>& cost) {
  const std::size_t n = cost.size();
  if (n < 2) return 0;
  std::vector<double> price(n, 0);
  double best = 0, step = 0.1;
  for (int round = 0; round < 300; ++round, step *= 0.98) {
    std::vector<double> least(n, std::numeric_limits<double>::infinity());
    std::vector<std::size_t> from(n, 0);
    std::vector<int> lines(n, 0);
    std::vector<bool> in(n, false);
    double total = 0;
    least[0] = 0;
    for (std::size_t k = 0; k < n; ++k) {
      std::size_t next = n;
      for (std::size_t i = 0; i < n; ++i)
        if (!in[i] && (next == n || least[i] < least[next])) next = i;
      in[next] = true;
      total += least[next];
      if (k > 0) ++lines[next], ++lines[from[next]];
      for (std::size_t i = 0; i < n; ++i)
        if (const double c = cost[next][i] + price[next] + price[i]; !in[i] && c < least[i])
          least[i] = c, from[i] = next;
    }
    for (std::size_t i = 0; i < n; ++i) total -= price[i] * (i == 0 || i + 1 == n ? 1 : 2);
    best = std::max(best, total);
    for (std::size_t i = 0; i < n; ++i) price[i] += step * (lines[i] - (i == 0 || i + 1 == n ? 1 : 2));
  }
  return best;
}

/// Where the camera may be turned to a stop's bearing: the rows of its azimuth that are tilted enough.
std::vector<Pose> turning_poses(const HemisphereOptions& views, double release_tilt_rad, double azimuth) {
  std::vector<Pose> poses;
  for (int row = 0; row < views.rows; ++row) {
    const double phi = views.phi_from_rad + (views.phi_to_rad - views.phi_from_rad) * row / std::max(1, views.rows - 1);
    if (views.tilt_rad(phi) >= release_tilt_rad - 1e-9)
      poses.push_back(
          platform_pose(views.center, views.radius_m, azimuth, phi, views.tilt_factor, views.tilt_offset_rad));
  }
  return poses;
}

/// No tour that takes the bearings in the plan's order, and turns the camera at a row that is tilted enough, costs
/// less: from each turn to the next by `path_bound`, over the best sequence of places to turn (Viterbi 1967).
double bound(const Plan& plan, const HemisphereOptions& views, double release_tilt_rad,
             const std::function<double(const Pose&, const Pose&)>& cost_of) {
  std::vector<std::vector<const PlannedStop*>> groups;
  bool turned = true;
  for (const PlannedStop& stop : plan.stops) {
    if (stop.name.starts_with("turn")) turned = true;
    if (!stop.photograph) continue;
    if (std::exchange(turned, false)) groups.emplace_back();
    groups.back().push_back(&stop);
  }
  const bool gravity = views.bearing == Bearing::gravity;
  const auto turns_of = [&](std::size_t g) {
    return gravity ? turning_poses(views, release_tilt_rad, groups[g].front()->roll_rad) : std::vector<Pose>();
  };
  std::vector<double> total(std::max<std::size_t>(1, turns_of(0).size()), 0);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const std::vector<Pose> from = turns_of(g), to = g + 1 < groups.size() ? turns_of(g + 1) : std::vector<Pose>();
    std::vector<double> with(std::max<std::size_t>(1, to.size()), std::numeric_limits<double>::infinity());
    for (std::size_t u = 0; u < with.size(); ++u)
      for (std::size_t t = 0; t < total.size(); ++t) {
        std::vector<const Pose*> part;
        if (!from.empty()) part.push_back(&from[t]);
        for (const PlannedStop* stop : groups[g]) part.push_back(&stop->world_from_platform);
        if (!to.empty()) part.push_back(&to[u]);
        // A free end is a place at no distance from all.
        const std::size_t before = from.empty(), n = part.size() + before + to.empty();
        std::vector<std::vector<double>> cost(n, std::vector<double>(n, 0));
        for (std::size_t a = 0; a < part.size(); ++a)
          for (std::size_t b = 0; b < part.size(); ++b) cost[before + a][before + b] = cost_of(*part[a], *part[b]);
        with[u] = std::min(with[u], total[t] + path_bound(cost));
      }
    total = with;
  }
  return *std::min_element(total.begin(), total.end());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Travel of plans beside the raster's and lower bounds.");
  std::string file;
  int kicks = 1000;
  app.add_option("--mechanism", file, "mechanism.json; else the paper's");
  app.add_option("--kicks", kicks);
  CLI11_PARSE(app, argc, argv);
  try {
    const Mechanism mechanism = file.empty() ? paper_mechanism() : read_mechanism(file);
    Job job;
    std::printf(
        "radius steps    bearing     stops left  raster m      s   plan m      s   less m  less s  bound m      s  "
        "cpu s\n");
    for (const double radius : {1.2, 1.5, 1.8})
      for (const auto& [azimuths, rows] : {std::pair{12, 6}, std::pair{24, 10}, std::pair{36, 16}})
        for (const double tolerance : {-1.0, 0.0, 8.0, 16.0}) {
          HemisphereOptions views;
          views.radius_m = radius, views.azimuths = azimuths, views.rows = rows;
          views.bearing = tolerance < 0 ? Bearing::motor : Bearing::gravity;
          views.bearing_tolerance_rad = std::max(0.0, tolerance) * kDegree;
          PlannerOptions options;
          options.object = KeepOut{{0, 0, -1}, 0.35, 1.0};
          options.kicks = kicks;
          char bearing[32];
          std::snprintf(bearing, sizeof bearing, tolerance < 0 ? "motor" : "gravity %g", tolerance);
          try {
            const PlannedTour raster = raster_tour(mechanism, views, options, job);
            const std::clock_t start = std::clock();
            const PlannedTour tour = plan_tour(mechanism, views, options, job);
            const double cpu = double(std::clock() - start) / CLOCKS_PER_SEC;
            std::printf("%6.1f %2dx%-2d  %-12s %4zu %4zu %9.1f %6.0f %8.1f %6.0f %7.0f%% %6.0f%% %8.1f %6.0f %6.2f\n",
                        radius, azimuths, rows, bearing, tour.plan.stops.size(), tour.left_out.size(), raster.travel_m,
                        raster.travel_s, tour.travel_m, tour.travel_s, 100 * (1 - tour.travel_m / raster.travel_m),
                        100 * (1 - tour.travel_s / raster.travel_s),
                        bound(tour.plan, views, options.release_tilt_rad,
                              [](const Pose& a, const Pose& b) { return (a.translation - b.translation).norm(); }),
                        bound(tour.plan, views, options.release_tilt_rad,
                              [&](const Pose& a, const Pose& b) { return least_duration_s(mechanism, a, b); }),
                        cpu);
          } catch (const std::exception& e) {
            std::printf("%6.1f %2dx%-2d  %-12s %s\n", radius, azimuths, rows, bearing, e.what());
          }
          std::fflush(stdout);
        }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
