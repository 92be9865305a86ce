#pragma once

// The structure of NeRF's transforms*.json.

#include <lumihull/base/api.h>
#include <lumihull/base/pose.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::internal {

/// A frame's intrinsics as the file gives them: what is missing is worked out from the photograph's size.
struct NerfIntrinsics {
  std::optional<double> angle_x, angle_y;               ///< radians
  std::optional<double> fx, fy, cx, cy, width, height;  ///< px
  std::array<double, 6> lens{};                         ///< k1, k2, k3, k4, p1, p2
  bool fisheye = false;
};

struct NerfFrame {
  std::string file;     ///< file_path, as written
  std::string pointer;  ///< the frame's JSON pointer
  NerfIntrinsics intrinsics;
  Pose cam_from_world;  ///< converted: y down, z forward
};

/// Errors: bad_input with the JSON pointer, unsupported (camera_model).
LUMIHULL_API std::vector<NerfFrame> parse_nerf(std::string_view text, const std::string& file);

}  // namespace lumihull::internal
