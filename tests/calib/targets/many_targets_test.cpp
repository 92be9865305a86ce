// A small sample of what tests/bench/detection.cpp and false_targets.cpp measure.

#include <lumihull/calib/detect_targets.h>

#include <cmath>
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
