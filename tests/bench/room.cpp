// A session in an enclosure of known truth: photographs of 6.3 megapixels from a hemisphere of 1.5 m about a box, in a
// room of 3 m radius whose floor and walls carry targets; made as JPEG files, and a calibrated capture of them judged.
//
//     bench_room FOLDER [--photos 600]             makes FOLDER/0001.jpg …; those that are there stay
//     bench_room FOLDER --judge CAPTURE            poses, focal length, points and covariances against the truth
//     bench_room FOLDER --measure 50               circles in so many of the photographs, against where they should be

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/rig/flat_print.h>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "../calib/targets/target_shot.h"
#include "alignment.h"

using namespace lumihull;
namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kRoom_m = 3, kHemisphere_m = 1.5, kBox_m = .3;
constexpr double kCone = .9;  // rad about the axis: the picture's corners are at .65
constexpr int kLeast = 5;     // targets that each photograph shows whole

struct Room {
  calib::TargetSet set;
  Camera camera;
  std::vector<int> ids;
  std::vector<Pose> world_from_target;
  std::vector<rig::FlatPrint> prints;  ///< targets, then the box
};

/// A sheet's pose at a place; the print's z goes into the paper, against the normal.
Pose facing(const Vector3d& place, const Vector3d& normal, double turn) {
  const Vector3d z = -normal, side = std::abs(z.z()) > .9 ? Vector3d::UnitX() : Vector3d::UnitZ();
  const Vector3d x0 = side.cross(z).normalized(), x = std::cos(turn) * x0 + std::sin(turn) * z.cross(x0);
  Eigen::Matrix3d rotation;
  rotation << x, z.cross(x), z;
  return Pose::from_matrix(rotation, place);
}

Room make_room() {
  Room room;
  room.set = calib::TargetSet::from_word("matrix5x5:36mm");
  room.camera.width = 3072, room.camera.height = 2048;
  room.camera.f = 2436.4, room.camera.u0 = 1541, room.camera.v0 = 1019;
  room.camera.k1 = .03, room.camera.k2 = -.005, room.camera.p1 = .0004, room.camera.p2 = -.0003;
  test::Dice dice(17);
  std::vector<Pose> places;
  constexpr double kStep = .44;  // on the floor, rows staggered
  for (int row = -7; row <= 7; ++row)
    for (int column = -7; column <= 7; ++column) {
      const Vector3d at((column + .5 * (row & 1)) * kStep + dice.between(-.04, .04),
                        row * kStep * std::sqrt(.75) + dice.between(-.04, .04), 0);
      const double turn = dice.between(0, 2 * std::numbers::pi);
      if (at.norm() > kBox_m && at.norm() < kRoom_m - .25) places.push_back(facing(at, Vector3d::UnitZ(), turn));
    }
  constexpr int kColumns = 36;
  for (int column = 0; column < kColumns; ++column)
    for (int row = 0; row < 2; ++row) {
      const double turn = 2 * std::numbers::pi * (column + .5 * row + dice.between(-.1, .1)) / kColumns;
      const Vector3d out(std::cos(turn), std::sin(turn), 0);
      const Vector3d at = kRoom_m * out + Vector3d(0, 0, .45 + .65 * row + dice.between(-.1, .1));
      places.push_back(facing(at, -out, dice.between(0, 2 * std::numbers::pi)));
    }
  const auto ids = room.set.designs[0].family.ids();
  if (places.size() > ids.size()) throw Error(ErrorCode::internal, "more targets than ids", "room");
  for (std::size_t i = 0; i < places.size(); ++i) {
    room.ids.push_back(ids[i]);
    room.world_from_target.push_back(places[i]);
    room.prints.push_back(rig::print_of(room.set.designs[0], ids[i]));
    room.prints.back().world_from_print = places[i];
  }
  const double half = .5 * kBox_m;
  for (int side = 0; side < 5; ++side) {
    const double turn = .5 * std::numbers::pi * side;
    const Vector3d normal = side < 4 ? Vector3d(std::cos(turn), std::sin(turn), 0) : Vector3d::UnitZ();
    rig::FlatPrint face;
    face.low = {-half, -half}, face.high = {half, half};
    face.paper = Eigen::Vector3f(.3f + .05f * float(side), .2f, .15f);
    face.world_from_print = facing(half * normal + Vector3d(0, 0, half), normal, 0);
    room.prints.push_back(face);
  }
  return room;
}

