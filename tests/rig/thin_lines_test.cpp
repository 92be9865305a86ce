// Cables through the picture.
#include "photograph/thin_lines.h"

#include "rig_support.h"

namespace lumihull::rig {
namespace {

/// What a line covers of each pixel: black over white.
struct Covered {
  Image part;
  double sum = 0;
};

class ThinLines : public testing::Test {
 protected:
  ThinLines()
      : scene_(make_scene(make_sphere(.4, 4), kGreenPaint, false, 1)), lit_(scene_, test::coarse_light(), job_) {
    view_.camera = sensor_camera(600, 18, kSensorWidth_mm, 0);
    middle_ = scene_.center().cast<double>();
    view_.cam_from_world = look_at(middle_ + Eigen::Vector3d(1.2, 0, 0), middle_, {0, 0, 1});
  }
  Covered draw(const Eigen::Vector3d& from_cam, const Eigen::Vector3d& to_cam, double radius, double blur = 0,
               const PhotoOptions& lens = {}) const {
    const Pose world_from_cam = view_.cam_from_world.inverse();
    return draw({world_from_cam * from_cam, world_from_cam * to_cam, float(radius), {0, 0, 0}}, blur, lens);
  }
  Covered draw(const ThinLine& line, double blur = 0, const PhotoOptions& lens = {}) const {
    Image light(view_.camera.width, view_.camera.height, 3, PixelType::f32);
    for (int y = 0; y < light.height(); ++y)
      for (int i = 0; i < 3 * light.width(); ++i) light.row<float>(y)[i] = 1;
    add_lines(lit_, view_, {&line, 1}, Shutter(view_, lens, {}, 1.2), blur, light);
    Covered out{Image(light.width(), light.height(), 1, PixelType::f32), 0};
    for (int y = 0; y < light.height(); ++y)
      for (int x = 0; x < light.width(); ++x)
        out.sum += double(out.part.row<float>(y)[x] = 1 - light.row<float>(y)[3 * x]);
    return out;
  }

