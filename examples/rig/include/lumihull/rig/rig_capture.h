#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/rig/photographer.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace lumihull::rig {

enum class Path : std::uint8_t { hemisphere, ring, random };
enum class PhotoFormat : std::uint8_t { jpeg, png };

/// A whole session with the virtual rig.
struct RigOptions {
  std::string object = "vase";  ///< a name that object_by_name knows, or a mesh file
  double size_m = 0.6;          ///< of the object's longest side
  bool matt = false;            ///< no gloss: the mirror reflectance is 0
  bool uniform = false;         ///< the material's first colour all over, no pattern, no grain, no texture
  /// The object has this colour (8-bit sRGB) in every photograph, whatever the light; without noise, exactly.
  std::optional<std::array<std::uint8_t, 3>> unlit;
  bool blue = false;  ///< paint the room blue instead of green
  bool pedestal = false;
  bool targets = false;    ///< printed targets on walls and floor, by which photographs can be positioned
  double target_px = 12;   ///< diameter of their circles, seen straight
  int photos = 48;         ///< 1 … 100,000
  int empty_photos = 8;    ///< of the enclosure without the object
  int width = 1536;        ///< px; height is two thirds
  bool distortion = true;  ///< the lens distorts
  Path path = Path::hemisphere;
  double fill = 0.85;  ///< part of the picture's height that the object's ball takes
  PhotoFormat format = PhotoFormat::jpeg;
  int jpeg_quality = 93;
  bool truth_masks = true;
  int test_views = 0;  ///< pictures along an arc, beside the capture: what a renderer should make of it; 0 … 100,000
  std::uint64_t seed = 1;
  LightOptions light;
  PhotoOptions photo;
};

/// Photographs an object and writes a capture folder (without targets: its cameras are known): photos/, enclosure/,
/// known cameras, unit metres, white background. The truth goes into `truth/` within it, where no stage looks:
/// cameras.json, masks/, mesh.ply and, of a glossy object, highlights.json. With test_views: test_views.json (a camera
/// path, "lumihull-camera-path"), test_views/NAME.png and test_views/masks/NAME.png (free of noise, each pixel traced),
/// test_highlights.json. Errors: invalid_argument (options, folder in use), io, cancelled.
Capture make_capture(const std::filesystem::path& folder, const RigOptions& options, Job& job);

/// The same as plain files for importers: photos/, enclosure/ and truth/. With targets: sheets.json says what was
/// printed, and truth/targets.json where it hangs ("targets": design, id, world_from_target); nothing is said of
/// cameras and poses. Without: P.txt ("photos/NAME p11 … p34" a line; the pixel convention of Camera), and the lens
/// must be free of distortion: a matrix can't say it.
void make_photographs(const std::filesystem::path& folder, const RigOptions& options, Job& job);

}  // namespace lumihull::rig
