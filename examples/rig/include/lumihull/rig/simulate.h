#pragma once

#include <lumihull/capture/plan.h>
#include <lumihull/rig/rig_camera.h>
#include <lumihull/rig/rig_robot.h>
#include <lumihull/rig/studio.h>
#include <lumihull/rig/target_sheets.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::rig {

/// What carries the virtual camera.
enum class Carrier : std::uint8_t {
  automatic,  ///< the paper's mechanism where it can take three quarters of the views, else `ideal`
  cables,     ///< the paper's mechanism, with its errors
  turntable,
  hand,
  ideal,  ///< is where it should be
};

/// A capture of an object by the virtual rig, as one would make it with the real one.
struct SimulateOptions {
  // ---- what is photographed
  std::string object = "bust";                       ///< a name that object_by_name knows, or a mesh file
  double size_m = 0;                                 ///< of its longest side; 0: as in the paper (table 1), others .6 m
  bool matt = false;                                 ///< no gloss
  bool uniform = false;                              ///< one paint all over
  std::optional<std::array<std::uint8_t, 3>> unlit;  ///< this colour (sRGB) in every photograph, whatever the light
  // ---- where it stands
  bool blue = false;         ///< a blue enclosure
  double room_radius_m = 0;  ///< axis to panel; 0: 3 m, more where the camera's way asks for it
  bool sheets = true;        ///< printed targets on walls and floor
  double density = .12;      ///< of the sheets: share of walls and floor that they cover, at most .4
  double circle_px = 0;      ///< diameter of the targets' circles, seen straight; 0: 9, of a letter sheet at full size
  int least_targets = 5;     ///< more sheets are hung where a view of the plan decodes fewer
  // ---- the way
  int photos = 48;                    ///< 1 … 100,000
  std::optional<capture::Plan> plan;  ///< instead of views on a hemisphere
  Carrier carrier = Carrier::automatic;
  double radius_m = 0;  ///< of the hemisphere; 0: as in the paper, or where the object fills it
  double phi_from_rad = .12, phi_to_rad = 1.5707963267948966;
  RobotErrors errors;
  // ---- the camera
  int width = 1536;  ///< px; height is two thirds
  double focal_mm = kFocalLength_mm;
  double distortion = 1;  ///< of the lens, 0 … 1
  int jpeg_quality = 93;
  bool cables = true;  ///< they may cross the picture
  LightOptions light;
  PhotoOptions photo;
  // ---- what else is made
  int empty_photos = 8;        ///< of the enclosure without the object
  int lens_photos = 12;        ///< of a printed board, into lens/
  bool known_cameras = false;  ///< true cameras and poses go into the capture: no calibration, for tests
  bool depth = false;          ///< true depth of each photograph
  int test_views = 0;          ///< pictures along an arc, beside the capture, for judging a renderer
  std::uint64_t seed = 1;
};

/// What came of it.
struct Simulated {
  std::size_t photographs = 0;  ///< in the capture
  std::size_t taken = 0;        ///< by this call
  std::size_t sheets = 0;
  int least_targets = 0;        ///< that can be decoded in a view of the plan, as commanded or as it will be
  std::size_t with_cables = 0;  ///< photographs that a cable may cross
  double radius_m = 0, room_radius_m = 0;
  std::string carrier;  ///< in words
  std::vector<std::string> notes;
};

/// Plans, photographs, and writes a capture folder that the stages go on from:
///
///     photos/, capture.json, plan.json, journal.jsonl, contact.html   as `capture` makes them
///     enclosure/           the empty room               sheets.json    what was printed (lumihull-targets)
///     lens/, lens/board.json   a printed board          simulate.json  these options
///     truth/               what nobody knows of a real capture: README.md
///
/// Nothing of the truth is in the capture, but with known_cameras. The folder must be new, empty, or begun with the
/// same options: then the capture goes on where it was stopped or killed. Errors: invalid_argument (options, folder),
/// bad_input (mesh, plan), io, cancelled.
Simulated simulate(const std::filesystem::path& folder, const SimulateOptions& options, Job& job,
                   const std::function<void(const std::string&)>& say = {});

/// Error{invalid_argument} naming the first option that is out of range.
void check(const SimulateOptions& options);

/// All that is decided before the first photograph: the same for the same options.
struct RigSession {
  capture::Plan plan;
  Eigen::Vector3d center{0, 0, 0};  ///< of the views, in the plan's world
  double radius_m = 0;
  Pose world_from_plan;  ///< the scene's floor is z = 0
  Scene scene;           ///< with the sheets
  std::string said;      ///< object, distance, room and sheets in a line
  RoomTargets targets;
  RigLens lens;
  RobotErrors errors;
  int least_targets = 0;
  std::vector<std::string> notes;
};
/// plan: one that was stored, else options' or a new one.
RigSession plan_session(const SimulateOptions& options, const std::optional<capture::Plan>& plan, Job& job);

/// How far the session's robot is from its plan.
RobotErrors errors_of(const SimulateOptions& options, const capture::Plan& plan);
/// One of its cameras, whose truth goes into a folder.
RigCamera::Options camera_of(const SimulateOptions& options, const RigSession& session, const std::string& name,
                             const std::filesystem::path& truth);

}  // namespace lumihull::rig
