#pragma once

#include <lumihull/capture/operator.h>
#include <lumihull/capture/robot.h>

namespace lumihull::capture {

/// A turntable that a person turns: asks for each stop's azimuth, then for Enter.
class LUMIHULL_API TurntableRobot : public Robot {
 public:
  explicit TurntableRobot(Operator& operator_) : operator_(operator_) {}
  State state() override { return {.ready = true, .position_known = true}; }
  void move_to(const PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const PlannedStop&) override {}
  void make_safe() noexcept override {}

 private:
  Operator& operator_;
};

/// A person who holds the camera, or moves a tripod: asks for each stop's place.
class LUMIHULL_API HandRobot : public Robot {
 public:
  explicit HandRobot(Operator& operator_) : operator_(operator_) {}
  State state() override { return {.ready = true, .position_known = true}; }
  void move_to(const PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const PlannedStop&) override {}
  void make_safe() noexcept override {}

 private:
  Operator& operator_;
};

/// A camera whose shutter a person presses; its files come later, from its card.
class LUMIHULL_API OperatorCamera : public CameraDevice {
 public:
  explicit OperatorCamera(Operator& operator_) : operator_(operator_) {}
  bool delivers_files() const override { return false; }
  ShotOutcome shoot(ShotId id, double exposure_s, const std::filesystem::path& folder, Job& job) override;
  ShotOutcome recall(ShotId) override { return {.detail = "only the operator can tell"}; }
  void make_safe() noexcept override {}

 private:
  Operator& operator_;
};

}  // namespace lumihull::capture
