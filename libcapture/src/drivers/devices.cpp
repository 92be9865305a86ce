// From words to robots and cameras.
#include <lumihull/base/error.h>
#include <lumihull/capture/camera_devices.h>
#include <lumihull/capture/devices.h>
#include <lumihull/capture/operator_robot.h>
#include <lumihull/capture/serial.h>
#include <lumihull/capture/simulated_devices.h>

#include <utility>

namespace lumihull::capture {

namespace {

/// "serial:/dev/ttyUSB0" is what and where; "serial" has nothing after it.
struct Word {
  std::string what, where;
  bool colon = false;

  explicit Word(const std::string& word) {
    const std::size_t at = word.find(':');
    what = word.substr(0, at);
    colon = at != std::string::npos;
    if (colon) where = word.substr(at + 1);
  }
  /// Nothing may follow, something must, or both are right.
  bool alone() const { return !colon; }
  bool complete() const { return colon && !where.empty(); }
};

constexpr const char* kRobotWords = "simulate, turntable, hand, serial:PORT";
constexpr const char* kCameraWords = "simulate, hand, serial[:PORT], gphoto2[:PORT], folder:DIR";

bool is_robot(const Word& w) {
  const bool simple = w.what == "simulate" || w.what == "turntable" || w.what == "hand";
  return (simple && w.alone()) || (w.what == "serial" && w.complete());
}

bool is_camera(const Word& w) {
  const bool simple = w.what == "simulate" || w.what == "hand";
  const bool with_port = w.what == "serial" || w.what == "gphoto2";
  return (simple && w.alone()) || (with_port && (w.alone() || w.complete())) || (w.what == "folder" && w.complete());
}

[[noreturn]] void unknown(const std::string& word, const std::string& expected) {
  std::string what = "expected one of " + expected;
  if (Word(word).what == "rig")
    what += "; the virtual rig is a device of the program alone: `lumihull capture --robot rig --camera rig`";
  throw Error(ErrorCode::invalid_argument, what, word);
}

}  // namespace

void check_robot_word(const std::string& word) {
  if (!is_robot(Word(word))) unknown(word, kRobotWords);
}

void check_camera_word(const std::string& word) {
  if (!is_camera(Word(word))) unknown(word, kCameraWords);
}

Devices::Devices(std::filesystem::path folder, Operator& who) : folder_(std::move(folder)), who_(who) {}
Devices::~Devices() = default;

void Devices::bring(const std::string& word, BroughtDevices devices) { brought_[word] = std::move(devices); }

std::string Devices::expected(std::string words, std::string BroughtDevices::*usage) const {
  for (const auto& [word, devices] : brought_) words += ", " + devices.*usage;
  return words;
}

std::filesystem::path Devices::memory() const {
  std::filesystem::path out = std::filesystem::absolute(folder_).lexically_normal();
  if (!out.has_filename()) out = out.parent_path();
  out += ".simulated";
  std::filesystem::create_directories(out);
  return out;
}

std::shared_ptr<SerialLink> Devices::link(const std::string& port) {
  std::shared_ptr<SerialLink>& link = links_[port];
  if (!link) link = open_serial_link({.device = port});
  return link;
}

std::unique_ptr<Robot> Devices::robot(const std::string& word, const Plan& plan) {
  const Word w(word);
  if (const auto own = brought_.find(w.what); own != brought_.end() && (w.alone() || w.complete()))
    return own->second.robot(w.where, plan);
  if (!is_robot(w)) unknown(word, expected(kRobotWords, &BroughtDevices::robot_usage));
  using Moves = OperatorRobot::Moves;
  if (w.what == "turntable") return std::make_unique<OperatorRobot>(Moves::turntable, who_);
  if (w.what == "hand") return std::make_unique<OperatorRobot>(Moves::camera, who_);
  if (w.what == "simulate") {
    const std::filesystem::path remembered = memory() / "robot";
    const bool fresh = !std::filesystem::exists(remembered);
    auto robot = std::make_unique<SimulatedRobot>(SimulatedRobot::Options{.memory = remembered});
    if (fresh && !plan.stops.empty()) robot->declare_position(plan.stops.front());  // it was made there
    return robot;
  }
  if (!plan.mechanism)
    throw Error(ErrorCode::invalid_argument, "the plan is for no mechanism with cables: `lumihull plan --mechanism`",
                word);
  robot_port_ = w.where;
  return open_serial_robot(link(robot_port_), *plan.mechanism);
}

std::unique_ptr<CameraDevice> Devices::camera(const std::string& word, const std::string& name, const Robot& on,
                                              Job& job) {
  const Word w(word);
  if (const auto own = brought_.find(w.what); own != brought_.end() && (w.alone() || w.complete()))
    return own->second.camera(w.where, name, on);
  if (!is_camera(w)) unknown(word, expected(kCameraWords, &BroughtDevices::camera_usage));
  if (w.what == "simulate")
    return std::make_unique<SimulatedCamera>(
        SimulatedCamera::Options{.name = name, .list = memory() / ("exposures-" + name), .card = {}},
        dynamic_cast<const SimulatedRobot*>(&on));
  if (w.what == "hand") return std::make_unique<OperatorCamera>(who_);
  if (w.what == "serial") {
    const std::string& port = w.complete() ? w.where : robot_port_;
    if (port.empty())
      throw Error(ErrorCode::invalid_argument, "the robot has no serial port to share: expected serial:PORT", word);
    return open_serial_camera(link(port));
  }
  if (w.what == "gphoto2") {
    GphotoOptions options;
    if (w.complete()) options.port = w.where;
    if (options.port.rfind("ptpip:", 0) == 0) options.model = "PTP/IP Camera";  // only USB tells its cameras
    return open_gphoto_camera(options, job);
  }
  const auto ask = [this, folder = w.where](ShotId id, double) {
    who_.tell("shot " + std::to_string(id) + ": take the photograph; its file is waited for in " + folder);
    return true;
  };
  return watch_folder({.watched = w.where, .release = ask});
}

}  // namespace lumihull::capture
