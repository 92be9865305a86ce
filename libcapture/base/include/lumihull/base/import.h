#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace lumihull {

/// What all importers share.
///
/// An importer makes a new capture: it is built in a folder beside `output` and renamed when it is complete, so that a
/// failed, cancelled or killed import leaves no half of one, and an existing capture is never overwritten. Shots are
/// named after their photographs' stems; where two are alike, the folder's name, the extension or a number is added.
/// What the importer had to decide (mirrored world, refitted lenses) stands in Capture::notes.
///
/// Errors of all: invalid_argument (`output` in use), not_found (a photograph; named), bad_input (file, line or JSON
/// pointer, and what was expected), io, cancelled.
struct ImportOptions {
  std::filesystem::path output;  ///< the new capture's folder: absent or empty
  bool reference = false;        ///< refer to photographs where they are instead of copying them into photos/
};

struct ProjectionImportOptions : ImportOptions {
  /// The pixel coordinate that the matrices give to the centre of the first pixel: 0.5 (ours, COLMAP), 0 (OpenCV and
  /// most calibration programs), 1 (MATLAB).
  double first_pixel_center = 0.5;
};

/// Imports a listing of projection matrices: "NAME p11 p12 … p34" a line, row-major, with '#' comments and empty lines.
/// Names are relative to the listing.
///
/// Each matrix may have any scale and sign: P = λ K [R | t] (Hartley & Zisserman 2004, 6.2.4: RQ decomposition, K with
/// a positive diagonal and a skew). λ's sign is the one that puts the point at which all cameras look (the
/// least-squares intersection of the rays through the pictures' centres) in front. If the determinant of each left 3 x
/// 3 block is then negative, the listing's world is left-handed: its z axis is reversed, and a note says so. Errors:
/// bad_input naming the line (values missing, not finite, singular) or the photographs whose handedness differs from
/// the others'; degenerate where handedness can't be told: all rays parallel.
LUMIHULL_API Capture import_projections(const std::filesystem::path& listing, const ProjectionImportOptions& options,
                                        Job& job);

/// Imports a Middlebury multi-view file (`*_par.txt`): a line with the count, then "NAME k11 … k33 r11 … r33 t1 t2 t3".
/// Its pixel centres are whole numbers: half a pixel is added to the principal point. Its unit is not stated.
LUMIHULL_API Capture import_middlebury(const std::filesystem::path& par_file, const ImportOptions& options, Job& job);

struct RefitImportOptions : ImportOptions {
  /// Lenses of other models are refitted to Heikkilä's; import fails where a pixel would move farther than this.
  double max_refit_error_px = 0.5;
};

/// Imports NeRF's transforms*.json; several files (train, val, test) become one capture, in that order.
///
/// Intrinsics: camera_angle_x, or fl_x, fl_y, cx, cy, w, h, k1, k2, k3, p1, p2 (OpenCV's lens), for the file or for
/// each frame. Poses: camera to world, 4 x 4, x right, y up, z backwards (OpenGL). file_path: relative to its JSON
/// file, with or without extension. An alpha channel that is not opaque everywhere becomes the mask.
LUMIHULL_API Capture import_nerf(std::span<const std::filesystem::path> files, const RefitImportOptions& options,
                                 Job& job);

/// Imports a COLMAP model: the folder with cameras and images, text (.txt) or binary (.bin; preferred where both are
/// there, as COLMAP does). `photos`: the folder that COLMAP's image names are relative to. Only registered images
/// become shots. Camera models: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV,
/// SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, OPENCV_FISHEYE; others are Error{unsupported}. Notes give the largest error
/// of each refitted lens.
LUMIHULL_API Capture import_colmap(const std::filesystem::path& model, const std::filesystem::path& photos,
                                   const RefitImportOptions& options, Job& job);

/// The camera that a photograph's header tells of: principal point in the middle, no lens distortion, f from EXIF's 35 mm
/// equivalent (by the diagonal, 43.27 mm; CIPA DCG-001), else 1.2 times the longer side.
struct HeaderCamera {
  Camera camera;
  bool f_known = false;  ///< f is EXIF's
};
LUMIHULL_API HeaderCamera camera_of_header(const ImageInfo& info);

/// Imports photographs without poses. A camera is made for each combination of size, maker, model and focal length; its
/// camera_of_header; a note says where f comes from.
LUMIHULL_API Capture import_photos(std::span<const std::filesystem::path> files, const ImportOptions& options,
                                   Job& job);

/// Adds masks from a folder to a capture: a picture belongs to the shot whose name, or whose photograph's stem or name,
/// is its stem. An alpha channel is taken where there is one, else grey values (RGB must be grey). 0 = background.
/// Masks that are there are replaced. All are checked before the first is written; the capture is saved. Returns how
/// many there were.
/// Errors: bad_input (a size that is not the photograph's, a colour picture), not_found (no picture fits any shot).
LUMIHULL_API int import_masks(Capture& capture, const std::filesystem::path& folder, Job& job);

/// Adds photographs of the empty enclosure to a capture, which keying then learns the background from. They are copied
/// into enclosure/ unless `reference`; the capture is saved. Returns how many were added.
/// Errors: invalid_argument (none named), not_found, bad_input (not a picture), io, cancelled.
LUMIHULL_API int import_enclosure(Capture& capture, std::span<const std::filesystem::path> files, bool reference,
                                  Job& job);

}  // namespace lumihull
