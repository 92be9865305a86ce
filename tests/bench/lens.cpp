// Lens calibration beside OpenCV's calibrateCamera and mrcal: accuracy and time on views of known truth, and on
// photographs of a chessboard. bench_lens [FOLDER of the chessboards]
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "../calib/lens/real_boards.h"
#include "../calib/lens/synthetic_views.h"

namespace {

using namespace lumihull;
using calib::Intrinsic;

double cpu_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

/// Which parameters OpenCV estimates: fx, fy, cx, cy, k1, k2, p1, p2 and, where wanted, k3.
calib::LensCalibrationOptions like_opencv(bool k3) {
  calib::LensCalibrationOptions options;
  options.free[std::size_t(Intrinsic::s)] = true;
  options.free[std::size_t(Intrinsic::k3)] = k3;
  options.robust = false;
  return options;
}

/// A lens without distortion is in both programs' models.
void synthetic() {
  Camera truth = test::wide_camera();
  truth.k1 = truth.k2 = truth.p1 = truth.p2 = 0;
  constexpr int kTrials = 30;
  double error[2] = {0, 0}, claimed[2] = {0, 0}, seconds[2] = {0, 0}, robust_seconds = 0, validated = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const test::ViewMaker maker{.camera = truth, .body = test::plane_points(10, 10, 0.03), .noise = 0.1};
    auto views = test::make_views(maker, 20, std::uint64_t(trial + 1));
    Job job({}, 1);
    double start = cpu_seconds();
    const auto theirs = test::opencv_calibration(views, truth.width, truth.height, false);
    seconds[0] += cpu_seconds() - start;
    start = cpu_seconds();
    const auto ours = calib::calibrate_lens(views, truth.width, truth.height, like_opencv(false), job);
    seconds[1] += cpu_seconds() - start;
    start = cpu_seconds();
    calib::calibrate_lens(views, truth.width, truth.height, {}, job);
    robust_seconds += cpu_seconds() - start;
    error[0] += std::pow(theirs.fy - truth.f, 2), error[1] += std::pow(ours.camera.f - truth.f, 2);
    claimed[0] += std::pow(theirs.fx_sigma, 2), claimed[1] += ours.covariance(0, 0);
    validated += std::pow(ours.cross_validation_sigma, 2);
  }
  std::printf("20 views x 100 points, 0.1 px noise, %d trials; focal length %g px\n", kTrials, truth.f);
  std::printf("%-28s %10s %10s %10s\n", "", "OpenCV", "ours", "ours, robust");
  std::printf("%-28s %10.4f %10.4f\n", "RMS error of f, px", std::sqrt(error[0] / kTrials),
              std::sqrt(error[1] / kTrials));
  std::printf("%-28s %10.4f %10.4f\n", "claimed, px", std::sqrt(claimed[0] / kTrials), std::sqrt(claimed[1] / kTrials));
  std::printf("%-28s %10.1f %10.1f %10.1f   (ours with cross-validation)\n", "CPU time, ms", 1e3 * seconds[0] / kTrials,
              1e3 * seconds[1] / kTrials, 1e3 * robust_seconds / kTrials);
  std::printf("%-28s %10s %10.2f\n\n", "halves' difference / expected", "", std::sqrt(validated / kTrials));
}

