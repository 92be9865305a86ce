// Moves limited in jerk: the pieces add up, limits hold where they are sampled finer than the planner does.
#include <lumihull/capture/motion.h>
#include <lumihull/capture/statics.h>
#include <lumihull/capture/workspace.h>

#include <cmath>
#include <numbers>
#include <random>

#include "support.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;

double unit(std::mt19937_64& random) { return double(random() >> 11) * 0x1p-53; }

TEST(MotionProfile, KeepsItsLimitsAndEndsAtRest) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE(trial);
    const double distance = std::pow(10, 4 * unit(random) - 3), v = 0.1 + unit(random), a = 0.1 + unit(random),
                 j = 0.1 + 2 * unit(random);
    const MotionProfile p = rest_to_rest(distance, v, a, j);
    const double total = p.duration_s();
    constexpr int kSteps = 2000;
    const double h = total / kSteps;
    for (int i = 0; i <= kSteps; ++i) {
      const auto [s, speed, acceleration] = p.at(i * h);
      EXPECT_LE(std::abs(speed), v * (1 + 1e-9));
      EXPECT_LE(std::abs(acceleration), a * (1 + 1e-9));
      EXPECT_GE(s, -1e-12);
      EXPECT_LE(s, distance * (1 + 1e-12));
      if (i == 0) continue;
      const auto [s0, speed0, acceleration0] = p.at((i - 1) * h);
      EXPECT_LE(std::abs(acceleration - acceleration0) / h, j * (1 + 1e-6));
      // Trapezoids: exact but for the jerk's share h³ / 12 and h² / 4 at a change of pieces.
      EXPECT_NEAR(s - s0, 0.5 * h * (speed + speed0), j * h * h * h);
      EXPECT_NEAR(speed - speed0, 0.5 * h * (acceleration + acceleration0), j * h * h);
    }
    EXPECT_EQ(p.at(total)[0], distance);
    EXPECT_EQ(p.at(total + 1)[1], 0);
  }
}

TEST(MotionProfile, IsAsShortAsTheLimitsAllow) {
  // A long way: all limits are reached. A short one: jerk alone. In between: acceleration, but not the speed.
  EXPECT_NEAR(rest_to_rest(10, 0.5, 0.4, 0.8).duration_s(), 10 / 0.5 + 0.5 / 0.4 + 0.4 / 0.8, 1e-12);
  EXPECT_NEAR(rest_to_rest(0.01, 0.5, 0.4, 0.8).duration_s(), 4 * std::cbrt(0.01 / (2 * 0.8)), 1e-12);
  const MotionProfile middle = rest_to_rest(0.5, 10, 0.4, 0.8);
  EXPECT_GT(middle.ramp_s, 0);
  EXPECT_EQ(middle.cruise_s, 0);
  EXPECT_NEAR(middle.at(0.5 * middle.duration_s())[0], 0.25, 1e-12);
  EXPECT_EQ(rest_to_rest(0, 1, 1, 1).duration_s(), 0);
  EXPECT_THROW(rest_to_rest(-1, 1, 1, 1), Error);
  EXPECT_THROW(rest_to_rest(1, 0, 1, 1), Error);
  EXPECT_THROW(rest_to_rest(std::nan(""), 1, 1, 1), Error);
}

Pose somewhere(std::mt19937_64& random) {
  return platform_pose(Vector3d::Zero(), 1 + unit(random), 6.28 * unit(random), 1.5 * unit(random), 2.0 / 3, -0.5);
}

