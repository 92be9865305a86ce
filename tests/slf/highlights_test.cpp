#include <lumihull/base/files.h>
#include <lumihull/slf/highlights.h>

#include <cmath>

#include "support.h"

namespace lumihull {
namespace {

/// A grey picture with a soft white spot.
Image spot(const Eigen::Vector2d& at, double strength) {
  Image image(120, 100, 3);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 120; ++x)
      for (int c = 0; c < 3; ++c)
        image.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(
            60 + 150 * strength * std::exp(-(Eigen::Vector2d(x + 0.5, y + 0.5) - at).squaredNorm() / (2 * 9)));
  return image;
}

struct Case {
  std::vector<slf::ViewHighlights> truth;
  std::vector<Image> photographs, matt;
};

Case moving() {
  Case c;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector2d at(30 + 6 * i, 40 + 2 * i);
    c.truth.push_back({"view" + std::to_string(i), {{1, at, 0.5}, {0, {10, 10}, 0.1}}});
    c.photographs.push_back(spot(at, 1));
    c.matt.push_back(spot({0, 0}, 0));
  }
  return c;
}

slf::HighlightPath followed(const Case& c, const std::vector<Image>& pictures) {
  return slf::follow_highlight(pictures, c.photographs, c.matt, c.truth);
}

TEST(FollowHighlight, TruePicturesFollowTheWholeWay) {
  const Case c = moving();
  const slf::HighlightPath path = followed(c, c.photographs);
  EXPECT_EQ(path.lamp, 1);
  EXPECT_EQ(path.views, 8u);
  EXPECT_EQ(path.found, 8u);
  EXPECT_NEAR(path.true_length_px, 7 * std::hypot(6, 2), 1e-9);
  EXPECT_GT(path.share, 0.99);
  EXPECT_LT(path.rms_px, 0.2);
}

TEST(FollowHighlight, WhatStandsStillOrIsMissingDoesNot) {
  const Case c = moving();
  const slf::HighlightPath none = followed(c, c.matt);
  EXPECT_EQ(none.found, 0u);
  EXPECT_EQ(none.share, 0);
  const std::vector<Image> still(8, spot({51, 47}, 1));
  EXPECT_LT(followed(c, still).share, 0.05);
  std::vector<Image> weak;
  for (const auto& view : c.truth) weak.push_back(spot(view.highlights[0].pixel, 0.2));
  EXPECT_EQ(followed(c, weak).found, 0u);
}

TEST(FollowHighlight, HalfTheSpeedIsHalfTheWay) {
  const Case c = moving();
  std::vector<Image> slow;
  for (int i = 0; i < 8; ++i) slow.push_back(spot({51 + 3 * (i - 3.5), 47 + (i - 3.5)}, 1));
  const slf::HighlightPath path = followed(c, slow);
  // At its ends it is out of reach: 8 % of the picture's shorter side.
  EXPECT_GT(path.share, 0.2);
  EXPECT_LT(path.share, 0.55);
}

TEST(FollowHighlight, ReadsTheTruthAndSaysWhatIsWrong) {
  const test::TemporaryFolder folder;
  write_file(folder / "good.json", R"({"format": "lumihull-highlights", "version": 1, "shots": [{"name": "a",
    "highlights": [{"lamp": 2, "point": [1, 2, 3], "pixel": [4.5, 5.5], "strength": 0.25}]}, {"name": "b", "highlights": []}]})");
  const auto read = slf::read_highlights(folder / "good.json");
  ASSERT_EQ(read.size(), 2u);
  ASSERT_EQ(read[0].highlights.size(), 1u);
  EXPECT_EQ(read[0].highlights[0].lamp, 2);
  EXPECT_EQ(read[0].highlights[0].pixel, Eigen::Vector2d(4.5, 5.5));
  write_file(folder / "bad.json", R"({"format": "lumihull-highlights", "version": 1, "shots": [{"name": "a",
    "highlights": [{"lamp": 2, "pixel": [4.5], "strength": 0.25}]}]})");
  const Error e = test::expect_error([&] { slf::read_highlights(folder / "bad.json"); });
  EXPECT_EQ(e.code(), ErrorCode::bad_input);
  EXPECT_THAT(e.message(), testing::HasSubstr("/shots/0/highlights/0/pixel"));
  const Case c = moving();
  EXPECT_EQ(test::expect_error([&] { followed(c, {c.matt[0]}); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { slf::follow_highlight({}, {}, {}, {}); }).code(), ErrorCode::degenerate);
}

}  // namespace
}  // namespace lumihull