/// Places on the hemisphere by the golden angle, all aimed at about the box; held level, some upright.
Pose pose_of(int photo, int photos) {
  test::Dice dice(std::uint64_t(photo) + 1);
  const double turn = std::numbers::pi * (3 - std::sqrt(5.)) * photo, up = .12 + .86 * (photo + .5) / photos;
  const double across = std::sqrt(1 - up * up);
  const Vector3d aim(dice.between(-.08, .08), dice.between(-.08, .08), .5 * kBox_m);
  const Vector3d eye = kHemisphere_m * Vector3d(across * std::cos(turn), across * std::sin(turn), up);
  const double roll = dice.between(-.15, .15) + (photo % 4 == 0 ? .5 * std::numbers::pi : 0);
  const Pose rolled{Eigen::Quaterniond(Eigen::AngleAxisd(roll, Vector3d::UnitZ())), Vector3d::Zero()};
  return rolled * look_at(eye, aim, {0, 0, 1});
}

/// Targets whose corner circles' edges are all in the picture, large enough and not too oblique, box aside.
int targets_seen(const Room& room, const View& view) {
  const calib::TargetDesign& design = room.set.designs[0];
  int seen = 0;
  for (const Pose& world_from_target : room.world_from_target) {
    const Pose cam_from_target = view.cam_from_world * world_from_target;
    const Vector3d& middle = cam_from_target.translation;
    const double facing = (cam_from_target.rotation * Vector3d::UnitZ()).dot(middle.normalized());
    bool whole = facing > .45 && 2 * design.circle_radius_m() * view.camera.f * facing / middle.norm() > 6;
    for (int i = 0; i < design.features() && whole; ++i) {
      const Vector2d p = design.feature(i);
      const auto pixel = view.camera.project(cam_from_target * Vector3d(p.x(), p.y(), 0));
      whole = pixel && pixel->x() > 15 && pixel->y() > 15 && pixel->x() < view.camera.width - 15 &&
              pixel->y() < view.camera.height - 15;
    }
    seen += whole;
  }
  return seen;
}

void make(const fs::path& folder, int photos, unsigned threads) {
  const Room room = make_room();
  std::vector<int> seen;
  for (int i = 0; i < photos; ++i) seen.push_back(targets_seen(room, {room.camera, pose_of(i, photos)}));
  const auto [least, most] = std::minmax_element(seen.begin(), seen.end());
  std::printf("%zu targets, %d to %d of them in a photograph\n", room.ids.size(), *least, *most);
  std::fflush(stdout);
  if (*least < kLeast) throw Error(ErrorCode::internal, "a photograph shows fewer than five targets", "room");
  fs::create_directories(folder);
  Job job({}, threads);
  parallel_for(job, std::size_t(photos), [&](std::size_t i) {
    char name[16];
    std::snprintf(name, sizeof name, "%04zu.jpg", i + 1);
    if (fs::exists(folder / name)) return;
    rig::PrintPhotoOptions options;
    options.blur_px = .8, options.shading = {.3f, -.2f}, options.noise_read = .004, options.noise_shot = 3e-5;
    const View view{room.camera, pose_of(int(i), photos)};
    std::vector<rig::FlatPrint> prints;  // the renderer asks each tile of the picture about every one of them
    for (const rig::FlatPrint& print : room.prints) {
      const Vector3d middle = view.cam_from_world * print.world_from_print.translation;
      if (middle.z() > std::cos(kCone) * middle.norm()) prints.push_back(print);
    }
    write_jpeg(folder / name, rig::photograph_prints(view, prints, {.1f, .35f, .1f}, options, i), 95);
  });
}

struct Chi {
  double sum = 0, largest = 0;  ///< of errorᵀ Σ⁻¹ error / unknowns
  std::size_t n = 0;
  template <class Error, class Covariance>
  void add(const Error& e, const Covariance& c) {
    const double value = e.dot(c.ldlt().solve(e)) / double(e.size());
    sum += value, largest = std::max(largest, value), ++n;
  }
  double mean() const { return n > 0 ? sum / double(n) : -1; }
};

