// Answers of adjust(): the truth, the definitions in its header, one answer whatever the order and the threads.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "scenes.h"

namespace lumihull {
namespace {

using calib::AdjustOptions;
using calib::AdjustResult;
using calib::BodyModel;

AdjustResult adjusted(const calib::Adjustment& start, AdjustOptions options = {}, unsigned threads = 2) {
  Job job({}, threads);
  return calib::adjust(start, options, job);
}

struct Kind {
  const char* name;
  test::SceneMaker maker;
};

std::vector<Kind> kinds() {
  std::vector<Kind> all;
  all.push_back({"rigid", {}});
  all.push_back({"free", {.model = BodyModel::free}});
  all.push_back({"bending", {.model = BodyModel::bending, .bend = 0.3}});
  all.push_back({"rig", {.cameras = 2}});
  all.push_back({"print", {.print_scale = {1.004, 0.998}, .bars = 2}});
  all.push_back({"free with bars", {.model = BodyModel::free, .bars = 2}});
  all.push_back({"free on a rig", {.model = BodyModel::free, .cameras = 2}});
  all.push_back({"circles", {.radius = 0.009}});
  all.push_back(
      {"circles, bent, print",
       {.radius = 0.009, .model = BodyModel::bending, .bend = 0.3, .print_scale = {1.004, 0.998}, .bars = 2}});
  all.push_back({"more bodies than shots", {.shots = 5, .bodies = 14}});
  all.push_back({"free, many shots", {.shots = 40, .bodies = 6, .model = BodyModel::free, .seen = 0.7}});
  return all;
}

TEST(Adjust, ExactObservationsGiveTheTruth) {
  for (Kind kind : kinds()) {
    SCOPED_TRACE(kind.name);
    kind.maker.noise = 0;
    const test::Scene scene = test::make_scene(kind.maker, 1);
    const AdjustResult result = adjusted(scene.start, {.bend_sigma = 1e9});
    std::printf("%-24s %2d iterations, cost %.3g -> %.3g, rms %.3g px, points %.3g m, redundancy %ld\n", kind.name,
                result.iterations, result.start_cost, result.cost, result.rms_px,
                test::point_rms(result.adjusted, scene.truth, true), long(result.redundancy));
    EXPECT_TRUE(result.converged);
    EXPECT_LT(result.rms_px, 1e-8);
    EXPECT_LT(test::point_rms(result.adjusted, scene.truth, true), 1e-9);
  }
}

}  // namespace
}  // namespace lumihull
