// Winches and the bearing over the serial link, against the firmware's simulator.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lumihull/base/error.h>
#include <lumihull/capture/motion.h>
#include <lumihull/capture/serial.h>
#include <lumihull/capture/statics.h>

#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

#include "serial_simulator.h"

namespace lumihull::test {
namespace {

using namespace capture;
using testing::HasSubstr;

constexpr double kSpeed = 10;

/// Six cables; where they run does not matter here.
Mechanism six_cables() {
  Mechanism mechanism;
  mechanism.name = "test";
  for (int i = 0; i < 6; ++i) {
    Cable cable;
    cable.name = "cable " + std::to_string(i);
    cable.departure = {5 * std::cos(i * M_PI / 3), 5 * std::sin(i * M_PI / 3), 6};
    cable.attachment = {0.2 * std::cos(i * M_PI / 3), 0.2 * std::sin(i * M_PI / 3), 0};
    cable.max_length_m = 12;
    mechanism.cables.push_back(cable);
  }
  mechanism.room = {Eigen::Vector3d(-5, -6, 0), Eigen::Vector3d(5, 6, 6)};
  return mechanism;
}

PlannedStop stop_at(const std::string& name, std::vector<double> lengths_m, double roll_rad = 0) {
  PlannedStop stop;
  stop.name = name;
  stop.lengths_m = std::move(lengths_m);
  stop.roll_rad = roll_rad;
  return stop;
}

const PlannedStop kHome = stop_at("home", {5, 5, 5, 5, 5, 5});
const PlannedStop kAway = stop_at("away", {5.4, 5.3, 5.2, 4.9, 4.8, 4.7});

struct Rig {
  explicit Rig(std::vector<std::string> faults = {}, const SerialRobotOptions& options = {.straight = false},
               const Mechanism& mechanism = six_cables())
      : simulator([&] {
          faults.insert(faults.end(), {"--speed", "10"});
          return faults;
        }()) {
    SerialOptions serial;
    serial.device = simulator.device();
    serial.time_scale = kSpeed;
    for (int i = 0; !robot; ++i) try {
        link = open_serial_link(serial);
        robot = open_serial_robot(link, mechanism, options);
      } catch (const Error& e) {
        if (i > 20 || e.code() != ErrorCode::io) throw;
      }
  }
  SerialSimulator simulator;
  std::shared_ptr<SerialLink> link;
  std::unique_ptr<Robot> robot;
  Job job;
};

template <class Call>
std::string error_of(Call call, ErrorCode code = ErrorCode::io) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

/// Where the simulator's winches came to rest last.
std::vector<double> true_lengths(const SerialSimulator& simulator) {
  std::vector<double> lengths;
  for (const auto& event : simulator.log())
    if (event.what.rfind("rests", 0) == 0) {
      lengths.clear();
      std::istringstream in(event.what.substr(5));
      for (double um; in >> um;) lengths.push_back(um * 1e-6);
    }
  return lengths;
}

bool ever_moved(const SerialSimulator& simulator) {
  for (const auto& event : simulator.log())
    if (event.what.rfind("moves", 0) == 0) return true;
  return false;
}

TEST(SerialRobot, GoesWhereItIsToldOnceThePositionIsDeclared) {
  Rig rig;
  auto state = rig.robot->state();
  EXPECT_TRUE(state.ready);
  EXPECT_FALSE(state.position_known);
  EXPECT_TRUE(state.lengths_m.empty());
  EXPECT_THAT(error_of([&] { rig.robot->move_to(kAway, rig.job); }), HasSubstr("not known"));
  EXPECT_FALSE(ever_moved(rig.simulator));

  rig.robot->declare_position(kHome);
  EXPECT_EQ(rig.robot->state().lengths_m, kHome.lengths_m);
  rig.robot->move_to(kAway, rig.job);
  state = rig.robot->state();
  EXPECT_FALSE(state.moving);
  ASSERT_EQ(state.lengths_m.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(state.lengths_m[i], kAway.lengths_m[i], 1e-9);
    EXPECT_NEAR(true_lengths(rig.simulator).at(i), kAway.lengths_m[i], 1e-9);
  }
}

TEST(SerialRobot, LimitsAreRefusedByTheController) {
  Rig rig;
  rig.robot->declare_position(kHome);
  EXPECT_THAT(error_of([&] {
                rig.robot->move_to(stop_at("far", {5, 5, 12.1, 5, 5, 5}), rig.job);
              }),
              HasSubstr("cable 2"));
  error_of([&] { rig.robot->move_to(stop_at("none", {}), rig.job); }, ErrorCode::invalid_argument);
  error_of([&] { rig.robot->move_to(stop_at("nan", {5, 5, NAN, 5, 5, 5}), rig.job); }, ErrorCode::invalid_argument);
  EXPECT_FALSE(ever_moved(rig.simulator));

  // Faster than the controller was built for.
  Mechanism mechanism = six_cables();
  mechanism.limits.cable_speed_m_s = 0.9;
  EXPECT_THAT(error_of([&] { open_serial_robot(rig.link, mechanism, {.straight = false})->declare_position(kHome); }),
              HasSubstr("limit"));
  mechanism.cables.pop_back();
  error_of([&] { open_serial_robot(rig.link, mechanism); }, ErrorCode::invalid_argument);
}

/// A stop of a real mechanism.
PlannedStop stop_at(const Mechanism& mechanism, const std::string& name, const Eigen::Vector3d& position,
                    double turn_rad) {
  PlannedStop stop;
  stop.name = name;
  stop.world_from_platform =
      Pose(Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d(1, 2, 0).normalized())), position);
  const CableVector lengths = cable_lengths(mechanism, stop.world_from_platform);
  stop.lengths_m.assign(lengths.data(), lengths.data() + lengths.size());
  return stop;
}

