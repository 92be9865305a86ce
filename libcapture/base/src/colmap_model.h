#pragma once

// COLMAP's model files (https://colmap.github.io/format.html): cameras and images, text and binary. Points are not
// used.

#include <lumihull/base/pose.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "lens_models.h"

namespace lumihull::internal {

struct ColmapImage {
  std::string name;
  std::int64_t camera = 0;  ///< key of ColmapModel::cameras
  Pose cam_from_world;
};

struct ColmapModel {
  std::map<std::int64_t, ForwardCamera> cameras;
  std::vector<ColmapImage> images;  ///< in the file's order
};

// `file` names the source in errors: Error{bad_input} with line or byte, Error{unsupported} for a camera model.
LUMIHULL_API void parse_colmap_cameras_text(std::string_view text, const std::string& file, ColmapModel& model);
LUMIHULL_API void parse_colmap_images_text(std::string_view text, const std::string& file, ColmapModel& model);
LUMIHULL_API void parse_colmap_cameras_binary(std::string_view bytes, const std::string& file, ColmapModel& model);
LUMIHULL_API void parse_colmap_images_binary(std::string_view bytes, const std::string& file, ColmapModel& model);

/// Throws bad_input where an image names a camera that is not there.
LUMIHULL_API void check_colmap_model(const ColmapModel& model, const std::string& file);

/// The text of cameras.txt and images.txt; numbers with 17 digits.
std::string print_colmap_cameras(const ColmapModel& model);
std::string print_colmap_images(const ColmapModel& model);

}  // namespace lumihull::internal
