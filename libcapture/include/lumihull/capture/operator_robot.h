#pragma once

#include <lumihull/capture/operator.h>
#include <lumihull/capture/robot.h>

namespace lumihull::capture {

/// A turntable that a person turns: asks for each stop's azimuth, then for Enter.
class LUMIHULL_API TurntableRobot : public Robot {
 public:
  explicit TurntableRobot(Operator& who) : who_(who) {}
  State state() override;
  void move_to(const PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const PlannedStop&) override {}
  void make_safe() noexcept override {}

 private:
  Operator& who_;
};

/// A person who holds the camera, or moves a tripod: asks for each stop's place.
class LUMIHULL_API HandRobot : public Robot {
 public:
  explicit HandRobot(Operator& who) : who_(who) {}
  State state() override;
  void move_to(const PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const PlannedStop&) override {}
  void make_safe() noexcept override {}

 private:
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
