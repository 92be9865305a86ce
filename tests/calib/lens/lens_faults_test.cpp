// What calibration says of input that can't be calibrated from, and of geometry that is weak.
#include <lumihull/calib/lens_calibration.h>

#include <limits>

#include "support.h"
#include "synthetic_views.h"

namespace lumihull::calib {
namespace {

using test::expect_error;
using test::make_views;
using test::ViewMaker;
using testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

LensCalibration calibrate(std::span<const BoardView> views, const LensCalibrationOptions& options = {}) {
  Job job({}, 1);
  return calibrate_lens(views, 1600, 1200, options, job);
}

ViewMaker ordinary() { return {.camera = test::wide_camera(), .body = test::plane_points(9, 7, 0.03), .noise = 0.1}; }

void expect_refused(std::span<const BoardView> views, ErrorCode code, const std::string& what,
                    const LensCalibrationOptions& options = {}) {
  const Error error = expect_error([&] { calibrate(views, options); });
  EXPECT_EQ(error.code(), code) << error.what();
  EXPECT_THAT(error.what(), HasSubstr(what));
}

bool any_problem(const LensCalibration& found, const std::string& what) {
  for (const std::string& problem : found.problems)
    if (problem.find(what) != std::string::npos) return true;
  return false;
}

TEST(LensFaults, NumbersThatAreNone) {
  const auto good = make_views(ordinary(), 5, 1);
  const auto spoilt = [&](const std::function<void(BoardMatch&)>& spoil) {
    auto views = good;
    spoil(views[2].matches[7]);
    return views;
  };
  constexpr ErrorCode kCode = ErrorCode::invalid_argument;
  expect_refused(spoilt([](BoardMatch& m) { m.pixel.x() = kNaN; }), kCode, "view2: match 7");
  expect_refused(spoilt([](BoardMatch& m) { m.board.z() = INFINITY; }), kCode, "view2: match 7");
  expect_refused(spoilt([](BoardMatch& m) { m.pixel.y() = 1e300; }), kCode, "below 1e7 px");
  expect_refused(spoilt([](BoardMatch& m) { m.covariance(0, 1) = 0.5; }), kCode, "symmetric and positive definite");
  expect_refused(spoilt([](BoardMatch& m) { m.covariance.setZero(); }), kCode, "symmetric and positive definite");
  expect_refused(spoilt([](BoardMatch& m) { m.radius = -1; }), kCode, "radius");
  expect_refused(spoilt([](BoardMatch& m) { m.radius = 0.01, m.normal.setZero(); }), kCode, "normal");
  Job job;
  for (const auto& [w, h] : {std::pair{0, 100}, {100, -1}, {70000, 100}})
    EXPECT_EQ(expect_error([&, w = w, h = h] { calibrate_lens(good, w, h, {}, job); }).code(), kCode);
  LensCalibrationOptions options;
  options.outlier_sigma = kNaN;
  expect_refused(good, kCode, "outlier_sigma", options);
  options = {};
  options.start = test::wide_camera();
  options.start->f = -3;
  expect_refused(good, kCode, "start from", options);
}

TEST(LensFaults, TooFewViewsAndPoints) {
  expect_refused({}, ErrorCode::degenerate, "no view");
  auto one = make_views(ordinary(), 1, 1);
  expect_refused(one, ErrorCode::degenerate, "too few views of a plane");
  auto views = make_views(ordinary(), 3, 1);
  for (BoardView& view : views) view.matches.resize(3);
  expect_refused(views, ErrorCode::degenerate, "at least 4");
  views = make_views(ordinary(), 1, 1);
  views[0].matches = {views[0].matches[0], views[0].matches[8], views[0].matches[40], views[0].matches[62]};
  expect_refused(views, ErrorCode::degenerate, "too few");
}

TEST(LensFaults, PointsOnALineAndRepeatedPoints) {
  auto views = make_views(ordinary(), 4, 2);
  for (BoardView& view : views) view.matches.resize(7);  // a row
  expect_refused(views, ErrorCode::degenerate, "line");
  views = make_views(ordinary(), 4, 2);
  for (BoardView& view : views)
    for (BoardMatch& match : view.matches) match = view.matches.front();
  expect_refused(views, ErrorCode::degenerate, "one point");
  // One such view among good ones is left out and named.
  views = make_views(ordinary(), 8, 2);
  views[3].matches.resize(7);
  const LensCalibration found = calibrate(views);
  EXPECT_FALSE(found.cam_from_board[3]);
  EXPECT_TRUE(any_problem(found, "view view3 was left out"));
}

TEST(LensFaults, AllViewsTheSameOrParallel) {
  auto views = make_views(ordinary(), 1, 3);
  for (int i = 0; i < 5; ++i) views.push_back(views.front());
  expect_refused(views, ErrorCode::degenerate, "parallel");
  ViewMaker flat = ordinary();
  flat.tilt = 0;
  expect_refused(make_views(flat, 6, 3), ErrorCode::degenerate, "parallel");
  flat.noise = 0;
  expect_refused(make_views(flat, 6, 3), ErrorCode::degenerate, "parallel");
}

TEST(LensFaults, PointsAtRandom) {
  auto views = make_views(ordinary(), 5, 4);
  std::mt19937_64 random(1);
  for (BoardView& view : views)
    for (BoardMatch& match : view.matches) match.pixel = {double(random() % 1600), double(random() % 1200)};
  Job job;
  try {
    const LensCalibration found = calibrate_lens(views, 1600, 1200, {}, job);
    EXPECT_TRUE(any_problem(found, "times what the points' covariances say") || any_problem(found, "left out"));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::degenerate);
  }
}

TEST(LensFaults, WeakGeometryIsNamed) {
  ViewMaker maker = ordinary();
  EXPECT_TRUE(any_problem(calibrate(make_views(maker, 3, 5)), "only 3 views"));
  maker.distance = 2.5;  // small, and in the middle third
  EXPECT_TRUE(any_problem(calibrate(make_views(maker, 10, 5)), "of the way to its corners"));
  maker = ordinary();
  maker.tilt = 0.1;
  maker.noise = 0.5;
  const LensCalibration flat = calibrate(make_views(maker, 8, 6));
  EXPECT_TRUE(any_problem(flat, "parallel to within"));
  EXPECT_TRUE(any_problem(flat, "% only"));
  maker = ordinary();
  auto views = make_views(maker, 12, 7);
  for (BoardView& view : views)
    for (BoardMatch& match : view.matches) match.covariance *= 0.01;
  EXPECT_TRUE(any_problem(calibrate(views), "times what the points' covariances say"));
  EXPECT_TRUE(calibrate(make_views(ordinary(), 20, 8)).problems.empty());
}

TEST(LensFaults, CancelledIsCancelled) {
  const auto views = make_views(ordinary(), 5, 1);
  Job job;
  job.cancel();
  EXPECT_EQ(expect_error([&] { calibrate_lens(views, 1600, 1200, {}, job); }).code(), ErrorCode::cancelled);
}

}  // namespace
}  // namespace lumihull::calib
