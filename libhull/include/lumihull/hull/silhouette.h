#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>

namespace lumihull::hull {

struct SilhouetteOptions {
  /// Side of a cell of the field, in pixels (of the axis that has more of them a radian); 1 … 64; photographs of
  /// one camera and one cell share the lens's tables. A quarter of a voxel's footprint is fine enough: see
  /// `silhouette_options`.
  double cell_px = 1;
  /// Distances are exact up to here and clamped beyond, in pixels; at least two cells are taken. The surface is placed
  /// well where it is 1.75 voxels or more.
  double band_px = 8;
};

/// Where the object stands in a photograph, in the ideal image plane (X / Z, Y / Z).
struct SilhouetteBounds {
  Eigen::Vector2d min = Eigen::Vector2d::Zero(), max = Eigen::Vector2d::Zero();
  bool touches_border = false;  ///< the object may go on beyond the picture
};

/// What one photograph says of space: the signed distance field of its silhouette.
///
/// The contour is the 127.5 level of the 8-bit mask, interpolated between the centres of pixels (so that a binary
/// mask's contour runs between its pixels). It is carried to the *ideal* image plane by the lens's own polynomial
/// (paper, eq. 8: from the picture to the ray, no inverse needed) and aspect and skew are taken out; the field lives
/// there. Distances are isotropic, a distance times the depth is metric, and points are projected without a lens.
///
/// Kept: tiles of 16-bit distances around the contour, and a pyramid for the rest. A silhouette is immutable and cheap
/// to copy. The border of the picture is no contour: beyond it the silhouette says nothing.
class LUMIHULL_API Silhouette {
 public:
  struct Data;

  /// mask: 8-bit, 1 channel, of the camera's size; 255 = object.
  /// Errors: bad_input (type or size), invalid_argument (options, camera), degenerate (a lens that folds in the
  /// middle).
  static Silhouette from_mask(const Image& mask, const Camera& camera, const SilhouetteOptions& options = {});

  /// Signed distance to the contour at a point of the ideal plane, in its units, negative inside, clamped to `band()`;
  /// nullopt where the picture says nothing (cells of the field that are not wholly inside it).
  std::optional<double> distance(const Eigen::Vector2d& ideal) const;

  /// Largest distance that the field holds, in units of the ideal plane.
  double band() const;
  /// No pixel, or every pixel, is object.
  bool is_empty() const;
  bool is_full() const;
  /// Of the object's pixels; zero for an empty mask.
  const SilhouetteBounds& bounds() const;
  /// Memory that the field takes.
  std::size_t bytes() const;

  const Data& data() const { return *data_; }

 private:
  friend class SilhouetteMaker;
  explicit Silhouette(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

/// Makes the silhouettes of one camera's masks: what depends on the lens alone is computed once.
class LUMIHULL_API SilhouetteMaker {
 public:
  /// Errors: invalid_argument, degenerate, as `Silhouette::from_mask`.
  SilhouetteMaker(const Camera& camera, double cell_px);
  ~SilhouetteMaker();
  SilhouetteMaker(SilhouetteMaker&&) noexcept;
  SilhouetteMaker& operator=(SilhouetteMaker&&) noexcept;

  /// May be called from many threads.
  Silhouette make(const Image& mask, double band_px) const;

 private:
  struct Frame;
  std::unique_ptr<const Frame> frame_;
};

}  // namespace lumihull::hull
