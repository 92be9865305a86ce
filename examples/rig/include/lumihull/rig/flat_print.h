#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/pose.h>
#include <lumihull/calib/target_set.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::rig {

/// A disc or a polygon on a sheet; colours are linear reflectances, 0 … 1.
struct FlatShape {
  Eigen::Vector3f color{0, 0, 0};
  Eigen::Vector2d center{0, 0};          ///< of a disc, m
  double radius = 0;                     ///< > 0: a disc
  std::vector<Eigen::Vector2d> polygon;  ///< simple; where there is no radius
};

/// A flat sheet with shapes that were printed on it one after another. Its frame: x right, y down, z into the paper.
struct FlatPrint {
  Eigen::Vector2d low{0, 0}, high{0, 0};  ///< the sheet, m
  Eigen::Vector3f paper{.8f, .8f, .8f};
  std::vector<FlatShape> shapes;
  Pose world_from_print;
  Eigen::Vector2d stretch{1, 1};  ///< of the print along x and y: true length over drawn length; all else is as drawn
};

/// A target as printed, with a margin of paper around it (circles: half a pitch beyond the outer circles' pitch square,
/// so that the sheet is grid + 1 pitches wide; squares: two modules), its frame that of TargetDesign; `stretch` is its
/// scale. Ink and paper are the design's sRGB colours in linear light. Errors: those of TargetDesign::validate and
/// TargetFamily::cells.
FlatPrint print_of(const calib::TargetDesign& design, int id);
/// A field of points as printed, with a margin of one spacing beyond the outer points (circles) or fields (chessboard,
/// whose top left field is ink); the frame is that of PointGrid. Error{invalid_argument} (columns, rows, spacing).
FlatPrint print_of(const calib::PointGrid& grid, const Eigen::Vector3f& ink, const Eigen::Vector3f& paper);

/// What happens between the sheets and the file.
struct PrintPhotoOptions {
  int edge_samples = 16;  ///< scan lines a pixel where edges pass (1 … 256); along each the colours' shares are exact
  double blur_px = 0;     ///< sigma of a Gaussian, in linear light, 0 … 100
  double exposure = 1;    ///< factor on the light
  /// Change of the light across the picture's width and height, about its middle, e.g. 0.5: from .75 to 1.25.
  Eigen::Vector2f shading{0, 0};
  double noise_read = 0;  ///< standard deviation in linear light
  double noise_shot = 0;  ///< variance = noise_shot · value on top
  bool bayer = false;     ///< one colour a pixel (RGGB), demosaiced bilinearly
  int jpeg_quality = 0;   ///< 1 … 100: through a JPEG and back; 0: none
};

/// Photographs sheets on an even background: nearest sheet first (sheets that cut one another are ordered pixel by
/// pixel). Sheets are opaque; from behind they show bare paper. Pixels integrate over their square, through the lens's
/// distortion, then the Gaussian is applied to the integrals; light that the lens's domain does not hold is background.
/// One thread; any number of threads may photograph. linear: f32, 3 channels, linear light (not clipped, no JPEG); else
/// 8-bit sRGB. Errors: bad_input (camera), invalid_argument (prints, options, not finite).
Image photograph_prints(const View& view, std::span<const FlatPrint> prints, const Eigen::Vector3f& background,
                        const PrintPhotoOptions& options, std::uint64_t seed, bool linear = false);

}  // namespace lumihull::rig
