// Orders of stops: the paper's raster, and one that travels less.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/capture/planner.h>
#include <lumihull/capture/workspace.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "expect.h"
#include "tour.h"
#include "ways.h"

namespace lumihull::capture {
namespace {

using internal::expect_between;

using internal::Way;

constexpr double kBlocked_s = 1e6;  // so long that any other order is preferred

/// Stops that share a bearing, and where the camera is turned to it: indices into Planner::stops_.
struct Group {
  std::vector<int> turns;  // places where it may be, the lowest one first; none: it need not be turned
  int turn = -1;           // the one that is taken
  std::vector<int> stops;
};

class Planner {
 public:
  Planner(const Mechanism& mechanism, const HemisphereOptions& views, const PlannerOptions& options, Job& job)
      : mechanism_(mechanism),
        views_(views),
        options_(options),
        job_(job),
        object_(options.object ? &*options.object : nullptr),
        finder_(mechanism, object_, views.center, options.limits) {
    check(mechanism);
    check(views);
    check(options);
  }

  PlannedTour raster() {
    if (!views_.thin) views_.bearing_tolerance_rad = 0;
    keep_stops_that_can_be_taken();
    if (views_.thin) gather_in_columns();
    make_groups();
    keep_largest_part();
    std::vector<int> order;
    for (const Group& group : groups_) {
      if (group.turn >= 0) order.push_back(group.turn);
      order.insert(order.end(), group.stops.begin(), group.stops.end());
    }
    return finished(order);
  }

  PlannedTour shortest() {
    keep_stops_that_can_be_taken();
    make_groups();
    keep_largest_part();
    if (views_.bearing == Bearing::gravity) choose_turns();
    std::vector<int> order;
    job_.begin("ordering the stops", groups_.size());
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const Group& group = groups_[g];
      const internal::PathProblem problem =
          path_through(group, group.turn, g + 1 < groups_.size() ? groups_[g + 1].turn : -1);
      if (group.turn >= 0) order.push_back(group.turn);
      const std::vector<int> path = internal::short_path(problem, options_.kicks, options_.seed + g, job_);
      order.insert(order.end(), path.begin(), path.end());
      job_.advance();
    }
    job_.end();
    return finished(order);
  }

 private:
  const Pose& pose(int i) const { return stops_[std::size_t(i)].world_from_platform; }
  Pose pose_at(double azimuth, double phi) const {
    return platform_pose(views_.center, views_.radius_m, azimuth, phi, views_.tilt_factor, views_.tilt_offset_rad);
  }

  internal::PathProblem path_through(const Group& group, int before, int after) {
    internal::PathProblem problem;
    problem.places = group.stops;
    problem.before = before;
    problem.after = after;
    problem.cost = [this](int a, int b) { return cost_s(a, b); };
    problem.true_cost = [this](int a, int b) { return way_s(a, b); };
    problem.distance = [this](int a, int b) { return motion_distance(mechanism_, pose(a), pose(b)); };
    problem.starts = meanders(group.stops);
    return problem;
  }

  /// Of each group's places the ones between which paths are shortest in sum: a path's length depends on where it
  /// begins and where the next one does, so that the best sequence is found exactly (Viterbi 1967).
  void choose_turns() {
    constexpr int kKicks = 10;  // the paths need not be the best ones to be compared
    std::vector<std::vector<std::size_t>> came(groups_.size());
    std::vector<double> total(groups_.front().turns.size(), 0);
    job_.begin("choosing where the camera is turned", groups_.size());
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const std::vector<int> last{-1}, &next = g + 1 < groups_.size() ? groups_[g + 1].turns : last;
      std::vector<double> with(next.size(), std::numeric_limits<double>::infinity());
      came[g].resize(next.size());
      for (std::size_t u = 0; u < next.size(); ++u)
        for (std::size_t t = 0; t < total.size(); ++t) {
          const internal::PathProblem problem = path_through(groups_[g], groups_[g].turns[t], next[u]);
          const std::vector<int> path = internal::short_path(problem, kKicks, options_.seed + g, job_);
          if (const double sum = total[t] + internal::path_cost(problem, path); sum < with[u])
            with[u] = sum, came[g][u] = t;
        }
      total = std::move(with);
      job_.advance();
    }
    job_.end();
    std::size_t best = 0;
    for (std::size_t g = groups_.size(); g-- > 0;) {
      best = came[g][best];
      groups_[g].turn = groups_[g].turns[best];
    }
  }

