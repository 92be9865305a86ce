// From detections to observations, and the poses that each sighting of a plane allows.
#include "network.h"

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/circle_projection.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <tuple>

#include "lens/point_term.h"

namespace lumihull::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Adds a target's features to a body.
void add_target(const TargetSet& set, int design_index, int id, const Pose& body_from_target, CalibratedBody& body) {
  const TargetDesign& design = set.designs[std::size_t(design_index)];
  for (int i = 0; i < design.features(); ++i) {
    BodyPoint point;
    const Vector2d place = design.feature(i);
    point.place = body_from_target * Vector3d(place.x(), place.y(), 0);
    if (design.family.kind() == TargetKind::circles) point.radius = design.circle_radius_m();
    point.normal = body_from_target.rotation * Vector3d::UnitZ();
    body.body.points.push_back(point);
    body.features.push_back({design_index, id, i});
  }
}

}  // namespace

std::vector<CalibratedBody> bodies_of(const TargetSet& set, std::span<const PhotoTargets> photos) {
  std::vector<CalibratedBody> bodies;
  for (std::size_t b = 0; b < set.boards.size(); ++b) {
    CalibratedBody& body = bodies.emplace_back();
    body.board = int(b);
    body.name = set.boards[b].name;
    for (const BoardTarget& t : set.boards[b].targets) add_target(set, t.design, t.id, t.board_from_target, body);
  }
  if (set.boards.empty()) {
    std::set<std::pair<int, int>> ids;
    for (const PhotoTargets& photo : photos)
      for (const Detection& d : photo.targets)
        if (d.id >= 0) ids.emplace(d.design, d.id);
    for (const auto& [design, id] : ids) {
      CalibratedBody& body = bodies.emplace_back();
      body.design = design;
      body.id = id;
      body.name = set.designs.at(std::size_t(design)).family.name() + " " + std::to_string(id);
      add_target(set, design, id, Pose{}, body);
    }
  }
  for (CalibratedBody& body : bodies) body.body.name = body.name;
  return bodies;
}

