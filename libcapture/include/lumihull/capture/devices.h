#pragma once

#include <lumihull/capture/operator.h>
#include <lumihull/capture/plan.h>
#include <lumihull/capture/robot.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace lumihull::capture {

class SerialLink;

/// Error{invalid_argument} where a word is none of Devices' own.
LUMIHULL_API void check_robot_word(const std::string& word);
LUMIHULL_API void check_camera_word(const std::string& word);

/// Robots and cameras that a program brings along, behind a word of its own: "rig", "rig:WHAT". The functions are given
/// WHAT, empty where there is none, and throw Error{invalid_argument} where they can't take it.
struct BroughtDevices {
  std::string robot_usage, camera_usage;  ///< for messages: "rig[:WHAT]"
  std::function<std::unique_ptr<Robot>(const std::string& what, const Plan& plan)> robot;
  std::function<std::unique_ptr<CameraDevice>(const std::string& what, const std::string& name, const Robot& on)>
      camera;
};

/// Robots and cameras by the words that users write. What names the same serial port shares one link to it.
/// Errors: invalid_argument (no such word), and those of the device's own function: not_found, io, cancelled.
class LUMIHULL_API Devices {
 public:
  /// folder: the capture's; simulated devices remember beside it, in FOLDER.simulated, what machines would between two
  /// runs of a program. who outlives the devices.
  Devices(std::filesystem::path folder, Operator& who);
  ~Devices();

  /// From now on `word` means these. It has no ':' and is none of the words below.
  void bring(const std::string& word, BroughtDevices devices);

  /// "simulate", "turntable", "hand", "serial:PORT" (the winches of the plan's mechanism).
  std::unique_ptr<Robot> robot(const std::string& word, const Plan& plan);

  /// "simulate", "hand", "serial:PORT", "serial" (the robot's port), "gphoto2", "gphoto2:PORT", "folder:DIR".
  /// name: the plan's; on: what the camera hangs on, it outlives the camera.
  std::unique_ptr<CameraDevice> camera(const std::string& word, const std::string& name, const Robot& on, Job& job);

 private:
  std::shared_ptr<SerialLink> link(const std::string& port);
  std::filesystem::path memory() const;
  std::string expected(std::string words, std::string BroughtDevices::*usage) const;

  std::filesystem::path folder_;
  Operator& who_;
  std::string robot_port_;
  std::map<std::string, std::shared_ptr<SerialLink>> links_;
  std::map<std::string, BroughtDevices> brought_;
};

}  // namespace lumihull::capture
