// The virtual robot: how it errs, how it swings, what it remembers.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/experiments.h>
#include <lumihull/capture/planner.h>
#include <lumihull/rig/rig_robot.h>

#include <cmath>
#include <map>
#include <numbers>

#include "support.h"

namespace lumihull::rig {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

const capture::Plan& square() {
  static const capture::Plan plan = capture::repeatability_plan(capture::paper_mechanism(), {});
  return plan;
}

TEST(RigRobot, ComesBackAsThePapersRobotDoes) {
  double distance = 0, angle = 0, least = 1e9;
  for (const std::uint64_t seed : {1, 2, 3}) {
    RobotErrors errors;
    errors.seed = seed;
    const RigRobot robot(square(), {errors, {}, false});
    std::map<std::string, std::vector<Pose>> places;  // p0 … p3
    for (const capture::PlannedStop& stop : square().stops)
      if (stop.photograph)
        places[stop.name.substr(0, 2)].push_back(
            robot.foreseen(stop, 1 + int(places[stop.name.substr(0, 2)].size())).cam_from_world.inverse());
    ASSERT_EQ(places.size(), 4u);
    for (const auto& [name, poses] : places) {
      ASSERT_EQ(poses.size(), 25u);
      const capture::PoseSpread spread = capture::pose_spread(poses);
      distance = std::max(distance, spread.largest_distance_m);
      angle = std::max(angle, spread.largest_angle_rad);
      least = std::min(least, spread.largest_distance_m);
    }
  }
  // Paper, fig. 9: below 6 cm and 7 degrees, but not by an order of magnitude.
  RecordProperty("largest_distance_mm", int(1000 * distance));
  RecordProperty("largest_angle_mdeg", int(1000 * angle / kDegree));
  EXPECT_LT(distance, .06);
  EXPECT_LT(angle, 7 * kDegree);
  EXPECT_GT(distance, .02);
  EXPECT_GT(angle, 2 * kDegree);
  EXPECT_GT(least, .005);
}

TEST(RigRobot, IsNotWhereThePlanSaysUnlessItHasNoErrors) {
  const RigRobot robot(square(), {});
  const RigRobot exact(square(), {RobotErrors::none(), {}, false});
  double far = 0, near = 1e9;
  for (const capture::PlannedStop& stop : square().stops) {
    const Pose commanded = stop.cam_from_world;
    const double off = (robot.foreseen(stop).cam_from_world.center() - commanded.center()).norm();
    far = std::max(far, off), near = std::min(near, off);
    EXPECT_LT((exact.foreseen(stop).cam_from_world.center() - commanded.center()).norm(), 1e-9);
    EXPECT_LT(exact.foreseen(stop).cam_from_world.rotation.angularDistance(commanded.rotation), 1e-9);
  }
  EXPECT_GT(far, .005);
  EXPECT_LT(far, .15);
  EXPECT_GT(near, 1e-4);
}

TEST(RigRobot, SwingsAndComesToRest) {
  RigRobot robot(square(), {});
  Job job;
  double late = 0, early = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    robot.move_to(square().stops[i], job);
    const double start = robot.now_s();
    const Pose rest = robot.cam_from_world_at_rest();
    // What a sphere at 1.5 m does in the paper's picture (18 mm on 22.7 mm and 3072 px).
    const Eigen::Vector3d sphere = rest.inverse() * Eigen::Vector3d(0, 0, 1.5);
    std::vector<double> times, moved;
    for (double t = 0; t < 12; t += .04) {
      const Eigen::Vector3d p = robot.cam_from_world(start + t) * sphere;
      times.push_back(t);
      moved.push_back(2436 * std::hypot(p.x(), p.y()) / p.z());
    }
    if (i == 0) continue;  // it was there: no way to stop from
    early = std::max(early, *std::max_element(moved.begin(), moved.begin() + 25));
    const auto settled = capture::settle_time_s(times, moved, 1);
    ASSERT_TRUE(settled.has_value());
    late = std::max(late, *settled);
    EXPECT_LT(*settled, 7) << "paper, 5.1";
  }
  EXPECT_GT(early, 5);
  EXPECT_GT(late, 2);
}

