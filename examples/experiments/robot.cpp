// How well the robot comes back, how long it swings, and what cables that stretch do (paper, sections 5.1, 5.2, 6).
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/ellipse.h>
#include <lumihull/calib/light_plane.h>
#include <lumihull/capture/experiments.h>
#include <lumihull/capture/forward.h>
#include <lumihull/capture/mechanism.h>
#include <lumihull/capture/sag.h>
#include <lumihull/capture/trajectory.h>
#include <lumihull/rig/rig_robot.h>
#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/truth.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "model.h"

namespace lumihull::experiments {
namespace {

namespace fs = std::filesystem;
constexpr double kDegree = std::numbers::pi / 180;

Json spread_json(const std::vector<capture::PoseSpread>& places) {
  double distance = 0, angle = 0, squares = 0, squares_angle = 0;
  std::size_t n = 0;
  for (const capture::PoseSpread& p : places) {
    distance = std::max(distance, p.largest_distance_m), angle = std::max(angle, p.largest_angle_rad);
    for (const double d : p.distance_m) squares += d * d, ++n;
    for (const double a : p.angle_rad) squares_angle += a * a;
  }
  return {{"poses", n},
          {"distance_rms_cm", 100 * std::sqrt(squares / double(n))},
          {"distance_largest_cm", 100 * distance},
          {"angle_rms_deg", std::sqrt(squares_angle / double(n)) / kDegree},
          {"angle_largest_deg", angle / kDegree},
          {"paper_distance_below_cm", 6},
          {"paper_angle_below_deg", 7}};
}

/// "p2-v07" belongs to place 2.
std::size_t place_of(const std::string& stop) { return std::size_t(std::stoul(stop.substr(1))); }

std::vector<capture::PoseSpread> spreads(const std::map<std::size_t, std::vector<Pose>>& places) {
  std::vector<capture::PoseSpread> out;
  for (const auto& [place, poses] : places) out.push_back(capture::pose_spread(poses));
  return out;
}

// ---- the film of a sphere
// ---------------------------------------------------------------------------------------------

constexpr int kFilmWidth = 720, kFilmHeight = 576, kSamples = 8, kMoments = 4;
constexpr double kFilmFocal_px = 820, kSphereRadius_m = 0.075, kDistance_m = 1.5;
constexpr double kWhite = 0.75, kGround = 0.08;  // linear light

/// A white sphere before a dark ground as a camera sees it: coverage by rays, the mean of a few moments of the
/// exposure, noise of the sensor. `center`: in the camera's frame at each moment, m.
Image film_frame(const Camera& camera, std::span<const Eigen::Vector3d> center, std::uint64_t seed) {
  Image picture(camera.width, camera.height, 1, PixelType::u8);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto pixel = camera.project(center[0]);
  const double reach = pixel ? 1.3 * camera.f * kSphereRadius_m / center[0].z() : 0;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      double covered = 0;
      if (pixel && (Eigen::Vector2d(x + 0.5, y + 0.5) - *pixel).norm() < reach)
        for (const Eigen::Vector3d& c : center) {
          const double limit = c.squaredNorm() - kSphereRadius_m * kSphereRadius_m;  // the tangent cone
          for (int k = 0; k < kSamples * kSamples; ++k) {
            const Eigen::Vector3d ray((x + (k % kSamples + 0.5) / kSamples - camera.u0) / camera.f,
                                      (y + (k / kSamples + 0.5) / kSamples - camera.v0) / camera.f, 1);
            const double along = c.dot(ray);
            covered += along > 0 && along * along > limit * ray.squaredNorm();
          }
        }
      const double light = kGround + (kWhite - kGround) * covered / double(kSamples * kSamples * int(center.size()));
      const double noisy = light + 0.004 * std::sqrt(light + 0.02) * normal(random);
      picture.row<std::uint8_t>(y)[x] =
          std::uint8_t(std::lround(255 * srgb_from_linear(float(std::clamp(noisy, 0.0, 1.0)))));
    }
  return picture;
}

}  // namespace

