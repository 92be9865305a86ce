#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/silhouette.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace lumihull::hull {

/// An axis-parallel box, world units.
struct Box {
  Eigen::Vector3d min = Eigen::Vector3d::Zero(), max = Eigen::Vector3d::Zero();

  Eigen::Vector3d size() const { return max - min; }
  Eigen::Vector3d center() const { return 0.5 * (min + max); }
  bool contains(const Eigen::Vector3d& p) const {
    return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
  }
};

/// A half-space that is cut away: normal · x > offset.
struct CutPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< any length > 0
  double offset = 0;
};

/// When a point is carved away.
struct CarveRule {
  /// A point is carved only where at least so many views say so: φ is the m-th largest of the φ_i. 1: the visual hull;
  /// more: robust against up to m - 1 bad masks at any point.
  int tolerance = 1;
  /// A point that fewer views see is not object (`tolerance`, if that is more: fewer could never carve it).
  int min_views = 1;
  std::vector<CutPlane> cut_planes;  ///< e.g. a table
  std::vector<Box> cut_boxes;        ///< what they contain is cut away, e.g. a support
};

/// The implicit function of the visual hull, evaluated exactly, one point at a time: negative inside.
///
///     φ(X) = max_i φ_i(X),  φ_i(X) = s_i(M_i X) · depth_i(X)      (paper, section 4)
///
/// s_i: the silhouette's signed distance in the ideal image plane, so that φ_i is metric across the line of sight; the
/// true distance to the cone is between cos β φ_i and φ_i, β the angle off the optical axis. Views that don't see X
/// (outside the picture or behind the camera) are skipped. Distances are clamped to the silhouettes' bands.
/// This is the definition that everything faster must agree with.
class LUMIHULL_API HullFunction {
 public:
  /// The silhouettes are kept (they are cheap to copy). Errors: invalid_argument (counts differ, none or more than
  /// 1,000,000 views, a bad rule), bad_input (a pose that is not finite; subject "view 17").
  HullFunction(std::span<const View> views, std::span<const Silhouette> silhouettes, const CarveRule& rule = {});
  ~HullFunction();
  HullFunction(HullFunction&&) noexcept;
  HullFunction& operator=(HullFunction&&) noexcept;

  /// φ(X); +infinity where too few views see X.
  double operator()(const Eigen::Vector3d& x) const;
  /// φ_i(X); nullopt where view i doesn't see X.
  std::optional<double> of_view(std::size_t i, const Eigen::Vector3d& x) const;
  std::size_t views() const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Where the samples of a field are: cubic voxels, samples at their centres.
struct Grid {
  Box region;                 ///< its longest side is `resolution` voxels; the others are rounded up to whole ones
  double voxel = 0;           ///< side
  std::array<int, 3> size{};  ///< voxels along x, y, z

  Eigen::Vector3d sample(int i, int j, int k) const {
    return {region.min.x() + voxel * (i + 0.5), region.min.y() + voxel * (j + 0.5), region.min.z() + voxel * (k + 0.5)};
  }
};

inline constexpr int kMinResolution = 8, kMaxResolution = 2048;

/// Errors: invalid_argument (resolution outside 8 … 2048; a region that is empty, not finite, or too far from the
/// origin for float vertices).
LUMIHULL_API Grid make_grid(const Box& region, int resolution);

/// φ sampled on a grid, kept only near its zero level: memory follows the surface.
class LUMIHULL_API Field {
 public:
  struct Data;

  const Grid& grid() const;
  /// Whether sample (i, j, k) is inside: φ < 0. Exactly the sign of HullFunction, for every sample.
  bool inside(int i, int j, int k) const;
  /// φ at a sample near the surface, in single precision; ±infinity away from it.
  float at(int i, int j, int k) const;

  std::size_t samples_inside() const;
  std::size_t samples_evaluated() const;  ///< one by one, rather than block by block
  std::size_t views_evaluated() const;    ///< sum over the evaluated samples of the views that were asked
  std::size_t bytes() const;

  const Data& data() const { return *data_; }
  explicit Field(std::unique_ptr<Data> data);
  ~Field();
  Field(Field&&) noexcept;
  Field& operator=(Field&&) noexcept;

 private:
  std::unique_ptr<Data> data_;
};

/// Samples φ by an octree: a block's views are kept while they can still matter in it. Exact in sign.
/// Errors: cancelled, out_of_memory.
LUMIHULL_API Field sample_field(const HullFunction& function, const Grid& grid, Job& job);

}  // namespace lumihull::hull
