// From detections to poses: start, growth, adjustments with data snooping, the rest by resection, all of them together,
// figures.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/calibrate.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "cross_validation.h"
#include "findings.h"
#include "grow.h"
#include "model_photos.h"
#include "settle.h"

namespace lumihull::calib {
namespace {

using namespace network;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kRobust = 3;  // scale of the loss, in units of the residuals' own
constexpr int kMostParts = 100;
constexpr double kAsksForMore = 50;  // five standard deviations of each of two parameters
constexpr double kFarAway = 1e3;     // scales of the loss, for what can't be predicted
constexpr double kSheet = 0.02;      // points whose RMS distance from a plane is below this share of their extent

[[noreturn]] void invalid(const std::string& message, const std::string& subject) {
  throw Error(ErrorCode::invalid_argument, message, subject);
}

void check(const TargetSet& set, std::span<const PhotoTargets> photos, std::span<const CameraStart> cameras,
           const CalibrateOptions& options) {
  set.validate();
  options.validate();
  if (photos.empty()) invalid("expected at least one photograph", "photos");
  if (cameras.empty()) invalid("expected at least one camera", "cameras");
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const std::string subject = "camera " + std::to_string(c);
    if (cameras[c].width < 1 || cameras[c].height < 1) invalid("expected a size of at least 1 px", subject);
    if (cameras[c].camera) cameras[c].camera->validate();
    if (!cameras[c].camera && !options.refine_intrinsics)
      invalid("intrinsics are to be kept, but none are given", subject);
    if (!(std::isfinite(cameras[c].focal_px) && cameras[c].focal_px >= 0))
      invalid("expected a focal length of 0 or more", subject);
  }
  for (const PhotoTargets& photo : photos) {
    if (photo.camera < 0 || std::size_t(photo.camera) >= cameras.size()) invalid("there is no such camera", photo.name);
    for (const Detection& d : photo.targets) {
      if (d.id >= 0 && (d.design < 0 || std::size_t(d.design) >= set.designs.size()))
        invalid("a detection's design is not in the set", photo.name);
      for (const Feature& f : d.features)
        if (!f.pixel.allFinite() || !f.covariance.allFinite() || !(f.covariance(0, 0) > 0) ||
            !(f.covariance.determinant() > 0))
          invalid("a feature's pixel is not finite, or its covariance not positive", photo.name);
    }
  }
  const std::vector<CalibratedBody> bodies = bodies_of(set, photos);
  for (const ScaleBar& bar : options.bars)
    if (bar.body_a >= bodies.size() || bar.body_b >= bodies.size() ||
        bar.point_a >= bodies[bar.body_a].features.size() || bar.point_b >= bodies[bar.body_b].features.size())
      invalid("there is no such body or point", "bars: " + bar.name);
}

/// How much of the cameras may be estimated from what is placed.
std::array<bool, kIntrinsics> free_now(const Network& n, int part, const CalibrateOptions& options, bool all) {
  std::array<bool, kIntrinsics> free{};
  if (!options.refine_intrinsics) return free;
  if (all) return options.free;
  int photos = 0, points = 0;
  for (std::size_t i = 0; i < n.photos.size(); ++i) photos += n.photo_part[i] == part;
  for (const Seen& s : n.seen)
    points += s.counts && n.photo_part[std::size_t(s.photo)] == part && n.body_part[std::size_t(s.body)] == part;
  if (photos < 3 || points < 60) return free;
  if (photos >= 6 && points >= 200) return options.free;
  free[std::size_t(Intrinsic::f)] = options.free[std::size_t(Intrinsic::f)];
  return free;
}

/// A loss whose scale follows the residuals down.
std::optional<Settled> settle_robustly(Network& n, int part, int rounds, Job& job,
                                       const std::array<bool, kIntrinsics>& free) {
  std::optional<Settled> settled;
  double before = 0;
  for (int i = 0; i < rounds; ++i) {
    SettleOptions s;
    s.free = free;
    s.as_points = true;
    const double scale = std::max(1.0, residual_scale(n, part));
    if (i > 0 && scale > 0.9 * before) break;
    before = scale;
    s.robust_sigma = std::clamp(kRobust * scale, 1.0, 1e6);
    settled = settle(n, part, n.in_model, s, job);
    if (!settled) break;
  }
  return settled;
}

/// Σ log(1 + r² / c²) c², the Cauchy loss of what counts in a part, c in standard deviations.
double robust_cost(const Network& n, int part, double c) {
  double sum = 0;
  for (const Seen& s : n.seen) {
    if (!s.counts || n.photo_part[std::size_t(s.photo)] != part || n.body_part[std::size_t(s.body)] != part) continue;
    const auto error = error_of(n, s);
    const double r = error ? in_sigmas(s, *error) / c : kFarAway;
    sum += c * c * std::log1p(r * r);
  }
  return sum;
}

/// Frees s and k3, too, where that lowers the loss by more than two parameters do by chance.
void free_more_if_needed(Network& n, int part, CalibrateOptions& options, Job& job) {
  const auto free = free_now(n, part, options, false);
  if (!options.more_if_needed || !options.refine_intrinsics || free != options.free) return;
  CalibrateOptions wider = options;
  wider.free[std::size_t(Intrinsic::s)] = wider.free[std::size_t(Intrinsic::k3)] = true;
  if (wider.free == options.free) return;
  const Network before = n;
  const double scale = std::max(1.0, residual_scale(n, part)), c = kRobust * scale;
  const double cost = robust_cost(n, part, c);
  const bool settled = settle_robustly(n, part, 6, job, wider.free).has_value();
  // What left the part would lower the loss as well.
  const bool all = n.photo_part == before.photo_part && n.body_part == before.body_part;
  if (settled && all && cost - robust_cost(n, part, c) > kAsksForMore * scale * scale)
    options.free = wider.free;
  else
    n = before;
}

/// The largest part gets number 0; a single photograph beside it is no part. Returns how many there are.
int number_parts(Network& n, int parts) {
  std::vector<int> photos(std::size_t(parts), 0), order(std::size_t(parts), 0), number(std::size_t(parts), 0);
  for (const int p : n.photo_part)
    if (p >= 0) ++photos[std::size_t(p)];
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return photos[std::size_t(a)] > photos[std::size_t(b)]; });
  int kept = 1;
  for (int i = 1; i < parts; ++i) {
    const std::size_t part = std::size_t(order[std::size_t(i)]);
    number[part] = photos[part] > 1 ? kept++ : -1;
  }
  for (std::size_t i = 0; i < n.photos.size(); ++i) {
    int& p = n.photo_part[i];
    if (p >= 0) p = number[std::size_t(p)];
    if (p < 0) n.cam_from_world[i].reset();
  }
  for (std::size_t b = 0; b < n.bodies.size(); ++b) {
    int& p = n.body_part[b];
    if (p >= 0) p = number[std::size_t(p)];
    n.bodies[b].placed = p >= 0;
  }
  return kept;
}

