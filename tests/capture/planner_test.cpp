// Plans of the paper's robot: shorter than the raster, and each way of them checked by other means than the planner's.
#include <lumihull/capture/plan_report.h>
#include <lumihull/capture/planner.h>
#include <lumihull/capture/statics.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "support.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

HemisphereOptions paper_views() {
  HemisphereOptions views;
  views.bearing_tolerance_rad = 8 * kDegree;
  return views;
}

PlannerOptions around_a_bust() {
  PlannerOptions options;
  options.object = KeepOut{{0, 0, -1}, 0.35, 1.0};
  options.kicks = 100;
  return options;
}

std::vector<std::string> names(const Plan& plan) {
  std::vector<std::string> all;
  for (const PlannedStop& stop : plan.stops) all.push_back(stop.name);
  return all;
}

double tilt(const Pose& pose) { return std::acos(std::clamp((pose.rotation * Vector3d::UnitZ()).z(), -1.0, 1.0)); }

/// Each way of a plan every centimetre, its times, and where the camera is turned.
void expect_sound(const Plan& plan, const PlannerOptions& options, double tolerance_rad, bool motor = false) {
  const Mechanism& mechanism = *plan.mechanism;
  std::set<std::string> once;
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    const PlannedStop& stop = plan.stops[i];
    SCOPED_TRACE(stop.name);
    EXPECT_TRUE(once.insert(stop.name).second);
    if (stop.photograph) {
      EXPECT_LE(std::abs(std::remainder(stop.roll_rad - stop.theta_rad, 2 * std::numbers::pi)), tolerance_rad + 1e-9);
    }
    if (i == 0) continue;
    const PlannedStop& last = plan.stops[i - 1];
    if (!motor && stop.roll_rad != last.roll_rad) {
      EXPECT_FALSE(stop.photograph);
      EXPECT_GE(tilt(stop.world_from_platform), options.release_tilt_rad - 1e-7);  // acos near its end
      // Gravity turns it to the azimuth to which the platform is tilted.
      const Vector3d axis = stop.world_from_platform.rotation * Vector3d::UnitZ();
      EXPECT_NEAR(std::remainder(std::atan2(axis.y(), axis.x()) - stop.roll_rad, 2 * std::numbers::pi), 0, 1e-9);
    }
    const Pose &a = last.world_from_platform, &b = stop.world_from_platform;
    EXPECT_FALSE(first_crossing(mechanism, a, b));
    EXPECT_NEAR(stop.travel_s, plan_move(mechanism, a, b).duration_s(), 1e-9);
    const int steps = 1 + int((b.translation - a.translation).norm() / 0.01);
    for (int k = 0; k <= steps; ++k) {
      const Pose pose = between(a, b, double(k) / steps);
      EXPECT_EQ(static_test(mechanism, pose), Balance::controlled);
      const Clearance c = clearance(mechanism, pose, &*options.object);
      // Between the planner's checks, 5 cm apart, a distance may change by half of that.
      EXPECT_GE(std::min({c.cable_object, c.platform_object, c.platform_room}), options.limits.clearance_m - 0.025);
      EXPECT_GE(c.cable_cable, 0);
    }
  }
}

TEST(Planner, TravelsAQuarterLessThanTheRaster) {
  const Mechanism mechanism = paper_mechanism();
  const PlannerOptions options = around_a_bust();
  Job job;
  const PlannedTour raster = raster_tour(mechanism, paper_views(), options, job);
  const PlannedTour tour = plan_tour(mechanism, paper_views(), options, job);
  EXPECT_TRUE(raster.left_out.empty());
  EXPECT_TRUE(tour.left_out.empty());
  EXPECT_LT(tour.travel_m, 0.75 * raster.travel_m);
  EXPECT_LT(tour.travel_s, raster.travel_s);
  for (const PlannedTour* t : {&raster, &tour}) {
    SCOPED_TRACE(t == &raster ? "raster" : "tour");
    expect_sound(t->plan, options, t == &raster ? 0 : 8 * kDegree);
    EXPECT_EQ(
        std::count_if(t->plan.stops.begin(), t->plan.stops.end(), [](const PlannedStop& s) { return s.photograph; }),
        240);
    double travel_m = 0, travel_s = 0;
    for (std::size_t i = 1; i < t->plan.stops.size(); ++i) {
      travel_m +=
          (t->plan.stops[i].world_from_platform.translation - t->plan.stops[i - 1].world_from_platform.translation)
              .norm();
      travel_s += t->plan.stops[i].travel_s;
    }
    EXPECT_NEAR(travel_m, t->travel_m, 1e-6);
    EXPECT_NEAR(travel_s, t->travel_s, 1e-6);
  }
  EXPECT_EQ(raster.turns, 24);
  EXPECT_EQ(tour.turns, 12);
}

