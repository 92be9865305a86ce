#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>
#include <lumihull/capture/plan.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::capture {

/// What carries the camera: cables, a turntable, a person, a simulation. One thread at a time.
///
/// Errors of all calls: Error{io} where the link or the machine fails, Error{cancelled} after Job::cancel. After an
/// error the robot stands still or is stopping, and `state` tells what is known.
class LUMIHULL_API Robot {
 public:
  virtual ~Robot();

  struct State {
    bool ready = false;  ///< connected, no fault, motors may be commanded
    bool moving = false;
    bool position_known = false;    ///< false after a restart of the controller: nothing may move without consent
    std::vector<double> lengths_m;  ///< as far as they are known; else empty
    std::string fault;              ///< in words, or empty
  };
  virtual State state() = 0;

  /// Moves to a stop and waits until it is there (settling is the caller's). The caller has checked the way.
  virtual void move_to(const PlannedStop& stop, Job& job) = 0;

  /// Turns the camera in its bearing, where there is one; the others do nothing.
  virtual void set_roll(double roll_rad, Job& job) = 0;

  /// After the operator has agreed that the platform is at `stop` or that its lengths are these.
  virtual void declare_position(const PlannedStop& stop) = 0;

  /// Stops motors, releases the solenoid, leaves outputs safe. Never throws; may be called at any time by its thread.
  virtual void make_safe() noexcept = 0;
};

/// Identifies one exposure for its whole life: a retry after a refusal has the same number, a retake a new one.
using ShotId = std::uint32_t;

enum class ShotState : std::uint8_t {
  done,     ///< exactly one exposure was made
  refused,  ///< none was made, surely
  unknown,  ///< one or none: the link or the controller failed in between; the operator decides
};

struct ShotOutcome {
  ShotState state = ShotState::unknown;
  std::filesystem::path file;  ///< where the camera's own file now is, if it came at once; else empty (ingested later)
  std::string detail;          ///< why, for refused and unknown
};

/// What takes a photograph. One thread at a time.
class LUMIHULL_API CameraDevice {
 public:
  virtual ~CameraDevice();

  /// Whether `shoot` brings the file along (tethered) or it stays on the camera's card (`ingest` later).
  virtual bool delivers_files() const = 0;

  /// Releases the shutter once. Returns after the exposure, and after the download where files are delivered; in
  /// bounded time whatever the camera does. A file is put into `folder` under a name that is not in use there.
  /// Throws Error{io} only where the device is lost for good; the outcome tells all else.
  virtual ShotOutcome shoot(ShotId id, double exposure_s, const std::filesystem::path& folder, Job& job) = 0;

  /// What became of an earlier shot, where the device can tell (a controller that logs); else `unknown`.
  virtual ShotOutcome recall(ShotId id) = 0;

  virtual void make_safe() noexcept = 0;
};

}  // namespace lumihull::capture
