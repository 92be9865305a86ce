// The virtual rig as devices of a session that somebody else drives.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/session.h>
#include <lumihull/rig/rig_devices.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "session_truth.h"
#include "simulate_options.h"

namespace lumihull::rig {

namespace fs = std::filesystem;

namespace {

/// "OBJECT:WIDTH", each of which may be missing.
void read_scene(const std::string& what, SimulateOptions& options) {
  std::string object = what;
  const std::size_t colon = what.rfind(':');
  const std::string width = colon == std::string::npos ? "" : what.substr(colon + 1);
  if (!width.empty() && width.size() < 6 &&
      std::all_of(width.begin(), width.end(), [](unsigned char c) { return std::isdigit(c); })) {
    options.width = std::stoi(width);
    object.resize(colon);
  }
  if (!object.empty()) options.object = object;
  // The sheets stay those of full pictures as long as their circles, of 9 px there, can be read in smaller ones.
  constexpr double kReadable_px = 6.5;
  options.circle_px = std::max(kReadable_px, 9. * options.width / SimulateOptions{}.width);
  check(options);
}

/// Pictures to rehearse with: sharp where targets and outlines are, with light and paint that are soon there again
/// after each start. `simulate` makes those by which results are judged.
SimulateOptions drafts() {
  SimulateOptions options;
  options.light = {.ambient_rays = 16, .lamp_rays = 4, .bounces = 4, .floor_texels = 48, .vertex_spacing = .03f};
  options.photo.reduce = 3;
  options.photo.blur_px = .6;
  return options;
}

}  // namespace

RigDevices::RigDevices(fs::path folder, bool dry, std::function<void(const std::string&)> say)
    : folder_(std::move(folder)), dry_(dry), say_(std::move(say)), options_(drafts()) {}

capture::BroughtDevices RigDevices::brought(Job& job) {
  capture::BroughtDevices devices;
  devices.robot_usage = "rig";
  devices.camera_usage = "rig[:OBJECT[:WIDTH]]";
  devices.robot = [this](const std::string& what, const capture::Plan& plan) { return robot(what, plan); };
  devices.camera = [this, &job](const std::string& what, const std::string& name, const capture::Robot& on) {
    return camera(what, name, on, job);
  };
  return devices;
}

std::unique_ptr<capture::Robot> RigDevices::robot(const std::string& what, const capture::Plan& plan) {
  if (!what.empty())
    throw Error(ErrorCode::invalid_argument, "the rig's object is the camera's word: expected rig", "rig:" + what);
  options_.plan = plan;
  options_.carrier = plan.robot == "turntable" ? Carrier::turntable
                     : plan.robot == "hand"    ? Carrier::hand
                                               : Carrier::cables;
  fs::path memory = folder_ / "truth" / "robot.txt";
  if (dry_ && !fs::exists(memory)) memory.clear();
  if (!memory.empty()) fs::create_directories(memory.parent_path());
  auto robot = std::make_unique<RigRobot>(plan, RigRobot::Options{errors_of(options_, plan), memory, false});
  if (robot->stop().empty()) robot->declare_position(plan.stops.front());  // it was set up there
  robot_ = robot.get();
  return robot;
}

std::unique_ptr<capture::CameraDevice> RigDevices::camera(const std::string& what, const std::string& name,
                                                          const capture::Robot& on, Job& job) {
  if (&on != robot_)
    throw Error(ErrorCode::invalid_argument, "the rig's cameras hang on the rig's robot: --robot rig", "rig");
  if (!session_)
    set_up(what, job);
  else if (what != what_)
    throw Error(ErrorCode::invalid_argument, "all cameras of the rig see the same object, at the same size: " + what_,
                "rig:" + what);
  const auto photographer = [this, threads = job.threads()]() -> const Photographer& {
    Job light({}, threads);  // no step of the session
    if (!photographer_) photographer_.emplace(session_->scene, options_.light, light);
    return *photographer_;
  };
  return std::make_unique<RigCamera>(camera_of(options_, *session_, name, folder_ / "truth"), photographer, *robot_);
}

/// Decides about the scene, or finds that it is the one that this capture was begun with.
void RigDevices::set_up(const std::string& what, Job& job) {
  read_scene(what, options_);
  const fs::path file = folder_ / "simulate.json";
  const std::string text = options_json(options_);
  if (fs::exists(file) && read_file(file) != text)
    throw Error(ErrorCode::invalid_argument,
                "was begun with another object or size: name the same, or another folder for the capture",
                "rig:" + what);
  what_ = what;
  session_ = plan_session(options_, {}, job);
  if (say_) {
    say_("virtual rig: " + session_->said);
    for (const std::string& note : session_->notes) say_("note: " + note);
  }
  if (dry_) return;
  fs::create_directories(folder_);
  write_file(file, text);
  session_->targets.set.save(folder_ / "sheets.json");
}

std::function<void(double, Job&)> RigDevices::settle() const {
  if (!robot_) return {};
  return [robot = robot_](double seconds, Job&) { robot->settle(seconds); };
}

void RigDevices::write_truth(Job& job) const {
  if (!session_ || dry_ || !fs::exists(capture::journal_path(folder_))) return;
  write_session_truth(folder_, *session_, exposures_of(folder_), job);
}

}  // namespace lumihull::rig