/// The least time of all orders within the bearings and all rows at which the camera can be turned: straight moves, as
/// if nothing were in the way. Each bearing's stops are few enough to try all their orders.
double least_of_all_orders_s(const Mechanism& mechanism, const HemisphereOptions& views, double release_tilt_rad) {
  const std::vector<PlannedStop> stops = hemisphere_stops(mechanism, views);
  std::map<double, std::vector<const PlannedStop*>> bearings;
  for (const PlannedStop& stop : stops) bearings[stop.roll_rad].push_back(&stop);
  std::vector<std::vector<const PlannedStop*>> groups, turns;
  for (const auto& [roll, group] : bearings) {
    groups.push_back(group);
    turns.emplace_back();
    for (const PlannedStop* stop : group)
      if (views.tilt_rad(stop->phi_rad) >= release_tilt_rad - 1e-9) turns.back().push_back(stop);
  }
  const auto time = [&](const PlannedStop* a, const PlannedStop* b) {
    return least_duration_s(mechanism, a->world_from_platform, b->world_from_platform);
  };
  std::vector<double> total(turns[0].size(), 0);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const std::vector<const PlannedStop*> nowhere{nullptr}, &next = g + 1 < groups.size() ? turns[g + 1] : nowhere;
    std::vector<double> with(next.size(), 1e9);
    std::vector<const PlannedStop*> order = groups[g];
    std::sort(order.begin(), order.end());
    do {
      double within = 0;
      for (std::size_t i = 1; i < order.size(); ++i) within += time(order[i - 1], order[i]);
      for (std::size_t t = 0; t < total.size(); ++t)
        for (std::size_t u = 0; u < next.size(); ++u)
          with[u] = std::min(with[u], total[t] + time(turns[g][t], order.front()) + within +
                                          (next[u] ? time(order.back(), next[u]) : 0));
    } while (std::next_permutation(order.begin(), order.end()));
    total = with;
  }
  return *std::min_element(total.begin(), total.end());
}

TEST(Planner, WithABearingForEachAzimuthNoOrderIsBetter) {
  const Mechanism mechanism = paper_mechanism();
  HemisphereOptions views = paper_views();
  views.bearing_tolerance_rad = 0;
  views.azimuths = 8, views.rows = 4;
  PlannerOptions options = around_a_bust();
  Job job;
  const PlannedTour raster = raster_tour(mechanism, views, options, job);
  const PlannedTour tour = plan_tour(mechanism, views, options, job);
  expect_sound(tour.plan, options, 0);
  EXPECT_LT(tour.travel_m, 0.85 * raster.travel_m);
  const double least = least_of_all_orders_s(mechanism, views, options.release_tilt_rad);
  EXPECT_GE(tour.travel_s, least - 1e-6);
  EXPECT_LE(tour.travel_s, 1.002 * least);
  // It is turned at the lowest place and higher up by turns; where more tilt is asked for, at the lowest alone.
  std::set<int> rows;
  for (const PlannedStop& stop : tour.plan.stops)
    if (stop.name.starts_with("turn")) rows.insert(int(std::lround(stop.phi_rad / kDegree)));
  EXPECT_EQ(rows, (std::set<int>{60, 90}));
  options.release_tilt_rad = 25 * kDegree;
  for (const PlannedStop& stop : plan_tour(mechanism, views, options, job).plan.stops)
    if (stop.name.starts_with("turn")) {
      EXPECT_NEAR(stop.phi_rad, 90 * kDegree, 1e-9);
    }
}

