#include "real_boards.h"

#include <cstdio>
#include <cstdlib>

#include "support.h"
#include "zhang_model.h"

namespace lumihull::calib {
namespace {

LensCalibration calibrate(std::span<const BoardView> views, int width, int height,
                          std::initializer_list<Intrinsic> free) {
  LensCalibrationOptions options;
  options.free.fill(false);
  for (const Intrinsic i : free) options.free[std::size_t(i)] = true;
  options.robust = false;  // as the programs that it is compared with
  Job job;
  return calibrate_lens(views, width, height, options, job);
}

using enum Intrinsic;

TEST(RealBoards, ZhangsPublishedAnswerInHisModelAndOursIsNoWorse) {
  LUMIHULL_NEED_REAL_DATA(folder, "zhang");
  const auto views = test::zhang_views(folder);
  ASSERT_EQ(views.size(), 5u);
  for (const BoardView& view : views) ASSERT_EQ(view.matches.size(), 256u);
  const LensCalibration ours = calibrate(views, 640, 480, {f, s, skew, u0, v0, k1, k2});

  test::ZhangModel start;
  start.alpha = ours.camera.s * ours.camera.f, start.beta = ours.camera.f;
  start.u0 = ours.camera.u0, start.v0 = ours.camera.v0;
  for (const auto& pose : ours.cam_from_board) start.cam_from_board.push_back(pose.value());
  const test::ZhangModel his = test::adjust_zhang_model(views, start);
  // Published: 832.5 0.204494 832.53 303.959 206.585, -0.228601 0.190353.
  EXPECT_NEAR(his.alpha, 832.50, 0.01);
  EXPECT_NEAR(his.beta, 832.53, 0.01);
  EXPECT_NEAR(his.gamma, 0.204494, 2e-4);
  EXPECT_NEAR(his.u0, 303.959, 0.001);
  EXPECT_NEAR(his.v0, 206.585, 0.001);
  EXPECT_NEAR(his.k1, -0.228601, 2e-5);
  EXPECT_NEAR(his.k2, 0.190353, 2e-5);
  // His polynomial goes from the ray to the picture, ours the other way: with as many parameters they are equal to 1e-4
  // px. Ours as it is used, with tangential terms and square pixels, is the better one.
  EXPECT_NEAR(ours.rms_px, his.rms_px, 1e-4);
  EXPECT_LE(calibrate(views, 640, 480, {f, u0, v0, k1, k2, p1, p2}).rms_px, his.rms_px);
}

TEST(RealBoards, ChessboardsAgreeWithOpenCv) {
  LUMIHULL_NEED_REAL_DATA(folder, "chessboards");
  for (const std::string side : {"left", "right"}) {
    SCOPED_TRACE(side);
    const test::ChessboardViews views = test::chessboard_views(folder, side);
    EXPECT_GE(views.ours.size(), 12u);
    for (const auto* corners : {&views.opencv, &views.ours}) {
      const auto theirs = test::opencv_calibration(*corners, views.width, views.height, true);
      auto same = *corners;
      for (BoardView& view : same)
        for (BoardMatch& match : view.matches) match.covariance.setIdentity();
      const LensCalibration ours = calibrate(same, views.width, views.height, {f, s, u0, v0, k1, k2, k3, p1, p2});
      const LensCalibration weighted =
          calibrate(*corners, views.width, views.height, {f, s, u0, v0, k1, k2, k3, p1, p2});
      const double fx = ours.camera.s * ours.camera.f;
      if (std::getenv("LUMIHULL_VERBOSE"))
        std::printf(
            "%s %s corners: %zu views; OpenCV rms %.4f fx %.3f +- %.3f fy %.3f c %.2f %.2f; ours rms %.4f fx %.3f fy "
            "%.3f +- %.3f c %.2f %.2f; weighted rms %.4f f %.3f sigma0 %.2f cv %.3f %.2f\n",
            side.c_str(), corners == &views.ours ? "our" : "OpenCV's", corners->size(), theirs.rms_px, theirs.fx,
            theirs.fx_sigma, theirs.fy, theirs.cx, theirs.cy, ours.rms_px, fx, ours.camera.f,
            std::sqrt(ours.covariance(0, 0)) * ours.sigma0, ours.camera.u0, ours.camera.v0, weighted.rms_px,
            weighted.camera.f, weighted.sigma0, weighted.cross_validation_px, weighted.cross_validation_sigma);
      EXPECT_LT(ours.rms_px, 1.005 * theirs.rms_px);
      EXPECT_LT(std::abs(fx - theirs.fx), 2 * theirs.fx_sigma);
    }
  }
}

}  // namespace
}  // namespace lumihull::calib