/// Adjusts, judges and looks again until nothing changes. options.free may grow.
void clean(Network& n, int part, CalibrateOptions& options, Job& job) {
  for (int round = 0; round < 10; ++round) {
    if (!settle_robustly(n, part, round == 0 ? 6 : 2, job, free_now(n, part, options, false))) return;
    if (round == 0 && part == 0) free_more_if_needed(n, part, options, job);
    double scale = 1;
    const int changed = judge(n, part, options.outlier_sigma, &scale);
    bool other = false;
    if (round < 4) {
      other = second_look(n, part, job) > 0;
      if (!other && round > 0) other = find_second_places(n, part, job);
      std::size_t before = 0, after = 0;
      for (const auto& pose : n.cam_from_world) before += pose.has_value();
      grow_on(n, part, job, [] {});
      for (const auto& pose : n.cam_from_world) after += pose.has_value();
      other = other || after > before;
    }
    if (round > 0 && changed == 0 && !other) break;
  }
}

/// A photograph beyond the model: the pose that its points and the model's agree on. factor: how much larger variances
/// are than the detections' own, as the adjustment found. True where one got a place.
bool place_rest(Network& n, const CalibrateOptions& options, double factor, Job& job) {
  std::atomic<bool> placed = false;
  parallel_for(job, n.photos.size(), [&](std::size_t i) {
    if (n.in_model[i] || n.by_photo[i].empty() || n.photo_part[i] >= 0 || !place_photo(n, int(i), 0)) return;
    std::vector<PointMatch> matches;
    std::vector<std::uint32_t> seen;
    for (const int s : n.by_photo[i]) {
      const Sighting& sighting = n.sightings[std::size_t(s)];
      if (n.body_part[std::size_t(sighting.body)] != 0) continue;
      for (const std::uint32_t k : sighting.seen) {
        matches.push_back(n.match(n.seen[k], true)), seen.push_back(k);
        matches.back().covariance *= factor;
      }
    }
    ResectOptions resect_options;
    resect_options.outlier_sigma = std::clamp(options.outlier_sigma, 2.0, 100.0);
    try {
      const Resection r = resect(n.camera_of(int(i)), matches, resect_options);
      n.cam_from_world[i] = r.cam_from_world;
      for (const std::uint32_t k : r.outliers) n.seen[seen[k]].counts = false;
      for (const int s : n.by_photo[i]) {
        Sighting& sighting = n.sightings[std::size_t(s)];
        sighting.counts =
            std::any_of(sighting.seen.begin(), sighting.seen.end(), [&](std::uint32_t k) { return n.seen[k].counts; });
      }
      placed = true;
    } catch (const Error& e) {
      if (e.code() != ErrorCode::degenerate) throw;
      n.cam_from_world[i].reset();
      n.photo_part[i] = -1;
    }
  });
  return placed;
}

