#pragma once

// Rendered photographs of targets on a table, with the truth.

#include <lumihull/base/camera.h>
#include <lumihull/calib/target_set.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::test {

struct PrintedScene {
  calib::TargetSet set;
  Camera camera;
  std::vector<Pose> cam_from_world;
  std::vector<std::filesystem::path> photos;  ///< as they were written

  /// RMS difference of the distances between cameras' centres to the truth, m: free of any frame. Photographs without
  /// a pose are left out; fewer than two poses: -1.
  double center_error_m(const std::vector<std::optional<Pose>>& poses) const;
};

/// `photos` pictures p0.png … of six targets (ids 1 … 6) from a ring and from above, written into the folder.
PrintedScene print_scene(const std::filesystem::path& folder, const std::string& word = "matrix5x5:18mm",
                         int photos = 10);

}  // namespace lumihull::test
