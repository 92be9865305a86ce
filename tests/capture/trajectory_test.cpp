// Stops on a hemisphere: where the camera is, what it looks at, how it is turned; targets in its picture.
#include <lumihull/base/files.h>
#include <lumihull/capture/statics.h>
#include <lumihull/capture/trajectory.h>

#include <cmath>
#include <numbers>
#include <set>

#include "support.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

Vector3d axis_of(const PlannedStop& stop) { return stop.cam_from_world.rotation.conjugate() * Vector3d::UnitZ(); }

TEST(Trajectory, CameraLooksAtTheObjectButForTheFixedOffset) {
  const Mechanism mechanism = paper_mechanism();
  HemisphereOptions o;
  o.center = {0.1, -0.2, 0.05};
  const auto stops = hemisphere_stops(mechanism, o);
  ASSERT_EQ(stops.size(), 240u);
  double worst = 0;
  for (const PlannedStop& stop : stops) {
    SCOPED_TRACE(stop.name);
    const Vector3d out(std::sin(stop.phi_rad) * std::cos(stop.theta_rad),
                       std::sin(stop.phi_rad) * std::sin(stop.theta_rad), std::cos(stop.phi_rad));
    EXPECT_LT((stop.cam_from_world.center() - o.center - 1.5 * out).norm(), 1e-12);
    // The offset that would be needed is φ - φ_t; there are 45 degrees (paper, 2.3).
    const double error = std::acos(std::clamp(-out.dot(axis_of(stop)), -1.0, 1.0));
    EXPECT_NEAR(error, std::abs(stop.phi_rad - o.tilt_rad(stop.phi_rad) - 45 * kDegree), 1e-6);
    worst = std::max(worst, error);
    // All of it along the meridian; and the picture is upright: its rows run along the meridian, too.
    const Vector3d across(-std::sin(stop.theta_rad), std::cos(stop.theta_rad), 0);
    EXPECT_NEAR(axis_of(stop).dot(across), 0, 1e-12);
    EXPECT_NEAR((stop.cam_from_world.rotation.conjugate() * Vector3d::UnitX()).dot(across), 0, 1e-12);
    const CableVector lengths = cable_lengths(mechanism, stop.world_from_platform);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(stop.lengths_m[std::size_t(i)], lengths[i]);
  }
  EXPECT_NEAR(worst, 15 * kDegree, 1e-6);
}

TEST(Trajectory, BearingsAreSharedWithinTheTolerance) {
  const Mechanism mechanism = paper_mechanism();
  HemisphereOptions o;
  o.bearing_tolerance_rad = 8 * kDegree;
  std::set<double> rolls;
  for (const PlannedStop& stop : hemisphere_stops(mechanism, o)) {
    EXPECT_LE(std::abs(std::remainder(stop.roll_rad - stop.theta_rad, 2 * std::numbers::pi)), 8 * kDegree + 1e-9);
    rolls.insert(stop.roll_rad);
  }
  EXPECT_EQ(rolls.size(), 12u);
  o.bearing = Bearing::fixed;
  for (const PlannedStop& stop : hemisphere_stops(mechanism, o)) EXPECT_EQ(stop.roll_rad, 0);
  o.bearing = Bearing::motor;
  for (const PlannedStop& stop : hemisphere_stops(mechanism, o)) EXPECT_EQ(stop.roll_rad, stop.theta_rad);
}

TEST(Trajectory, SpacingIsKeptEverywhere) {
  for (const double spacing : {7.0, 10.0, 33.0}) {
    HemisphereOptions o;
    o.spacing_rad = spacing * kDegree;
    o.thin = true;
    const auto stops = hemisphere_views(o, Orientation::landscape);
    std::set<std::string> names;
    for (const PlannedStop& stop : stops) names.insert(stop.name);
    EXPECT_EQ(names.size(), stops.size());
    EXPECT_EQ(std::count_if(stops.begin(), stops.end(), [](const PlannedStop& s) { return s.phi_rad < 1e-9; }), 1);
    // Any direction of the hemisphere has a view within a half step along both angles.
    for (int i = 0; i <= 18; ++i)
      for (int k = 0; k < 72; ++k) {
        const double phi = i * 5 * kDegree, theta = k * 5 * kDegree;
        const Vector3d out(std::sin(phi) * std::cos(theta), std::sin(phi) * std::sin(theta), std::cos(phi));
        double nearest = 10;
        for (const PlannedStop& stop : stops)
          nearest = std::min(nearest, std::acos(std::clamp(out.dot(stop.cam_from_world.center()) / 1.5, -1.0, 1.0)));
        EXPECT_LE(nearest, std::numbers::sqrt2 / 2 * spacing * kDegree * 1.1);
      }
  }
}