/// mrcal on the same corners, as a program of its own: its RMS, focal length, and uncertainty beside ours at the same
/// places. Says nothing where it is not installed.
void run_mrcal(const std::vector<calib::BoardView>& views, int width, int height, const calib::LensCalibration& ours) {
  if (std::system("test -x /usr/bin/mrcal-calibrate-cameras") != 0) return std::puts("mrcal: not installed"), void();
  const auto folder = std::filesystem::temp_directory_path() / "lumihull-bench-mrcal";
  std::filesystem::create_directories(folder);
  std::string corners = "# filename x y level\n";
  for (std::size_t v = 0; v < views.size(); ++v)
    for (const calib::BoardMatch& m : views[v].matches) {
      char line[120];
      std::snprintf(line, sizeof line, "view%02zu.jpg %.6f %.6f 0\n", v, m.pixel.x() - 0.5, m.pixel.y() - 0.5);
      corners += line;
    }
  write_file(folder / "corners.vnl", corners);
  // Its program reads the pictures' size from a picture.
  for (std::size_t v = 0; v < views.size(); ++v) {
    char name[40];
    std::snprintf(name, sizeof name, "view%02zu.jpg", v);
    write_jpeg(folder / name, Image(width, height, 1));
  }
  write_file(folder / "look.py",
             "import mrcal, numpy as np\n"
             "m = mrcal.cameramodel('camera-0.cameramodel')\n"
             "o = m.optimization_inputs()\n"

             "n = o['observations_board'].shape[0]*o['observations_board'].shape[1]*o['observations_board'].shape[2]\n"
             "r = mrcal.residuals_chessboard(optimization_inputs=o).reshape(-1, 2)\n"
             "print('mrcal (%s): RMS %.4f px, fx %.3f fy %.3f, %d outliers of %d' % (m.intrinsics()[0], \n"
             "  np.sqrt((r*r).sum()/len(r)), m.intrinsics()[1][0], m.intrinsics()[1][1],\n"
             "  (o['observations_board'][...,2] <= 0).sum(), n))\n"
             "w, h = m.imagersize()\n"
             "for v in (0.1, 0.5, 0.9):\n"
             "  q = np.array([[w*u, h*v] for u in (0.1, 0.3, 0.5, 0.7, 0.9)])\n"
             "  p = mrcal.unproject(q, *m.intrinsics())\n"
             "  s = mrcal.projection_uncertainty(p, model=m, atinfinity=True, what='worstdirection-stdev')\n"
             "  print('mrcal, px:', ' '.join('%6.3f' % x for x in s))\n");
  // It estimates how the board is bent, too, unless told not to.
  for (const std::string board : {"--skip-calobject-warp-solve ", ""}) {
    std::printf("mrcal, board %s\n", board.empty() ? "bent" : "flat");
    std::fflush(stdout);
    const std::string command =
        "cd " + folder.string() + " && rm -f *.cameramodel && mrcal-calibrate-cameras " + board +
        "--corners-cache corners.vnl --lensmodel LENSMODEL_OPENCV5 --focal 540 --object-spacing 1 "
        "--object-width-n 9 --object-height-n 6 --outdir . 'view*.jpg' > log 2>&1 && "
        "/usr/bin/python3 look.py 2>&1";
    if (std::system(command.c_str()) != 0) std::puts("mrcal: failed");
  }
  for (const double v : {0.1, 0.5, 0.9}) {
    std::printf("ours,  px:");
    // 5 x 5 cells of which 10 %, 30 %, … are the middles.
    const auto sigma = calib::projection_uncertainty(ours, 5, 5);
    for (int x = 0; x < 5; ++x) std::printf(" %6.3f", sigma[std::size_t(int(v * 5) * 5 + x)]);
    std::puts("");
  }
}

void chessboards(const std::filesystem::path& folder) {
  for (const std::string side : {"left", "right"}) {
    const test::ChessboardViews views = test::chessboard_views(folder, side);
    for (const auto* corners : {&views.opencv, &views.ours}) {
      auto same = *corners;
      for (auto& view : same)
        for (auto& match : view.matches) match.covariance.setIdentity();
      Job job({}, 1);
      const auto theirs = test::opencv_calibration(same, views.width, views.height, true);
      const auto ours = calib::calibrate_lens(same, views.width, views.height, like_opencv(true), job);
      std::printf(
          "%s, %zu photographs, %s corners: OpenCV RMS %.4f px, fx %.2f, fy %.2f; ours RMS %.4f px, fx %.2f, fy %.2f\n",
          side.c_str(), same.size(), corners == &views.ours ? "our" : "OpenCV's", theirs.rms_px, theirs.fx, theirs.fy,
          ours.rms_px, ours.camera.s * ours.camera.f, ours.camera.f);
      // The covariance with the residuals' own scale, as mrcal's.
      calib::LensCalibration scaled = ours;
      if (ours.sigma0 < 1) scaled.covariance *= ours.sigma0 * ours.sigma0;
      run_mrcal(same, views.width, views.height, scaled);
    }
  }
}

}  // namespace

int main(int argc, char** argv) try {
  synthetic();
  const char* data = std::getenv("LUMIHULL_TEST_DATA");
  const std::filesystem::path folder = argc > 1 ? argv[1]
                                       : data   ? std::filesystem::path(data) / "chessboards"
                                                : "../shared/data/chessboards";
  if (std::filesystem::exists(folder))
    chessboards(folder);
  else
    std::puts("no photographs of chessboards: name their folder");
  return 0;
} catch (const lumihull::Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
