#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/background.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lumihull::hull {

/// A photograph as the coarse carver sees it: every `step`-th pixel of every `step`-th row. Pixel (i, j) stands for the
/// photograph's pixels step i … step i + step - 1, likewise in rows.
struct CoarseView {
  View view;  ///< of the full photograph
  int step = 1;
  calib::Frame frame;  ///< what is picture, in coarse pixels; outside it the view says nothing
  Image mask;          ///< 8 bits, 1 channel, coarse; object: >= 128
};

/// A small, forgiving visual hull: a grid of voxels, kept unless too many views vote against them.
///
/// It tells where the object can be while silhouettes are still being learned; the model's hull is made elsewhere.
class CoarseHull {
 public:
  /// Finds the region that the silhouettes look at, and carves it. A voxel stays where it is in the picture of at least
  /// two views and of half of them, and at most `tolerance` (0 … 1) of these show background there.
  /// nullopt where nothing is left or the views have no common region.
  static std::optional<CoarseHull> carve(std::span<const CoarseView> views, int resolution, double tolerance, Job& job);

  /// Where the hull is in a view, grown by `grow` coarse pixels: 8 bits, 255 inside.
  Image silhouette(const CoarseView& view, int grow) const;

  /// How deep in the hull the rays of a view's pixels come: 8 bits, in voxels, 1 at the hull's surface, 0 where the ray
  /// misses it, at most 15. Right to within a voxel's width across the ray. Voxels less deep than `least` count as 0.
  Image depth(const CoarseView& view, int least) const;

  /// How far beyond `silhouette` the object may reach in a view, coarse pixels: what the grid can't tell.
  int margin_px(const CoarseView& view) const;

 private:
  struct Grid {
    Eigen::Vector3d low;
    double voxel = 0;
    int n = 0;  ///< voxels a side
    Eigen::Vector3d center() const { return low + Eigen::Vector3d::Constant(0.5 * voxel * n); }
  };
  double voxel_px(const CoarseView& view) const;
  static std::vector<std::uint8_t> vote(std::span<const CoarseView> views, const Grid& grid, double tolerance,
                                        Job& job);
  void measure_depth();
  /// Calls visit(depth, u, v) for the voxels of at least that depth whose centres lie in the picture, coarse pixels.
  template <class Visit>
  void visit_kept(const CoarseView& view, int least, Visit&& visit) const;

  Grid grid_;
  /// n³, x fastest; 0: carved; else the voxels to the nearest carved one along any of the 26 ways, at most kDeepest.
  std::vector<std::uint8_t> kept_;
};

/// Object pixels of an 8-bit mask (>= 128) and all within `radius` pixels along rows and columns of one: 255, else 0.
Image grown(const Image& mask, int radius);
/// Object pixels without background within `radius` pixels along rows and columns: 255, else 0.
Image shrunk(const Image& mask, int radius);

}  // namespace lumihull::hull