Json measure_repeatability(const fs::path& folder, const Size& size, Job& job) {
  capture::RepeatabilityOptions options;
  const capture::Mechanism mechanism = capture::paper_mechanism();
  const capture::Plan plan = capture::repeatability_plan(mechanism, options);

  // Where the robot truly is, all 25 times.
  std::map<std::size_t, std::vector<Pose>> truly;
  rig::RigRobot robot(plan, {.errors = {}, .memory = {}});
  for (const capture::PlannedStop& stop : plan.stops) {
    robot.move_to(stop, job);
    robot.set_roll(stop.roll_rad, job);
    if (stop.photograph) truly[place_of(stop.name)].push_back(robot.cam_from_world_at_rest().inverse());
  }
  const auto places = spreads(truly);
  write_file(folder / "figure9.svg", capture::repeatability_svg(places));
  Json out{{"visits", options.visits}, {"true", spread_json(places)}};

  // And as the paper measured it: by the photographs' targets.
  options.visits = size.visits();
  rig::SimulateOptions s;
  s.object = "box";
  s.size_m = 0.3;
  // The corners see different walls: views from around tie them together, as the paper's model of the targets does.
  capture::Plan both = capture::repeatability_plan(mechanism, options);
  capture::HemisphereOptions around;
  around.azimuths = 16, around.rows = 2;
  around.phi_from_rad = 0.6, around.phi_to_rad = 1.2;
  const auto views = capture::hemisphere_stops(mechanism, around);
  both.stops.insert(both.stops.end(), views.begin(), views.end());
  s.plan = both;
  s.width = size.width();
  s.circle_px = size.circle_px();
  s.density = size.density();
  s.lens_photos = 0, s.empty_photos = 1, s.test_views = 0;
  const Stopwatch photographing;
  rig::simulate(folder / "capture", s, job);
  Capture capture = Capture::open(folder / "capture");
  slf::set_option(capture, "calibrate", "targets", (fs::absolute(folder) / "capture" / "sheets.json").string());
  slf::run_stage(capture, "calibrate", job);
  std::map<std::size_t, std::vector<Pose>> measured;
  std::size_t placed = 0;
  for (const Shot& shot : capture.shots) {
    if (!shot.cam_from_world || !shot.commanded) continue;
    ++placed;
    if (shot.commanded->stop[0] != 'p') continue;
    measured[place_of(shot.commanded->stop)].push_back(shot.cam_from_world->inverse());
  }
  out["photographed_visits"] = options.visits;
  out["photographs"] = capture.shots.size(), out["placed"] = placed;
  out["measured"] = spread_json(spreads(measured));
  const slf::TruthComparison truth = slf::compare_with_truth(capture, folder / "capture" / "truth", {}, job);
  out["truth"] = Json::parse(truth.to_json());
  return out;
}

