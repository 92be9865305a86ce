#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/rig/photographer.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace lumihull::rig {

enum class Path : std::uint8_t { hemisphere, ring, random };
enum class PhotoFormat : std::uint8_t { jpeg, png };

/// A whole session with the virtual rig.
struct RigOptions {
  std::string object = "vase";  ///< a name that object_by_name knows, or a mesh file
  double size_m = 0.6;          ///< of the object's longest side
  bool blue = false;            ///< paint the room blue instead of green
  bool pedestal = false;
  int photos = 48;         ///< 1 … 100,000
  int empty_photos = 8;    ///< of the enclosure without the object
  int width = 1536;        ///< px; height is two thirds
  bool distortion = true;  ///< the lens distorts
  Path path = Path::hemisphere;
  double fill = 0.85;  ///< part of the picture's height that the object's ball takes
  PhotoFormat format = PhotoFormat::jpeg;
  int jpeg_quality = 93;
  bool truth_masks = true;
  std::uint64_t seed = 1;
  LightOptions light;
  PhotoOptions photo;
};

/// Photographs an object and writes a capture folder: photos/, enclosure/, known cameras, unit metres, white
/// background. The truth goes into `truth/` within it, where no stage looks: cameras.json, masks/, mesh.ply. Errors:
/// invalid_argument (options, folder in use), io, cancelled.
Capture make_capture(const std::filesystem::path& folder, const RigOptions& options, Job& job);

/// The same as plain files for importers: photos/, enclosure/, P.txt ("photos/NAME p11 … p34" a line; the pixel
/// convention of Camera) and truth/. The lens must be free of distortion: a matrix can't say it.
void make_photographs(const std::filesystem::path& folder, const RigOptions& options, Job& job);

}  // namespace lumihull::rig
