// The same optimum as an independent formulation reaches.
#include <gtest/gtest.h>

#include "ceres_bundle.h"
#include "kinds.h"

namespace lumihull {
namespace {

calib::AdjustResult adjusted(const calib::Adjustment& start, const calib::AdjustOptions& options) {
  Job job({}, 2);
  return calib::adjust(start, options, job);
}

void expect_one_optimum(const calib::Adjustment& start, const calib::AdjustOptions& options) {
  const calib::AdjustResult ours = adjusted(start, options);
  EXPECT_TRUE(ours.converged);
  const test::CeresAnswer theirs = test::adjust_by_ceres(start, options, {});
  EXPECT_NEAR(ours.start_cost, theirs.start_cost, 1e-9 * theirs.start_cost);
  EXPECT_NEAR(ours.cost, theirs.cost, 1e-8 * theirs.cost);
  // From our answer there is nowhere to go.
  const test::CeresAnswer again = test::adjust_by_ceres(ours.adjusted, options, {.max_iterations = 5});
  EXPECT_NEAR(again.start_cost, ours.cost, 1e-9 * ours.cost);
  EXPECT_GT(again.cost, (1 - 1e-8) * ours.cost);
  // The same places, to a thousandth of what noise does to them.
  EXPECT_LT(test::point_rms(ours.adjusted, theirs.adjusted, true), 1e-7);
}

TEST(AdjustCeres, OneOptimum) {
  for (test::Kind kind : test::kinds()) {
    if (kind.maker.radius > 0) continue;
    SCOPED_TRACE(kind.name);
    kind.maker.shots = std::min(kind.maker.shots, 12);
    expect_one_optimum(test::make_scene(kind.maker, 11).start, {});
  }
}

TEST(AdjustCeres, OneOptimumUnderARobustLoss) {
  test::Scene scene = test::make_scene({}, 12);
  for (std::size_t i = 0; i < scene.start.observations.size(); i += 50)
    scene.start.observations[i].pixel += Eigen::Vector2d(3, -2);
  // The loss has no curvature left far out: both come from near by.
  scene.start = adjusted(scene.start, {}).adjusted;
  expect_one_optimum(scene.start, {.robust_sigma = 2});
}

TEST(AdjustCeres, OneOptimumWithCirclesAndWithoutDistortion) {
  for (const bool print : {false, true}) {
    test::SceneMaker maker{.radius = 0.009, .cameras = 2, .free_lens = false};
    if (print) maker.print_scale = {1.003, 0.999}, maker.bars = 2;
    test::Scene scene = test::make_scene(maker, 13);
    for (calib::AdjustedCamera& camera : scene.start.cameras)
      camera.camera.k1 = camera.camera.k2 = camera.camera.p1 = camera.camera.p2 = 0;
    std::size_t i = 0;
    for (calib::AdjustedCamera& camera : scene.truth.cameras) camera.camera = scene.start.cameras[i++].camera;
    for (calib::Observation& o : scene.start.observations) {
      const Eigen::Vector2d pixel = test::predicted_pixel(scene.truth, o);
      o.pixel =
          pixel + Eigen::Vector2d(0.05 * std::sin(1.0 * o.point + o.shot), 0.05 * std::cos(3.0 * o.point + o.body));
    }
    expect_one_optimum(scene.start, {});
  }
}

}  // namespace
}  // namespace lumihull
