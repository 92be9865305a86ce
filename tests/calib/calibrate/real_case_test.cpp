// Real photographs of which nothing is known but what was printed: a red case on a sheet that is not flat.
#include <gtest/gtest.h>
#include <lumihull/base/image.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/calibrate.h>
#include <lumihull/calib/detect_targets.h>

#include <cmath>
#include <string>

#include "support.h"

namespace lumihull::calib {
namespace {

TEST(CalibrateReal, CaseFromNothing) {
  LUMIHULL_NEED_REAL_DATA(folder, "case");
  Job job;
  const TargetDetector detector(TargetSet::from_word("aruco:6x6_250:35mm"));
  std::vector<PhotoTargets> photos(22);
  parallel_for(job, photos.size(), [&](std::size_t i) {
    Job inner({}, 1);
    PhotoTargets& photo = photos[i];
    photo.name = (i < 9 ? "0" : "") + std::to_string(i + 1);
    photo.shot = int(i);
    photo.targets = detector.detect(read_image(folder / (photo.name + ".png")), inner).targets;
  });
  CameraStart camera;
  camera.width = 1280, camera.height = 720;
  const Calibration c = calibrate_targets(detector.set(), photos, std::vector{camera}, {}, job);
  for (const CalibratedPhoto& p : c.photos) EXPECT_EQ(p.part, 0);
  EXPECT_LT(c.rms_px, 0.35);
  EXPECT_GT(c.share, 0.95);
  EXPECT_NEAR(c.cross_validation_sigma, 1, 0.5);
  EXPECT_LT(c.cross_validation_m, 2e-4);
  EXPECT_GT(c.bend_m, 1e-3);  // the sheet is not flat
  EXPECT_LT(c.bend_m, 3e-3);
  // The print: 35 mm markers, 40 mm apart, in a ring of 5 x 7.
  ASSERT_EQ(c.bodies.size(), 20u);
  const auto place = [&](int id) {
    for (const CalibratedBody& b : c.bodies)
      if (b.id == id) return b.body.world_from_body.translation;
    return Eigen::Vector3d(std::nan(""), 0, 0);
  };
  EXPECT_NEAR((place(0) - place(4)).norm(), 0.160, 0.0006);
  EXPECT_NEAR((place(0) - place(30)).norm(), 0.240, 0.0012);
  EXPECT_NEAR((place(4) - place(34)).norm(), 0.240, 0.0012);
}

}  // namespace
}  // namespace lumihull::calib
