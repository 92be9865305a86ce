#pragma once

// COLMAP's model files (https://colmap.github.io/format.html): cameras and images, text and binary. Points are
// written, not read.

#include <lumihull/base/pose.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lens_models.h"

namespace lumihull::internal {

struct ColmapImage {
  std::string name;
  std::int64_t camera = 0;  ///< key of ColmapModel::cameras
  Pose cam_from_world;
  struct Point {
    Eigen::Vector2d pixel{0, 0};
    std::size_t point3d = 0;  ///< index into ColmapModel::points
  };
  std::vector<Point> points;
};

struct ColmapPoint {
  Eigen::Vector3d place{0, 0, 0};
  double error_px = 0;  ///< mean distance of its pictures from where it is seen
  std::vector<std::pair<std::size_t, std::size_t>> track;  ///< image, index of its point
};

struct ColmapModel {
  std::map<std::int64_t, ForwardCamera> cameras;
  std::vector<ColmapImage> images;  ///< in the file's order
  std::vector<ColmapPoint> points;
};

// `file` names the source in errors: Error{bad_input} with line or byte, Error{unsupported} for a camera model.
LUMIHULL_API void parse_colmap_cameras_text(std::string_view text, const std::string& file, ColmapModel& model);
LUMIHULL_API void parse_colmap_images_text(std::string_view text, const std::string& file, ColmapModel& model);
LUMIHULL_API void parse_colmap_cameras_binary(std::string_view bytes, const std::string& file, ColmapModel& model);
LUMIHULL_API void parse_colmap_images_binary(std::string_view bytes, const std::string& file, ColmapModel& model);

/// Throws bad_input where an image names a camera that is not there.
LUMIHULL_API void check_colmap_model(const ColmapModel& model, const std::string& file);

/// The text of cameras.txt, images.txt and points3D.txt; numbers with 17 digits. Images and points are counted from 1.
std::string print_colmap_cameras(const ColmapModel& model);
std::string print_colmap_images(const ColmapModel& model);
std::string print_colmap_points(const ColmapModel& model);

}  // namespace lumihull::internal
