#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/calib/detection.h>
#include <lumihull/calib/target_set.h>
#include <lumihull/rig/flat_print.h>

#include <cstdint>
#include <span>

namespace lumihull::test {

/// How a target is to be seen.
struct Seen {
  double minor_px = 12;  ///< smaller axis of its circles; squares: of circles on a 5 x 5 target of the same outer size
  double tilt_rad = 0;   ///< between the sheet's normal and the line of sight
  double blur_px = .7;
  bool wide = false;  ///< a corner of a 12-megapixel picture through a 10 mm lens, with its distortion
  bool bayer = false, jpeg = false;
  bool occluded = false;  ///< a bar of paper lies over a part of it
  double noise = .01;     ///< standard deviation in linear light at white; half of its variance is shot noise
};

/// A photograph of one target at a random place, turn, exposure and shading before a random background.
struct TargetShot {
  Camera camera;
  Pose cam_from_target;
  int id = 0;
  Image photo;
};

/// The camera's picture is as large as the target needs; the same seed gives the same place whatever the design.
/// outer_m: the target's outer size; the design's own size is scaled to it.
TargetShot photograph_target(calib::TargetDesign design, int id, const Seen& seen, std::uint64_t seed);

/// A design whose outer contour is `outer_m` wide: circles with their outer circles' edges, squares with their black
/// border.
calib::TargetDesign sized(calib::TargetDesign design, double outer_m);
double outer_size(const calib::TargetDesign& design);

/// What a detector made of a shot of one target.
struct Verdict {
  bool found = false;  ///< with its id, its features where they are (to half a circle's or a module's size)
  int wrong = 0;       ///< detections with another id, or with features elsewhere
};
Verdict judge(const TargetShot& shot, const calib::TargetDesign& design, std::span<const calib::Detection> targets);

/// Uniform numbers from a seed, for scenes.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ull + 0x632be59bd9b4e019ull) { next(); }
  std::uint64_t next();
  double unit() { return double(next() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  int below(int n) { return int(unit() * n); }
  bool chance(double p) { return unit() < p; }

 private:
  std::uint64_t state_;
};

}  // namespace lumihull::test
