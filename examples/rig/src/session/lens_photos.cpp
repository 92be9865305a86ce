#include "lens_photos.h"

#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "objects/noise.h"
#include "photograph/develop.h"

namespace lumihull::rig {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kSpacing_m = .03, kPi = 3.14159265358979323846;

/// How much of the picture's half sides the print takes, seen by a pinhole; infinity where it is behind.
double extent(const Camera& camera, const FlatPrint& print, const Pose& cam_from_board, const Vector2d& about) {
  double most = 0;
  for (const double x : {print.low.x(), print.high.x()})
    for (const double y : {print.low.y(), print.high.y()}) {
      const Vector3d p = cam_from_board * Vector3d(x, y, 0);
      if (p.z() <= .05) return INFINITY;
      const Vector2d px(camera.f * p.x() / p.z() - about.x(), camera.f * p.y() / p.z() - about.y());
      most = std::max({most, 2 * std::fabs(px.x()) / camera.width, 2 * std::fabs(px.y()) / camera.height});
    }
  return most;
}

/// The i-th of n: tilted this way and that, every third one upright of the picture, at the middle and the four corners.
Pose board_pose(const Camera& camera, const FlatPrint& print, int i, std::uint64_t seed) {
  const auto random = [&](int k) { return 2 * unit_double(mix(mix(seed, std::uint64_t(i)), std::uint64_t(k))) - 1; };
  const double tilt = i == 0 ? 0 : (20 + 20 * std::fabs(random(0))) * kPi / 180;
  const double towards = 2 * kPi * i * .381966;  // the golden angle: no two alike
  const double roll = (i % 3 == 1 ? .5 * kPi : 0) + .15 * random(1);
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(tilt, Vector3d(std::cos(towards), std::sin(towards), 0)) *
                                  Eigen::AngleAxisd(roll, Vector3d::UnitZ());
  const int corner = i % 5;
  const double part = corner == 0 ? 0 : .17;
  const Vector2d about =
      part * Vector2d(corner & 1 ? camera.width : -camera.width, corner & 2 ? camera.height : -camera.height) / 2;
  const Vector3d middle((print.low.x() + print.high.x()) / 2, (print.low.y() + print.high.y()) / 2, 0);
  const double room = .94 - part;
  double near = .01, far = 1000;
  for (int k = 0; k < 60; ++k) {
    const double z = std::sqrt(near * far);
    Pose pose;
    pose.rotation = turn;
    pose.translation = z * Vector3d(about.x() / camera.f, about.y() / camera.f, 1) - turn * middle;
    (extent(camera, print, pose, about) > room ? near : far) = z;
  }
  return {turn, far * Vector3d(about.x() / camera.f, about.y() / camera.f, 1) - turn * middle};
}

}  // namespace

void photograph_board(const fs::path& folder, const RigLens& lens, int n, double from_s, std::uint64_t seed, Job& job) {
  if (n == 0) return;
  fs::create_directories(folder);
  calib::TargetSet set;
  set.grids.push_back({calib::PointGrid::Kind::chessboard, 11, 8, kSpacing_m, 0});
  const FlatPrint print = print_of(set.grids[0], Eigen::Vector3f::Constant(.03f), Eigen::Vector3f::Constant(.80f));
  job.begin("photographs of the board", std::uint64_t(n));
  parallel_for(
      job, std::size_t(n),
      [&](std::size_t i) {
        char name[32];
        std::snprintf(name, sizeof name, "board_%04zu.jpg", i + 1);
        if (fs::exists(folder / name)) return;
        Job alone({}, 1);
        const View view{lens.camera, board_pose(lens.camera, print, int(i), seed)};
        PrintPhotoOptions options;
        options.blur_px = lens.photo.blur_px;
        const Image light = photograph_prints(view, {&print, 1}, Eigen::Vector3f(.10f, .11f, .12f), options, 0, true);
        const Image picture = rig::develop(light, lens.photo, mix(mix(seed, 1), i), alone);
        write_file(folder / name, camera_file(picture, lens, from_s + 20 * double(i), .1));
      },
      true);
  job.end();
  set.save(folder / "board.json");
}

}  // namespace lumihull::rig