namespace network {
namespace {

/// Share of the targets in a mirrored photograph whose homographies turn the pattern over.
constexpr double kMirrored = 0.5;

bool turned_over(const Detection& d) {
  // det(H) keeps its sign where the denominator is positive at the target: that of an unmirrored plane seen from its
  // front is positive.
  const Matrix3d& h = d.pixel_from_target;
  const double w = h(2, 2);
  return h.determinant() * w * w * w < 0;
}

}  // namespace

std::string photo_text(const Network& network, int photo) {
  return "photograph " + network.photos[std::size_t(photo)].name;
}

std::string body_text(const Network& network, int body) {
  const CalibratedBody& b = network.bodies[std::size_t(body)];
  return (b.board >= 0 ? "board " : "target ") + b.name;
}

void remove_photo(Network& network, int photo, Removed::Why why, std::string text) {
  Removed r;
  r.kind = Removed::Kind::photo;
  r.why = why;
  r.photo = photo;
  r.text = std::move(text);
  network.removed.push_back(std::move(r));
}

PointMatch Network::match(const Seen& s, bool in_world) const {
  const AdjustedBody& body = bodies[std::size_t(s.body)].body;
  const BodyPoint& p = body.points[std::size_t(s.point)];
  PointMatch m;
  m.pixel = s.pixel;
  m.covariance = s.covariance;
  m.world = in_world ? body.point(std::size_t(s.point), print_scale) : p.place;
  m.radius = p.radius;
  m.normal = in_world ? Vector3d(body.world_from_body.rotation * p.normal) : p.normal;
  return m;
}

std::vector<PointMatch> Network::matches(const Sighting& s, bool in_world) const {
  std::vector<PointMatch> result;
  for (const std::uint32_t i : s.seen)
    if (seen[i].counts) result.push_back(match(seen[i], in_world));
  return result;
}

Network make_network(const TargetSet& set, std::span<const PhotoTargets> photos) {
  Network n;
  n.photos = photos;
  n.bodies = bodies_of(set, photos);
  n.by_photo.resize(photos.size());
  n.by_body.resize(n.bodies.size());
  n.cam_from_world.resize(photos.size());
  n.photo_part.assign(photos.size(), -1);
  n.in_model.assign(photos.size(), true);
  n.body_part.assign(n.bodies.size(), -1);
  // Which body and which of its points a feature is.
  std::map<std::pair<int, int>, std::vector<std::pair<int, int>>> place;  // (design, id) -> (body, first point)
  for (std::size_t b = 0; b < n.bodies.size(); ++b)
    for (std::size_t k = 0; k < n.bodies[b].features.size(); ++k)
      if (n.bodies[b].features[k].feature == 0)
        place[{n.bodies[b].features[k].design, n.bodies[b].features[k].id}].emplace_back(int(b), int(k));

  for (std::size_t i = 0; i < photos.size(); ++i) {
    const PhotoTargets& photo = photos[i];
    std::size_t over = 0;
    for (const Detection& d : photo.targets) over += turned_over(d);
    if (over > 0 && double(over) >= kMirrored * double(photo.targets.size())) {
      remove_photo(
          n, int(i), Removed::Why::mirrored,
          photo_text(n, int(i)) + " shows its targets mirrored: taken in a mirror, or flipped; it is left out");
      continue;
    }
    std::map<int, std::size_t> sighting_of;  // body -> index
    for (std::size_t k = 0; k < photo.targets.size(); ++k) {
      const Detection& d = photo.targets[k];
      const auto found = place.find({d.design, d.id});
      // The same target on two boards can't be told apart.
      if (d.id < 0 || found == place.end() || found->second.size() != 1 || turned_over(d)) {
        Removed r;
        r.kind = Removed::Kind::detection;
        r.why = turned_over(d) ? Removed::Why::mirrored : Removed::Why::unknown_board;
        r.photo = int(i), r.design = d.design, r.id = d.id;
        r.text = photo_text(n, int(i)) + ": target " + std::to_string(d.id) +
                 (turned_over(d) ? " is seen mirrored" : " is on no board, or on two of them");
        n.removed.push_back(std::move(r));
        continue;
      }
      const auto [body, first] = found->second.front();
      auto [at, fresh] = sighting_of.try_emplace(body, n.sightings.size());
      if (fresh) {
        n.by_photo[i].push_back(int(n.sightings.size()));
        n.by_body[std::size_t(body)].push_back(int(n.sightings.size()));
        n.sightings.push_back({});
        n.sightings.back().photo = int(i), n.sightings.back().body = body;
      }
      for (const Feature& f : d.features) {
        if (f.index < 0 || std::size_t(first + f.index) >= n.bodies[std::size_t(body)].features.size())
          throw Error(ErrorCode::invalid_argument, "a detection has a feature that its target does not have",
                      photo.name);
        Seen s;
        s.photo = int(i), s.body = body, s.point = first + f.index, s.detection = int(k);
        s.pixel = f.pixel;
        s.covariance = f.covariance;
        if (f.dual_conic(2, 2) != 0) {
          const Eigen::Matrix2d shape =
              f.pixel * f.pixel.transpose() - f.dual_conic.topLeftCorner<2, 2>() / f.dual_conic(2, 2);
          const double half = 0.5 * shape.trace(), det = shape.determinant();
          s.size_px = 2 * std::sqrt(std::max(0.0, half - std::sqrt(std::max(0.0, half * half - det))));
        }
        n.sightings[at->second].seen.push_back(std::uint32_t(n.seen.size()));
        n.seen.push_back(s);
      }
    }
  }
  for (Sighting& s : n.sightings) {
    Vector2d mean(0, 0);
    for (const std::uint32_t i : s.seen) mean += n.seen[i].pixel / double(s.seen.size());
    double sum = 0;
    for (const std::uint32_t i : s.seen) sum += (n.seen[i].pixel - mean).squaredNorm();
    s.size_px = 2 * std::sqrt(sum / double(std::max<std::size_t>(1, s.seen.size())));
  }
  return n;
}

void find_poses(Network& network, Job& job) {
  parallel_chunks(job, network.sightings.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      Sighting& s = network.sightings[i];
      s.poses = 0;
      if (!s.counts) continue;
      const std::vector<PointMatch> matches = network.matches(s, false);
      if (matches.size() < 4) continue;
      ResectOptions options;
      options.robust = matches.size() >= 8;
      try {
        const Resection r = resect(network.camera_of(s.photo), matches, options);
        s.cam_from_body[0] = r.cam_from_world;
        s.poses = 1;
        s.sure = !r.alternative;
        if (r.alternative) s.cam_from_body[std::size_t(s.poses++)] = *r.alternative;
      } catch (const Error& e) {
        if (e.code() != ErrorCode::degenerate) throw;
      }
    }
  });
}