/// Part 0 adjusted and judged until nothing changes, by the photographs that n.in_model has.
std::optional<Settled> settle_finally(Network& n, SettleOptions options, double outlier_sigma, Job& job) {
  std::optional<Settled> settled;
  for (int round = 0; round < 5; ++round) {
    options.as_points = round == 0;
    settled = settle(n, 0, n.in_model, options, job);
    double scale = 1;
    if (!settled || (judge(n, 0, outlier_sigma, &scale) == 0 && round > 0)) break;
  }
  return settled;
}

/// A frame of the world that people would choose: a sheet's or table's, z up from it; else that of the body that is
/// seen most.
Pose chosen_frame(const Network& n, int part, double* bend) {
  Vector3d mean(0, 0, 0), facing(0, 0, 0);
  std::vector<Vector3d> points;
  int most = -1;
  std::size_t best = 0;
  for (std::size_t b = 0; b < n.bodies.size(); ++b) {
    if (n.body_part[b] != part) continue;
    const AdjustedBody& body = n.bodies[b].body;
    for (std::size_t k = 0; k < body.points.size(); ++k) points.push_back(body.point(k, n.print_scale));
    facing -= double(body.points.size()) * (body.world_from_body.rotation * Vector3d::UnitZ());
    std::size_t seen = 0;
    for (const int s : n.by_body[b]) seen += n.sightings[std::size_t(s)].counts;
    if (seen > best) best = seen, most = int(b);
  }
  if (most < 0) return {};
  for (const Vector3d& p : points) mean += p / double(points.size());
  Matrix3d scatter = Matrix3d::Zero();
  for (const Vector3d& p : points) scatter += (p - mean) * (p - mean).transpose() / double(points.size());
  const internal::SymmetricAxes axes = internal::symmetric_axes(scatter);
  const Vector3d sizes = axes.values.cwiseMax(0).cwiseSqrt();
  const Pose body_frame = n.bodies[std::size_t(most)].body.world_from_body;
  if (n.bodies.size() < 2 || !(sizes[0] < kSheet * sizes[2])) return body_frame.inverse();
  Vector3d up = axes.vectors.col(0);
  if (up.dot(facing) < 0) up = -up;
  for (const Vector3d& p : points) *bend = std::max(*bend, std::abs((p - mean).dot(up)));
  Vector3d x = body_frame.rotation * Vector3d::UnitX();
  x = (x - x.dot(up) * up).normalized();
  Matrix3d world_from_new;
  world_from_new << x, up.cross(x), up;
  return Pose::from_matrix(world_from_new, mean).inverse();
}

void turn_world(Network& n, int part, const Pose& new_from_world) {
  for (std::size_t i = 0; i < n.photos.size(); ++i)
    if (n.photo_part[i] == part) n.cam_from_world[i] = *n.cam_from_world[i] * new_from_world.inverse();
  for (std::size_t b = 0; b < n.bodies.size(); ++b)
    if (n.body_part[b] == part) {
      AdjustedBody& body = n.bodies[b].body;
      body.world_from_body = new_from_world * body.world_from_body;
      for (Vector3d& p : body.free_places) p = new_from_world * p;
    }
}