void judge(const fs::path& folder) {
  const Room room = make_room();
  const Capture capture = Capture::open(folder);
  const calib::TargetModel model = calib::TargetModel::of(capture);
  const calib::Calibration& c = model.calibration;
  const int photos = int(capture.shots.size());

  // The covariances' datum: the answer's points on the truth's by the best rigid motion.
  std::vector<Vector3d> found, truth;
  std::vector<Eigen::Matrix3d> covariances;
  for (const calib::CalibratedBody& b : c.bodies) {
    const auto at = std::find(room.ids.begin(), room.ids.end(), b.id);
    if (!b.placed) continue;
    if (at == room.ids.end()) throw Error(ErrorCode::internal, b.name + " is not in the room", "judge");
    for (std::size_t k = 0; k < b.points.size(); ++k) {
      const Vector2d p = room.set.designs[0].feature(b.features[k].feature);
      found.push_back(b.points[k]);
      truth.push_back(room.world_from_target[std::size_t(at - room.ids.begin())] * Vector3d(p.x(), p.y(), 0));
      covariances.push_back(b.point_covariances[k]);
    }
  }
  if (found.size() < 3) throw Error(ErrorCode::degenerate, "no targets were placed", "judge");
  const Pose truth_from_world = test::align_points(found, truth, true).motion;

  Chi points;
  double squares = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vector3d e = truth_from_world.inverse() * truth[i] - found[i];
    squares += e.squaredNorm();
    points.add(e, covariances[i]);
  }
  std::printf("points: %zu, RMS %.4f mm, chi2 / 3 %.2f (largest %.1f); scale wrong by %.1f ppm\n", found.size(),
              1e3 * std::sqrt(squares / double(found.size())), points.mean(), points.largest,
              1e6 * (1 / test::align_points(found, truth, false).scale - 1));

  Chi adjusted, resected;
  double centres = 0, angles = 0, worst = 0;
  int placed = 0;
  for (int i = 0; i < photos; ++i) {
    const calib::CalibratedPhoto& p = c.photos[std::size_t(i)];
    if (!p.cam_from_world) continue;
    ++placed;
    const Pose ours = *p.cam_from_world,
               true_pose = pose_of(std::stoi(model.photos[std::size_t(i)].name) - 1, photos) * truth_from_world;
    const Eigen::AngleAxisd turn(true_pose.rotation * ours.rotation.conjugate());
    Eigen::Matrix<double, 6, 1> e;
    e << turn.angle() * turn.axis(), true_pose.translation - turn * ours.translation;
    (p.in_model ? adjusted : resected).add(e, p.covariance);
    const double off = (ours.center() - true_pose.center()).norm();
    centres += off * off, worst = std::max(worst, off), angles += turn.angle() * turn.angle();
  }
  std::printf(
      "poses: %d of %d, centres RMS %.4f mm (worst %.4f), angles RMS %.5f degrees; chi2 / 6: %.2f of %zu adjusted, "
      "%.2f of %zu by resection (largest %.1f, %.1f)\n",
      placed, photos, 1e3 * std::sqrt(centres / placed), 1e3 * worst,
      180 / std::numbers::pi * std::sqrt(angles / placed), adjusted.mean(), adjusted.n, resected.mean(), resected.n,
      adjusted.largest, resected.largest);

  const Camera &ours = capture.cameras.at(0), &t = room.camera;
  const auto& sigma = capture.camera_covariances.at(0);
  const std::array<double, calib::kIntrinsics> off{ours.f - t.f,   ours.s - t.s,   ours.skew - t.skew, ours.u0 - t.u0,
                                                   ours.v0 - t.v0, ours.k1 - t.k1, ours.k2 - t.k2,     ours.k3 - t.k3,
                                                   ours.p1 - t.p1, ours.p2 - t.p2};
  for (std::size_t k = 0; k < off.size(); ++k)
    if (const double s = std::sqrt(sigma(Eigen::Index(k), Eigen::Index(k))); s > 0)
      std::printf("%s: off by %.3g, standard deviation %.3g\n", calib::intrinsic_names()[k].c_str(), off[k], s);
  std::printf("RMS %.4f px, share %.5f, sigma0 %.3f, halves differ by %.4f mm (%.2f expected)\n%s\n", c.rms_px, c.share,
              c.sigma0, 1e3 * c.cross_validation_m, c.cross_validation_sigma, c.verdict.c_str());
}