double distance_px(const Network& network, const Sighting& sighting, const Pose& cam_from_body) {
  const Camera& camera = network.camera_of(sighting.photo);
  const AdjustedBody& body = network.bodies[std::size_t(sighting.body)].body;
  std::vector<double> squares;
  squares.reserve(sighting.seen.size());
  for (const std::uint32_t i : sighting.seen) {
    const Seen& s = network.seen[i];
    const auto pixel = camera.project(cam_from_body * body.points[std::size_t(s.point)].place);
    if (!pixel) return std::numeric_limits<double>::infinity();
    squares.push_back((*pixel - s.pixel).squaredNorm());
  }
  if (squares.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = squares.begin() + std::ptrdiff_t(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle);
}

double focal_from_planes(const Network& network, int camera, int width, int height) {
  // (h1 · h2, h1 · h2 over f², …) of each sighting of a plane, coordinates about the middle of the picture.
  struct Plane {
    double cross_xy, cross_z, square_xy, square_z, sum_xy, sum_z;
  };
  std::vector<Plane> planes;
  for (const Sighting& s : network.sightings) {
    if (network.photos[std::size_t(s.photo)].camera != camera) continue;
    const std::vector<PointMatch> matches = network.matches(s, false);
    if (matches.size() < 4) continue;
    std::vector<Vector2d> plane, pixels;
    bool flat = true;
    for (const PointMatch& m : matches) {
      flat = flat && std::abs(m.world.z()) < 1e-9;
      plane.push_back(m.world.head<2>());
      pixels.emplace_back((m.pixel - Vector2d(0.5 * width, 0.5 * height)) / double(width));
    }
    if (!flat) continue;
    try {
      const Matrix3d h = find_homography(plane, pixels);
      const Vector3d a = h.col(0), b = h.col(1);
      planes.push_back({a.head<2>().dot(b.head<2>()), a.z() * b.z(),
                        a.head<2>().squaredNorm() - b.head<2>().squaredNorm(), a.z() * a.z() - b.z() * b.z(),
                        a.head<2>().squaredNorm() + b.head<2>().squaredNorm(), a.z() * a.z() + b.z() * b.z()});
    } catch (const Error&) {
    }
  }
  if (planes.empty()) return 0;
  // A pattern that is off by 2 % of its size or 2 % of a right angle counts half.
  const auto cost = [&](double f) {
    const double w = 1 / (f * f);
    double sum = 0;
    for (const Plane& p : planes) {
      const double size = p.sum_xy * w + p.sum_z;
      const double skew = 2 * (p.cross_xy * w + p.cross_z) / size, stretch = (p.square_xy * w + p.square_z) / size;
      sum += std::log1p((skew * skew + stretch * stretch) / (0.02 * 0.02));
    }
    return sum;
  };
  double best = 0, least = std::numeric_limits<double>::infinity();
  constexpr int kSteps = 200;  // 0.2 to 20 times the width
  for (int i = 0; i <= kSteps; ++i) {
    const double f = 0.2 * std::pow(100.0, double(i) / kSteps), c = cost(f);
    if (c < least) least = c, best = f;
  }
  // Pictures that say nothing (all targets seen straight on) leave the cost flat.
  const double flat = std::max(cost(0.2), cost(20.0));
  return flat - least < 1 ? 0 : best * width;
}

}  // namespace network
}  // namespace lumihull::calib
