#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace lumihull {

struct ExportOptions {
  /// Export fails where another program's camera model would move a pixel farther than this.
  double max_refit_error_px = 0.5;
};

/// What an export had to change.
struct ExportReport {
  int photos = 0;                     ///< positioned photographs: the others can't be expressed
  double largest_refit_error_px = 0;  ///< 0 where every camera is expressed exactly
  std::vector<std::string> notes;
};

/// A point in space and where photographs show it.
struct Track {
  Eigen::Vector3d point{0, 0, 0};  ///< in the capture's world
  struct Sight {
    std::size_t shot = 0;
    Eigen::Vector2d pixel{0, 0};
  };
  std::vector<Sight> sights;  ///< at most one a shot
};

/// Writes a COLMAP text model (cameras.txt, images.txt, points3D.txt) into a new or empty folder. Image names are the
/// photographs' file names. points3D.txt and the images' points are the tracks; sights in shots without a pose are left
/// out. Cameras: PINHOLE where there is no lens distortion, else OPENCV or, where that is
/// off by more than 0.01 px, FULL_OPENCV. Errors: invalid_argument (folder in use), unsupported (a camera that COLMAP
/// can't express to max_refit_error_px, e.g. with a skew; the message gives the error), bad_input (no positioned
/// photograph).
LUMIHULL_API ExportReport export_colmap(const Capture& capture, const std::filesystem::path& folder,
                                        const ExportOptions& options = {}, std::span<const Track> tracks = {});

/// Writes NeRF's transforms.json with intrinsics for each frame: fl_x, fl_y, cx, cy, w, h, and k1, k2, p1, p2, k3
/// (OpenCV's lens) where there is distortion. file_path is relative to the JSON file's folder. The same errors.
LUMIHULL_API ExportReport export_nerf(const Capture& capture, const std::filesystem::path& file,
                                      const ExportOptions& options = {});

/// A camera in another program's words, and how far its lens model is from ours there.
struct CameraText {
  std::string text;
  double largest_error_px = 0;  ///< over a grid of 65 x 49 pixels up to the picture's border; 0: exact
};

/// For cv::FileStorage (YAML): image_width, image_height, camera_matrix, and distortion_coefficients k1, k2, p1, p2, k3
/// or, where these are off by more than 0.01 px, k1, k2, p1, p2, k3, k4, k5, k6. OpenCV counts pixels from the first
/// one's centre: its principal point is ours less 0.5. Errors: as export_colmap.
LUMIHULL_API CameraText opencv_camera(const Camera& camera, const ExportOptions& options = {});
/// cameras.txt of COLMAP with this one camera of id 1: PINHOLE, OPENCV or FULL_OPENCV. Errors: as export_colmap.
LUMIHULL_API CameraText colmap_camera(const Camera& camera, const ExportOptions& options = {});

}  // namespace lumihull
