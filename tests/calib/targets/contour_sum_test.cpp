// The expansion about the nearest point beside the sum along the contour: shares, derivatives, and the answers of fits.
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "ellipse_picture.h"
#include "support.h"
#include "targets/blurred_ellipse.h"
#include "targets/contour_fit.h"
#include "targets/curved_edge.h"

namespace lumihull::calib {
namespace {

/// Eight pixels across the contour of an ellipse at angle t, `span` px to both sides.
BlurredEllipse::Pixels across(const UnitFrame& frame, double t, double span) {
  const Eigen::Vector2d u(std::cos(t), std::sin(t)), normal = (frame.inverse * u).normalized();
  BlurredEllipse::Pixels p{};
  for (int i = 0; i < kLanes; ++i) {
    const Eigen::Vector2d at = frame.center + frame.root * u + span * (i - 3.5) / 3.5 * normal;
    p.x[i] = float(at.x()), p.y[i] = float(at.y());
  }
  p.low_x = p.high_x = p.x[0], p.low_y = p.high_y = p.y[0];
  for (int i = 1; i < kLanes; ++i) {
    p.low_x = std::min(p.low_x, p.x[i]), p.high_x = std::max(p.high_x, p.x[i]);
    p.low_y = std::min(p.low_y, p.y[i]), p.high_y = std::max(p.high_y, p.y[i]);
  }
  p.side = std::abs(normal.x()) >= std::abs(normal.y())
               ? (normal.x() > 0 ? BlurredEllipse::right : BlurredEllipse::left)
               : (normal.y() > 0 ? BlurredEllipse::bottom : BlurredEllipse::top);
  return p;
}

TEST(CurvedEdge, IsTheSumToTheFourthOrderOfTheCurvature) {
  const double s = 1;
  for (const double ratio : {0.0, 0.55})
    for (const double b : {8.0, 12.0, 24.0})
      for (const double a : {b, 1.4 * b})
        for (int i = 0; i < 16; ++i) {
          const Ellipse e{{0.3, -0.2}, a, b, 0.4};
          const UnitFrame frame(e);
          BlurredEllipse sum;
          sum.set(e.center, frame.root, s, ratio);
          CurvedEdge outer, inner;
          outer.set(e.center, frame.root, s, 1, false);
          if (ratio > 0) inner.set(e.center, frame.root, s, ratio, true);
          const BlurredEllipse::Pixels pixels = across(frame, i * std::numbers::pi / 8 + 0.1, 4);
          BlurredEllipse::Share exact, quick{};
          sum.evaluate(pixels, exact);
          CurvedEdge::Foot foot, inner_foot;
          outer.find(pixels, foot);
          outer.add(pixels, foot, quick);
          if (ratio > 0) {
            inner.find(pixels, inner_foot);
            inner.add(pixels, inner_foot, quick);
          }
          const Lanes alone = sum.covered(pixels);
          const double k = s * a / (b * b) / (ratio > 0 ? ratio : 1), by_share = k * k * k * k + 3e-5,
                       by_place = 0.4 * k * k + 1e-3;
          for (int l = 0; l < kLanes; ++l) {
            SCOPED_TRACE(testing::Message()
                         << "ratio " << ratio << ", " << a << " x " << b << " px, angle " << i << ", pixel " << l);
            EXPECT_NEAR(alone[l], exact.w[l], 1e-6);
            EXPECT_NEAR(quick.w[l], exact.w[l], by_share);
            for (int c = 0; c < 2; ++c) EXPECT_NEAR(quick.by_center[c][l], exact.by_center[c][l], by_place);
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(quick.by_root[c][l], exact.by_root[c][l], by_place);
            EXPECT_NEAR(quick.by_s[l], exact.by_s[l], by_place);
            if (ratio > 0) {
              EXPECT_NEAR(quick.by_ratio[l], exact.by_ratio[l], by_place * ratio * a);
            }
          }
        }
}

TEST(ContourFit, QuickAnswersAreThoseOfTheSum) {
  struct Case {
    double minor, aspect, blur, ratio;
  };
  std::mt19937_64 random(7);
  int quick_ones = 0;
  for (const Case& c : {Case{8, .7, .8, 0},
                        {12, 1, .5, 0},
                        {12, 1, 1, 0},
                        {12, .7, 1, 0},
                        {12, 1, 1.6, 0},
                        {12, .8, 1, .55},
                        {18, .7, .8, .55},
                        {24, .6, .8, .55},
                        {40, .7, 1, 0},
                        {60, .5, 1.5, 0}})
    for (int i = 0; i < 4; ++i) {
      SCOPED_TRACE(testing::Message() << c.minor << " px, " << c.aspect << ", blur " << c.blur << ", ring " << c.ratio);
      test::EllipseScene scene = test::scene_of(c.minor, c.aspect, 0.8 * i, c.blur, random);
      if (c.ratio > 0) make_ring(scene, c.ratio);
      const LightPlane plane = noisy_plane(scene, render(scene), {64e-6, 0}, random);
      const Ellipse& truth = scene.ellipses[0].ellipse;
      const double s = std::sqrt(c.blur * c.blur + 1.0 / 12);
      ContourModel answers[2];
      ContourModel::Matrix information[2];
      for (const ContourSum sum : {ContourSum::exact, ContourSum::quick}) {
        ContourFit fit(plane, truth.center, std::sqrt(truth.a * truth.b), sum);
        ContourModel& model = answers[int(sum)];
        const Eigen::Matrix2d root = UnitFrame(truth).root;
        model.p << 0.02, -0.03, root(0, 0) + 0.03, root(0, 1), root(1, 1) - 0.02, 1.04 * s, scene.paper, -0.7, 0, 0,
            c.ratio;
        fit.gather(truth, model, {6 * s + 2, 6 * s + 2, 1.8}, 16, c.ratio, {0, 0}, false);
        ASSERT_TRUE(fit.solve(model, 20, 1e-5, 0, true));
        information[int(sum)] = fit.information();
        if (sum == ContourSum::quick) quick_ones += fit.quick();
      }
      EXPECT_LT((answers[0].center() - answers[1].center()).norm(), 3e-4);
      EXPECT_LT((answers[0].root() - answers[1].root()).norm(), 1.5e-3);
      const Eigen::Matrix2d exact = information[0].inverse().topLeftCorner<2, 2>(),
                            quick = information[1].inverse().topLeftCorner<2, 2>();
      EXPECT_LT((exact - quick).norm(), 0.03 * exact.norm());
    }
  EXPECT_GE(quick_ones, 36);
}

}  // namespace
}  // namespace lumihull::calib