TEST(RigRobot, RemembersWhereItIs) {
  const test::TemporaryFolder folder;
  Job job;
  const capture::PlannedStop& stop = square().stops[3];
  Pose pose, first;
  double clock = 0;
  {
    RigRobot robot(square(), {{}, folder / "robot", false});
    robot.move_to(square().stops[0], job);
    robot.move_to(stop, job);
    first = robot.cam_from_world_at_rest();
    robot.move_to(square().stops[2], job);
    robot.move_to(stop, job);
    robot.set_roll(.3, job);
    robot.settle(2);
    robot.settle(1);  // has passed already
    pose = robot.cam_from_world(robot.now_s());
    clock = robot.now_s();
    robot.declare_position(stop);
    EXPECT_LT((robot.cam_from_world(clock).matrix() - pose.matrix()).norm(), 1e-12);
  }
  RigRobot robot(square(), {{}, folder / "robot", false});
  EXPECT_EQ(robot.stop(), stop.name);
  EXPECT_EQ(robot.now_s(), clock);
  EXPECT_EQ(robot.state().lengths_m, stop.lengths_m);
  EXPECT_LT((robot.cam_from_world(clock).matrix() - pose.matrix()).norm(), 1e-12);
  // Each visit is another pose; a move to where it is is none.
  EXPECT_GT((robot.cam_from_world_at_rest().center() - first.center()).norm(), 1e-4);

  for (const char* text : {"", "rig-robot 2\nstop x\n", "rig-robot 2\nclock a b c d\nend\n",
                           "rig-robot 2\nreached 99999 0\nend\n", "something"}) {
    write_file(folder / "broken", text);
    EXPECT_EQ(test::expect_error([&] {
                RigRobot(square(), {{}, folder / "broken", false});
              }).code(),
              ErrorCode::bad_input)
        << text;
  }
}

/// Whatever ways a session takes that goes on, the clock is the plan's.
TEST(RigRobot, ItsClockGoesByThePlan) {
  capture::Plan plan = square();
  ASSERT_GE(plan.stops.size(), 6u);
  for (std::size_t i = 3; i < plan.stops.size(); ++i) plan.stops[i].roll_rad += .5;  // turned at the fourth stop
  Job job;
  const auto visit = [&](RigRobot& robot, std::size_t i) {
    robot.move_to(plan.stops[i], job);
    robot.settle(7);
  };
  RigRobot whole(plan, {}), stopped(plan, {});
  for (std::size_t i = 0; i < 6; ++i) {
    whole.move_to(plan.stops[i], job);
    if (i == 0 || i == 3) whole.set_roll(plan.stops[i].roll_rad, job);
    if (i == 1 || i == 5) whole.settle(7);
  }
  stopped.move_to(plan.stops[0], job);
  stopped.set_roll(plan.stops[0].roll_rad, job);
  visit(stopped, 1);
  stopped.pass(2);
  const double at_second = stopped.now_s();
  stopped.pass_until(at_second - 1);  // has passed
  stopped.move_to(plan.stops[1], job);
  capture::PlannedStop above = plan.stops[1];
  above.name = "above", above.travel_s = 9;
  for (double& length : above.lengths_m) length -= .2;
  stopped.move_to(above, job);
  stopped.move_to(plan.stops[0], job);
  EXPECT_EQ(stopped.now_s(), at_second) << "ways back, and out, are none of the plan's";
  stopped.move_to(plan.stops[4], job);  // past the place where the camera is turned, which is turned here
  stopped.set_roll(plan.stops[4].roll_rad, job);
  visit(stopped, 5);
  EXPECT_DOUBLE_EQ(stopped.now_s(), whole.now_s() + 2);
  EXPECT_GT(whole.now_s(), 7 + 7 + 2 + 2 + plan.stops[5].travel_s);
}

TEST(RigRobot, TablesAndHandsHaveSmallErrors) {
  capture::HemisphereOptions views;
  views.azimuths = 6, views.rows = 2, views.radius_m = .8, views.phi_from_rad = .5;
  for (const char* kind : {"turntable", "hand"}) {
    const capture::Plan plan = capture::view_tour(kind, views, capture::Orientation::landscape, {"camera"}, 3).plan;
    RigRobot robot(plan, {});
    Job job;
    double sum = 0;
    for (const capture::PlannedStop& stop : plan.stops) {
      robot.move_to(stop, job);
      sum += (robot.cam_from_world(robot.now_s()).center() - stop.cam_from_world.center()).squaredNorm();
    }
    const double rms = std::sqrt(sum / double(3 * plan.stops.size()));
    const double expected = std::string(kind) == "hand" ? RobotErrors{}.hand_m : RobotErrors{}.table_m;
    EXPECT_GT(rms, .6 * expected) << kind;
    EXPECT_LT(rms, 1.5 * expected) << kind;
    EXPECT_TRUE(robot.cables(0).empty());
  }
}

TEST(RigRobot, RefusesWhatIsNoError) {
  RobotErrors errors;
  errors.winch_m = NAN;
  EXPECT_THROW(RigRobot(square(), {errors, {}, false}), Error);
  errors = {};
  errors.swing_decay_s = 0;
  EXPECT_THROW(RigRobot(square(), {errors, {}, false}), Error);
}

}  // namespace
}  // namespace lumihull::rig