  void keep_stops_that_can_be_taken() {
    std::vector<PlannedStop> all = hemisphere_stops(mechanism_, views_);
    std::vector<PoseJudgement> judged(all.size());
    job_.begin("reaching the stops", all.size());
    parallel_chunks(
        job_, all.size(), 16,
        [&](std::size_t first, std::size_t last) {
          for (std::size_t i = first; i < last; ++i)
            judged[i] = judge_pose(mechanism_, all[i].world_from_platform, object_, options_.limits);
        },
        true);
    job_.end();
    std::vector<PoseJudgement> refused;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (judged[i].ok()) {
        stops_.push_back(std::move(all[i]));
      } else {
        tour_.left_out.push_back(all[i].name);
        refused.push_back(std::move(judged[i]));
      }
    }
    tour_.left_out_why = obstacles_in_words(refused);
    if (!stops_.empty()) return;
    std::string why;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, tour_.left_out_why.size()); ++i)
      why += "; " + tour_.left_out_why[i];
    throw Error(ErrorCode::degenerate, "none of the " + std::to_string(all.size()) + " stops can be taken" + why,
                mechanism_.name);
  }

  /// Rows with fewer azimuths have none in common: each stop belongs to the equator's nearest azimuth.
  void gather_in_columns() {
    std::size_t columns = 0;
    for (const PlannedStop& stop : hemisphere_stops(mechanism_, views_))
      columns += std::abs(stop.phi_rad - views_.phi_to_rad) < 1e-9;
    const double step = 2 * std::numbers::pi / double(columns);
    for (PlannedStop& stop : stops_) {
      const double azimuth = step * double(std::lround(stop.theta_rad / step) % long(columns));
      if (views_.bearing == Bearing::gravity) stop.roll_rad = azimuth;
      stop.cam_from_world = cam_from_platform(mechanism_, stop.roll_rad) * stop.world_from_platform.inverse();
    }
    std::stable_sort(stops_.begin(), stops_.end(), [&](const PlannedStop& a, const PlannedStop& b) {
      const long i = std::lround(a.theta_rad / step) % long(columns),
                 j = std::lround(b.theta_rad / step) % long(columns);
      return i != j ? i < j : a.phi_rad < b.phi_rad;
    });
  }

  /// By bearing, in the order of the azimuths.
  void make_groups() {
    const int photographed = int(stops_.size());
    std::map<double, std::size_t> known;
    for (int i = 0; i < photographed; ++i) {
      const double roll = views_.bearing == Bearing::gravity ? stops_[std::size_t(i)].roll_rad : 0;
      const auto [at, added] = known.emplace(roll, groups_.size());
      if (added) groups_.emplace_back();
      groups_[at->second].stops.push_back(i);
    }
    if (views_.bearing != Bearing::gravity) return;
    std::vector<Group> usable;
    std::string why;
    for (Group& group : groups_) {
      const double azimuth = stops_[std::size_t(group.stops.front())].roll_rad;
      for (PlannedStop& place : turning_places(azimuth, int(usable.size()), &why)) {
        group.turns.push_back(int(stops_.size()));
        stops_.push_back(std::move(place));
      }
      if (!group.turns.empty()) {
        group.turn = group.turns.front();
        usable.push_back(std::move(group));
      } else {
        for (const int i : group.stops) tour_.left_out.push_back(stops_[std::size_t(i)].name);
        tour_.left_out_why.push_back("at " + std::to_string(group.stops.size()) + " stops: " + why);
      }
    }
    groups_ = std::move(usable);
    if (groups_.empty()) throw Error(ErrorCode::degenerate, why, mechanism_.name);
  }

  /// Places of an azimuth that can be taken and are tilted enough: the lowest one, and some of the rows above it.
  std::vector<PlannedStop> turning_places(double azimuth, int number, std::string* why_not) const {
    constexpr double kDegree = std::numbers::pi / 180, kRounding_rad = 1e-9;
    constexpr std::size_t kMostPlaces = 4;
    std::string why;
    const auto tilted = [&](double phi) {
      return phi >= 0 && views_.tilt_rad(phi) >= options_.release_tilt_rad - kRounding_rad;
    };
    const auto can_be_taken = [&](double phi) {
      const PoseJudgement judged = judge_pose(mechanism_, pose_at(azimuth, phi), object_, options_.limits);
      if (!judged.ok() && why.empty()) why = judged.obstacles.front().text;
      return judged.ok();
    };
    std::vector<double> usable;
    for (double phi = views_.phi_to_rad; tilted(phi); phi -= kDegree)
      if (can_be_taken(phi)) {
        usable.push_back(phi);
        break;
      }
    if (!usable.empty()) {
      std::vector<double> rows;  // where the platform stops anyway
      for (const PlannedStop& stop : stops_)
        if (stop.photograph && stop.phi_rad < usable.front() - kDegree && tilted(stop.phi_rad))
          rows.push_back(stop.phi_rad);
      std::sort(rows.begin(), rows.end(), std::greater<>());
      rows.erase(std::unique(rows.begin(), rows.end(), [](double a, double b) { return a - b < kDegree; }), rows.end());
      std::erase_if(rows, [&](double phi) { return !can_be_taken(phi); });
      const std::size_t more = std::min(rows.size(), kMostPlaces - 1);
      for (std::size_t k = 1; k <= more; ++k) usable.push_back(rows[k * rows.size() / more - 1]);
    }
    std::vector<PlannedStop> places;
    for (const double phi : usable) {
      PlannedStop stop = platform_stop(mechanism_, views_.center, pose_at(azimuth, phi), azimuth);
      char name[32];
      std::snprintf(name, sizeof name, "turn-%03d", number);
      stop.name = name;
      stop.photograph = false;
      stop.settle_s = options_.turn_s, stop.exposure_s = 0;
      places.push_back(std::move(stop));
    }
    if (!places.empty()) return places;
    char text[300];
    if (why.empty())
      std::snprintf(text, sizeof text,
                    "the camera can't be turned by gravity: at the largest polar angle the platform is tilted by %.1f "
                    "degrees, at least %.1f are needed",
                    views_.tilt_rad(views_.phi_to_rad) / kDegree, options_.release_tilt_rad / kDegree);
    else
      std::snprintf(text, sizeof text, "the camera can't be turned to azimuth %.1f degrees: %s", azimuth / kDegree,
                    why.c_str());
    *why_not = text;
    return {};
  }

  /// Straight lines between neighbours that are open; stops beyond the largest connected part are left out.
  void keep_largest_part() {
    constexpr std::size_t kNeighbours = 10;
    const int n = int(stops_.size());
    struct Line {
      int to;
      Way way;
    };
    std::vector<std::vector<Line>> lines(std::size_t(n), std::vector<Line>{});
    job_.begin("ways between the stops", std::uint64_t(n));
    parallel_for(
        job_, std::size_t(n),
        [&](std::size_t i) {
          std::vector<std::pair<double, int>> near;
          for (int j = 0; j < n; ++j)
            if (j != int(i)) near.emplace_back(motion_distance(mechanism_, pose(int(i)), pose(j)), j);
          const std::size_t count = std::min(kNeighbours, near.size());
          std::partial_sort(near.begin(), near.begin() + std::ptrdiff_t(count), near.end());
          near.resize(count);
          if (int(i) + 1 < n) near.emplace_back(0, int(i) + 1);  // the next one down the same azimuth
          for (const auto& [distance, j] : near) lines[i].push_back({j, finder_.straight(pose(int(i)), pose(j))});
        },
        true);
    job_.end();
    std::vector<int> part(std::size_t(n), 0);
    std::iota(part.begin(), part.end(), 0);
    const std::function<int(int)> root = [&](int i) {
      while (part[std::size_t(i)] != i) i = part[std::size_t(i)] = part[std::size_t(part[std::size_t(i)])];
      return i;
    };
    roads_.assign(std::size_t(n), {});
    for (int i = 0; i < n; ++i)
      for (const Line& line : lines[std::size_t(i)]) {
        if (!line.way.open) continue;
        roads_[std::size_t(i)].emplace_back(line.to, line.way.duration_s);
        roads_[std::size_t(line.to)].emplace_back(i, line.way.duration_s);
        part[std::size_t(root(i))] = root(line.to);
      }
    // A stop counts where its camera can be turned, too.
    std::map<int, std::size_t> photographs;
    for (const Group& group : groups_)
      for (const int i : group.stops)
        photographs[root(i)] += group.turns.empty() || std::any_of(group.turns.begin(), group.turns.end(),
                                                                   [&](int turn) { return root(turn) == root(i); });
    int largest = std::max_element(photographs.begin(), photographs.end(), [](const auto& a, const auto& b) {
                    return a.second < b.second;
                  })->first;
    std::map<int, std::vector<int>> parts;
    for (int i = 0; i < n; ++i) parts[root(i)].push_back(i);
    for (const auto& [other, members] : parts)
      if (other != root(largest) && join(members, parts[largest])) part[std::size_t(root(other))] = root(largest);
    largest = root(largest);
    std::map<std::string, int> why;
    std::vector<Group> kept;
    for (Group& group : groups_) {
      const bool needs_turn = !group.turns.empty();
      std::erase_if(group.turns, [&](int turn) { return root(turn) != largest; });
      const bool turned = !needs_turn || !group.turns.empty();
      if (turned && needs_turn) group.turn = group.turns.front();
      std::vector<int> reached;
      for (const int i : group.stops) {
        if (turned && root(i) == largest) {
          reached.push_back(i);
          continue;
        }
        tour_.left_out.push_back(stops_[std::size_t(i)].name);
        std::string reason = "what lies between";
        for (const int from : {i, group.turn})
          if (from >= 0)
            for (const Line& line : lines[std::size_t(from)])
              if (!line.way.open) reason = line.way.why;
        ++why[reason];
      }
      group.stops = std::move(reached);
      if (!group.stops.empty()) kept.push_back(std::move(group));
    }
    for (const auto& [reason, count] : why)
      tour_.left_out_why.push_back(std::to_string(count) + " stops can't be reached from the others: " + reason);
    groups_ = std::move(kept);
    if (groups_.empty()) throw Error(ErrorCode::degenerate, tour_.left_out_why.back(), mechanism_.name);
  }

  /// A way round what lies between two parts; the places on it become places that other ways may use.
  bool join(const std::vector<int>& part, const std::vector<int>& largest) {
    constexpr std::size_t kTries = 5;
    std::vector<std::tuple<double, int, int>> pairs;
    for (const int i : part)
      for (const int j : largest) pairs.emplace_back(motion_distance(mechanism_, pose(i), pose(j)), i, j);
    const std::size_t count = std::min(kTries, pairs.size());
    std::partial_sort(pairs.begin(), pairs.begin() + std::ptrdiff_t(count), pairs.end());
    for (std::size_t k = 0; k < count; ++k) {
      const auto [distance, i, j] = pairs[k];
      const Way found = finder_.find(pose(i), pose(j));
      if (!found.open) continue;
      int last = i;
      for (std::size_t v = 0; v <= found.via.size(); ++v) {
        int next = j;
        if (v < found.via.size()) {
          next = int(stops_.size());
          stops_.push_back(platform_stop(mechanism_, views_.center, found.via[v], 0));
          roads_.emplace_back();
        }
        const double duration = plan_move(mechanism_, pose(last), pose(next)).duration_s();
        roads_[std::size_t(last)].emplace_back(next, duration);
        roads_[std::size_t(next)].emplace_back(last, duration);
        last = next;
      }
      return true;
    }
    return false;
  }

  /// Straight, round what is in the way, or from stop to stop.
  Way way(int a, int b) const {
    Way found = finder_.find(pose(a), pose(b));
    if (found.open) return found;
    // Dijkstra 1959 over the open lines between neighbours.
    std::vector<double> least(stops_.size(), std::numeric_limits<double>::infinity());
    std::vector<int> before(stops_.size(), -1);
    std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> open;
    least[std::size_t(a)] = 0;
    open.emplace(0, a);
    while (!open.empty()) {
      const auto [so_far, i] = open.top();
      open.pop();
      if (i == b) break;
      if (so_far > least[std::size_t(i)]) continue;
      for (const auto& [j, duration] : roads_[std::size_t(i)])
        if (so_far + duration < least[std::size_t(j)]) {
          least[std::size_t(j)] = so_far + duration;
          before[std::size_t(j)] = i;
          open.emplace(so_far + duration, j);
        }
    }
    if (before[std::size_t(b)] < 0) return found;
    found = Way();
    found.open = true;
    found.duration_s = least[std::size_t(b)];
    for (int i = b; i != a; i = before[std::size_t(i)]) {
      const int last = before[std::size_t(i)];
      found.length_m += (pose(i).translation - pose(last).translation).norm();
      if (last != a) found.via.push_back(pose(last));
    }
    std::reverse(found.via.begin(), found.via.end());
    return found;
  }

  static std::uint64_t key(int a, int b) {
    return (std::uint64_t(std::min(a, b)) << 32) | std::uint64_t(std::uint32_t(std::max(a, b)));
  }

  /// As far as it is known.
  double cost_s(int a, int b) const {
    const auto known = ways_.find(key(a, b));
    return known != ways_.end() ? known->second : least_duration_s(mechanism_, pose(a), pose(b));
  }
  double way_s(int a, int b) {
    const auto [at, added] = ways_.try_emplace(key(a, b), 0);
    if (!added) return at->second;
    const Way found = way(a, b);
    return at->second = found.open ? found.duration_s : kBlocked_s;
  }

  /// Up one column and down the next; along one row and back the next.
  std::vector<std::vector<int>> meanders(const std::vector<int>& stops) const {
    std::vector<std::vector<int>> orders;
    for (const bool columns : {true, false})
      for (const bool up : {true, false}) {
        const auto major = [&](int i) {
          const PlannedStop& s = stops_[std::size_t(i)];
          return columns ? s.theta_rad : s.phi_rad;
        };
        const auto minor = [&](int i) {
          const PlannedStop& s = stops_[std::size_t(i)];
          return columns ? s.phi_rad : s.theta_rad;
        };
        std::vector<int> order = stops;
        std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
          return major(a) != major(b) ? major(a) < major(b) : minor(a) < minor(b);
        });
        bool turn = up;
        for (std::size_t i = 0; i < order.size(); turn = !turn) {
          std::size_t end = i;
          while (end < order.size() && major(order[end]) == major(order[i])) ++end;
          if (turn) std::reverse(order.begin() + std::ptrdiff_t(i), order.begin() + std::ptrdiff_t(end));
          i = end;
        }
        orders.push_back(std::move(order));
      }
    return orders;
  }

  /// The stops in order, with the ways between them, times and pauses.
  PlannedTour finished(const std::vector<int>& order) {
    Plan& plan = tour_.plan;
    plan.robot = "cables";
    plan.mechanism = mechanism_;
    plan.object = options_.object;
    plan.cameras = options_.cameras;
    int pictures = 0;
    for (std::size_t k = 0; k < order.size(); ++k) {
      PlannedStop stop = stops_[std::size_t(order[k])];
      if (k > 0) {
        const PlannedStop& last = stops_[std::size_t(order[k - 1])];
        const Way found = way(order[k - 1], order[k]);
        if (!found.open)
          throw Error(ErrorCode::degenerate, "no way from " + last.name + " to " + stop.name + ": " + found.why,
                      mechanism_.name);
        tour_.travel_m += found.length_m;
        tour_.travel_s += found.duration_s;
        add_ways_round(found, last.roll_rad);
        stop.travel_s =
            plan_move(mechanism_, plan.stops.back().world_from_platform, stop.world_from_platform).duration_s();
      }
      if (stop.photograph) {
        if (options_.pictures_per_battery > 0 && pictures == options_.pictures_per_battery) {
          stop.pause = "Change the batteries of camera and end-effector: " + std::to_string(pictures) +
                       " pictures since the last change.";
          tour_.notes.push_back("pause before " + stop.name + ": the battery, after " + std::to_string(pictures) +
                                " pictures");
          pictures = 0;
        }
        ++pictures;
      } else {
        ++tour_.turns;
      }
      plan.stops.push_back(std::move(stop));
    }
    check(plan, mechanism_.name);
    return std::move(tour_);
  }

  void add_ways_round(const Way& way, double roll) {
    for (const Pose& pose : way.via) {
      PlannedStop stop = platform_stop(mechanism_, views_.center, pose, roll);
      char name[32];
      std::snprintf(name, sizeof name, "way-%04d", tour_.ways_round++);
      stop.name = name;
      stop.photograph = false;
      stop.settle_s = 0, stop.exposure_s = 0;
      stop.travel_s = plan_move(mechanism_, tour_.plan.stops.back().world_from_platform, pose).duration_s();
      tour_.plan.stops.push_back(std::move(stop));
    }
  }

  const Mechanism& mechanism_;
  HemisphereOptions views_;
  const PlannerOptions& options_;
  Job& job_;
  const KeepOut* object_;
  internal::WayFinder finder_;
  std::vector<PlannedStop> stops_;  // that are photographed, where the camera is turned, places on ways round
  std::vector<Group> groups_;
  std::vector<std::vector<std::pair<int, double>>> roads_;  // open lines to neighbours: to which stop, s
  std::unordered_map<std::uint64_t, double> ways_;          // s
  PlannedTour tour_;
};

}  // namespace

void check(const PlannerOptions& o) {
  expect_between(o.limits.clearance_m, -10, 100, "clearance, m");
  expect_between(o.limits.cable_clearance_m, -10, 100, "clearance of cables, m");
  expect_between(o.turn_s, 0, 86400, "time to turn the camera, s");
  expect_between(o.release_tilt_rad, 0, std::numbers::pi / 2, "tilt for turning the camera, rad");
  expect_between(o.pictures_per_battery, 0, 1e9, "pictures a battery");
  expect_between(o.kicks, 0, 1e8, "kicks");
}

PlannedTour plan_tour(const Mechanism& mechanism, const HemisphereOptions& views, const PlannerOptions& options,
                      Job& job) {
  return Planner(mechanism, views, options, job).shortest();
}

PlannedTour raster_tour(const Mechanism& mechanism, const HemisphereOptions& views, const PlannerOptions& options,
                        Job& job) {
  return Planner(mechanism, views, options, job).raster();
}

}  // namespace lumihull::capture
