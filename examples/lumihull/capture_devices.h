#pragma once

// From the words of the command line to robots, cameras and the person who is asked.

#include <lumihull/capture/operator.h>
#include <lumihull/capture/plan.h>
#include <lumihull/capture/robot.h>
#include <lumihull/capture/serial.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

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

/// Robot and cameras by their words. What names the same serial port shares one link to it.
/// Errors: invalid_argument (no such word), not_found, io.
class Devices {
 public:
  /// folder: the capture's, beside whose files simulated devices remember. who and job outlive the devices.
  Devices(std::filesystem::path folder, capture::Operator& who, Job& job)
      : folder_(std::move(folder)), who_(who), job_(job) {}

  /// simulate, turntable, hand, serial:PORT (the winches of the plan's mechanism)
  std::unique_ptr<capture::Robot> robot(const std::string& word, const capture::Plan& plan);

  /// simulate, hand, serial[:PORT] (without a port: the robot's), gphoto2[:PORT], folder:DIR. name: the plan's; on:
  /// what the camera hangs on.
  std::unique_ptr<capture::CameraDevice> camera(const std::string& word, const std::string& name, capture::Robot& on);

 private:
  std::shared_ptr<capture::SerialLink> link(const std::string& port);
  std::filesystem::path memory() const;

  std::filesystem::path folder_;
  capture::Operator& who_;
  Job& job_;
  std::string robot_port_;
  std::map<std::string, std::shared_ptr<capture::SerialLink>> links_;
};

}  // namespace lumihull::program
