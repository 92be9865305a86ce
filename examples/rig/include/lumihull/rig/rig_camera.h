#pragma once

#include <lumihull/capture/robot.h>
#include <lumihull/rig/photographer.h>
#include <lumihull/rig/rig_robot.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace lumihull::rig {

/// Lens, sensor and file of the virtual camera.
struct RigLens {
  Camera camera;                                                         ///< as it really is
  double focal_mm = kFocalLength_mm, sensor_width_mm = kSensorWidth_mm;  ///< as the maker says
  int jpeg_quality = 93;
  PhotoOptions photo;
};

/// Seconds since the rig's morning to an EXIF time.
std::string exif_time(double seconds);
/// A JPEG with EXIF as the camera writes it.
std::string camera_file(const Image& picture, const RigLens& lens, double time_s, double exposure_s,
                        int orientation = 1);

/// A camera on a RigRobot: photographs what is before it where it really is, its swing during the exposure included.
///
/// The truth of each exposure is written into `truth`/exposures before its file is delivered: NUMBER.json
/// ("lumihull-exposure": name of the stop, camera, time, exposure, cam_from_world, swing, digest), NUMBER.png (mask),
/// and on request NUMBER.depth. These are also the camera's own list: a shot that was killed and is not on it was not
/// made; one that is, is delivered again, the same to the byte.
class RigCamera : public capture::CameraDevice {
 public:
  struct Options {
    std::string name = "camera";  ///< as the plan calls it
    RigLens lens;
    std::filesystem::path truth;  ///< a folder
    bool masks = true;
    bool depth = false;               ///< as NUMBER.depth: width x height floats, little-endian, row by row, m
    bool cables = true;               ///< they may cross the picture
    Pose world_from_plan;             ///< the scene's world
    Eigen::Vector3d center{0, 0, 0};  ///< of the views, in the plan's world
    std::uint64_t seed = 1;           ///< of the sensor's noise
  };
  /// photographer: asked for when the first photograph is taken; it and the robot outlive the camera.
  RigCamera(const Options& options, std::function<const Photographer&()> photographer, RigRobot& robot);

  bool delivers_files() const override { return true; }
  capture::ShotOutcome shoot(capture::ShotId id, double exposure_s, const std::filesystem::path& folder,
                             Job& job) override;
  capture::ShotOutcome recall(capture::ShotId id) override;
  void make_safe() noexcept override {}

 private:
  struct Exposure;
  std::filesystem::path record(capture::ShotId id, const char* extension) const;
  std::string develop(const Exposure& exposure, Job& job) const;

  Options options_;
  std::function<const Photographer&()> photographer_;
  RigRobot& robot_;
};

/// What a camera wrote of one exposure.
struct ExposureRecord {
  capture::ShotId id = 0;
  std::string camera, stop, sha256, file;
  double time_s = 0, exposure_s = 0;
  double sway_px = 0;        ///< the longest way of an image point during the exposure
  Pose cam_from_world;       ///< the mean of the exposure
  std::vector<Pose> during;  ///< equally spaced moments of it; empty: it stood still
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> cables;  ///< ends, m
};
/// Of `truth`/exposures, by number. Errors: bad_input (file, expectation), io.
std::optional<ExposureRecord> read_exposure(const std::filesystem::path& truth, capture::ShotId id);

}  // namespace lumihull::rig
