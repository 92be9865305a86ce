#include "capture_devices.h"

#include <lumihull/base/error.h>
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

/// What the simulated devices keep between two runs of the program: a folder beside the capture's.
std::filesystem::path memory_of(const std::filesystem::path& folder) {
  std::filesystem::path out = std::filesystem::absolute(folder).lexically_normal();
  if (!out.has_filename()) out = out.parent_path();
  out += ".simulated";
  std::filesystem::create_directories(out);
  return out;
}

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

std::unique_ptr<Robot> make_robot(const std::string& word, const std::filesystem::path& folder, Operator& who) {
  if (word == "simulate")
    return std::make_unique<rig::SimulatedRobot>(rig::SimulatedRobot::Options{.memory = memory_of(folder) / "robot"});
  if (word == "turntable") return std::make_unique<TurntableRobot>(who);
  if (word == "hand") return std::make_unique<HandRobot>(who);
  if (word.rfind("serial:", 0) == 0)
    throw Error(ErrorCode::unsupported, "robots on a serial port are not in this build", after_colon(word));
  throw Error(ErrorCode::invalid_argument, "expected simulate, turntable, hand or serial:PORT", word);
}

std::unique_ptr<CameraDevice> make_camera(const std::string& word, const std::string& name,
                                          const std::filesystem::path& folder, Robot& robot, Operator& who) {
  if (word == "simulate")
    return std::make_unique<rig::SimulatedCamera>(
        rig::SimulatedCamera::Options{.name = name, .list = memory_of(folder) / ("exposures-" + name), .card = {}},
        dynamic_cast<const rig::SimulatedRobot*>(&robot));
  if (word == "hand") return std::make_unique<OperatorCamera>(who);
  if (word == "serial" || word == "gphoto2" || word.rfind("gphoto2:", 0) == 0 || word.rfind("folder:", 0) == 0)
    throw Error(ErrorCode::unsupported, "cameras of this kind are not in this build", word);
  throw Error(ErrorCode::invalid_argument, "expected simulate, hand, serial, gphoto2[:PORT] or folder:DIR", word);
}

}  // namespace lumihull::program