TEST(Trajectory, ViewsWithoutAMechanismLookStraightAtTheCentre) {
  HemisphereOptions o;
  o.azimuths = 36, o.rows = 3, o.phi_from_rad = 30 * kDegree, o.phi_to_rad = 80 * kDegree;
  for (const Orientation orientation : {Orientation::landscape, Orientation::portrait}) {
    const auto stops = hemisphere_views(o, orientation);
    ASSERT_EQ(stops.size(), 108u);
    for (const PlannedStop& stop : stops) {
      EXPECT_LT((axis_of(stop) + stop.cam_from_world.center().normalized()).norm(), 1e-9);
      const Vector3d along(-std::sin(stop.theta_rad), std::cos(stop.theta_rad), 0);
      const Vector3d rows = stop.cam_from_world.rotation.conjugate() * Vector3d::UnitX();
      EXPECT_NEAR(std::abs(rows.dot(along)), orientation == Orientation::landscape ? 1 : 0, 1e-9);
      EXPECT_TRUE(stop.lengths_m.empty());
    }
    // Neighbours in the list are neighbours on the sphere.
    for (std::size_t i = 1; i < stops.size(); ++i)
      EXPECT_LT((stops[i].cam_from_world.center() - stops[i - 1].cam_from_world.center()).norm(), 0.7);
  }
}

TEST(Trajectory, RefusesWhatIsNoHemisphere) {
  const auto refused = [](const std::function<void(HemisphereOptions&)>& change) {
    HemisphereOptions o;
    change(o);
    const Error e = test::expect_error([&] { hemisphere_views(o, Orientation::landscape); });
    EXPECT_EQ(e.code(), ErrorCode::invalid_argument);
    return e.subject();
  };
  EXPECT_EQ(refused([](auto& o) { o.radius_m = 0; }), "radius, m");
  EXPECT_EQ(refused([](auto& o) { o.radius_m = std::nan(""); }), "radius, m");
  EXPECT_EQ(refused([](auto& o) { o.azimuths = 0; }), "azimuths");
  EXPECT_EQ(refused([](auto& o) { o.rows = -1; }), "rows");
  EXPECT_EQ(refused([](auto& o) { o.spacing_rad = -1; }), "spacing, rad");
  EXPECT_EQ(refused([](auto& o) { o.phi_to_rad = -0.1; }), "last polar angle, rad");
  EXPECT_EQ(refused([](auto& o) { o.settle_s = -1; }), "settling, s");
  EXPECT_EQ(refused([](auto& o) { o.exposure_s = 0; }), "exposure, s");
  EXPECT_EQ(refused([](auto& o) { o.spacing_rad = 1e-4; }), "trajectory");
  EXPECT_EQ(refused([](auto& o) { o.azimuths = 100000, o.rows = 10000; }), "trajectory");
}

class Targets : public testing::Test {
 protected:
  int seen(const PlacedTarget& target) const {
    return targets_in_view(view_, std::span(&target, 1), object_, Vector3d::Zero());
  }
  ObjectSize object_{0.5, 0};
  View view_{ideal_camera({}, 2), look_at({2, 0, 0}, Vector3d::Zero(), Vector3d::UnitZ())};
};

