// Point grids in photographs by the virtual rig, whose truth is known.
#include <lumihull/calib/board_views.h>
#include <lumihull/calib/point_grids.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "support.h"
#include "synthetic_views.h"

namespace lumihull::calib {
namespace {

struct Scene {
  PointGrid grid;
  Camera camera;
  Pose cam_from_grid;
  Image photo;
};

Scene scene_of(PointGrid::Kind kind, int columns, int rows, double tilt, double turn,
               const rig::PrintPhotoOptions& options, std::uint64_t seed) {
  Scene s;
  s.grid = {.kind = kind, .columns = columns, .rows = rows, .spacing_m = 0.025};
  s.camera = test::wide_camera();
  s.camera.width = 800, s.camera.height = 600, s.camera.f = 650, s.camera.u0 = 405, s.camera.v0 = 296;
  const Eigen::Vector3d middle(0.5 * (columns - 1) * 0.025, 0.5 * (rows - 1) * 0.025, 0);
  s.cam_from_grid.rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d(1, 0.4, 0).normalized()) *
                             Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
  s.cam_from_grid.translation =
      Eigen::Vector3d(0.01, -0.005, 0.042 * std::max(columns, rows)) - s.cam_from_grid.rotation * middle;
  rig::FlatPrint print = rig::print_of(s.grid, {.03f, .03f, .03f}, {.8f, .8f, .8f});
  const View view{s.camera, s.cam_from_grid};
  s.photo = rig::photograph_prints(view, std::span(&print, 1), {.3f, .3f, .3f}, options, seed);
  return s;
}

/// Mean squared distance from the truth, and in units of the covariances; every point is there.
void expect_measured(const Scene& s, const Detection& found, double rms_limit, double mahalanobis_limit) {
  const BoardView view = grid_view(s.grid, found, "photo");
  ASSERT_EQ(view.matches.size(), std::size_t(s.grid.columns) * std::size_t(s.grid.rows));
  double squares = 0, mahalanobis = 0;
  for (const BoardMatch& m : view.matches) {
    const auto truth = s.camera.project(s.cam_from_grid * m.board);
    ASSERT_TRUE(truth);
    const Eigen::Vector2d error = m.pixel - *truth;
    squares += error.squaredNorm();
    mahalanobis += error.dot(m.covariance.inverse() * error);
  }
  const double n = double(view.matches.size());
  EXPECT_LT(std::sqrt(squares / n), rms_limit);
  EXPECT_LT(mahalanobis / n, mahalanobis_limit);
  if (std::getenv("LUMIHULL_VERBOSE"))
    std::printf("rms %.4f, Mahalanobis2 %.2f\n", std::sqrt(squares / n), mahalanobis / n);
}

TEST(PointGrids, ChessboardCornersToHundredths) {
  Job job;
  for (const double tilt : {0.0, 0.4, 0.8}) {
    SCOPED_TRACE(tilt);
    rig::PrintPhotoOptions options;
    options.blur_px = 0.9;
    options.noise_read = 0.005;
    options.noise_shot = 2e-5;
    const Scene s = scene_of(PointGrid::Kind::chessboard, 9, 6, tilt, 0.2, options, 3);
    const auto found = find_point_grid(s.photo, s.grid, job);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->id, -1);
    expect_measured(s, *found, 0.008, 3);
  }
}

TEST(PointGrids, TheFirstFieldIsDarkHoweverTheCameraIsHeld) {
  Job job;
  for (const double turn : {0.0, 1.57, 3.14, 4.71}) {
    SCOPED_TRACE(turn);
    const Scene s = scene_of(PointGrid::Kind::chessboard, 8, 5, 0.4, turn, {.blur_px = 0.8}, 3);
    const auto found = find_point_grid(s.photo, s.grid, job);
    ASSERT_TRUE(found);
    expect_measured(s, *found, 0.005, 1e9);  // columns + rows is odd: the numbering is the board's own
  }
}

TEST(PointGrids, EvenBoardsBeginNearestToTheCorner) {
  Job job;
  const Scene s = scene_of(PointGrid::Kind::chessboard, 8, 6, 0.3, 3.0, {.blur_px = 0.8}, 3);
  const auto found = find_point_grid(s.photo, s.grid, job);
  ASSERT_TRUE(found);
  EXPECT_LT(found->features.front().pixel.norm(), found->features.back().pixel.norm());
  EXPECT_GT(found->pixel_from_target.determinant(), 0);  // not mirrored
}

TEST(PointGrids, CirclesCalibrateTheCamera) {
  Job job;
  std::vector<BoardView> views;
  Camera truth;
  int seed = 0;
  for (const double tilt : {0.5, -0.5, 0.6, -0.4, 0.3})
    for (const double turn : {0.1, 1.4}) {
      const Scene s = scene_of(PointGrid::Kind::circles, 8, 7, tilt, turn, {.blur_px = 0.8, .noise_read = 0.005},
                               std::uint64_t(++seed));
      truth = s.camera;
      if (const auto found = find_point_grid(s.photo, s.grid, job))
        views.push_back(grid_view(s.grid, *found, std::to_string(seed)));
    }
  ASSERT_GE(views.size(), 8u);
  const LensCalibration found = calibrate_lens(views, truth.width, truth.height, {}, job);
  if (std::getenv("LUMIHULL_VERBOSE"))
    std::printf("circles: views %zu rms %.4f sigma0 %.2f f %.3f +- %.3f\n", views.size(), found.rms_px, found.sigma0,
                found.camera.f, std::sqrt(found.covariance(0, 0)));
  EXPECT_LT(found.rms_px, 0.005);
  EXPECT_NEAR(found.sigma0, 1, 0.2);
  EXPECT_LT(std::abs(found.camera.f - truth.f), 5 * std::sqrt(found.covariance(0, 0)));
}

TEST(PointGrids, NothingWhereThereIsNone) {
  Job job;
  const PointGrid grid{.columns = 9, .rows = 6, .spacing_m = 0.02};
  for (const auto& [w, h] : {std::pair{1, 1}, {3, 2}, {40, 30}, {300, 200}}) {
    Image photo(w, h, 3);
    EXPECT_FALSE(find_point_grid(photo, grid, job));
    PointGrid circles = grid;
    circles.kind = PointGrid::Kind::circles;
    EXPECT_FALSE(find_point_grid(photo, circles, job));
  }
  EXPECT_EQ(test::expect_error([&] { find_point_grid({}, grid, job); }).code(), ErrorCode::invalid_argument);
  const Image photo(30, 30, 1);
  for (const PointGrid& bad :
       {PointGrid{.columns = 2, .rows = 6, .spacing_m = 1}, PointGrid{.columns = 9, .rows = 101, .spacing_m = 1},
        PointGrid{.columns = 9, .rows = 6, .spacing_m = NAN}})
    EXPECT_EQ(test::expect_error([&] { find_point_grid(photo, bad, job); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::calib
