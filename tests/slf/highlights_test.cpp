#include <lumihull/slf/highlights.h>

#include <cmath>
#include <functional>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kViews = 6;

/// A wall, z = 0, past which the camera moves, and two highlights that move over it, one faster than the other.
hull::Mesh wall() {
  hull::Mesh mesh;
  mesh.vertices = {{-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

View view(int i) {
  Pose pose;
  pose.translation = Vector3d(0.1 - 0.04 * i, 0, 2);
  return {test::camera(400, 300, 400), pose};
}

Vector3d first(double i) { return {-0.35 + 0.05 * i, -0.3, 0}; }
Vector3d second(double i) { return {0.3, 0.3 - 0.04 * i, 0}; }

struct Spot {
  Vector3d place;
  double strength;
};

/// Spots of light, alone or on top of grey paint.
Image picture(int i, const std::vector<Spot>& spots, bool alone = false) {
  Image image(400, 300, 3);
  std::vector<float> light(400 * 300, alone ? 0 : 0.2f);
  for (const Spot& s : spots) {
    const Vector2d middle = *view(i).project(s.place);
    for (int y = std::max(0, int(middle.y()) - 20); y < std::min(300, int(middle.y()) + 20); ++y)
      for (int x = std::max(0, int(middle.x()) - 20); x < std::min(400, int(middle.x()) + 20); ++x)
        light[std::size_t(400 * y + x)] +=
            float(s.strength * std::exp(-(Vector2d(x + 0.5, y + 0.5) - middle).squaredNorm() / (2 * 3.5 * 3.5)));
  }
  for (std::size_t k = 0; k < light.size(); ++k) {
    const auto byte = std::byte(255 * srgb_from_linear(std::min(light[k], 1.0f)) + 0.5f);
    for (std::size_t c = 0; c < 3; ++c) image.data()[3 * k + c] = byte;
  }
  return image;
}

/// Now this, now that one is the strongest.
std::vector<Spot> truth(int i) { return {{first(i), i % 2 ? 0.5 : 0.3}, {second(i), 0.4}}; }

using Method = std::function<std::vector<Spot>(int)>;

std::map<std::string, slf::HighlightPath> judged(const Method& method) {
  slf::HighlightJudge judge(wall());
  for (int i = 0; i < kViews; ++i) {
    judge.add_view(view(i), picture(i, {}), picture(i, truth(i), true), picture(i, truth(i)));
    judge.add_picture("method", picture(i, method(i)));
  }
  return judge.paths();
}

TEST(HighlightJudge, PhotographsGoTheWholeWayWhicheverIsTheStrongest) {
  const auto paths = judged(truth);
  for (const char* name : {"photograph", "method"}) {
    const slf::HighlightPath& path = paths.at(name);
    EXPECT_EQ(path.tracks, 2u);
    EXPECT_EQ(path.places, 2u * kViews);
    EXPECT_EQ(path.found, path.places);
    // 400 px / 2 m: 10 and 8 px a view over the wall, whatever way the camera goes.
    EXPECT_NEAR(path.true_length_px, (kViews - 1) * 18, 1);
    EXPECT_GT(path.share, 0.98);
    EXPECT_LT(path.rms_px, 0.2);
  }
}

TEST(HighlightJudge, HalfTheSpeedIsHalfTheWay) {
  const double middle = (kViews - 1) / 2.;
  for (const double speed : {0.25, 0.5, 0.75}) {
    const auto at = [&](int i) { return middle + speed * (i - middle); };
    const auto paths = judged([&](int i) -> std::vector<Spot> { return {{first(at(i)), 0.4}, {second(at(i)), 0.4}}; });
    // At the ends of the way they are too far behind to be found.
    const slf::HighlightPath& path = paths.at("method");
    if (speed < 0.5)
      EXPECT_LT(path.share, speed + 0.03);
    else
      EXPECT_NEAR(path.share, speed, 0.03) << path.found;
  }
}

TEST(HighlightJudge, WhatIsPaintedOnTheSurfaceGoesNoWay) {
  // It moves in the picture, as the camera does, and some of it is always near a true highlight.
  std::vector<Spot> paint;
  for (int k = 0; k < kViews; ++k) paint.push_back({first(k), 0.35}), paint.push_back({second(k), 0.35});
  for (const double spacing : {0.12, 0.25}) {
    std::vector<Spot> apart;
    for (double k = -5; k < 6; ++k)
      apart.push_back({{spacing * k, -0.3, 0}, 0.35}), apart.push_back({{0.3, spacing * k, 0}, 0.35});
    const auto path = judged([&](int) { return apart; }).at("method");
    EXPECT_GT(path.found, path.places / 3);
    EXPECT_LT(path.share, 0.03) << spacing;
  }
  EXPECT_LT(judged([&](int) { return paint; }).at("method").share, 0.05);
}

TEST(HighlightJudge, WhatFadesFromOnePlaceToTheNextDoesNotMove) {
  // As photographs of every third view, blended.
  const auto path = judged([](int i) -> std::vector<Spot> {
                      const int before = i / 3 * 3;
                      const double part = (i - before) / 3.;
                      return {{first(before), 0.4 * (1 - part)},
                              {first(before + 3), 0.4 * part},
                              {second(before), 0.4 * (1 - part)},
                              {second(before + 3), 0.4 * part}};
                    }).at("method");
  EXPECT_GT(path.found, path.places / 2);
  EXPECT_LT(path.share, 0.45);  // one step of three, when the other one is nearer
}

TEST(HighlightJudge, WhatIsMissingOrWeakIsNotFound) {
  const auto none = judged([](int) { return std::vector<Spot>(); }).at("method");
  EXPECT_EQ(none.found, 0u);
  EXPECT_EQ(none.share, 0);
  const auto weak = judged([](int i) -> std::vector<Spot> { return {{first(i), 0.06}, {second(i), 0.06}}; });
  EXPECT_EQ(weak.at("method").found, 0u);
  const auto one = judged([](int i) -> std::vector<Spot> { return {{first(i), 0.4}}; }).at("method");
  EXPECT_EQ(one.found, std::size_t(kViews));
  EXPECT_NEAR(one.share, 0.5, 0.1);
}

TEST(HighlightJudge, WhatThePhotographsDoNotShowIsNotAsked) {
  slf::HighlightJudge judge(wall());
  for (int i = 0; i < kViews; ++i)
    judge.add_view(view(i), picture(i, {}), picture(i, truth(i), true), picture(i, {truth(i)[1]}));
  const auto paths = judge.paths();
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(paths.at("photograph").tracks, 1u);
  EXPECT_NEAR(paths.at("photograph").true_length_px, (kViews - 1) * 8, 1);

  slf::HighlightJudge nothing(wall());
  for (int i = 0; i < 2; ++i) nothing.add_view(view(i), picture(i, {}), picture(i, {}, true), picture(i, {}));
  EXPECT_TRUE(nothing.paths().empty());
}

TEST(HighlightJudge, WhatPaintCouldFakeIsNotAsked) {
  // On stripes of 6 px: a picture that is off by a pixel differs by more than a faint highlight.
  const auto striped = [](int i, double strength) {
    Image image = picture(i, {});
    const Image gloss = picture(i, {{first(i), strength}, {second(i), strength}}, true);
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < 3 * image.width(); ++x) {
        const float light =
            linear_from_srgb(float(gloss.row<std::uint8_t>(y)[x]) / 255) + ((x / 3 + y) / 6 % 2 ? 0.15f : 0.4f);
        image.row<std::uint8_t>(y)[x] = std::uint8_t(std::lround(255 * srgb_from_linear(std::min(light, 1.0f))));
      }
    return image;
  };
  for (const double strength : {0.05, 0.5}) {
    slf::HighlightJudge judge(wall());
    for (int i = 0; i < kViews; ++i)
      judge.add_view(view(i), striped(i, 0), picture(i, {{first(i), strength}, {second(i), strength}}, true),
                     striped(i, strength));
    const auto paths = judge.paths();
    if (strength < 0.1)
      EXPECT_TRUE(paths.empty());
    else
      EXPECT_EQ(paths.at("photograph").tracks, 2u);
  }
}

TEST(HighlightJudge, SaysWhatItNeeds) {
  slf::HighlightJudge judge(wall());
  const auto refused = [](const std::function<void()>& act) {
    EXPECT_EQ(test::expect_error(act).code(), ErrorCode::invalid_argument);
  };
  refused([&] { judge.add_picture("method", picture(0, {})); });
  refused([&] { judge.add_view(view(0), picture(0, {}), Image(400, 300, 1), picture(0, {})); });
  refused([&] { judge.add_view(view(0), picture(0, {}), picture(0, {}), Image(300, 400, 3)); });
  judge.add_view(view(0), picture(0, {}), picture(0, truth(0), true), picture(0, truth(0)));
  refused([&] { judge.add_picture("photograph", picture(0, {})); });
  refused([&] { judge.add_picture("method", Image(10, 10, 3)); });
  judge.add_picture("method", picture(0, {}));
  refused([&] { judge.add_picture("method", picture(0, {})); });
  judge.add_view(view(1), picture(1, {}), picture(1, truth(1), true), picture(1, truth(1)));
  judge.add_view(view(2), picture(2, {}), picture(2, truth(2), true), picture(2, truth(2)));
  refused([&] { judge.add_picture("method", picture(2, {})); });
  EXPECT_EQ(judge.paths().count("method"), 0u);
}

}  // namespace
}  // namespace lumihull