TEST_F(Targets, CountWhereTheyAreSeen) {
  EXPECT_EQ(seen({{-1, 0.8, 0}, {1, 0, 0}, 0.15}), 1);
  EXPECT_EQ(seen({{-1, 0.8, 0}, {-1, 0, 0}, 0.15}), 0) << "its back";
  EXPECT_EQ(seen({{-1, 0.8, 0}, {std::cos(1.4), 0, std::sin(1.4)}, 0.15}), 0) << "too oblique";
  EXPECT_EQ(seen({{-1, 0, 0}, {1, 0, 0}, 0.15}), 0) << "behind the object";
  EXPECT_EQ(seen({{1.5, 0, 0}, {1, 0, 0}, 0.05}), 1) << "before the object";
  EXPECT_EQ(seen({{-1, 0.8, 0}, {1, 0, 0}, 0.01}), 0) << "too small";
  EXPECT_EQ(seen({{-1, 4, 0}, {1, 0, 0}, 0.15}), 0) << "beside the picture";
  EXPECT_EQ(seen({{3, 0, 0}, {-1, 0, 0}, 0.15}), 0) << "behind the camera";
}

TEST_F(Targets, AreHiddenByACylinderAsHighAsItIs) {
  object_ = {0.5, 0.4};
  EXPECT_EQ(seen({{-1, 0, 0.25}, {1, 0, 0}, 0.15}), 0) << "the line of sight passes 0.17 m above the middle";
  EXPECT_EQ(seen({{-1, 0, 0.6}, {1, 0, 0}, 0.15}), 1) << "over its top";
}

TEST_F(Targets, ScatterLiesOnWallsAndFloor) {
  Enclosure e;
  e.targets = 4000;
  e.center = {1, 2, 3};
  const auto targets = scatter_targets(e);
  ASSERT_EQ(targets.size(), 4000u);
  const double width = 2 * 3 * std::tan(std::numbers::pi / 8), walls = 8 * width * 3, floor = 4 * width * 3;
  int on_floor = 0;
  for (const PlacedTarget& t : targets) {
    const Vector3d p = t.center - e.center;
    EXPECT_NEAR(t.normal.norm(), 1, 1e-12);
    if (t.normal.z() > 0.5) {
      ++on_floor;
      EXPECT_NEAR(p.z(), -1, 1e-12);
      EXPECT_LE(p.head<2>().norm(), 3 / std::cos(std::numbers::pi / 8) + 1e-9);
    } else {
      EXPECT_NEAR(-t.normal.dot(p), 3, 1e-9) << "on its panel";
      EXPECT_GE(p.z(), -1);
      EXPECT_LE(p.z(), 2);
    }
  }
  EXPECT_NEAR(on_floor / 4000.0, floor / (walls + floor), 0.03);
  EXPECT_EQ(scatter_targets(e)[17].center, targets[17].center);
  e.seed = 2;
  EXPECT_NE(scatter_targets(e)[17].center, targets[17].center);
  e.panels = 2;
  EXPECT_THROW(scatter_targets(e), Error);
}

TEST_F(Targets, AreReadFromAList) {
  test::TemporaryFolder folder;
  write_file(
      folder / "t.json",
      R"({"format": "lumihull-placed-targets", "version": 1, "targets": [{"center": [1, 2, 3], "normal": [0, 0, 2], "size_m": 0.2}]})");
  const auto targets = read_placed_targets(folder / "t.json");
  ASSERT_EQ(targets.size(), 1u);
  EXPECT_EQ(targets[0].normal, Vector3d::UnitZ());
  EXPECT_EQ(targets[0].size_m, 0.2);
  write_file(
      folder / "bad.json",
      R"({"format": "lumihull-placed-targets", "version": 1, "targets": [{"center": [1, 2, 3], "normal": [0, 0, 0], "size_m": 0.2}]})");
  const Error e = test::expect_error([&] { read_placed_targets(folder / "bad.json"); });
  EXPECT_THAT(e.what(), HasSubstr("bad.json"));
  EXPECT_THAT(e.what(), HasSubstr("/targets/0/normal"));
  EXPECT_EQ(test::expect_error([&] { read_placed_targets(folder / "none.json"); }).code(), ErrorCode::not_found);
}

TEST_F(Targets, AreReadFromACalibration) {
  const auto targets =
      read_placed_targets(std::filesystem::path(LUMIHULL_SOURCE_DIR) / "tests/fuzz/corpus/calibration/model.json");
  ASSERT_FALSE(targets.empty());
  for (const PlacedTarget& t : targets) {
    EXPECT_TRUE(t.center.allFinite());
    EXPECT_NEAR(t.normal.norm(), 1, 1e-6);
    EXPECT_GT(t.size_m, 1e-3);
  }
}

}  // namespace
}  // namespace lumihull::capture
