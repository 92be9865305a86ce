#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/job.h>
#include <lumihull/capture/journal.h>
#include <lumihull/capture/operator.h>
#include <lumihull/capture/plan.h>
#include <lumihull/capture/robot.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture {

/// How a session goes about its plan.
struct SessionOptions {
  /// Names of photographs: {stop}, {camera} and {number} (of the stop in the plan, four digits). A retake's file is
  /// NAME~2, NAME~3, … Kept from the first session on.
  std::string names = "{stop}-{camera}";
  std::optional<double> settle_s, exposure_s;    ///< instead of the plan's: 0 to 3600; above 0, at most 3600
  int retries = 2;                               ///< of a refused shot, in a session
  double retry_after_s = 1;                      ///< a camera may be busy
  std::string retake;                            ///< a stop's name: photograph it once more, and nothing else
  std::size_t pause_after = 0;                   ///< photographs; 0: go on to the end
  std::uint64_t least_free_bytes = 200'000'000;  ///< on the folder's disk, before each shot
  double page_every_s = 5;                       ///< contact.html and capture.json, while it goes on
  std::map<std::string, Camera> intrinsics;      ///< by the plan's camera names, where they are known
  std::string devices;                           ///< words for the journal: which robot, which cameras
  /// Waits until the camera hangs still, the seconds asked for, where time does not pass by the clock: a simulation's.
  std::function<void(double seconds, Job& job)> settle{};
};

/// What was found before anything moves.
struct DryRun {
  std::vector<std::string> problems;  ///< a session would not start
  std::vector<std::string> notes;     ///< it would; to know
  std::size_t left = 0;               ///< photographs to take
  double seconds = 0;                 ///< that they take by the plan
};

/// Checks all that can be checked without moving or writing: the plan (each stop's clearances, lengths and balance,
/// each way's crossings), devices, names, files in the way, the folder, its disk, its journal.
LUMIHULL_API DryRun dry_run(const Plan& plan, Robot& robot, std::span<CameraDevice* const> cameras,
                            const std::filesystem::path& folder, const SessionOptions& options);

struct SessionResult {
  std::size_t views = 0, of = 0;  ///< photographs in the folder, of the plan's
  std::size_t taken = 0;          ///< by this call
  std::size_t awaited = 0;        ///< taken, their files still on the camera's card
  bool paused = false;
};

/// Carries out a plan, or goes on with it, in the plan's order: moves, waits until the camera hangs still, releases
/// each camera, puts the photographs into `folder`. After a killed session the same call goes on: no view is lost, none
/// is taken twice unless the operator says so.
///
/// cameras: as many as plan.cameras, in that order. The folder becomes a capture (capture.json) as soon as the first
/// photograph is there; contact.html shows how far it is. However it ends, robot and cameras are made safe.
///
/// Errors: bad_input (dry run's first problem; damaged journal; a plan that is not the one the folder was begun with),
/// io (disk, device, another process at work here), invalid_argument (a question that nobody answers, "stop" answered),
/// cancelled (an exposure under way is waited for).
LUMIHULL_API SessionResult capture(const Plan& plan, Robot& robot, std::span<CameraDevice* const> cameras,
                                   const std::filesystem::path& folder, const SessionOptions& options, Operator& who,
                                   Job& job);

// ---- parts of it, for whoever brings files afterwards ---------------------------------------------------------------

/// Where a capture's journal and plan are.
LUMIHULL_API std::filesystem::path journal_path(const std::filesystem::path& folder);
LUMIHULL_API std::filesystem::path plan_path(const std::filesystem::path& folder);

/// One process at a time works on a capture's journal. Error{io} where another one does.
class LUMIHULL_API SessionLock {
 public:
  explicit SessionLock(const std::filesystem::path& folder);
  SessionLock(const SessionLock&) = delete;
  SessionLock& operator=(const SessionLock&) = delete;
  ~SessionLock();

 private:
  int descriptor_;
};

/// Puts a shot's photograph into photos/ under its name; the shot must be `done`. A file outside the folder is copied,
/// one in incoming/ is moved. Nothing is overwritten. Returns the name. Errors: bad_input (no picture, or another file
/// of that name is in the way), io.
LUMIHULL_API std::string land_photograph(Journal& journal, const std::filesystem::path& folder, ShotId shot,
                                         const std::filesystem::path& file);

/// Brings capture.json up to date with the journal: an entry for each photograph that landed, in the plan's order, with
/// what was commanded. Cameras as `import_photos` makes them where `intrinsics` has none. What stages have added stays;
/// a retaken photograph loses its pose. Errors: bad_input (intrinsics of another size), io.
LUMIHULL_API void update_capture(const std::filesystem::path& folder, const Plan& plan, const JournalState& state,
                                 const std::map<std::string, Camera>& intrinsics = {});

/// Writes contact.html: a thumbnail, the state and what seems wrong (clipped, dark, blurred) of each photograph.
/// `status`: a line at its top. `seconds_left` < 0: not going on; else the page reloads itself.
LUMIHULL_API void write_contact_sheet(const std::filesystem::path& folder, const Plan& plan, const JournalState& state,
                                      const std::string& status, double seconds_left);

}  // namespace lumihull::capture
