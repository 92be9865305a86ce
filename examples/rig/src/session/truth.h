#pragma once

#include <lumihull/rig/highlights.h>
#include <lumihull/rig/photographer.h>
#include <lumihull/rig/target_sheets.h>

#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::rig {

/// One camera's photographs of a scene: where they were taken from and what they are called.
struct NamedShots {
  std::vector<std::string> names;
  std::vector<Pose> cam_from_world;
};

/// {"format": "lumihull-rig-truth", "version": 1, "unit": "m", "camera": …, "object": …, "lamps": …, "views": …}
void write_camera_truth(const std::filesystem::path& file, const Scene& scene, const Camera& camera,
                        const NamedShots& shots);

/// Where each sheet hangs.
void write_target_truth(const std::filesystem::path& file, const std::vector<PlacedTarget>& targets);

/// {"format": "lumihull-highlights", "version": 1, "shots": [{"name": "0001", "highlights": [{"lamp": 0,
///  "point": [x, y, z], "pixel": [u, v], "strength": s}]}]}: what HighlightFinder finds; m and px; strength is that of
/// the photograph, 1 = white.
void write_highlights(const std::filesystem::path& file, const HighlightFinder& finder, const Camera& camera,
                      const NamedShots& shots, double exposure, Job& job);

/// What each shot shows without the lamps' gloss, and that gloss alone: without_highlights/NAME.png and
/// highlights/NAME.png in `folder`. Files that are there stay.
void photograph_highlights(const std::filesystem::path& folder, const Photographer& photographer, const Camera& camera,
                           const NamedShots& shots, const PhotoOptions& options, Job& job);

/// {"format": "lumihull-camera-path", "version": 1, "views": …}: the renderer's camera path.
void write_camera_path(const std::filesystem::path& file, const Camera& camera, const NamedShots& shots);

}  // namespace lumihull::rig