void gather_figures(const Network& n, Calibration& c) {
  double sum = 0;
  std::size_t count = 0, all = 0;
  std::vector<double> by_body(n.bodies.size(), 0), by_photo(n.photos.size(), 0);
  std::vector<int> body_points(n.bodies.size(), 0);
  std::vector<std::vector<int>> body_photos(n.bodies.size());
  for (const Seen& s : n.seen) {
    if (n.photo_part[std::size_t(s.photo)] != 0) continue;
    ++all;
    CalibrationResidual r;
    r.photo = s.photo, r.body = s.body, r.point = s.point;
    r.pixel = s.pixel;
    r.size_px = s.size_px;
    r.removed = !s.counts || n.body_part[std::size_t(s.body)] != 0;
    const auto error = error_of(n, s);
    r.error = error.value_or(Eigen::Vector2d::Constant(std::nan("")));
    r.sigmas = error ? in_sigmas(s, *error) / std::max(1.0, c.sigma0) : std::nan("");
    if (!error) r.removed = true;
    if (!r.removed) {
      const double d2 = r.error.squaredNorm();
      sum += d2, ++count;
      by_body[std::size_t(s.body)] += d2, ++body_points[std::size_t(s.body)];
      by_photo[std::size_t(s.photo)] += d2, ++c.photos[std::size_t(s.photo)].points;
      if (body_photos[std::size_t(s.body)].empty() || body_photos[std::size_t(s.body)].back() != s.photo)
        body_photos[std::size_t(s.body)].push_back(s.photo);
    }
    c.residuals.push_back(r);
  }
  c.rms_px = count > 0 ? std::sqrt(sum / double(count)) : 0;
  c.share = all > 0 ? double(count) / double(all) : 0;
  for (std::size_t i = 0; i < n.photos.size(); ++i)
    if (c.photos[i].points > 0) c.photos[i].rms_px = std::sqrt(by_photo[i] / c.photos[i].points);
  for (std::size_t b = 0; b < n.bodies.size(); ++b) {
    if (body_points[b] > 0) c.bodies[b].rms_px = std::sqrt(by_body[b] / body_points[b]);
    c.bodies[b].photos = int(body_photos[b].size());
  }
}

}  // namespace

void CalibrateOptions::validate() const {
  if (model_photos < 0) invalid("expected 0 (all) or more photographs", "model_photos");
  if (!(outlier_sigma >= 2 && outlier_sigma <= 100)) invalid("expected 2 to 100", "outlier_sigma");
  for (const ScaleBar& bar : bars)
    if (!(bar.length_m > 0) || !(bar.sigma_m > 0) || !std::isfinite(bar.length_m) || !std::isfinite(bar.sigma_m))
      invalid("expected a length and a standard deviation above 0", "bars: " + bar.name);
  if (free_print_scale && bars.empty()) invalid("a print's scale can only be told from scale bars", "free_print_scale");
}