  Job job_;
  Scene scene_;
  LitScene lit_;
  View view_;
  Eigen::Vector3d middle_;
};

TEST_F(ThinLines, CoverWhatTheirOutlineDoes) {
  const double f = view_.camera.f;
  // Across the sight above the object, .6 m away: a strip of constant width.
  const Covered flat = draw({-.1, -.14, .6}, {.12, -.12, .6}, .0008);
  // A cylinder's outline touches it where the line of sight does, which off the axis is not where it is widest across
  // the axis: wider by the angle at which the eye's plane through the line stands off the axis.
  const double away = .13 / std::hypot(.6, .13);
  const double length = std::hypot(.22, .02) * f / .6, width = 2 * .0008 * f / .6 / std::sqrt(1 - away * away);
  EXPECT_NEAR(flat.sum, length * width, 2e-3 * length * width);
  // Each pixel by itself: a strip's coverage from signed distances to its middle, by 40 x 40 points.
  const Eigen::Vector2d a(f * -.1 / .6 + view_.camera.u0, f * -.14 / .6 + view_.camera.v0),
      b(f * .12 / .6 + view_.camera.u0, f * -.12 / .6 + view_.camera.v0);
  const Eigen::Vector2d along = (b - a).normalized(), across(-along.y(), along.x());
  for (int x = int(a.x()) + 3; x < int(b.x()) - 3; x += 7)
    for (int y = int(a.y()) - 3; y <= int(b.y()) + 3; ++y) {
      int in = 0;
      for (int i = 0; i < 1600; ++i)
        in += std::fabs(across.dot(Eigen::Vector2d(x + (i % 40 + .5) / 40, y + (i / 40 + .5) / 40) - a)) < width / 2;
      EXPECT_NEAR(flat.part.row<float>(y)[x], in / 1600., .02) << x << ", " << y;
    }
  // Along the depth it tapers: in the plane of the optical axis the mean of the width is that of 1 / z.
  const Covered deep = draw({0, -.14, .5}, {0, -.30, 1.3}, .001);
  const double mean = .001 * f * (1 / .5 + 1 / 1.3);
  EXPECT_NEAR(deep.sum, f * (.14 / .5 - .30 / 1.3) * mean, 3e-3 * deep.sum);
  // Blur spreads, it does not add.
  EXPECT_NEAR(draw({-.1, -.14, .6}, {.12, -.12, .6}, .0008, 1.5).sum, flat.sum, 2e-3 * flat.sum);
}

TEST_F(ThinLines, AreOutOfFocusByTheirDepth) {
  const double f = view_.camera.f, blur = .6;
  PhotoOptions lens;
  lens.f_number = 2, lens.focus_m = .9;
  const double image_m = 1e-3 * f * lens.sensor_width_mm / view_.camera.width;
  const double opening_m = 1 / (1 / image_m + 1 / lens.focus_m) / lens.f_number;
  for (const double depth : {.3, .45, .9}) {
    // Level, above the object: each column holds the same strip.
    const double y = -.16 * depth, x = .3 * depth;
    const auto spread = [&](const Covered& c) {
      double sum = 0, first = 0, second = 0;
      const int column = view_.camera.width / 2;
      for (int row = 0; row < view_.camera.height; ++row) {
        const double part = double(c.part.row<float>(row)[column]);
        sum += part, first += part * row, second += part * row * row;
      }
      return std::pair(sum, second / sum - first * first / (sum * sum));
    };
    const auto [sharp_sum, sharp] = spread(draw({-x, y, depth}, {x, y, depth}, .001 * depth, 0));
    const auto [sum, wide] = spread(draw({-x, y, depth}, {x, y, depth}, .001 * depth, blur, lens));
    const double confusion = f * opening_m * std::fabs(1 / depth - 1 / lens.focus_m);  // its second moment: d² / 16
    EXPECT_NEAR(wide - sharp, blur * blur + confusion * confusion / 16, .03 * (wide - sharp)) << depth;
    EXPECT_NEAR(sum, sharp_sum, 2e-3 * sharp_sum) << depth;
    if (depth < .5) {
      EXPECT_GT(wide - sharp, 1.5 * blur * blur) << "nothing was out of focus";
    }
  }
  // Out of one sharp plane into another's blur: spread, not added.
  const Covered in = draw({0, -.14, .4}, {0, -.30, 1.3}, .001, blur),
                out = draw({0, -.14, .4}, {0, -.30, 1.3}, .001, blur, lens);
  EXPECT_NEAR(out.sum, in.sum, 5e-3 * in.sum);
}

TEST_F(ThinLines, FollowTheLens) {
  const Covered straight = draw({-.4, -.14, .6}, {.4, -.14, .6}, .001);
  view_.camera = sensor_camera(600, 18, kSensorWidth_mm, 1);
  const Covered bent = draw({-.4, -.14, .6}, {.4, -.14, .6}, .0025);
  for (const double wanted : {60.5, 150.5, 300.5, 520.5}) {
    // The line's point in the middle of a column.
    double low = -.4, high = .4;
    for (int i = 0; i < 60; ++i)
      (view_.camera.project({(low + high) / 2, -.14, .6})->x() < wanted ? low : high) = (low + high) / 2;
    const auto px = view_.camera.project({low, -.14, .6});
    ASSERT_TRUE(px);
    // Both borders, from how much of the column is covered above and below a row that is wholly covered.
    const int middle = int(px->y());
    double above = 0, below = 0;
    for (int y = 0; y < view_.camera.height; ++y)
      (y < middle ? above : below) += double(bent.part.row<float>(y)[int(px->x())]);
    ASSERT_GT(above + below, .5);
    EXPECT_GT(bent.part.row<float>(middle)[int(px->x())], .999);
    EXPECT_NEAR(middle + .5 * (below - above), px->y(), .01);
  }
  EXPECT_GT(straight.sum, 100);
}

TEST_F(ThinLines, AreHiddenByWhatStandsBefore) {
  // Through the object's middle, from side to side of the picture.
  const Covered before = draw({-.3, .01, .5}, {.3, .01, .5}, .002),
                behind = draw({-.9, .01, 1.9}, {.9, .01, 1.9}, .006);
  const auto at = [&](const Covered& c, double x, double z) {
    const auto px = view_.camera.project({x, .01, z});
    return c.part.row<float>(int(px->y()))[int(px->x())];
  };
  EXPECT_GT(at(before, 0, .5), .9);
  EXPECT_EQ(at(behind, 0, 1.9), 0);
  EXPECT_GT(at(behind, .6, 1.9), .9);
  // Half of it is in the object.
  const Covered into = draw({0, -.01, .3}, {.01, .01, 1.2}, .001);
  EXPECT_GT(into.sum, 5);
  EXPECT_EQ(at(into, 0.01, 1.2), 0);
}

TEST_F(ThinLines, EndAtTheWallsAndBehindTheEye) {
  EXPECT_EQ(draw({0, 0, -2}, {.1, 0, -.1}, .01).sum, 0);
  EXPECT_EQ(draw({2, 0, .1}, {3, 0, .2}, .01).sum, 0);  // beside the picture
  const ThinLine outside{{-50, 0, 1}, {-60, 1, 1}, .1f, {0, 0, 0}};
  EXPECT_EQ(draw(outside).sum, 0);
  const ThinLine none{{0, 0, 1}, {0, 0, 1}, .1f, {0, 0, 0}};
  EXPECT_EQ(draw(none).sum, 0);
  // Through the eye, and past it.
  const Pose world_from_cam = view_.cam_from_world.inverse();
  const ThinLine eye{world_from_cam * Eigen::Vector3d(0, 0, 0), world_from_cam * Eigen::Vector3d(0, 0, 1), .01f, {}};
  EXPECT_EQ(draw(eye).sum, 0);
  EXPECT_GT(draw({.01, .05, -.5}, {-.01, -.1, .8}, .001).sum, 1);
}

}  // namespace
}  // namespace lumihull::rig