Json measure_stability(const fs::path& folder, const Size&, Job& job) {
  const capture::Mechanism mechanism = capture::paper_mechanism();
  const capture::Plan plan = capture::repeatability_plan(mechanism, {});
  rig::RigRobot robot(plan, {.errors = {}, .memory = {}});
  const auto stop = std::find_if(plan.stops.begin() + 1, plan.stops.end(), [](const auto& s) { return s.photograph; });
  robot.move_to(plan.stops.front(), job);
  robot.move_to(*stop, job);
  const double start = robot.now_s();
  const Pose rest = robot.cam_from_world_at_rest();
  const Eigen::Vector3d sphere = rest.inverse() * Eigen::Vector3d(0, 0, kDistance_m);

  Camera camera;
  camera.width = kFilmWidth, camera.height = kFilmHeight, camera.f = kFilmFocal_px;
  camera.u0 = 0.5 * kFilmWidth, camera.v0 = 0.5 * kFilmHeight;
  constexpr double kSeconds = 14, kShutter_s = 0.01, kFrames_per_s = 25;
  const auto frames = std::size_t(kSeconds * kFrames_per_s);
  std::vector<double> time(frames), moved(frames), truly(frames), step(frames);
  std::vector<Eigen::Vector2d> middle(frames), true_middle(frames);
  std::vector<Image> shown(1);
  job.begin("film", frames);
  parallel_for(
      job, frames,
      [&](std::size_t i) {
        time[i] = double(i) / kFrames_per_s;
        std::vector<Eigen::Vector3d> centers;
        for (int k = 0; k < kMoments; ++k)
          centers.push_back(robot.cam_from_world(start + time[i] + kShutter_s * (k + 0.5) / kMoments) * sphere);
        const Image frame = film_frame(camera, centers, i + 1);
        if (i == 0) shown[0] = frame;
        const Eigen::Vector3d c = robot.cam_from_world(start + time[i] + 0.5 * kShutter_s) * sphere;
        const double radius = camera.f * kSphereRadius_m / std::sqrt(c.z() * c.z() - kSphereRadius_m * kSphereRadius_m);
        // A tracker's guess: whole pixels.
        const Eigen::Vector2d guess = camera.project(c)->array().round();
        const auto fit = calib::dual_conic_fit(calib::light_plane(frame), {guess, radius, radius, 0});
        middle[i] = fit.ellipse.center;
        true_middle[i] = *camera.project(c);
        if (fit.state != calib::EllipseState::good)
          throw Error(ErrorCode::degenerate, "the sphere was not found in frame " + std::to_string(i));
      },
      true);
  job.end();
  // The displacement from where it comes to rest (the last second's mean), as the larger coordinate's sign and length.
  Eigen::Vector2d settled = Eigen::Vector2d::Zero();
  const auto last = std::max<std::size_t>(1, std::size_t(kFrames_per_s));
  for (std::size_t i = frames - last; i < frames; ++i) settled += middle[i] / double(last);
  Eigen::Vector2d axis = middle[0] - settled;
  axis.normalize();
  double squares = 0;
  for (std::size_t i = 0; i < frames; ++i) {
    moved[i] = (middle[i] - settled).dot(axis);
    // A sphere's outline is an ellipse whose centre is a little outside of the projected centre, always by the same
    // amount.
    const Eigen::Vector2d off = (middle[i] - settled) - (true_middle[i] - true_middle[frames - 1]);
    squares += off.squaredNorm();
  }
  constexpr double kAllowed_px = 1, kSharp_px = 0.25;
  write_file(folder / "figure8.svg", capture::stability_svg(time, moved, kAllowed_px));
  write_jpeg(folder / "sphere.jpg", shown[0], 85);
  const auto settle = capture::settle_time_s(time, moved, kAllowed_px),
             sharp = capture::settle_time_s(time, moved, kSharp_px);
  Json out{{"frames", frames}, {"first_displacement_px", std::abs(moved[0])}, {"allowed_px", kAllowed_px}};
  out["settled_after_s"] = settle ? Json(*settle) : Json(nullptr);
  out["within_0.25_px_after_s"] = sharp ? Json(*sharp) : Json(nullptr);
  out["paper_settled_after_s"] = 7;
  out["against_truth_rms_px"] = std::sqrt(squares / double(frames));
  return out;
}

namespace {

struct PoseErrors {
  double position_rms_mm = 0, position_max_mm = 0, angle_max_deg = 0;
  std::size_t views = 0, lost = 0;

