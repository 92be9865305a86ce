#pragma once

#include <lumihull/base/image.h>
#include <lumihull/calib/target_family.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace lumihull::test {

/// Squares drawn by exact coverage: the truth that corners are compared with.
class SquareScene {
 public:
  using Map = std::function<Eigen::Vector2d(const Eigen::Vector2d&)>;

  /// Values are linear light. Everything is paper at first.
  SquareScene(int width, int height, double paper = 0.8, double ink = 0.05);

  /// pixel of a point of the target's grid: (0, 0) … (grid, grid), x right, y down. Sides may be curved.
  void add(const calib::TargetFamily& family, int id, const Map& pixel);
  /// A dark polygon beside.
  void add_polygon(const std::vector<Eigen::Vector2d>& points, double share = 1);

  struct Options {
    double blur_px = 0;        ///< sigma
    double noise = 0;          ///< standard deviation, linear light
    Eigen::Vector2d shade{0, 0};  ///< change of the light across width and height
    std::uint64_t seed = 0;
  };
  /// 8-bit or f32 sRGB, 1 channel.
  Image photograph(const Options& options, PixelType type = PixelType::f32) const;

 private:
  static constexpr int kFine = 3;  // subpixels along a pixel, for the blur
  int width_, height_;
  double paper_, ink_;
  std::vector<double> area_;  ///< signed areas, not yet summed along the rows
};

/// The homography of a square target seen by a camera of focal length f (px): `side_px` long where it is seen straight,
/// turned by `roll`, tilted by `tilt` about an axis at `axis`, its middle at `middle`. rad.
SquareScene::Map view_of_square(int grid, double side_px, double f, double roll, double tilt, double axis,
                                const Eigen::Vector2d& middle, const Eigen::Vector2d& principal);

}  // namespace lumihull::test
