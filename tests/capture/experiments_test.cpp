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

}  // namespace
}  // namespace lumihull::capture
