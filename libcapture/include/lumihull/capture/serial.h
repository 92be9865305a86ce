#pragma once

#include <lumihull/base/api.h>
#include <lumihull/capture/robot.h>

#include <cstdint>
#include <memory>
#include <string>

namespace lumihull::capture {

/// A controller on a serial line that winds cables, fires the camera and releases the bearing's solenoid. The protocol
/// is libcapture/firmware/PROTOCOL.md.
struct SerialOptions {
  std::string device;     ///< e.g. "/dev/ttyUSB0"
  unsigned baud = 57600;  ///< 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600
  /// How many of the controller's seconds pass in one of ours, >= 1: all time-outs are divided by it. 1 for hardware;
  /// simulators may run faster.
  double time_scale = 1;
};

class SerialLink;

/// Opens the port for this process alone, says HELLO, and sends heartbeats from then on until the last owner is gone.
/// The controller makes its outputs safe when heartbeats stay away for 1.5 s. A robot and a camera may share one link,
/// from different threads. Errors: invalid_argument (an option), not_found (no such device), io (no permission, in use,
/// not a serial port, nothing answers, another version of the protocol).
LUMIHULL_API std::shared_ptr<SerialLink> open_serial_link(const SerialOptions& options);

struct SerialRobotOptions {
  /// Moves run as `plan_move` plans them: along the straight line that the planner has checked, jerk bounded. The
  /// controller holds up to 64 setpoints of it and a cubic between them. false: the controller moves all cables in
  /// proportion, with constant acceleration, speed, deceleration; nothing is known of the platform's way then.
  bool straight = true;
  double solenoid_s = 1.5;  ///< how long the bearing is released for a turn; the controller has a limit, too
};

/// The winches. `mechanism` gives number and limits of the cables, which the controller checks itself before anything
/// moves.
///
/// move_to: Error{invalid_argument} where the stop's lengths are not those of this mechanism (straight: at its pose, to
/// 1 µm); Error{io} where the controller refuses, the position is not known, or a move was broken off. After that the
/// next one goes on from where the platform hangs by its lengths (`hang_rigid`). set_roll releases the bearing where
/// the angle is another than at the last call or declare_position (or there was none); gravity turns the camera. Errors
/// of the construction: invalid_argument (options, another number of winches), bad_input (check(mechanism)), io.
LUMIHULL_API std::unique_ptr<Robot> open_serial_robot(std::shared_ptr<SerialLink> link, const Mechanism& mechanism,
                                                      const SerialRobotOptions& options = {});

/// The shutter's contact: files stay in the camera. A shot number is fired at most once; of one whose fate is in doubt
/// (`unknown`), this object refuses to fire the number again. The outcome `unknown` also stands for an exposure that
/// was cut short. A port that was lost before is `refused`; Error{io} where it is lost meanwhile; Error{cancelled} only
/// before anything was fired.
LUMIHULL_API std::unique_ptr<CameraDevice> open_serial_camera(std::shared_ptr<SerialLink> link);

}  // namespace lumihull::capture
