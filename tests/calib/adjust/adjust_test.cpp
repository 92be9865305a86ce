// Answers of adjust(): the truth, the definitions in its header, one answer whatever the order and the threads.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "kinds.h"

namespace lumihull {
namespace {

using calib::AdjustOptions;
using calib::AdjustResult;
using calib::BodyModel;

AdjustResult adjusted(const calib::Adjustment& start, AdjustOptions options = {}, unsigned threads = 2) {
  Job job({}, threads);
  return calib::adjust(start, options, job);
}

TEST(Adjust, ExactObservationsGiveTheTruth) {
  for (test::Kind kind : test::kinds()) {
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
