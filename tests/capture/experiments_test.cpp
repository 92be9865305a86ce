// Repeatability and stability: from visits and swings that were made up.
#include <lumihull/capture/experiments.h>
#include <lumihull/capture/statics.h>

#include <cmath>
#include <numbers>
#include <random>

#include "support.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

TEST(Repeatability, PlansVisitsOfFourCorners) {
  const Mechanism mechanism = paper_mechanism();
  const Plan plan = repeatability_plan(mechanism, {});
  ASSERT_EQ(plan.stops.size(), 100u);
  for (std::size_t i = 0; i < 100; ++i) {
    const PlannedStop& stop = plan.stops[i];
    EXPECT_EQ(stop.world_from_platform.translation, plan.stops[i % 4].world_from_platform.translation);
    EXPECT_EQ(stop.roll_rad, 0);
    if (i > 0) {
      EXPECT_NEAR((stop.world_from_platform.translation - plan.stops[i - 1].world_from_platform.translation).norm(), 3,
                  1e-12);
      EXPECT_GT(stop.travel_s, 3 / mechanism.limits.speed_m_s);
    }
  }
  EXPECT_NO_THROW(check(plan));
  RepeatabilityOptions wide;
  wide.side_m = 12;
  EXPECT_THAT(test::expect_error([&] { repeatability_plan(mechanism, wide); }).what(),
              HasSubstr("corner 0 can't be taken"));
  wide.visits = 0;
  EXPECT_EQ(test::expect_error([&] { repeatability_plan(mechanism, wide); }).code(), ErrorCode::invalid_argument);
}

TEST(Repeatability, SpreadIsThatOfTheVisits) {
  // Pairs at both sides of a known pose: it is their mean.
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  const Pose truth{Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized(), Vector3d(1, 2, 3)};
  std::vector<Pose> visits;
  double farthest = 0, most_turned = 0;
  for (int i = 0; i < 12; ++i) {
    const Vector3d by = 0.02 * vector(), turn = 0.05 * vector();
    farthest = std::max(farthest, by.norm()), most_turned = std::max(most_turned, turn.norm());
    for (const double sign : {-1.0, 1.0}) {
      Eigen::Quaterniond q =
          truth.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(sign * turn.norm(), turn.normalized()));
      if (i % 2) q.coeffs() *= -1;  // the same rotation
      visits.push_back({q, truth.translation + sign * by});
    }
  }
  const PoseSpread spread = pose_spread(visits);
  EXPECT_LT((spread.mean.translation - truth.translation).norm(), 1e-12);
  EXPECT_LT(spread.mean.rotation.angularDistance(truth.rotation), 1e-7);
  EXPECT_NEAR(spread.largest_distance_m, farthest, 1e-9);
  EXPECT_NEAR(spread.largest_angle_rad, most_turned, 1e-6);
  EXPECT_TRUE(repeatability_svg(std::vector{spread, spread}).starts_with("<svg"));
  EXPECT_THROW(pose_spread({}), Error);
  visits[3].translation.x() = std::nan("");
  EXPECT_THROW(pose_spread(visits), Error);
}

TEST(Stability, SettlesWhenTheSwingHasDied) {
  // A e^(-t / τ) is within a after τ ln(A / a); samples lie on the swing's crests.
  std::vector<double> time, swing;
  for (int i = 0; i <= 240; ++i) {
    time.push_back(i / 20.0);
    swing.push_back((i % 2 ? -1 : 1) * 12 * std::exp(-time.back() / 2.2));
  }
  const auto settled = settle_time_s(time, swing, 0.5);
  ASSERT_TRUE(settled);
  EXPECT_NEAR(*settled, 2.2 * std::log(12 / 0.5), 1 / 20.0);
  EXPECT_FALSE(settle_time_s(time, swing, 1e-3));
  EXPECT_EQ(*settle_time_s(time, swing, 20), 0);
  EXPECT_THAT(stability_svg(time, swing, 0.5), HasSubstr("within 0.5 px from 7.0"));
  EXPECT_THROW(settle_time_s(time, std::span(swing).first(3), 0.5), Error);
  EXPECT_THROW(settle_time_s({}, {}, 0.5), Error);
  EXPECT_THROW(settle_time_s(time, swing, 0), Error);
}

/// A capture of two places with four visits each, by two cameras; camera centres at 1, 2, 3 … mm from the place.
Capture visits(const std::filesystem::path& folder) {
  Capture capture = Capture::create(folder);
  capture.unit = Unit::metres;
  capture.cameras.assign(1, {.width = 64, .height = 48, .f = 80, .u0 = 32, .v0 = 24});
  for (int visit = 0; visit < 4; ++visit)
    for (int place = 0; place < 2; ++place)
      for (const char* device : {"a", "b"}) {
        Shot shot;
        shot.name = "p" + std::to_string(place) + "-v" + std::to_string(visit) + "-" + device;
        shot.file = "photos/" + shot.name + ".jpg";
        CommandedShot& commanded = shot.commanded.emplace();
        commanded.stop = "p" + std::to_string(place) + "-v" + std::to_string(visit);
        commanded.device = device;
        commanded.cam_from_world = {Eigen::Quaterniond(0, 1, 0, 0), Vector3d(3.0 * place, 0.5, 1)};
        // Opposite pairs along x about the place, and turns about y by as many milliradians.
        const double d = 1e-3 * (visit < 2 ? 1 : 2) * (visit % 2 ? -1 : 1) * (1 + place);
        const Vector3d center(3.0 * place + d, 0, 1);
        const Eigen::Quaterniond turn(Eigen::AngleAxisd(d, Vector3d::UnitY()));
        shot.cam_from_world = Pose{turn, center}.inverse();
        PoseQuality& known = shot.pose_quality.emplace();
        known.covariance.diagonal() << 1e-8, 1e-8, 2e-8, 4e-10, 4e-10, 8e-10;
        capture.shots.push_back(std::move(shot));
      }
  return capture;
}