TEST(Planner, RasterGoesDownEachAzimuth) {
  HemisphereOptions views = paper_views();
  views.azimuths = 6, views.rows = 4;
  Job job;
  const PlannedTour raster = raster_tour(paper_mechanism(), views, around_a_bust(), job);
  std::vector<std::string> expected;
  for (int a = 0; a < 6; ++a) {
    expected.push_back("turn-00" + std::to_string(a));
    for (int e = 0; e < 4; ++e) expected.push_back("a00" + std::to_string(a) + "-e0" + std::to_string(e));
  }
  std::vector<std::string> found = names(raster.plan);
  std::erase_if(found, [](const std::string& name) { return name.starts_with("way"); });
  EXPECT_EQ(found, expected);
}

TEST(Planner, DependsOnTheSeedAloneAndNotOnThreads) {
  const Mechanism mechanism = paper_mechanism();
  HemisphereOptions views = paper_views();
  views.azimuths = 8, views.rows = 5, views.bearing = Bearing::motor;
  const PlannerOptions options = around_a_bust();
  Job one({}, 1), three({}, 3);
  EXPECT_EQ(names(plan_tour(mechanism, views, options, one).plan),
            names(plan_tour(mechanism, views, options, three).plan));
}

TEST(Planner, GoesRoundTheObject) {
  // Two views from the side, opposite to each other: the straight line leads through the object.
  HemisphereOptions views;
  views.azimuths = 2, views.rows = 1, views.bearing = Bearing::motor;
  const PlannerOptions options = around_a_bust();
  Job job;
  const PlannedTour tour = plan_tour(paper_mechanism(), views, options, job);
  EXPECT_GE(tour.ways_round, 1);
  EXPECT_EQ(std::size_t(tour.ways_round) + 2, tour.plan.stops.size());
  expect_sound(tour.plan, options, 0, true);
  EXPECT_GT(tour.travel_m, 3.0);
}

TEST(Planner, SaysWhichCablesAndWhy) {
  Job job;
  Mechanism mechanism = paper_mechanism();
  for (Cable& cable : mechanism.cables) cable.max_length_m = 2;
  Error e = test::expect_error([&] { plan_tour(mechanism, paper_views(), around_a_bust(), job); });
  EXPECT_EQ(e.code(), ErrorCode::degenerate);
  EXPECT_THAT(e.what(), HasSubstr("none of the 240 stops can be taken"));
  EXPECT_THAT(e.what(), HasSubstr("cable 1 would be"));
  EXPECT_THAT(e.what(), HasSubstr("its drum holds 2 m"));
  HemisphereOptions far = paper_views();
  far.radius_m = 9;
  e = test::expect_error([&] { plan_tour(paper_mechanism(), far, around_a_bust(), job); });
  EXPECT_THAT(e.what(), HasSubstr("outside of the room"));
  HemisphereOptions high = paper_views();
  high.phi_to_rad = 50 * kDegree;
  e = test::expect_error([&] { plan_tour(paper_mechanism(), high, around_a_bust(), job); });
  EXPECT_THAT(e.what(), HasSubstr("can't be turned by gravity"));
  EXPECT_THAT(e.what(), HasSubstr("3.3 degrees"));
  EXPECT_EQ(test::expect_error([&] {
              PlannerOptions bad;
              bad.turn_s = -1;
              plan_tour(paper_mechanism(), paper_views(), bad, job);
            }).code(),
            ErrorCode::invalid_argument);
}

TEST(Planner, LeavesOutWhatIsOutOfReach) {
  // A low ceiling of tension for one cable.
  Mechanism mechanism = paper_mechanism();
  mechanism.cables[2].max_tension_N = 20;
  Job job;
  const PlannedTour tour = plan_tour(mechanism, paper_views(), around_a_bust(), job);
  ASSERT_FALSE(tour.left_out.empty());
  std::set<std::string> out(tour.left_out.begin(), tour.left_out.end());
  std::size_t photographed = 0;
  for (const PlannedStop& stop : tour.plan.stops) {
    photographed += stop.photograph;
    EXPECT_FALSE(out.contains(stop.name));
  }
  EXPECT_EQ(photographed + out.size(), 240u);
  EXPECT_THAT(tour.left_out_why.at(0), HasSubstr("cable 3 would be too taut"));
}

