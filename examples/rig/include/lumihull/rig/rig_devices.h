#pragma once

#include <lumihull/capture/devices.h>
#include <lumihull/rig/simulate.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace lumihull::rig {

/// The virtual rig behind a word, for a program that drives robots and cameras by words: a capture is rehearsed with
/// photographs of a scene, on the same ways as with hardware. The robot is "rig"; cameras on it are
/// "rig[:OBJECT[:WIDTH]]", OBJECT as SimulateOptions has it, WIDTH in pixels.
///
/// Time is the rig's own. What stays in the capture's folder is what `simulate` leaves: sheets.json (what hangs on the
/// walls), simulate.json, truth/. A folder that was begun with one object can't go on with another.
class RigDevices {
 public:
  /// folder: the capture's. dry: nothing is written. say: gets a line about the scene.
  RigDevices(std::filesystem::path folder, bool dry, std::function<void(const std::string&)> say);

  /// For Devices::bring; this outlives what they make. job: of planning the scene.
  capture::BroughtDevices brought(Job& job);

  /// What SessionOptions::settle has to be; empty where no rig was asked for.
  std::function<void(double seconds, Job& job)> settle() const;

  /// After a session: brings truth/ up to date where a rig's camera took photographs.
  void write_truth(Job& job) const;

 private:
  std::unique_ptr<capture::Robot> robot(const std::string& what, const capture::Plan& plan);
  std::unique_ptr<capture::CameraDevice> camera(const std::string& what, const std::string& name,
                                                const capture::Robot& on, Job& job);
  void set_up(const std::string& what, Job& job);

  std::filesystem::path folder_;
  bool dry_;
  std::function<void(const std::string&)> say_;
  SimulateOptions options_;
  RigRobot* robot_ = nullptr;  // the session's
  std::string what_;
  std::optional<RigSession> session_;
  std::optional<Photographer> photographer_;
};

}  // namespace lumihull::rig
