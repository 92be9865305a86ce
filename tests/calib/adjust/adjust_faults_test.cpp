// What adjust() refuses, and that it names it.
#include <cmath>
#include <functional>
#include <limits>

#include "scenes.h"
#include "support.h"

namespace lumihull {
namespace {

using calib::Adjustment;
using calib::BodyModel;
using testing::HasSubstr;

Error refused(const Adjustment& start, const calib::AdjustOptions& options = {}) {
  return test::expect_error([&] {
    Job job({}, 1);
    calib::adjust(start, options, job);
  });
}

const Adjustment& good() {
  static const Adjustment start = test::make_scene({.shots = 6, .bodies = 4, .bars = 1}, 1).start;
  return start;
}

void expect_refused(const char* subject, const char* message, ErrorCode code,
                    const std::function<void(Adjustment&)>& spoil) {
  SCOPED_TRACE(message);
  Adjustment start = good();
  spoil(start);
  const Error error = refused(start);
  EXPECT_EQ(error.code(), code);
  EXPECT_THAT(error.subject(), HasSubstr(subject));
  EXPECT_THAT(error.message(), HasSubstr(message));
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(AdjustFaults, ValuesOutOfRange) {
  const ErrorCode invalid = ErrorCode::invalid_argument;
  expect_refused("observation 3", "no shot 6", invalid, [](Adjustment& a) { a.observations[3].shot = 6; });
  expect_refused("observation 4", "no camera 1", invalid, [](Adjustment& a) { a.observations[4].camera = 1; });
  expect_refused("observation 5", "no body 99", invalid, [](Adjustment& a) { a.observations[5].body = 99; });
  expect_refused("observation 6", "no point 25", invalid, [](Adjustment& a) { a.observations[6].point = 25; });
  expect_refused("observation 7", "finite", invalid, [](Adjustment& a) { a.observations[7].pixel.x() = kNan; });
  expect_refused("observation 8", "positive definite", invalid,
                 [](Adjustment& a) { a.observations[8].covariance(0, 0) = 0; });
  expect_refused("observation 9", "symmetric", invalid,
                 [](Adjustment& a) { a.observations[9].covariance(0, 1) += 1e-4; });
  expect_refused("shot 'shot 2'", "finite", invalid,
                 [](Adjustment& a) { a.shots[2].rig_from_world.translation.z() = kNan; });
  expect_refused("shot 'shot 2'", "unit", invalid,
                 [](Adjustment& a) { a.shots[2].rig_from_world.rotation.coeffs() *= 2; });
  expect_refused("camera 0", "first camera", invalid, [](Adjustment& a) { a.cameras[0].on_rig = true; });
  expect_refused("target 1", "needs points", invalid, [](Adjustment& a) { a.bodies[1].points.clear(); });
  expect_refused("target 1", "radius", invalid, [](Adjustment& a) { a.bodies[1].points[3].radius = -1; });
  expect_refused("target 1", "normal", invalid, [](Adjustment& a) {
    a.bodies[1].points[3].radius = 0.01;
    a.bodies[1].points[3].normal.setZero();
  });
  expect_refused("target 1", "free_places", invalid, [](Adjustment& a) { a.bodies[1].free_places.resize(3); });
  expect_refused("bar 0", "no body", invalid, [](Adjustment& a) { a.bars[0].body_b = 7; });
  expect_refused("bar 0", "no point", invalid, [](Adjustment& a) { a.bars[0].point_b = 70; });
  expect_refused("bar 0", "two points", invalid, [](Adjustment& a) { a.bars[0].body_b = a.bars[0].body_a; });
  expect_refused("bar 0", "positive", invalid, [](Adjustment& a) { a.bars[0].sigma_m = 0; });
  expect_refused("adjustment", "needs scale bars", invalid, [](Adjustment& a) { a.bars.clear(); });
  expect_refused("adjustment", "positive", invalid, [](Adjustment& a) { a.print_scale.x() = 0; });
  expect_refused("adjustment", "at least", invalid, [](Adjustment& a) { a.observations.clear(); });
  expect_refused("", "f must be positive", ErrorCode::bad_input, [](Adjustment& a) { a.cameras[0].camera.f = 0; });
}

TEST(AdjustFaults, Options) {
  for (const calib::AdjustOptions& options :
       {calib::AdjustOptions{.robust_sigma = -1}, {.bend_sigma = 0}, {.max_iterations = 0}, {.tolerance = kNan}})
    EXPECT_EQ(refused(good(), options).code(), ErrorCode::invalid_argument);
}

TEST(AdjustFaults, TooLittleIsSeen) {
  const ErrorCode degenerate = ErrorCode::degenerate;
  expect_refused("shot 'shot 3'", "no observation", degenerate,
                 [](Adjustment& a) { std::erase_if(a.observations, [](const auto& o) { return o.shot == 3; }); });
  expect_refused("body 'target 2'", "no observation", degenerate,
                 [](Adjustment& a) { std::erase_if(a.observations, [](const auto& o) { return o.body == 2; }); });
  // Two points do not hold a photograph's six unknowns.
  expect_refused("shot 'shot 3'", "too little", degenerate, [](Adjustment& a) {
    std::erase_if(a.observations, [](const auto& o) { return o.shot == 3 && !(o.body == 0 && o.point < 2); });
  });
  // A body seen along one line of its points can turn about it.
  expect_refused("body 'target 2'", "too little", degenerate, [](Adjustment& a) {
    std::erase_if(a.observations, [](const auto& o) { return o.body == 2 && o.point >= 5; });
  });
  expect_refused("scale bar 'bar 0'", "no observation", degenerate, [](Adjustment& a) {
    for (auto& body : a.bodies) body.model = BodyModel::free;
    a.free_print_scale = false;
    std::erase_if(a.observations, [](const auto& o) { return o.body == 0 && o.point == 0; });
  });
}

TEST(AdjustFaults, AFreePointSeenOnce) {
  Adjustment start = test::make_scene({.shots = 6, .bodies = 4, .model = BodyModel::free}, 2).start;
  std::erase_if(start.observations, [](const auto& o) { return o.body == 1 && o.point == 4 && o.shot != 2; });
  const Error error = refused(start);
  EXPECT_EQ(error.code(), ErrorCode::degenerate);
  EXPECT_THAT(error.subject(), HasSubstr("point 4 of body 'target 1'"));
}

TEST(AdjustFaults, PartsThatShareNothingAreNamed) {
  Adjustment start = good();
  std::erase_if(start.observations, [](const auto& o) { return (o.shot < 3) != (o.body < 2); });
  const Error error = refused(start);
  EXPECT_EQ(error.code(), ErrorCode::degenerate);
  EXPECT_THAT(error.message(), HasSubstr("2 parts"));
  EXPECT_THAT(error.message(), HasSubstr("shot 'shot 0', shot 'shot 3'"));
}

TEST(AdjustFaults, UnknownsThatCanNotBeToldApart) {
  // One photograph of one flat target: its focal length and distance.
  Adjustment start = test::make_scene({.shots = 1, .bodies = 1, .noise = 0, .off = 0}, 3).start;
  Camera& camera = start.cameras[0].camera;
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = 0;
  for (calib::Observation& o : start.observations) o.pixel = test::predicted_pixel(start, o);
  start.cameras[0].free = {true, true, false, true, true, false, false, false, false, false};
  const Error error = refused(start);
  EXPECT_EQ(error.code(), ErrorCode::degenerate);
  EXPECT_THAT(error.message(), HasSubstr("do not determine"));
}

TEST(AdjustFaults, Cancelled) {
  Job job({}, 1);
  job.cancel();
  const Error error = test::expect_error([&] { calib::adjust(good(), {}, job); });
  EXPECT_EQ(error.code(), ErrorCode::cancelled);
}

}  // namespace
}  // namespace lumihull
