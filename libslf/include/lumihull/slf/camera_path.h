#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/capture.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::slf {

/// A camera to render from, and what its picture is called (without extension).
struct PathView {
  std::string name;
  View view;
};

/// "frame_0000", "frame_0001", …
LUMIHULL_API std::string frame_name(std::size_t i);

/// The direction that the photographs have as up, unit length. Whoever photographs holds one side of the picture level:
/// up is across all their x axes, or, of portrait pictures, across all their y axes, towards the side from which cameras
/// look; it does not matter from which sides the photographs are. Where neither is so (cameras held anyhow, or all in
/// one place), the mean of the cameras' -y, or of their x where these agree much more. (0, 0, 1) where all vanish.
LUMIHULL_API Eigen::Vector3d up_axis(std::span<const View> views);

struct TurntableOptions {
  int frames = 60;            ///< 1 … 100000
  double elevation_deg = 20;  ///< above the horizon, -90 … 90
  double distance = 0;   ///< from the middle of the object, world units; 0: so that the object fits into every picture
  double start_deg = 0;  ///< azimuth of the first frame, counted from the first photograph's
  int width = 1280, height = 720;  ///< px
  double field_of_view_deg = 30;   ///< vertical, 1 … 150
};

/// A full turn around the mesh. The up axis and the azimuth's origin come from the photographs' views.
/// Errors: invalid_argument (options), degenerate (empty mesh).
LUMIHULL_API std::vector<PathView> turntable(const hull::Mesh& mesh, std::span<const View> photographs,
                                             const TurntableOptions& options = {});
/// The same about a given axis; the azimuth's origin is the direction of `first` from the middle of the object.
LUMIHULL_API std::vector<PathView> turntable(const hull::Mesh& mesh, const Eigen::Vector3d& up,
                                             const Eigen::Vector3d& first, const TurntableOptions& options = {});

/// Reads cameras from a JSON file:
///
///     {"format": "lumihull-camera-path", "version": 1,
///      "views": [{"name": "left", "width": 1280, "height": 720, "f": 1500,
///                 "s": 1, "skew": 0, "u0": 640, "v0": 360, "k1": 0, "k2": 0, "k3": 0, "p1": 0, "p2": 0,
///                 "cam_from_world": {"rotation_wxyz": [1, 0, 0, 0], "translation": [0, 0, 2]}}]}
///
/// Camera fields are those of lumihull::Camera (lens: Heikkilä's, from the picture to the ray). Needed: width, height,
/// f, cam_from_world; s = 1, the principal point in the middle, no skew and no lens where left out. Names are optional
/// (then frame_0000 …), unique, and without '/'. Instead of cam_from_world: "eye": [x, y, z], "target": [x, y, z] and
/// "up": [x, y, z]. At most 100000 views. Errors: not_found, bad_input naming the file, the JSON pointer and what was
/// expected.
LUMIHULL_API std::vector<PathView> read_camera_path(const std::filesystem::path& file);
/// Writes what read_camera_path reads, atomically.
LUMIHULL_API void write_camera_path(const std::filesystem::path& file, std::span<const PathView> views);

/// The cameras of some shots of a capture, named like the shots.
LUMIHULL_API std::vector<PathView> views_of_shots(const Capture& capture, std::span<const std::size_t> shots);

}  // namespace lumihull::slf