TEST(SerialRobot, ThePlatformGoesAlongThePlannedLine) {
  const Mechanism mechanism = paper_mechanism();
  const PlannedStop a = stop_at(mechanism, "a", {0.2, -0.5, 1.5}, 0),
                    b = stop_at(mechanism, "b", {-0.6, 0.7, 2.0}, 0.3);
  Rig rig({}, {.straight = true}, mechanism);
  rig.robot->declare_position(a);
  rig.robot->move_to(b, rig.job);
  const Move move = plan_move(mechanism, a.world_from_platform, b.world_from_platform);
  double start_ms = 0, end_ms = 0, largest_m = 0;
  int samples = 0;
  for (const auto& event : rig.simulator.log()) {
    if (event.what.rfind("moves", 0) == 0) start_ms = double(event.ms);
    if (event.what.rfind("rests", 0) == 0) end_ms = double(event.ms);
    if (event.what.rfind("at ", 0) != 0) continue;
    const CableVector planned = cable_lengths(mechanism, pose_at(move, (double(event.ms) - start_ms) * 1e-3));
    std::istringstream in(event.what.substr(3));
    for (double um, i = 0; in >> um; ++i)
      largest_m = std::max(largest_m, std::abs(um * 1e-6 - planned[Eigen::Index(i)]));
    ++samples;
  }
  EXPECT_NEAR(end_ms - start_ms, move.duration_s() * 1e3, 2);
  EXPECT_GT(samples, 50);
  EXPECT_LT(largest_m, 0.0005);
  std::printf("    largest deviation %.3f mm in %.1f s\n", largest_m * 1e3, move.duration_s());

  // Broken off on the way, it goes on from where it hangs.
  std::thread operator_thread([&] {
    rig.simulator.await("moves", rig.simulator.await("rests"));
    rig.job.cancel();
  });
  error_of([&] { rig.robot->move_to(a, rig.job); }, ErrorCode::cancelled);
  operator_thread.join();
  while (rig.robot->state().moving) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  Job job;
  rig.robot->move_to(a, job);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(rig.robot->state().lengths_m.at(i), a.lengths_m[i], 1e-6);

  PlannedStop wrong = b;
  wrong.lengths_m[2] += 2e-6;
  EXPECT_THAT(error_of([&] { rig.robot->move_to(wrong, job); }, ErrorCode::invalid_argument), HasSubstr("pose"));
}

TEST(SerialRobot, AStopBeyondACablesLengthIsRefusedWithItsName) {
  Mechanism mechanism = paper_mechanism();
  const PlannedStop a = stop_at(mechanism, "a", {0.2, -0.5, 1.5}, 0),
                    b = stop_at(mechanism, "b", {-0.6, 0.7, 2.0}, 0.3);
  std::size_t longer = 0;
  while (b.lengths_m[longer] < a.lengths_m[longer] + 0.1) ++longer;
  mechanism.cables[longer].max_length_m = a.lengths_m[longer] + 0.05;
  Rig rig({}, {.straight = true}, mechanism);
  rig.robot->declare_position(a);
  EXPECT_THAT(error_of([&] { rig.robot->move_to(b, rig.job); }),
              HasSubstr("limit, cable \"" + mechanism.cables[longer].name + "\""));
  EXPECT_FALSE(ever_moved(rig.simulator));
}

TEST(SerialRobot, WhatTheControllerFindsTooFastTakesMoreTime) {
  Mechanism mechanism = paper_mechanism();
  mechanism.limits = {2, 3, 1000, 0.8,
                      0.6};  // next to no limit of jerk: the cubic overshoots the winches' acceleration
  const PlannedStop a = stop_at(mechanism, "a", {0.2, -0.5, 1.5}, 0),
                    b = stop_at(mechanism, "b", {-0.6, 0.7, 2.0}, 0.3);
  Rig rig({}, {.straight = true}, mechanism);
  rig.robot->declare_position(a);
  rig.robot->move_to(b, rig.job);
  const auto log = rig.simulator.log();
  const double took_s = double(log[rig.simulator.await("rests")].ms - log[rig.simulator.await("moves")].ms) * 1e-3;
  const double planned_s = plan_move(mechanism, a.world_from_platform, b.world_from_platform).duration_s();
  EXPECT_GT(took_s, 1.05 * planned_s);
  EXPECT_LT(took_s, 2.05 * planned_s);
}

