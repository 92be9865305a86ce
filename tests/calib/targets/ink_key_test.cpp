#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/ink_key.h>
#include <support.h>

#include "target_scene.h"

namespace lumihull::calib {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

struct InkKey : testing::Test {
  Camera camera = test::part_of_camera(640, 480, 800, {320, 240});
  std::vector<TargetDesign> designs{test::design_of("matrix5x5")};
  std::vector<test::PlacedTarget> targets;
  TargetSet set;

  InkKey() {
    set.designs = designs;
    const Vector2d places[] = {{130, 130}, {480, 150}, {250, 350}};
    for (int i = 0; i < 3; ++i)
      targets.push_back({0, 3 + i, test::pose_of(camera, designs[0], test::Lie{places[i], 14, 0.4, 1.0, 0.5 * i})});
  }
  Image photo() const {
    rig::PrintPhotoOptions options;
    options.blur_px = 0.7, options.noise_read = 0.005, options.shading = {.2f, -.1f};
    return test::photograph(camera, designs, targets, Vector3f(.03f, .2f, .04f), options, 5);
  }
};

TEST_F(InkKey, LearnedFromWhatWasFoundItFindsTheSame) {
  Job job({}, 1);
  const Image picture = photo();
  const Detections plain = TargetDetector(set).detect(picture, job);
  ASSERT_EQ(plain.targets.size(), targets.size());

  InkSamples samples;
  samples.add(picture, set, plain);
  DetectOptions options;
  options.ink_key = samples.train(7, job);
  EXPECT_TRUE(options.ink_key->is_object(designs[0].ink));
  EXPECT_FALSE(options.ink_key->is_object(designs[0].paper));

  const Detections keyed = TargetDetector(set, options).detect(picture, job);
  ASSERT_EQ(keyed.targets.size(), targets.size());
  for (std::size_t i = 0; i < targets.size(); ++i) {
    EXPECT_EQ(keyed.targets[i].id, plain.targets[i].id);
    ASSERT_EQ(keyed.targets[i].features.size(), plain.targets[i].features.size());
    for (std::size_t k = 0; k < plain.targets[i].features.size(); ++k)  // contours are measured in the same light
      EXPECT_LT((keyed.targets[i].features[k].pixel - plain.targets[i].features[k].pixel).norm(), 1e-3);
  }
}

TEST_F(InkKey, InkElsewhereDoesNotOutvoteIt) {
  Job job({}, 1);
  rig::PrintPhotoOptions plain;  // one colour for all of the ink, as on a page that was never printed
  Image picture = test::photograph(camera, designs, targets, Vector3f(.03f, .2f, .04f), plain, 5);
  const Detections found = TargetDetector(set).detect(picture, job);
  ASSERT_EQ(found.targets.size(), targets.size());
  for (int y = 440; y < 460; ++y)
    for (int x = 450; x < 600; ++x)
      for (int c = 0; c < 3; ++c) picture.row<std::uint8_t>(y)[3 * x + c] = designs[0].ink[std::size_t(c)];
  InkSamples samples;
  samples.add(picture, set, found);
  EXPECT_TRUE(samples.train(7, job).is_object(designs[0].ink));
}

TEST_F(InkKey, WithoutInkThereIsNoKey) {
  Job job({}, 1);
  InkSamples samples;
  samples.add(photo(), set, {});
  EXPECT_EQ(samples.ink_pixels(), 0u);
  EXPECT_EQ(test::expect_error([&] { samples.train(7, job); }).code(), ErrorCode::degenerate);
  // What no detector would say must not lead outside of the picture either.
  Detections wild;
  wild.targets.resize(2);
  wild.targets[0].features.resize(1);
  wild.targets[0].features[0].pixel = {1e9, -1e9};
  wild.targets[1].design = 9;
  wild.refused.resize(1);
  wild.refused[0].pixel = {-1e12, 5};
  wild.refused[0].size_px = 1e13;
  EXPECT_NO_THROW(samples.add(photo(), set, wild));
  EXPECT_EQ(samples.ink_pixels(), 0u);
}

}  // namespace
}  // namespace lumihull::calib