/// What is measured less what is true, by the circles' size: its mean would be in every photograph alike.
void measure(const fs::path& folder, int photos, int looked_at, unsigned threads) {
  const Room room = make_room();
  const calib::TargetDesign& design = room.set.designs[0];
  struct Sum {
    double x = 0, y = 0, outward = 0, squares = 0, chi = 0;
    std::size_t n = 0;
  };
  constexpr std::array<double, 7> kSizes{0, 8, 11, 15, 20, 28, 40};
  std::array<Sum, kSizes.size()> sums{};
  const calib::TargetDetector detector(room.set, {});
  Job job({}, threads);
  for (int k = 0; k < looked_at; ++k) {
    const int i = int(std::int64_t(k) * photos / looked_at);
    char name[16];
    std::snprintf(name, sizeof name, "%04d.jpg", i + 1);
    const View view{room.camera, pose_of(i, photos)};
    for (const calib::Detection& d : detector.detect(read_image(folder / name), job).targets) {
      const auto at = std::find(room.ids.begin(), room.ids.end(), d.id);
      if (at == room.ids.end()) continue;
      const Pose cam_from_target = view.cam_from_world * room.world_from_target[std::size_t(at - room.ids.begin())];
      const auto middle = view.camera.project(cam_from_target.translation);
      for (const calib::Feature& f : d.features) {
        const Vector2d p = design.feature(f.index);
        calib::Circle3 circle;
        circle.center = cam_from_target * Vector3d(p.x(), p.y(), 0);
        circle.u = cam_from_target.rotation * Vector3d::UnitX(),
        circle.v = cam_from_target.rotation * Vector3d::UnitY();
        circle.radius = design.circle_radius_m();
        const auto pixel = calib::projected_circle_center(view.camera, circle);
        if (!pixel || !middle) continue;
        const Vector2d e = f.pixel - *pixel, out = *pixel - *middle;
        if (e.norm() > 1) continue;
        const Eigen::Matrix2d axes = f.pixel * f.pixel.transpose() - f.dual_conic.topLeftCorner<2, 2>();
        const double size =
            2 * std::sqrt(std::max(0., Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(axes).eigenvalues()[0]));
        std::size_t bin = kSizes.size() - 1;
        while (size < kSizes[bin]) --bin;
        Sum& sum = sums[bin];
        sum.x += e.x(), sum.y += e.y(), sum.squares += e.squaredNorm(), ++sum.n;
        if (out.norm() > size) sum.outward += e.dot(out.normalized());
        sum.chi += e.dot(f.covariance.ldlt().solve(e)) / 2;
      }
    }
  }
  for (std::size_t k = 0; k < sums.size(); ++k)
    if (const Sum& s = sums[k]; s.n > 0)
      std::printf(
          "circles from %2.0f px: %6zu, mean %8.5f %8.5f px, away from the target's middle %8.5f, RMS %.5f, chi2 / 2 "
          "%.2f\n",
          kSizes[k], s.n, s.x / double(s.n), s.y / double(s.n), s.outward / double(s.n),
          std::sqrt(s.squares / double(s.n)), s.chi / double(s.n));
}

}  // namespace

int main(int argc, char** argv) {
  fs::path folder, capture;
  int photos = 600, looked_at = 0;
  unsigned threads = 0;
  CLI::App app("A session of photographs in an enclosure: made, and its calibration judged");
  app.add_option("folder", folder, "where the photographs are kept")->required();
  app.add_option("--photos", photos, "how many are made")->capture_default_str()->check(CLI::Range(1, 9999));
  app.add_option("--judge", capture, "a calibrated capture of them");
  app.add_option("--measure", looked_at, "look at so many of the photographs, and compare")->check(CLI::Range(1, 9999));
  app.add_option("--threads", threads, "0: one for each core")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    if (looked_at > 0)
      measure(folder, photos, looked_at, threads);
    else if (capture.empty())
      make(folder, photos, threads);
    else
      judge(capture);
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "%s\n", e.what()), 1;
  }
}