TEST(SerialRobot, OverABadLineItGoesOrSaysThatItDidNot) {
  Rig rig({"--drop", "0.05", "--damage", "0.05", "--duplicate", "0.05", "--delay", "0.05", "--seed", "5"});
  int arrived = 0;
  for (int i = 0; i < 30; ++i) {
    const PlannedStop& to = i % 2 ? kHome : kAway;
    try {
      if (!rig.robot->state().position_known) rig.robot->declare_position(i % 2 ? kAway : kHome);
      rig.robot->move_to(to, rig.job);
      for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(true_lengths(rig.simulator).at(k), to.lengths_m[k], 1e-9);
      ++arrived;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::io) << e.what();
    }
  }
  EXPECT_GE(arrived, 15);
}

TEST(SerialRobot, AfterARestartNothingMovesUntilThePositionIsDeclared) {
  Rig rig;
  rig.robot->declare_position(kHome);
  std::thread power([&] {
    rig.simulator.await("moves");
    rig.simulator.order("reset");
  });
  error_of([&] { rig.robot->move_to(kAway, rig.job); });
  power.join();
  rig.simulator.await("boot 2");
  EXPECT_FALSE(rig.robot->state().position_known);
  const auto events = rig.simulator.log().size();
  EXPECT_THAT(error_of([&] { rig.robot->move_to(kAway, rig.job); }), HasSubstr("not known"));
  const auto later = rig.simulator.log();
  for (std::size_t i = events; i < later.size(); ++i) EXPECT_THAT(later[i].what, testing::Not(HasSubstr("moves")));
  rig.robot->declare_position(kHome);
  rig.robot->move_to(kAway, rig.job);
  EXPECT_NEAR(true_lengths(rig.simulator).at(0), kAway.lengths_m[0], 1e-9);
}

TEST(SerialRobot, CancellingStopsTheWinches) {
  Rig rig;
  rig.robot->declare_position(kHome);
  std::thread operator_thread([&] {
    rig.simulator.await("moves");
    rig.job.cancel();
  });
  error_of([&] { rig.robot->move_to(kAway, rig.job); }, ErrorCode::cancelled);
  operator_thread.join();
  rig.simulator.await("rests");
  const auto at = true_lengths(rig.simulator);
  EXPECT_LT(at.at(0), kAway.lengths_m[0]);
  const auto state = rig.robot->state();
  EXPECT_TRUE(state.position_known);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(state.lengths_m.at(i), at[i], 1e-9);
}

TEST(SerialRobot, TheEmergencyStopIsAFault) {
  Rig rig;
  rig.robot->declare_position(kHome);
  std::thread operator_thread([&] {
    rig.simulator.await("moves");
    rig.simulator.order("stop on");
  });
  EXPECT_THAT(error_of([&] { rig.robot->move_to(kAway, rig.job); }), HasSubstr("emergency stop"));
  operator_thread.join();
  auto state = rig.robot->state();
  EXPECT_FALSE(state.ready);
  EXPECT_FALSE(state.position_known);
  EXPECT_THAT(state.fault, HasSubstr("emergency stop"));
  rig.simulator.order("stop off");
  rig.simulator.await("stop off");
  for (int i = 0; i < 100 && !rig.robot->state().ready; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_TRUE(rig.robot->state().ready);
  EXPECT_FALSE(rig.robot->state().position_known);
}

TEST(SerialRobot, TheBearingIsReleasedOnlyForAnotherAngle) {
  Rig rig;
  rig.robot->declare_position(kHome);  // at roll 0
  auto times = [&] {
    std::vector<std::uint64_t> on, off;
    for (const auto& event : rig.simulator.log()) {
      if (event.what == "solenoid on") on.push_back(event.ms);
      if (event.what == "solenoid off" && on.size() > off.size()) off.push_back(event.ms);
    }
    for (std::size_t i = 0; i < off.size(); ++i) off[i] -= on[i];
    return off;
  };
  rig.robot->set_roll(0, rig.job);
  EXPECT_TRUE(times().empty());
  rig.robot->set_roll(M_PI / 2, rig.job);
  rig.robot->set_roll(M_PI / 2, rig.job);
  EXPECT_EQ(times(), (std::vector<std::uint64_t>{1500}));
  rig.robot->set_roll(0, rig.job);  // waits until the coil has rested
  EXPECT_EQ(times(), (std::vector<std::uint64_t>{1500, 1500}));

  Rig hot({}, {.straight = false, .solenoid_s = 2.5});
  hot.robot->declare_position(kHome);
  EXPECT_THAT(error_of([&] { hot.robot->set_roll(1, hot.job); }), HasSubstr("limit"));
}

TEST(SerialRobot, APortThatIsPulledOutIsAFault) {
  Rig rig;
  rig.simulator.kill();
  const auto state = rig.robot->state();
  EXPECT_FALSE(state.ready);
  EXPECT_THAT(state.fault, HasSubstr("plug the controller in again"));
  error_of([&] { rig.robot->move_to(kAway, rig.job); });
  rig.robot->make_safe();
}

}  // namespace
}  // namespace lumihull::test