Calibration calibrate_targets(const TargetSet& set, std::span<const PhotoTargets> photos,
                              std::span<const CameraStart> cameras, const CalibrateOptions& wanted, Job& job) {
  check(set, photos, cameras, wanted);
  CalibrateOptions options = wanted;
  Network n = make_network(set, photos);
  Calibration c;
  if (n.sightings.empty())
    throw Error(
        ErrorCode::degenerate,
        "no target of the set was found in any photograph: is this what was printed, and large enough (5 px a circle)?",
        "targets");

  // Cameras to begin with.
  n.cameras.resize(cameras.size());
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    if (cameras[k].camera) {
      n.cameras[k] = *cameras[k].camera;
      continue;
    }
    Camera& camera = n.cameras[k];
    camera.width = cameras[k].width, camera.height = cameras[k].height;
    camera.u0 = 0.5 * camera.width, camera.v0 = 0.5 * camera.height;
    camera.f =
        cameras[k].focal_px > 0 ? cameras[k].focal_px : focal_from_planes(n, int(k), camera.width, camera.height);
    if (!(camera.f > 0)) {
      camera.f = 1.2 * std::max(camera.width, camera.height);
      c.warnings.push_back("camera " + std::to_string(k) +
                           ": neither EXIF nor the targets say its focal length; photograph targets obliquely");
    }
  }
  find_poses(n, job);
  const ModelPhotos model = choose_model_photos(n, options.model_photos);
  n.in_model = model.use;

  // Parts grow from their surest start.
  int parts = 0;
  while (parts < kMostParts &&
         grow_part(n, parts, job, [&] { settle_robustly(n, parts, 4, job, free_now(n, parts, options, false)); }))
    ++parts;
  if (parts == 0)
    throw Error(ErrorCode::degenerate, "no photograph shows a target well enough to say from where it is seen",
                "targets");
  parts = number_parts(n, parts);
  for (int part = parts; part-- > 0;) clean(n, part, options, job);

  // The answer proper, on what is left.
  SettleOptions last;
  last.free = free_now(n, 0, options, true);
  last.model = options.model;
  last.bars = options.bars;
  last.free_print_scale = options.free_print_scale;
  last.rig = options.rig;
  last.max_iterations = 50;
  std::optional<Settled> settled = settle_finally(n, last, options.outlier_sigma, job);
  // Placed photographs join the adjustment, and bring the targets that only they show: their poses' covariances then
  // know of the lens's and the targets' too, and these gain by what the photographs saw.
  const double variance = settled ? std::max(1.0, settled->result.sigma0 * settled->result.sigma0) : 1;
  if (settled && place_rest(n, options, variance, job)) {
    n.in_model.assign(photos.size(), true);
    grow_on(n, 0, job, [] {});
    settled = settle_finally(n, last, options.outlier_sigma, job);
  }
  double flatness = 0;
  turn_world(n, 0, chosen_frame(n, 0, &flatness));
  c.bend_m = flatness;
  last.covariances = true;
  settled = settle(n, 0, n.in_model, last, job);
  if (!settled) throw Error(ErrorCode::degenerate, "too few points are left to place any photograph", "targets");

  c.photos.resize(photos.size());
  for (std::size_t i = 0; i < photos.size(); ++i) c.photos[i].reason = model.reason[i];
  const AdjustResult& result = settled->result;
  c.sigma0 = result.sigma0;
  c.print_scale = result.adjusted.print_scale;
  const double factor = std::max(1.0, c.sigma0 * c.sigma0);
  c.cameras = n.cameras;
  c.cam_from_rig = settled->cam_from_rig;
  for (const auto& covariance : result.camera_covariances) c.camera_covariances.push_back(covariance * factor);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    CalibratedPhoto& photo = c.photos[i];
    photo.part = n.photo_part[i];
    photo.cam_from_part = n.cam_from_world[i];
    if (photo.part == 0) photo.cam_from_world = photo.cam_from_part;
    const bool adjusted = settled->shot_of_photo[i] >= 0;
    photo.in_model = adjusted && model.use[i];
    if (adjusted) photo.covariance = result.shot_covariances[std::size_t(settled->shot_of_photo[i])] * factor;
  }
  name_what_was_left_out(n, 0);
  name_unplaced_photos(n, 0, c.photos);
  for (std::size_t b = 0; b < n.bodies.size(); ++b) {
    CalibratedBody& body = n.bodies[b];
    body.part = n.body_part[b];
    if (body.part >= 0) body.part_from_body = body.body.world_from_body;
    body.placed = body.part == 0;
    if (!body.placed) continue;
    for (std::size_t k = 0; k < body.body.points.size(); ++k) body.points.push_back(body.body.point(k, n.print_scale));
    const int index = settled->body_of[b];
    if (index >= 0)
      for (const Matrix3d& covariance : result.point_covariances[std::size_t(index)])
        body.point_covariances.push_back(covariance * factor);
    else
      body.point_covariances.assign(body.points.size(), Matrix3d::Zero());
    if (options.model == BodyModel::bending)
      for (std::size_t k = 0; k < body.points.size(); ++k)
        c.bend_m = std::max(c.bend_m, std::abs((body.body.world_from_body.inverse() * body.points[k]).z() -
                                               body.body.points[k].place.z()));
  }
  c.bodies = n.bodies;
  gather_figures(n, c);
  c.removed = std::move(n.removed);
  c.parts = parts;
  if (options.cross_validate) cross_validate(n, last, c, job);
  judge_calibration(c, photos, check_bars(options, c));
  return c;
}

}  // namespace lumihull::calib
