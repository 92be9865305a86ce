// Adjusting a part of the network, and taking the answer over.
#include "settle.h"

#include <lumihull/base/error.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "lens/point_term.h"

namespace lumihull::calib::network {
namespace {

constexpr int kLeastPoints = 4;

/// cam_from_rig of each camera: the mean over the shots in which it and the first camera were placed. nullopt: none.
std::vector<Pose> rig_of(const Network& n, int part, const std::vector<bool>& use) {
  std::map<int, int> first;  // shot -> photograph of camera 0
  for (std::size_t i = 0; i < n.photos.size(); ++i)
    if (n.photos[i].camera == 0 && n.photo_part[i] == part && use[i]) first[n.photos[i].shot] = int(i);
  std::vector<Pose> poses(n.cameras.size());
  for (std::size_t c = 1; c < n.cameras.size(); ++c) {
    Eigen::Matrix3d rotations = Eigen::Matrix3d::Zero();
    std::vector<Eigen::Vector3d> translations;
    for (std::size_t i = 0; i < n.photos.size(); ++i) {
      if (n.photos[i].camera != int(c) || n.photo_part[i] != part || !use[i]) continue;
      const auto with = first.find(n.photos[i].shot);
      if (with == first.end()) continue;
      const Pose relative = *n.cam_from_world[i] * n.cam_from_world[std::size_t(with->second)]->inverse();
      rotations += relative.rotation.toRotationMatrix();
      translations.push_back(relative.translation);
    }
    if (translations.empty())
      throw Error(ErrorCode::degenerate,
                  "no shot has both this camera and the first one: how they lie to each other can't be told",
                  "camera " + std::to_string(c));
    Eigen::Vector3d middle;
    for (int k = 0; k < 3; ++k) {
      std::vector<double> values;
      for (const Eigen::Vector3d& t : translations) values.push_back(t[k]);
      std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
      middle[k] = values[values.size() / 2];
    }
    poses[c] = Pose::from_matrix(internal::nearest_rotation(rotations).rotation, middle);
  }
  return poses;
}

/// Where the centre of a circle's ellipse is seen, less where the circle's centre is.
Eigen::Vector2d circle_offset(const Network& n, const Seen& seen) {
  const PointMatch m = n.match(seen, true);
  if (m.radius == 0) return Eigen::Vector2d::Zero();
  BoardMatch match;
  match.board = m.world, match.radius = m.radius, match.normal = m.normal;
  Eigen::Vector2d ellipse, center;
  const Pose& pose = *n.cam_from_world[std::size_t(seen.photo)];
  if (!lens::predict(n.camera_of(seen.photo), pose, match, &ellipse)) return Eigen::Vector2d::Zero();
  match.radius = 0;
  if (!lens::predict(n.camera_of(seen.photo), pose, match, &center)) return Eigen::Vector2d::Zero();
  return ellipse - center;
}

/// Of what takes part, the largest piece that hangs together by what counts; the rest leaves the part, to be placed
/// again or named. True where something left.
bool keep_connected(Network& n, const std::vector<bool>& taken, bool by_points, bool rig, std::vector<bool>& photo_in,
                    std::vector<bool>& body_in) {
  const std::size_t photos = n.photos.size();
  std::vector<std::size_t> parent(photos);
  std::iota(parent.begin(), parent.end(), std::size_t(0));
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::map<std::pair<int, int>, std::size_t> first_of_body;
  std::map<int, std::size_t> first_of_shot;
  const auto join = [&](auto& first, const auto& key, std::size_t photo) {
    const auto [it, fresh] = first.try_emplace(key, photo);
    if (!fresh) parent[root(photo)] = root(it->second);
  };
  for (std::size_t k = 0; k < n.seen.size(); ++k) {
    const Seen& s = n.seen[k];
    const auto photo = std::size_t(s.photo);
    if (!taken[k] || !photo_in[photo] || !body_in[std::size_t(s.body)]) continue;
    join(first_of_body, std::pair(s.body, by_points ? s.point : 0), photo);
    if (rig) join(first_of_shot, n.photos[photo].shot, photo);
  }
  std::vector<int> size(photos, 0);
  for (std::size_t i = 0; i < photos; ++i)
    if (photo_in[i]) ++size[root(i)];
  const auto largest = std::size_t(std::max_element(size.begin(), size.end()) - size.begin());
  std::vector<bool> body_stays(n.bodies.size(), false);
  for (const auto& [body, photo] : first_of_body)
    if (root(photo) == largest) body_stays[std::size_t(body.first)] = true;
  bool left = false;
  for (std::size_t i = 0; i < photos; ++i)
    if (photo_in[i] && root(i) != largest) {
      photo_in[i] = false, left = true;
      n.photo_part[i] = -1, n.cam_from_world[i].reset();
    }
  if (!left) return false;
  for (std::size_t b = 0; b < body_in.size(); ++b)
    if (body_in[b] && !body_stays[b]) {
      body_in[b] = false;
      n.body_part[b] = -1, n.bodies[b].placed = false;
    }
  for (Sighting& sighting : n.sightings)  // judged from where they no longer are
    if (n.photo_part[std::size_t(sighting.photo)] < 0 || n.body_part[std::size_t(sighting.body)] < 0) {
      sighting.counts = true;
      for (const std::uint32_t k : sighting.seen) n.seen[k].counts = true;
    }
  return true;
}

}  // namespace

std::optional<Settled> settle(Network& n, int part, const std::vector<bool>& use, const SettleOptions& options,
                              Job& job) {
  Settled settled;
  settled.shot_of_photo.assign(n.photos.size(), -1);
  settled.body_of.assign(n.bodies.size(), -1);
  settled.cam_from_rig.resize(n.cameras.size());
  if (options.rig) settled.cam_from_rig = rig_of(n, part, use);

  // What is seen often enough, until nothing more falls out.
  std::vector<bool> photo_in(n.photos.size()), body_in(n.bodies.size());
  for (std::size_t i = 0; i < photo_in.size(); ++i) photo_in[i] = use[i] && n.photo_part[i] == part;
  for (std::size_t b = 0; b < body_in.size(); ++b) body_in[b] = n.body_part[b] == part;
  std::vector<bool> taken(n.seen.size()), in_sight(n.seen.size(), false);
  for (std::size_t k = 0; k < n.seen.size(); ++k)
    if (photo_in[std::size_t(n.seen[k].photo)] && body_in[std::size_t(n.seen[k].body)])
      in_sight[k] = error_of(n, n.seen[k]).has_value();
  for (bool changed = true; changed;) {
    changed = false;
    std::vector<int> by_photo(n.photos.size(), 0), by_body(n.bodies.size(), 0);
    std::map<std::pair<int, int>, int> by_point;
    for (std::size_t k = 0; k < n.seen.size(); ++k) {
      const Seen& s = n.seen[k];
      taken[k] = s.counts && photo_in[std::size_t(s.photo)] && body_in[std::size_t(s.body)] && in_sight[k];
      if (taken[k] && options.model == BodyModel::free) ++by_point[{s.body, s.point}];
    }
    for (std::size_t k = 0; k < n.seen.size(); ++k) {
      const Seen& s = n.seen[k];
      // A free point needs two photographs, and a third to say anything about itself.
      if (taken[k] && options.model == BodyModel::free && by_point[{s.body, s.point}] < 2) taken[k] = false;
      if (taken[k]) ++by_photo[std::size_t(s.photo)], ++by_body[std::size_t(s.body)];
    }
    for (std::size_t i = 0; i < photo_in.size(); ++i)
      if (photo_in[i] && by_photo[i] < kLeastPoints) photo_in[i] = false, changed = true;
    for (std::size_t b = 0; b < body_in.size(); ++b)
      if (body_in[b] && by_body[b] < kLeastPoints) body_in[b] = false, changed = true;
    if (!changed) changed = keep_connected(n, taken, options.model == BodyModel::free, options.rig, photo_in, body_in);
  }

  Adjustment problem;
  for (std::size_t c = 0; c < n.cameras.size(); ++c) {
    AdjustedCamera& camera = problem.cameras.emplace_back();
    camera.camera = n.cameras[c];
    camera.cam_from_rig = settled.cam_from_rig[c];
    camera.on_rig = options.rig && c > 0;
  }
  std::vector<bool> camera_used(n.cameras.size(), false);
  std::map<int, int> shot_of;  // of rigs
  for (std::size_t i = 0; i < photo_in.size(); ++i) {
    if (!photo_in[i]) continue;
    const std::size_t c = std::size_t(n.photos[i].camera);
    camera_used[c] = true;
    int index = int(problem.shots.size());
    if (options.rig) index = shot_of.try_emplace(n.photos[i].shot, index).first->second;
    settled.shot_of_photo[i] = index;
    if (index == int(problem.shots.size()))
      problem.shots.push_back({n.photos[i].name, settled.cam_from_rig[c].inverse() * *n.cam_from_world[i]});
  }
  for (std::size_t c = 0; c < camera_used.size(); ++c)
    if (camera_used[c])
      problem.cameras[c].free = options.free;
    else
      problem.cameras[c].on_rig = false;
  for (std::size_t b = 0; b < body_in.size(); ++b) {
    if (!body_in[b]) continue;
    settled.body_of[b] = int(problem.bodies.size());
    problem.bodies.push_back(n.bodies[b].body);
    problem.bodies.back().model = options.model;
  }
  if (options.model == BodyModel::free)  // points that are not seen enough don't take part
    for (std::size_t b = 0; b < body_in.size(); ++b)
      if (body_in[b] && problem.bodies[std::size_t(settled.body_of[b])].free_places.empty()) {
        AdjustedBody& body = problem.bodies[std::size_t(settled.body_of[b])];
        std::vector<Eigen::Vector3d> places;
        for (std::size_t k = 0; k < body.points.size(); ++k) places.push_back(n.bodies[b].body.point(k, n.print_scale));
        body.free_places = std::move(places);
      }
  if (problem.shots.empty() || problem.bodies.empty()) return std::nullopt;
  for (std::size_t k = 0; k < n.seen.size(); ++k) {
    const Seen& s = n.seen[k];
    if (!taken[k] || !photo_in[std::size_t(s.photo)] || !body_in[std::size_t(s.body)]) continue;
    problem.observations.push_back({std::uint32_t(settled.shot_of_photo[std::size_t(s.photo)]),
                                    std::uint32_t(n.photos[std::size_t(s.photo)].camera),
                                    std::uint32_t(settled.body_of[std::size_t(s.body)]), std::uint32_t(s.point),
                                    s.pixel, s.covariance});
    if (options.as_points) problem.observations.back().pixel -= circle_offset(n, s);
  }
  if (options.as_points)
    for (AdjustedBody& body : problem.bodies)
      for (BodyPoint& p : body.points) p.radius = 0;
  for (ScaleBar bar : options.bars) {
    const int a = settled.body_of.at(bar.body_a), b = settled.body_of.at(bar.body_b);
    if (a < 0 || b < 0) continue;
    bar.body_a = std::uint32_t(a), bar.body_b = std::uint32_t(b);
    problem.bars.push_back(bar);
  }
  problem.print_scale = n.print_scale;
  problem.free_print_scale = options.free_print_scale && !problem.bars.empty();

  AdjustOptions adjust_options;
  adjust_options.robust_sigma = options.robust_sigma;
  adjust_options.max_iterations = options.max_iterations;
  adjust_options.covariances = options.covariances;
  settled.result = adjust(problem, adjust_options, job);

  const Adjustment& now = settled.result.adjusted;
  n.print_scale = now.print_scale;
  for (std::size_t c = 0; c < n.cameras.size(); ++c) {
    n.cameras[c] = now.cameras[c].camera;
    settled.cam_from_rig[c] = now.cameras[c].cam_from_rig;
  }
  for (std::size_t i = 0; i < n.photos.size(); ++i)
    if (settled.shot_of_photo[i] >= 0)
      n.cam_from_world[i] = settled.cam_from_rig[std::size_t(n.photos[i].camera)] *
                            now.shots[std::size_t(settled.shot_of_photo[i])].rig_from_world;
  for (std::size_t b = 0; b < n.bodies.size(); ++b)
    if (settled.body_of[b] >= 0) {
      std::vector<BodyPoint> printed = std::move(n.bodies[b].body.points);
      n.bodies[b].body = now.bodies[std::size_t(settled.body_of[b])];
      n.bodies[b].body.points = std::move(printed);  // radii, too
    }
  return settled;
}

std::optional<Eigen::Vector2d> error_of(const Network& n, const Seen& seen) {
  const auto& pose = n.cam_from_world[std::size_t(seen.photo)];
  const CalibratedBody& body = n.bodies[std::size_t(seen.body)];
  if (!pose || !body.placed || n.photo_part[std::size_t(seen.photo)] != n.body_part[std::size_t(seen.body)])
    return std::nullopt;
  const PointMatch m = n.match(seen, true);
  BoardMatch match;
  match.board = m.world, match.radius = m.radius, match.normal = m.normal;
  Eigen::Vector2d pixel;
  if (!lens::predict(n.camera_of(seen.photo), *pose, match, &pixel)) return std::nullopt;
  return Eigen::Vector2d(seen.pixel - pixel);
}

double in_sigmas(const Seen& seen, const Eigen::Vector2d& error) {
  return std::sqrt(std::max(0.0, error.dot(seen.covariance.inverse() * error)));
}

}  // namespace lumihull::calib::network
