#pragma once

#include <lumihull/capture/operator.h>
#include <lumihull/capture/robot.h>

#include <cstdint>

namespace lumihull::capture {

/// A person who brings camera and object to each stop: turns a turntable, or moves the camera. Each stop is asked for.
class LUMIHULL_API OperatorRobot : public Robot {
 public:
  enum class Moves : std::uint8_t {
    turntable,  ///< asked for the stop's azimuth
    camera,     ///< in the hand or on a tripod: asked for the stop's place
  };
  OperatorRobot(Moves moves, Operator& who) : moves_(moves), who_(who) {}
  State state() override;
  void move_to(const PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const PlannedStop&) override {}
  void make_safe() noexcept override {}

 private:
  Moves moves_;
  Operator& who_;
};

/// A camera whose shutter a person presses; its files come later, from its card.
class LUMIHULL_API OperatorCamera : public CameraDevice {
 public:
  explicit OperatorCamera(Operator& who) : who_(who) {}
  bool delivers_files() const override { return false; }
  ShotOutcome shoot(ShotId id, double exposure_s, const std::filesystem::path& folder, Job& job) override;
  ShotOutcome recall(ShotId id) override;
  void make_safe() noexcept override {}

 private:
  Operator& who_;
};

}  // namespace lumihull::capture