  void add(const Pose& wanted, const Pose& found) {
    const double off = 1000 * (wanted.translation - found.translation).norm();
    position_rms_mm += off * off;
    position_max_mm = std::max(position_max_mm, off);
    angle_max_deg = std::max(angle_max_deg, wanted.rotation.angularDistance(found.rotation) / kDegree);
    ++views;
  }
  Json json() const {
    return {{"views", views},
            {"without_answer", lost},
            {"position_rms_mm", views ? std::sqrt(position_rms_mm / double(views)) : 0},
            {"position_largest_mm", position_max_mm},
            {"angle_largest_deg", angle_max_deg}};
  }
};

/// The paper's robot, so many times as large: room, cables, their limits; the end-effector stays.
capture::Mechanism enlarged(double times) {
  capture::Mechanism m = capture::paper_mechanism();
  for (capture::Cable& c : m.cables) {
    c.departure *= times;
    c.max_length_m *= times;
    c.max_tension_N = 1000;
    c.stiffness_N = 1.0e5;  // a steel rope of 2 mm, about
    c.density_kg_m = 0.016;
  }
  m.room = Eigen::AlignedBox3d(times * m.room.min(), times * m.room.max());
  return m;
}

constexpr double kSize_m = 12, kRadius_m = 12 / 2.8 * 2.7;  // as the snowmobile, larger

}  // namespace

Json measure_elastic(const fs::path&, const Size&, Job& job) {
  const double times = kRadius_m / 1.5;  // the paper's mechanism was designed for 1.5 m
  const capture::Mechanism mechanism = enlarged(times);
  capture::HemisphereOptions options;
  options.radius_m = kRadius_m;
  options.azimuths = 12, options.rows = 7;
  Json out{{"size_m", kSize_m}, {"radius_m", kRadius_m}, {"room_times", times}};
  PoseErrors ignored, considered, wrong_stiffness;
  double stretch = 0, longest = 0;
  for (const capture::PlannedStop& stop : capture::hemisphere_stops(mechanism, options)) {
    job.check();
    const auto hang = [&](const capture::CableVector& lengths, PoseErrors& errors) {
      try {
        const capture::Hanging h = capture::hang_elastic(
            mechanism, std::span<const double>(lengths.data(), std::size_t(lengths.size())), stop.world_from_platform);
        errors.add(stop.world_from_platform, h.world_from_platform);
      } catch (const Error& e) {
        if (e.code() != ErrorCode::degenerate) throw;
        ++errors.lost;
      }
    };
    try {
      const auto straight = capture::cable_lengths(mechanism, stop.world_from_platform);
      const auto unstrained = capture::unstrained_lengths(mechanism, stop.world_from_platform);
      stretch = std::max(stretch, (straight - unstrained).maxCoeff());
      longest = std::max(longest, straight.maxCoeff());
      capture::Mechanism believed = mechanism;
      for (capture::Cable& c : believed.cables) c.stiffness_N *= 1.1;
      hang(straight, ignored);
      hang(unstrained, considered);
      hang(capture::unstrained_lengths(believed, stop.world_from_platform), wrong_stiffness);
    } catch (const Error& e) {
      if (e.code() != ErrorCode::degenerate) throw;
      ++ignored.lost;  // no tensions hold the platform there
    }
  }
  out["longest_cable_m"] = longest;
  out["largest_stretch_mm"] = 1000 * stretch;
  out["elasticity_ignored"] = ignored.json();
  out["elasticity_considered"] = considered.json();
  out["stiffness_wrong_by_10_percent"] = wrong_stiffness.json();
  return out;
}

Json measure_large(const fs::path& folder, const Size& size, Job& job) {
  rig::SimulateOptions s;
  s.object = "snowmobile";
  s.size_m = kSize_m;
  s.photos = size.photos(600);
  s.radius_m = kRadius_m;
  s.focal_mm = 14;  // the sheets would be larger than the walls with 10
  s.width = size.width();
  s.circle_px = 6;
  s.density = 0.2;
  s.lens_photos = 0, s.empty_photos = 24, s.test_views = 4;
  s.photo.blur_px = 0.6;
  Json out = model_of(folder / "capture", s, size, job);
  out["size_m"] = kSize_m;
  return out;
}

}  // namespace lumihull::experiments
