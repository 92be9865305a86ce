#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/calib/key_image.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::hull {

/// How a capture's photographs are keyed.
struct LUMIHULL_API KeyOptions {
  /// Where the background's training samples come from:
  ///   "auto"       photographs of the empty enclosure where the capture has them, else the photographs themselves
  ///   "enclosure"  photographs of the empty enclosure
  ///   "photos"     the photographs themselves, with the cameras' help where they are known
  ///   "regions"    the rectangles named in `regions`
  ///   a path       a key that was saved before (JSON)
  std::string background = "auto";
  std::string regions;                ///< "NAME:x,y,width,height;…", px; for background = "regions"
  int k = 7;                          ///< neighbours asked (paper, eq. 9)
  double foreground_share = 0.2;      ///< uniform foreground samples as a share of the background's
  std::size_t max_samples = 100'000;  ///< background samples kept of all that were seen
  std::uint64_t seed = 1;             ///< of the uniform foreground samples
  /// matte: contours at half coverage. hard and soft keep the key's decision at every pixel.
  calib::EdgeMode edges = calib::EdgeMode::matte;
  /// Takes away specks of less than 0.02 % of the picture and fills holes of up to 0.01 % (learned
  /// from photographs before a dark enclosure: 0.3 %, where the hull agrees). Where cameras are known, it also
  /// decides by the colours around what of a mask the others contradict: where the object took on the enclosure's
  /// colour or, where targets were calibrated, that of their paper, and where shadows were taken for object. With clean
  /// = false, edges hard or soft, and background = "enclosure" the masks are the paper's, pixel by pixel.
  bool clean = true;

  /// Throws Error{invalid_argument} naming the option.
  void validate() const;
};

struct KeyReport {
  std::string source;                 ///< "enclosure", "photos", "photos and cameras", "regions" or "file"
  std::size_t keyed = 0;              ///< masks written
  std::size_t kept = 0;               ///< masks left alone: imported, or edited by a person
  std::size_t mended = 0;             ///< of the masks written: where the object took on the enclosure's colour
  int rounds = 0;                     ///< train, carve, train again: how often; 0 without cameras
  std::vector<std::string> warnings;  ///< each names its photograph
};

/// The stage `key`: trains a colour key, writes a mask for every photograph and key.json to the capture's folder, and
/// sets the capture's background colour where it has none. Held-out photographs are keyed, but train nothing. The
/// capture is not saved. Masks are the same for any number of threads.
/// Errors: invalid_argument (options), not_found, bad_input (a photograph, a key), degenerate (no background found;
/// every mask is empty or full), cancelled. Masks written before an error stay.
LUMIHULL_API KeyReport key_capture(Capture& capture, const KeyOptions& options, Job& job);

}  // namespace lumihull::hull