TEST(Planner, PausesForTheBattery) {
  PlannerOptions options = around_a_bust();
  options.pictures_per_battery = 100;
  options.kicks = 0;
  Job job;
  const PlannedTour tour = plan_tour(paper_mechanism(), paper_views(), options, job);
  EXPECT_EQ(tour.notes.size(), 2u);
  int pictures = 0, pauses = 0;
  for (const PlannedStop& stop : tour.plan.stops) {
    if (!stop.pause.empty()) {
      EXPECT_EQ(pictures % 100, 0);
      EXPECT_THAT(stop.pause, HasSubstr("batter"));
      ++pauses;
    }
    pictures += stop.photograph;
  }
  EXPECT_EQ(pauses, 2);
}

TEST(Planner, ReportsWhatThePicturesShow) {
  PlannerOptions options = around_a_bust();
  options.kicks = 0;
  Job job;
  const Plan plan = plan_tour(paper_mechanism(), paper_views(), options, job).plan;
  const Camera camera = ideal_camera({}, 1.5);
  Enclosure enclosure;
  const auto targets = scatter_targets(enclosure);
  const PlanReport bust = report(plan, camera, {0.7, 0.5}, Vector3d::Zero(), targets);
  EXPECT_EQ(bust.photographs, 240u);
  EXPECT_TRUE(bust.cut_off.empty());
  EXPECT_GT(bust.least_margin_px, 0);
  EXPECT_GT(bust.median_targets, kLeastTargets);
  EXPECT_GE(bust.least_tension_N, 1);
  EXPECT_GE(bust.least_clearance_m, 0.005);
  EXPECT_NEAR(bust.total_s, duration_s(plan), 1e-9);
  const PlanReport large = report(plan, camera, {1.6, 1.2}, Vector3d::Zero());
  EXPECT_FALSE(large.cut_off.empty());
  EXPECT_LT(large.least_margin_px, 0);
  EXPECT_EQ(large.least_targets, -1);

  // Cables in pictures: those of which a sampled point is projected into one, and hardly others.
  const Camera wide = ideal_camera({.focal_length_mm = 10}, 1.5);
  for (const Camera& c : {camera, wide}) {
    const std::vector<std::string> told = report(plan, c, {0.7, 0.5}, Vector3d::Zero()).cables_in_picture;
    std::size_t seen = 0;
    for (const PlannedStop& stop : plan.stops) {
      bool in_picture = false;
      for (const Cable& cable : plan.mechanism->cables)
        for (int k = 0; k <= 400 && !in_picture; ++k) {
          const Vector3d tip = stop.world_from_platform * cable.attachment,
                         at = stop.cam_from_world * Vector3d(tip + k / 400.0 * (cable.departure - tip));
          const auto pixel = c.project(at);
          in_picture =
              at.z() > 1e-3 && pixel && pixel->minCoeff() >= 0 && pixel->x() <= c.width && pixel->y() <= c.height;
        }
      if (!stop.photograph || !in_picture) continue;
      ++seen;
      EXPECT_THAT(told, testing::Contains(stop.name));
    }
    EXPECT_LE(told.size(), seen + seen / 20 + 1) << seen;
    if (c.f == wide.f) {
      EXPECT_GT(seen, 0u) << "a lens of 10 mm sees cables";
    }
  }
  Camera narrow = camera;
  narrow.k1 = -3;
  EXPECT_FALSE(report(plan, narrow, {0.7, 0.5}, Vector3d::Zero()).cables_known);
  for (const std::string& svg :
       {plan_from_above_svg(plan), plan_from_side_svg(plan), plan_tensions_svg(plan), plan_time_svg(plan)}) {
    EXPECT_TRUE(svg.starts_with("<svg"));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
  }
}

}  // namespace
}  // namespace lumihull::capture
