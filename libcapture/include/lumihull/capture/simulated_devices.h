#pragma once

#include <lumihull/capture/robot.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace lumihull::capture {

/// A robot that only takes its time. What a controller remembers while the program is killed is kept in a file.
class LUMIHULL_API SimulatedRobot : public capture::Robot {
 public:
  struct Options {
    double time_scale = 0.02;      ///< seconds for a second of the plan's travel
    double turn_s = 2;             ///< of the camera in its bearing, before scaling
    std::filesystem::path memory;  ///< cable lengths, the stop's name; empty: forgotten with the program
    bool starts_anywhere = true;   ///< without memory the position is known all the same: at the first stop moved to
  };
  explicit SimulatedRobot(const Options& options);

  State state() override;
  void move_to(const capture::PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const capture::PlannedStop& stop) override;
  void make_safe() noexcept override { motors_on_ = false; }

  const std::string& stop() const { return stop_; }
  bool motors_on() const { return motors_on_; }

  /// Called before each move and turn: a test's faults and records.
  std::function<void(const capture::PlannedStop&)> on_move;
  std::function<void(double)> on_roll;

 private:
  void remember(const std::vector<double>& lengths_m, const std::string& stop);

  Options options_;
  std::vector<double> lengths_m_;
  std::string stop_;
  bool known_ = false, motors_on_ = false;
};

/// A camera that writes small JPEGs, each different: by its name, the robot's stop and the shot's number. It keeps a
/// list of its exposures in a file, as a camera's own counter would.
class LUMIHULL_API SimulatedCamera : public capture::CameraDevice {
 public:
  struct Options {
    std::string name = "camera";
    std::filesystem::path list;  ///< a line an exposure: "ID STOP SHA256 PATH"
    bool recalls = true;         ///< can tell what became of a shot, and bring its file again
    bool delivers = true;        ///< files come along; else they stay on the card: the folder `card`
    std::filesystem::path card;
    double time_scale = 0.02;
    int width = 96, height = 64;
  };
  SimulatedCamera(const Options& options, const SimulatedRobot* robot) : options_(options), robot_(robot) {}

  bool delivers_files() const override { return options_.delivers; }
  capture::ShotOutcome shoot(capture::ShotId id, double exposure_s, const std::filesystem::path& folder,
                             Job& job) override;
  capture::ShotOutcome recall(capture::ShotId id) override;
  void make_safe() noexcept override { ready_ = false; }
  bool ready() const { return ready_; }

  /// A test's faults: an outcome in place of the exposure; an outcome told in place of the real one.
  std::function<std::optional<capture::ShotOutcome>(capture::ShotId)> instead, afterwards;
  std::function<void(capture::ShotId)> halfway;  ///< called when half of the file is there

 private:
  std::string picture(capture::ShotId id, const std::string& stop) const;

  Options options_;
  const SimulatedRobot* robot_;
  bool ready_ = false;
};

}  // namespace lumihull::capture
