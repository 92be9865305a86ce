// A small sample of what tests/bench/detection.cpp and false_targets.cpp measure.

#include <lumihull/calib/detect_targets.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "pictures_without_targets.h"
#include "support.h"
#include "target_shot.h"

namespace lumihull::test {
namespace {

const char* const kFamilies[] = {"matrix5x5", "matrix6x6", "paper4x4", "apriltag:36h11", "aruco:6x6_250"};

calib::TargetDesign design_of(const std::string& family) {
  calib::TargetDesign design;
  design.family = calib::TargetFamily::by_name(family);
  return sized(design, .09);
}

calib::TargetDetector detector_of(const calib::TargetDesign& design) {
  calib::TargetSet set;
  set.designs = {design};
  return calib::TargetDetector(set);
}

TEST(ManyTargets, AreFoundAndReadRightly) {
  Job job({}, 1);
  for (const std::string family : kFamilies) {
    SCOPED_TRACE(family);
    const calib::TargetDesign design = design_of(family);
    const calib::TargetDetector detector = detector_of(design);
    const auto ids = design.family.ids();
    int found = 0, clear = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      SCOPED_TRACE(seed);
      Dice dice(seed);
      Seen seen;
      seen.minor_px = dice.between(5, 10), seen.tilt_rad = dice.between(0, M_PI / 3),
      seen.blur_px = dice.between(.3, 1);
      seen.wide = seed % 4 == 0, seen.bayer = seed % 4 == 1, seen.jpeg = seed % 4 == 2, seen.occluded = seed % 8 == 7;
      const TargetShot shot = photograph_target(design, ids[std::size_t(seed * 37) % ids.size()], seen, seed);
      const Verdict verdict = judge(shot, design, detector.detect(shot.photo, job).targets);
      EXPECT_EQ(verdict.wrong, 0);
      clear += !seen.occluded, found += verdict.found && !seen.occluded;
    }
    EXPECT_GE(found, clear - 2) << "of " << clear;  // paper4x4 reads no cell twice
  }
}

/// A square spot over a part of one circle, of the paper's colour or the ink's, as seen beside it.
void cover_a_circle(const calib::TargetDesign& design, TargetShot& shot, Dice& dice, double minor_px) {
  const int circle = dice.below(design.features());
  const auto pixel_of = [&](const Eigen::Vector2d& p) {
    return *shot.camera.project(shot.cam_from_target * Eigen::Vector3d(p.x(), p.y(), 0));
  };
  const bool light = dice.chance(.7);
  const Eigen::Vector2d place = design.feature(circle), beside(.5 * design.size_m, .5 * design.size_m);
  const double reach = .6 * minor_px;
  const Eigen::Vector2d middle =
      pixel_of(place) + Eigen::Vector2d(dice.between(-reach, reach), dice.between(-reach, reach));
  const Eigen::Vector2d from = pixel_of(light ? place - beside : design.feature(0));  // feature 0 is of the L: dark
  const double half = dice.between(.2, .6) * minor_px;
  const auto clamped = [&](double v, int size) { return std::clamp(int(v), 0, size - 1); };
  const int fx = clamped(from.x(), shot.photo.width()), fy = clamped(from.y(), shot.photo.height());
  std::uint8_t color[3];
  for (int c = 0; c < 3; ++c) color[c] = shot.photo.row<std::uint8_t>(fy)[3 * fx + c];
  for (int y = clamped(middle.y() - half, shot.photo.height()); y <= clamped(middle.y() + half, shot.photo.height());
       ++y)
    for (int x = clamped(middle.x() - half, shot.photo.width()); x <= clamped(middle.x() + half, shot.photo.width());
         ++x)
      for (int c = 0; c < 3; ++c) shot.photo.row<std::uint8_t>(y)[3 * x + c] = color[c];
}

// paper4x4 has no check bits: what hides a part of a circle may make another word of it. Whole targets are all read;
// wrong ids are at most 2 % of those that a bar crosses, and at most 3 % of those on which a spot of the paper's or the
// ink's own colour lies over a part of one circle. With check bits none is wrong.
TEST(ManyTargets, WithoutCheckBitsHiddenOnesAreSeldomMisread) {
  Job job({}, 1);
  for (const std::string family : {"paper4x4", "matrix5x5"}) {
    SCOPED_TRACE(family);
    const bool checked = family != "paper4x4";
    const calib::TargetDesign design = design_of(family);
    const calib::TargetDetector detector = detector_of(design);
    const auto ids = design.family.ids();
    constexpr std::uint64_t kBars = 100, kSpots = 200, kWhole = 40;
    int crossed = 0, spotted = 0, spotted_found = 0;
    for (std::uint64_t seed = 0; seed < kBars + kSpots + kWhole; ++seed) {
      SCOPED_TRACE(seed);
      const bool bar = seed < kBars, spot = !bar && seed < kBars + kSpots;
      Dice dice(1000 + seed);
      Seen seen;
      seen.minor_px = dice.between(7, 14), seen.tilt_rad = dice.between(0, M_PI / 4),
      seen.blur_px = dice.between(.3, .8);
      seen.noise = .005, seen.occluded = bar;
      TargetShot shot = photograph_target(design, ids[std::size_t(seed * 37) % ids.size()], seen, 1000 + seed);
      if (spot) cover_a_circle(design, shot, dice, seen.minor_px);
      const Verdict verdict = judge(shot, design, detector.detect(shot.photo, job).targets);
      (bar ? crossed : spotted) += verdict.wrong;
      spotted_found += spot && verdict.found;
      if (bar || spot) continue;
      EXPECT_TRUE(verdict.found);
      EXPECT_EQ(verdict.wrong, 0);
    }
    EXPECT_LE(crossed, checked ? 0 : int(kBars) / 50);
    EXPECT_LE(spotted, checked ? 0 : int(kSpots) * 3 / 100);            // 3 when this was written
    EXPECT_GE(spotted_found, checked ? int(kSpots) : int(kSpots) / 4);  // what does no harm is no reason to refuse
  }
}

TEST(ManyTargets, AreNotSeenWhereThereAreNone) {
  Job job({}, 1);
  for (const std::string family : kFamilies) {
    SCOPED_TRACE(family);
    const calib::TargetDetector detector = detector_of(design_of(family));
    for (int kind = 0; kind < kClutterKinds; ++kind) {
      if (Clutter(kind) == Clutter::photographs) continue;
      for (std::uint64_t seed = 0; seed < 3; ++seed)
        EXPECT_TRUE(detector.detect(clutter(Clutter(kind), 200, seed), job).targets.empty())
            << clutter_name(Clutter(kind)) << ' ' << seed;
    }
  }
}

}  // namespace
}  // namespace lumihull::test
