#include "capture_devices.h"

#include <lumihull/base/error.h>
#include <lumihull/capture/camera_devices.h>
#include <lumihull/capture/operator_robot.h>
#include <lumihull/rig/simulated_devices.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace lumihull::program {

using namespace capture;

namespace {

std::string after_colon(const std::string& word) {
  const std::size_t colon = word.find(':');
  return colon == std::string::npos ? "" : word.substr(colon + 1);
}

bool begins(const std::string& word, const char* with) { return word.rfind(with, 0) == 0; }

}  // namespace

TerminalOperator::TerminalOperator(std::function<void(const std::string&)> say, bool yes, Job& interrupted)
    : say_(std::move(say)), yes_(yes), interrupted_(interrupted) {}

std::string TerminalOperator::read_line(Job& job) {
  for (;;) {
    if (const std::size_t end = typed_.find('\n'); end != std::string::npos) {
      std::string line = typed_.substr(0, end);
      typed_.erase(0, end + 1);
      while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.pop_back();
      return line;
    }
    // Ctrl-C must be heard while nobody types; the job at hand may be one that lets an exposure end.
    interrupted_.check();
    job.check();
    pollfd in{STDIN_FILENO, POLLIN, 0};
    if (poll(&in, 1, 100) <= 0) continue;
    char bytes[256];
    const ssize_t n = read(STDIN_FILENO, bytes, sizeof bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw Error(ErrorCode::cancelled, "standard input was closed", "operator");
    typed_.append(bytes, std::size_t(n));
  }
}

std::string TerminalOperator::ask(const Question& question, Job& job) {
  if (yes_ && question.about == Question::About::motion) return question.choices.front();
  if (!isatty(STDIN_FILENO)) return AbsentOperator().ask(question, job);
  std::string choices;
  for (const std::string& choice : question.choices) choices += (choices.empty() ? "" : ", ") + choice;
  // What only confirms a task is Enter; all else is typed, so that nothing is agreed to by accident.
  const bool enter = question.about == Question::About::task && question.choices.size() == 2;
  for (;;) {
    say_(question.text + (enter ? "  [Enter = " + question.choices.front() + "; " + question.choices.back() + "]"
                                : "  [" + choices + "]"));
    const std::string line = read_line(job);
    if (enter && line.empty()) return question.choices.front();
    if (std::find(question.choices.begin(), question.choices.end(), line) != question.choices.end()) return line;
  }
}

/// What the simulated devices keep between two runs of the program: a folder beside the capture's.
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
  if (word == "simulate") {
    const std::filesystem::path remembered = memory() / "robot";
    const bool fresh = !std::filesystem::exists(remembered);
    auto robot = std::make_unique<rig::SimulatedRobot>(rig::SimulatedRobot::Options{.memory = remembered});
    if (fresh && !plan.stops.empty()) robot->declare_position(plan.stops.front());  // it was made there
    return robot;
  }
  if (word == "turntable") return std::make_unique<TurntableRobot>(who_);
  if (word == "hand") return std::make_unique<HandRobot>(who_);
  if (begins(word, "serial:")) {
    if (!plan.mechanism)
      throw Error(ErrorCode::invalid_argument, "the plan is for no mechanism with cables: `lumihull plan --mechanism`",
                  word);
    robot_port_ = after_colon(word);
    return open_serial_robot(link(robot_port_), *plan.mechanism);
  }
  throw Error(ErrorCode::invalid_argument, "expected simulate, turntable, hand or serial:PORT", word);
}

std::unique_ptr<CameraDevice> Devices::camera(const std::string& word, const std::string& name, Robot& on) {
  if (word == "simulate")
    return std::make_unique<rig::SimulatedCamera>(
        rig::SimulatedCamera::Options{.name = name, .list = memory() / ("exposures-" + name), .card = {}},
        dynamic_cast<const rig::SimulatedRobot*>(&on));
  if (word == "hand") return std::make_unique<OperatorCamera>(who_);
  if (word == "serial" || begins(word, "serial:")) {
    const std::string port = word == "serial" ? robot_port_ : after_colon(word);
    if (port.empty())
      throw Error(ErrorCode::invalid_argument, "the robot has no serial port to share: expected serial:PORT", word);
    return open_serial_camera(link(port));
  }
  if (word == "gphoto2") return open_gphoto_camera({}, job_);
  if (begins(word, "gphoto2:")) {
    GphotoOptions options;
    options.port = after_colon(word);
    if (begins(options.port, "ptpip:")) options.model = "PTP/IP Camera";  // only USB tells its cameras
    return open_gphoto_camera(options, job_);
  }
  if (begins(word, "folder:")) {
    const std::string folder = after_colon(word);
    return watch_folder({.watched = folder, .release = [this, folder](ShotId id, double) {
                           who_.tell("shot " + std::to_string(id) +
                                     ": take the photograph; its file is waited for in " + folder);
                           return true;
                         }});
  }
  throw Error(ErrorCode::invalid_argument, "expected simulate, hand, serial[:PORT], gphoto2[:PORT] or folder:DIR",
              word);
}

}  // namespace lumihull::program