TEST(Move, KeepsTheWinchesLimits) {
  std::mt19937_64 random(2);
  Mechanism mechanism = paper_mechanism();
  mechanism.limits = {
      .speed_m_s = 2, .acceleration_m_s2 = 2, .jerk_m_s3 = 4, .cable_speed_m_s = 0.3, .cable_acceleration_m_s2 = 0.2};
  int slowed = 0;
  for (int trial = 0; trial < 20; ++trial) {
    SCOPED_TRACE(trial);
    const Pose from = somewhere(random), to = somewhere(random);
    const Move move = plan_move(mechanism, from, to);
    slowed += move.duration_s() > 1.001 * least_duration_s(mechanism, from, to);
    constexpr int kSteps = 3000;
    const double h = move.duration_s() / kSteps;
    std::vector<CableVector> l;
    for (int i = 0; i <= kSteps; ++i) l.push_back(cable_lengths(mechanism, pose_at(move, i * h)));
    double fastest = 0;
    for (int i = 1; i < kSteps; ++i) {
      const double speed = ((l[std::size_t(i + 1)] - l[std::size_t(i - 1)]) / (2 * h)).cwiseAbs().maxCoeff();
      const double acceleration =
          ((l[std::size_t(i + 1)] - 2 * l[std::size_t(i)] + l[std::size_t(i - 1)]) / (h * h)).cwiseAbs().maxCoeff();
      fastest = std::max(fastest, speed);
      EXPECT_LE(speed, 0.3);
      EXPECT_LE(acceleration, 0.2);
    }
    EXPECT_NEAR(fastest, move.cable_speed_m_s, 0.01 * fastest);
  }
  EXPECT_GT(slowed, 15);
}

TEST(Move, NoPointOfThePlatformIsFasterThanItsLimit) {
  std::mt19937_64 random(3);
  const Mechanism mechanism = paper_mechanism();
  for (int trial = 0; trial < 20; ++trial) {
    const Move move = plan_move(mechanism, somewhere(random), somewhere(random));
    const Vector3d point =
        mechanism.platform_radius_m * Vector3d(unit(random) - .5, unit(random) - .5, unit(random) - .5).normalized();
    constexpr int kSteps = 1000;
    const double h = move.duration_s() / kSteps;
    for (int i = 0; i < kSteps; ++i)
      EXPECT_LE((pose_at(move, (i + 1) * h) * point - pose_at(move, i * h) * point).norm() / h,
                mechanism.limits.speed_m_s * (1 + 1e-6));
  }
}

TEST(Move, SetpointsBeginAndEndWhereTheyShould) {
  std::mt19937_64 random(4);
  const Mechanism mechanism = paper_mechanism();
  const Pose from = somewhere(random), to = somewhere(random);
  const Move move = plan_move(mechanism, from, to);
  const auto points = setpoints(mechanism, move, 0.02);
  EXPECT_EQ(points.front().t_s, 0);
  EXPECT_EQ(points.back().t_s, move.duration_s());
  EXPECT_EQ(points.size(), std::size_t(std::ceil(move.duration_s() / 0.02)) + 1);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(points.front().lengths_m[std::size_t(i)], cable_lengths(mechanism, from)[i]);
    EXPECT_EQ(points.back().lengths_m[std::size_t(i)], cable_lengths(mechanism, to)[i]);
  }
  EXPECT_THROW(setpoints(mechanism, move, 0), Error);
  EXPECT_THROW(setpoints(mechanism, move, 1e-9), Error);
}

TEST(Move, TurnsAndStandsStill) {
  const Mechanism mechanism = paper_mechanism();
  Pose from, to;
  from.translation = to.translation = Vector3d(0.2, 0.1, 1);
  EXPECT_EQ(plan_move(mechanism, from, to).duration_s(), 0);
  to.rotation = Eigen::AngleAxisd(1e-9, Vector3d::UnitX());
  EXPECT_NEAR(motion_distance(mechanism, from, to), 1e-9 * mechanism.platform_radius_m, 1e-18);
  // The shortest rotation, though the quaternion has the other sign.
  to.rotation = Eigen::AngleAxisd(0.4, Vector3d::UnitX());
  to.rotation.coeffs() *= -1;
  EXPECT_NEAR(motion_distance(mechanism, from, to), 0.4 * mechanism.platform_radius_m, 1e-12);
  EXPECT_NEAR(from.rotation.angularDistance(pose_at(plan_move(mechanism, from, to), 1e9).rotation), 0.4, 1e-9);
  EXPECT_GE(plan_move(mechanism, from, to).duration_s(), least_duration_s(mechanism, from, to));
}

}  // namespace
}  // namespace lumihull::capture
