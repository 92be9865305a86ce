#include <lumihull/base/error.h>
#include <lumihull/capture/operator_robot.h>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace lumihull::capture {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

void ask_for(Operator& who, const std::string& text, Job& job) {
  job.check();
  if (who.ask({Question::About::task, text, {"there", "stop"}}, job) != "there")
    throw Error(ErrorCode::cancelled, "stopped by the operator", "operator");
}

std::string text(const char* format, double a, double b = 0, double c = 0) {
  char out[200];
  std::snprintf(out, sizeof out, format, a, b, c);
  return out;
}

std::string turn_of(const PlannedStop& stop) {
  double degrees = std::fmod(stop.theta_rad * kDegrees, 360.0);
  if (degrees < 0) degrees += 360;
  return text(": turn the table to %.1f°, the camera at %.1f° above the horizon", degrees,
              90 - stop.phi_rad * kDegrees);
}

std::string place_of(const PlannedStop& stop) {
  const Eigen::Vector3d at = stop.cam_from_world.center();
  return text(": move the camera to x %.2f, y %.2f, z %.2f m", at.x(), at.y(), at.z()) +
         text(" (azimuth %.1f°, %.1f° above the horizon), aimed at the object", stop.theta_rad * kDegrees,
              90 - stop.phi_rad * kDegrees);
}

}  // namespace

/// A person always knows where things are.
Robot::State OperatorRobot::state() {
  State state;
  state.ready = state.position_known = true;
  return state;
}

void OperatorRobot::move_to(const PlannedStop& stop, Job& job) {
  ask_for(who_, stop.name + (moves_ == Moves::turntable ? turn_of(stop) : place_of(stop)), job);
}

void OperatorRobot::set_roll(double roll_rad, Job& job) {
  const double degrees = roll_rad * kDegrees;
  ask_for(who_,
          std::abs(degrees) < 0.05        ? "hold the camera in landscape"
          : std::abs(degrees - 90) < 0.05 ? "hold the camera in portrait"
                                          : text("turn the camera about its axis to %.1f°", degrees),
          job);
}

ShotOutcome OperatorCamera::shoot(ShotId id, double, const std::filesystem::path&, Job& job) {
  const std::string answer = who_.ask({Question::About::task,
                                       "press the shutter once (picture " + std::to_string(id) + ")",
                                       {"taken", "not taken", "unsure"}},
                                      job);
  if (answer == "taken") return {ShotState::done, {}, {}};
  if (answer == "not taken") return {ShotState::refused, {}, "the operator says so"};
  return {ShotState::unknown, {}, "the operator is not sure"};
}

ShotOutcome OperatorCamera::recall(ShotId) { return {ShotState::unknown, {}, "only the operator can tell"}; }

}  // namespace lumihull::capture