TEST(Repeatability, OfACaptureIsThatOfEachPlace) {
  const test::TemporaryFolder folder;
  Capture capture = visits(folder / "c");
  Repeatability found = repeatability(capture);
  ASSERT_EQ(found.places.size(), 4u);  // two places, two cameras
  EXPECT_EQ(found.places[0].name, "p0-v0 a");
  EXPECT_EQ(found.places[3].name, "p1-v0 b");
  EXPECT_EQ(found.places[3].photographs, (std::vector<std::string>{"p1-v0-b", "p1-v1-b", "p1-v2-b", "p1-v3-b"}));
  EXPECT_NEAR(found.places[0].spread.largest_distance_m, 2e-3, 1e-12);
  EXPECT_NEAR(found.largest_distance_m, 4e-3, 1e-12);
  EXPECT_NEAR(found.largest_angle_rad, 4e-3, 1e-9);
  // Distances 1, 1, 2, 2 and 2, 2, 4, 4 mm.
  EXPECT_NEAR(found.rms_distance_m, 1e-3 * std::sqrt((10 + 40) / 8.0), 1e-12);
  EXPECT_EQ(found.visits, 16u);
  EXPECT_NEAR(found.measured_m, 4e-5, 1e-12);
  EXPECT_NEAR(found.measured_rad, 2e-4, 1e-12);
  EXPECT_THAT(describe_json(found), HasSubstr("\"name\":\"p1-v0 b\""));
  const std::string page = repeatability_html(found, "A & B");
  EXPECT_THAT(page, HasSubstr("A &amp; B"));
  EXPECT_THAT(page, HasSubstr("4.00"));

  // Visits without poses are told; places with one visit are none.
  capture.shots[0].cam_from_world.reset();
  capture.shots[1].pose_quality.reset();
  for (Shot& shot : capture.shots)
    if (shot.commanded->device == "b" && shot.commanded->stop[1] == '1')
      shot.commanded->cam_from_world.translation.y() += 0.01 * double(shot.name[4]);
  found = repeatability(capture);
  EXPECT_EQ(found.places.size(), 3u);
  EXPECT_EQ(found.without_pose, std::vector<std::string>{"p0-v0-a"});
  EXPECT_LT(found.measured_m, 0);
  EXPECT_THAT(describe_json(found), HasSubstr("\"measured_m\":null"));

  capture.unit = Unit::unknown;
  EXPECT_THAT(test::expect_error([&] { repeatability(capture); }).message(), HasSubstr("no scale"));
  capture.unit = Unit::metres;
  for (Shot& shot : capture.shots) shot.commanded.reset();
  EXPECT_THAT(test::expect_error([&] { repeatability(capture); }).message(), HasSubstr("no place was visited twice"));
}

TEST(Stability, OfATargetIsItsDistanceFromWhereItRests) {
  std::vector<double> time;
  std::vector<Eigen::Vector2d> centers;
  for (int i = 0; i <= 300; ++i) {
    time.push_back(i / 25.0);
    const double swing = 12 * std::exp(-time.back() / 2.2) * std::cos(2 * std::numbers::pi * 1.25 * time.back());
    centers.emplace_back(320.5 + 0.8 * swing, 200.25 - 0.6 * swing);
  }
  const Stability found = stability(time, centers, 0.5, 1);
  ASSERT_TRUE(found.settle_s);
  // The crests of |swing|, every 0.4 s, are within half a pixel from τ ln(24) on.
  EXPECT_NEAR(*found.settle_s, 2.2 * std::log(24), 0.4);
  EXPECT_NEAR(found.distance_px.front(), 12, 0.02);
  EXPECT_NEAR(found.offset_px.front().x(), 9.6, 0.02);
  EXPECT_LT(found.rest_px, 0.05);
  EXPECT_THAT(describe_json(found), HasSubstr("\"settle_s\":"));
  EXPECT_FALSE(stability(std::span(time).first(50), std::span(centers).first(50), 0.01, 0.5).settle_s);
  EXPECT_THROW(stability(time, std::span(centers).first(9)), Error);
  EXPECT_THROW(stability(time, centers, 0.5, 0.05), Error);  // two pictures
  EXPECT_THROW(stability(time, centers, -1, 2), Error);
  centers[7].x() = std::nan("");
  EXPECT_THROW(stability(time, centers), Error);
}

}  // namespace
}  // namespace lumihull::capture
