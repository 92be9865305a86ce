#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace lumihull {

enum class Unit : std::uint8_t { unknown, metres };

/// Where a mask came from. A mask whose digest is not the one that was stored is `edited`: a person's work, which wins.
enum class MaskSource : std::uint8_t { none, keyed, imported, edited };

/// A file as it was when it was last looked at.
struct FileStamp {
  std::string sha256;
  std::uint64_t size = 0;
  std::int64_t mtime_ns = 0;
};

/// How well a pose is known, where calibration found it.
struct PoseQuality {
  /// Of (rotation vector, translation) of a small motion applied after cam_from_world: rad, the capture's unit.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int points = 0;     ///< measured points that it rests on
  double rms_px = 0;  ///< sqrt(Σ (dx² + dy²) / points)
};

/// What a robot was told for a photograph, and how it went: of captures that libcapture took.
struct CommandedShot {
  std::string stop, device;      ///< the plan's stop and camera
  std::uint32_t id = 0;          ///< the exposure's number in the journal
  Pose cam_from_world;           ///< commanded, never measured
  std::vector<double> lengths_m; ///< of the cables; empty without a mechanism
  double settle_s = 0, exposure_s = 0;
  int attempts = 1;              ///< how often the shutter was asked for this photograph
  std::string plan_sha256;       ///< of the plan: it holds the mechanism as it was calibrated then
  std::string state;             ///< "done", or "confirmed": in doubt, until the operator said that it was taken
};

/// One shot of one camera.
struct Shot {
  std::string name;  ///< unique in the capture; masks and renderings are named after it
  std::string file;  ///< the photograph: relative to the capture's folder, or absolute (a reference)
  FileStamp stamp;
  int camera = 0;                      ///< index into Capture::cameras
  int orientation = 1;                 ///< EXIF; only for showing pictures to people
  std::optional<Pose> cam_from_world;  ///< nullopt: not positioned
  std::optional<PoseQuality> pose_quality;  ///< of cam_from_world; whoever changes the pose resets it
  std::string time;                    ///< ISO 8601, from EXIF, or empty
  std::optional<CommandedShot> commanded;   ///< nullopt: imported
  MaskSource mask_source = MaskSource::none;
  std::string mask_sha256;  ///< of the mask file as Lumihull wrote or imported it
};

/// What a stage left behind when it last ended.
struct StageRecord {
  std::string digest;  ///< of all its inputs and options
  double seconds = 0;
  std::uint64_t peak_bytes = 0;  ///< high-water mark of the process while it ran
  std::string finished;          ///< ISO 8601, UTC
};

using OptionValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>>;
using Options = std::map<std::string, OptionValue, std::less<>>;

/// A capture: the folder that holds one object's photographs and everything made from them.
///
///     capture.json   shots, options, stages      cameras.json   intrinsics and poses, and how well they are known
///     photos/  enclosure/  masks/  hull.ply  light_field.glb  report.html
///
/// The object in memory is a plain value; `save` writes both JSON files atomically. Reading checks every field: an
/// error names the file, the JSON pointer and what was expected.
class LUMIHULL_API Capture {
 public:
  /// A new capture in a folder that does not exist yet or is empty. Errors: invalid_argument (folder in use), io.
  static Capture create(const std::filesystem::path& folder);
  /// The same in a folder that may hold other files, but no capture.json.
  static Capture create_among(const std::filesystem::path& folder);
  /// Errors: not_found (no capture.json or cameras.json), bad_input.
  static Capture open(const std::filesystem::path& folder);

  /// Errors: io; bad_input for what `open` would refuse (a number that is not finite, a text that is not UTF-8, a name
  /// used twice): the files are then left as they were.
  void save() const;

  const std::filesystem::path& folder() const noexcept { return folder_; }

  Unit unit = Unit::unknown;
  std::vector<Camera> cameras;
  /// Of the cameras that calibration refined, by index into `cameras`: covariance of f, s, skew, u0, v0, k1, k2, k3, p1, p2 (px² where
  /// both are in pixels); rows of zeros belong to parameters that were kept. Whoever changes a camera erases its entry.
  std::map<int, Eigen::Matrix<double, 10, 10>> camera_covariances;
  std::vector<Shot> shots;
  std::vector<Shot> enclosure;  ///< photographs of the empty enclosure (name, file and stamp are used)
  std::map<std::string, Options, std::less<>> options;  ///< by stage: "key", "hull", "evaluate", …
  std::map<std::string, StageRecord, std::less<>> stages;
  std::optional<std::array<std::uint8_t, 3>> background_rgb;  ///< what pictures are composited on when judged
  std::vector<std::string> notes;  ///< what importers had to say, e.g. "the world was mirrored"

  /// Every Nth shot (the first, the N+1st, …) is held out of training, hull and appearance; 0: none.
  int hold_out() const;
  void set_hold_out(int n);
  bool held_out(std::size_t shot) const { return hold_out() > 0 && shot % std::size_t(hold_out()) == 0; }

  /// Adds a photograph without a pose and returns its index. file: relative to the folder, or absolute; not copied.
  /// Errors: invalid_argument (a name that is in use or no plain file name, no such camera), not_found.
  std::size_t add_shot(const std::string& name, const std::string& file, std::size_t camera);

  std::filesystem::path photo_path(const Shot& shot) const;
  std::filesystem::path mask_path(const Shot& shot) const { return folder_ / "masks" / (shot.name + ".png"); }
  std::filesystem::path hull_path() const { return folder_ / "hull.ply"; }

  /// The view of a shot. Error{bad_input} naming the shot where it has no pose.
  View view(std::size_t shot) const;
  bool positioned(std::size_t shot) const { return shots[shot].cam_from_world.has_value(); }

  /// Reads a shot's photograph; Error{bad_input} where its size is not its camera's.
  Image read_photo(std::size_t shot, int channels = 3) const;
  /// Reads a shot's mask as 8-bit, 1 channel, of the photograph's size; not_found where there is none.
  Image read_mask(std::size_t shot) const;
  /// Writes a mask (8-bit, 1 channel, the photograph's size) and stores its digest in the shot. Different threads may
  /// write masks of different shots at once.
  void write_mask(std::size_t shot, const Image& mask, MaskSource source);
  /// none, keyed, imported, or edited where the file is not what was written.
  MaskSource mask_state(const Shot& shot) const;

  /// The file's stamp; the digest is computed only if size or time differ from `known`.
  static FileStamp stamp(const std::filesystem::path& file, const FileStamp& known = {});
  /// Brings all shots' stamps up to date (in parallel). Error{not_found} naming the first photograph that is missing.
  void refresh_stamps(Job& job);

  /// An option of a stage, or the fallback where it is not stored. Error{bad_input} where the stored type differs.
  template <class T>
  T option(std::string_view stage, std::string_view name, T fallback) const;

 private:
  explicit Capture(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void absorb_mask_journal();
  std::filesystem::path folder_;
};

extern template LUMIHULL_API bool Capture::option(std::string_view, std::string_view, bool) const;
extern template LUMIHULL_API std::int64_t Capture::option(std::string_view, std::string_view, std::int64_t) const;
extern template LUMIHULL_API double Capture::option(std::string_view, std::string_view, double) const;
extern template LUMIHULL_API std::string Capture::option(std::string_view, std::string_view, std::string) const;
extern template LUMIHULL_API std::vector<double> Capture::option(std::string_view, std::string_view,
                                                                 std::vector<double>) const;

}  // namespace lumihull
