#pragma once

// From the words of the command line to robots, cameras and the person who is asked.

#include <lumihull/capture/operator.h>
#include <lumihull/capture/plan.h>
#include <lumihull/capture/robot.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace lumihull::program {

/// Asks at the terminal; where standard input is none it is nobody (AbsentOperator).
class TerminalOperator : public capture::Operator {
 public:
  /// say: prints a line, above the progress bar. yes: agrees to motion. interrupted: the program's job.
  TerminalOperator(std::function<void(const std::string&)> say, bool yes, Job& interrupted);
  std::string ask(const capture::Question& question, Job& job) override;
  void tell(const std::string& line) override { say_("note: " + line); }

 private:
  std::string read_line(Job& job);

  std::function<void(const std::string&)> say_;
  bool yes_;
  Job& interrupted_;
  std::string typed_;
};

/// simulate, turntable, hand, serial:PORT. `folder`: the capture's, beside whose files a simulated robot remembers.
/// Errors: invalid_argument (no such word), unsupported (not in this build), io.
std::unique_ptr<capture::Robot> make_robot(const std::string& word, const std::filesystem::path& folder,
                                           capture::Operator& who);

/// simulate, hand, serial, gphoto2[:PORT], folder:DIR. `name`: the plan's; `robot`: what the camera hangs on.
std::unique_ptr<capture::CameraDevice> make_camera(const std::string& word, const std::string& name,
                                                   const std::filesystem::path& folder, capture::Robot& robot,
                                                   capture::Operator& who);

}  // namespace lumihull::program
