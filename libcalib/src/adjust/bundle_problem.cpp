// What an adjustment's unknowns are, and where they are moved to.
#include "bundle_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "../lens/point_term.h"
#include "body_shape.h"

namespace lumihull::calib::bundle {

using Eigen::Vector2d;
using Eigen::Vector3d;

BundleProblem::BundleProblem(const Adjustment& start, const AdjustOptions& options) : start_(start), options_(options) {
  for (const AdjustedCamera& c : start.cameras) {
    kept_.cameras.push_back(c.camera);
    kept_.cam_from_rig.push_back(c.cam_from_rig);
    const bool identity = c.cam_from_rig.rotation.vec().isZero(0) && c.cam_from_rig.translation.isZero(0);
    rigged_.push_back(c.on_rig || !identity);
  }
  for (const AdjustedShot& s : start.shots) kept_.rig_from_world.push_back(s.rig_from_world);
  for (std::size_t b = 0; b < start.bodies.size(); ++b) {
    const AdjustedBody& body = start.bodies[b];
    kept_.world_from_body.push_back(body.world_from_body);
    kept_.bends.push_back(body.bend);
    middles_.push_back(middle(body));
    first_point_.push_back(points_.size());
    for (std::size_t i = 0; i < body.points.size(); ++i) {
      points_.push_back(&body.points[i]);
      body_of_point_.push_back(std::uint32_t(b));
      kept_.places.push_back(body.model == BodyModel::free ? body.point(i) : Vector3d(0, 0, 0));
    }
  }
  kept_.print_scale = start.print_scale;
  blocks_of_points_.assign(points_.size(), 0);  // all may be observed
  moved_ = begin_ = kept_;
  place();

  seen_.reserve(start.observations.size());
  for (const Observation& o : start.observations) {
    Seen seen;
    seen.shot = o.shot, seen.camera = o.camera, seen.body = o.body;
    seen.point = std::uint32_t(first_point_[o.body]) + o.point;
    seen.pixel = o.pixel;
    Vector2d pixel;
    counts_.push_back(predict(seen, pixel));
    if (!counts_.back()) continue;
    const Eigen::Matrix2d w = lens::whitening(o.covariance);
    seen.w00 = w(0, 0), seen.w10 = w(1, 0), seen.w11 = w(1, 1);
    seen_.push_back(seen);
  }
  lay_out();
  add_terms();
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (points_[i]->radius > 0)
      neglected = std::max(neglected, start.bodies[body_of_point_[i]].model == BodyModel::free ? 1e-5 : 1e-6);
  place();  // free bodies by those points only that are observed
  keep();
}

void BundleProblem::lay_out() {
  sizes.assign(start_.shots.size(), 6);
  blocks_of_points_.assign(points_.size(), -1);
  std::vector<char> needed(points_.size(), 0);
  for (const Seen& seen : seen_) needed[seen.point] = 1;
  bool all_free = true;
  std::vector<char> in_bar(start_.shots.size(), 0);
  for (std::size_t b = 0; b < start_.bodies.size(); ++b) {
    const AdjustedBody& body = start_.bodies[b];
    if (body.model != BodyModel::free) {
      sizes.push_back(body.model == BodyModel::bending ? 9 : 6);
      all_free = false;
    }
    for (std::size_t i = 0; i < body.points.size(); ++i) {
      const std::size_t point = first_point_[b] + i;
      if (body.model == BodyModel::free) {
        if (!needed[point]) continue;
        sizes.push_back(3);
      }
      blocks_of_points_[point] = int(sizes.size()) - 1;
    }
  }
  const std::size_t border = sizes.size();
  in_bar.resize(border, 0);
  for (const ScaleBar& bar : start_.bars)
    for (const int block : {body_block(bar.body_a, bar.point_a), body_block(bar.body_b, bar.point_b)})
      if (block >= 0) in_bar[std::size_t(block)] = 1;

  // The smaller rest is solved for; blocks that a bar joins can't be eliminated one by one.
  Eigen::Index of_bodies = 0;
  for (std::size_t b = start_.shots.size(); b < border; ++b) of_bodies += sizes[b];
  const bool eliminate_shots = of_bodies <= Eigen::Index(6 * start_.shots.size());
  eliminated.assign(border, 0);
  for (std::size_t b = 0; b < border; ++b)
    eliminated[b] = b < start_.shots.size() ? eliminate_shots : !eliminate_shots && !in_bar[b];

  camera_blocks_.assign(start_.cameras.size(), -1), rig_blocks_.assign(start_.cameras.size(), -1);
  free_intrinsics_.resize(start_.cameras.size());
  for (std::size_t c = 0; c < start_.cameras.size(); ++c) {
    for (int i = 0; i < kIntrinsics; ++i)
      if (start_.cameras[c].free[std::size_t(i)]) free_intrinsics_[c].push_back(i);
    if (free_intrinsics_[c].empty()) continue;
    camera_blocks_[c] = int(sizes.size());
    sizes.push_back(int(free_intrinsics_[c].size()));
  }
  for (std::size_t c = 0; c < start_.cameras.size(); ++c)
    if (start_.cameras[c].on_rig) {
      rig_blocks_[c] = int(sizes.size());
      sizes.push_back(6);
    }
  if (start_.free_print_scale) {
    print_block_ = int(sizes.size());
    sizes.push_back(2);
  }
  eliminated.resize(sizes.size(), 0);
  for (const int size : sizes) {
    offset_.push_back(unknowns_);
    unknowns_ += size;
  }

  // Two cameras that stand still on the rig apart from each other hold the scale, too.
  bool baseline = false;
  for (std::size_t c = 0; c < start_.cameras.size(); ++c)
    if (!start_.cameras[c].on_rig)
      baseline |= !(start_.cameras[c].cam_from_rig.center() - offset_of_rig()).isZero(1e-12);
  scale_is_free_ = all_free && start_.bars.empty() && !baseline;

  // In the order in which they will be summed.
  std::vector<std::uint32_t> order(seen_.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Seen &s = seen_[a], &t = seen_[b];
    const auto key = [&](const Seen& k, std::uint32_t index) {
      return eliminate_shots ? std::tuple(k.shot, k.camera, k.point, index)
                             : std::tuple(k.point, k.shot, k.camera, index);
    };
    return key(s, a) < key(t, b);
  });
  std::vector<Seen> sorted;
  sorted.reserve(seen_.size());
  for (const std::uint32_t i : order) sorted.push_back(seen_[i]);
  seen_ = std::move(sorted);
}

void BundleProblem::add_terms() {
  const auto touch = [](Term& term, int block) {
    if (block >= 0) term.block[term.blocks++] = block;
  };
  terms.reserve(seen_.size() + start_.bars.size());
  for (const Seen& seen : seen_) {
    Term term;
    touch(term, int(seen.shot));
    touch(term, rig_blocks_[seen.camera]);
    touch(term, camera_blocks_[seen.camera]);
    touch(term, blocks_of_points_[seen.point]);
    if (start_.bodies[seen.body].model != BodyModel::free) touch(term, print_block_);
    terms.push_back(term);
  }
  for (const ScaleBar& bar : start_.bars) {
    Term term;
    term.rows = 1;
    const int a = body_block(bar.body_a, bar.point_a), b = body_block(bar.body_b, bar.point_b);
    touch(term, a);
    if (b != a) touch(term, b);
    touch(term, print_block_);
    terms.push_back(term);
  }
  for (std::size_t b = 0; b < start_.bodies.size(); ++b) {
    if (start_.bodies[b].model != BodyModel::bending) continue;
    Term term;
    term.rows = 3;
    touch(term, body_block(b, 0));
    terms.push_back(term);
    bent_bodies_.push_back(std::uint32_t(b));
  }
}

Vector3d BundleProblem::center_of(const State& state, std::size_t body) const {
  return state.world_from_body[body] * middles_[body];
}

Vector3d BundleProblem::point_of(const State& state, std::size_t body, std::size_t point) const {
  const AdjustedBody& b = start_.bodies[body];
  if (b.model == BodyModel::free) return state.places[first_point_[body] + point];
  return state.world_from_body[body] *
         shaped(b.points[point], b.model, middles_[body], state.bends[body], state.print_scale).place;
}

/// A free body's pose, and with it its circles' normals, is the fit of the printed pattern to its points. Returns the
/// fit's scale, by which circles are larger than printed.
double BundleProblem::fit_pose(std::size_t body) {
  const AdjustedBody& b = start_.bodies[body];
  Vector3d printed = Vector3d::Zero(), placed = Vector3d::Zero();
  const auto for_observed = [&](const auto& add) {
    for (std::size_t i = 0; i < b.points.size(); ++i)
      if (body_block(body, i) >= 0) add(b.points[i].place, moved_.places[first_point_[body] + i]);
  };
  double count = 0;
  for_observed([&](const Vector3d& x, const Vector3d& y) { printed += x, placed += y, count += 1; });
  if (count < 3) return 1;
  printed /= count, placed /= count;
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
  double extent = 0;
  for_observed([&](const Vector3d& x, const Vector3d& y) {
    product += (y - placed) * (x - printed).transpose();
    extent += (x - printed).squaredNorm();
  });
  const BestTurn best = best_turn(product);
  if (!best.unique) return 1;
  moved_.world_from_body[body] = Pose::from_matrix(best.rotation, placed - best.rotation * printed);
  return best.trace / extent;
}

/// What evaluations need of the state moved to.
void BundleProblem::place() {
  lenses_.clear(), rig_rotations_.clear();
  for (const Camera& camera : moved_.cameras) lenses_.emplace_back(camera);
  for (const Pose& pose : moved_.cam_from_rig) rig_rotations_.push_back(pose.rotation.toRotationMatrix());
  views_.resize(moved_.rig_from_world.size() * moved_.cameras.size());
  for (std::size_t s = 0, v = 0; s < moved_.rig_from_world.size(); ++s)
    for (std::size_t c = 0; c < moved_.cameras.size(); ++c, ++v) {
      const Pose pose = is_rigged(c) ? moved_.cam_from_rig[c] * moved_.rig_from_world[s] : moved_.rig_from_world[s];
      views_[v] = {pose.rotation.toRotationMatrix(), pose.translation};
    }
  placed_.resize(points_.size());
  bodies_.resize(start_.bodies.size());
  for (std::size_t b = 0; b < start_.bodies.size(); ++b) {
    const AdjustedBody& body = start_.bodies[b];
    const double scale = body.model == BodyModel::free ? fit_pose(b) : moved_.print_scale.mean();
    bodies_[b] = {moved_.world_from_body[b].rotation.toRotationMatrix(), center_of(moved_, b)};
    for (std::size_t i = 0; i < body.points.size(); ++i) {
      PlacedPoint& placed = placed_[first_point_[b] + i];
      const double radius = scale * body.points[i].radius;
      if (body.model == BodyModel::free) {
        placed = {moved_.places[first_point_[b] + i], bodies_[b].rotation * body.points[i].normal.normalized(), radius};
        continue;
      }
      const ShapedPoint shape = shaped(body.points[i], body.model, middles_[b], moved_.bends[b], moved_.print_scale);
      placed = {bodies_[b].rotation * shape.place + moved_.world_from_body[b].translation,
                bodies_[b].rotation * shape.normal, radius};
    }
  }
}

bool BundleProblem::move(const Eigen::VectorXd& step) {
  moved_ = kept_;
  const auto part = [&](int block) { return step.segment(offset_[std::size_t(block)], sizes[std::size_t(block)]); };
  for (std::size_t s = 0; s < moved_.rig_from_world.size(); ++s)
    moved_.rig_from_world[s] = lens::moved(kept_.rig_from_world[s], part(int(s)));
  for (std::size_t b = 0; b < start_.bodies.size(); ++b) {
    const AdjustedBody& body = start_.bodies[b];
    if (body.model == BodyModel::free) {
      for (std::size_t i = 0; i < body.points.size(); ++i)
        if (const int block = body_block(b, i); block >= 0) moved_.places[first_point_[b] + i] += part(block);
      continue;
    }
    const auto change = part(body_block(b, 0));
    // About its centre: shifted there, turned, shifted back.
    const Vector3d center = center_of(kept_, b);
    Pose pose = kept_.world_from_body[b];
    pose.translation -= center;
    pose = lens::moved(pose, change.head<6>());
    pose.translation += center;
    moved_.world_from_body[b] = pose;
    if (body.model == BodyModel::bending) moved_.bends[b] += change.tail<3>();
  }
  for (std::size_t c = 0; c < moved_.cameras.size(); ++c) {
    if (rig_blocks_[c] >= 0) moved_.cam_from_rig[c] = lens::moved(kept_.cam_from_rig[c], part(rig_blocks_[c]));
    if (camera_blocks_[c] < 0) continue;
    lens::Vector10d parameters = lens::parameters_of(kept_.cameras[c]);
    const auto change = part(camera_blocks_[c]);
    for (std::size_t i = 0; i < free_intrinsics_[c].size(); ++i)
      parameters[free_intrinsics_[c][i]] += change[Eigen::Index(i)];
    lens::set_parameters(moved_.cameras[c], parameters);
    if (!(moved_.cameras[c].f > 0) || !(moved_.cameras[c].s > 0)) return false;
  }
  if (print_block_ >= 0) moved_.print_scale += part(print_block_);
  if (!(moved_.print_scale.minCoeff() > 0)) return false;
  place();
  return true;
}

Adjustment BundleProblem::adjusted() const {
  Adjustment a = start_;
  for (std::size_t c = 0; c < a.cameras.size(); ++c)
    a.cameras[c].camera = kept_.cameras[c], a.cameras[c].cam_from_rig = kept_.cam_from_rig[c];
  for (std::size_t s = 0; s < a.shots.size(); ++s) a.shots[s].rig_from_world = kept_.rig_from_world[s];
  for (std::size_t b = 0; b < a.bodies.size(); ++b) {
    AdjustedBody& body = a.bodies[b];
    body.world_from_body = kept_.world_from_body[b];
    body.bend = kept_.bends[b];
    if (body.model == BodyModel::free)
      body.free_places.assign(kept_.places.begin() + std::ptrdiff_t(first_point_[b]),
                              kept_.places.begin() + std::ptrdiff_t(first_point_[b] + body.points.size()));
  }
  a.print_scale = kept_.print_scale;
  return a;
}

std::string BundleProblem::name(std::size_t block) const {
  const int wanted = int(block);
  if (block < start_.shots.size()) return "shot '" + start_.shots[block].name + "'";
  for (std::size_t i = 0; i < blocks_of_points_.size(); ++i) {
    if (blocks_of_points_[i] != wanted) continue;
    const std::size_t body = body_of_point_[i];
    const std::string whole = "body '" + start_.bodies[body].name + "'";
    return start_.bodies[body].model == BodyModel::free
               ? "point " + std::to_string(i - first_point_[body]) + " of " + whole
               : whole;
  }
  for (std::size_t c = 0; c < camera_blocks_.size(); ++c) {
    if (camera_blocks_[c] == wanted) return "the lens of camera " + std::to_string(c);
    if (rig_blocks_[c] == wanted) return "camera " + std::to_string(c) + " on the rig";
  }
  return "the print scale";
}

std::int64_t BundleProblem::redundancy() const {
  std::int64_t measured = 0;
  for (const Term& term : terms) measured += term.rows;
  return measured - unknowns_ + (scale_is_free_ ? 7 : 6);
}

}  // namespace lumihull::calib::bundle

namespace lumihull::calib {

Eigen::Vector3d AdjustedBody::point(std::size_t index, const Eigen::Vector2d& print_scale) const {
  if (model == BodyModel::free && !free_places.empty()) return free_places[index];
  if (model == BodyModel::free) return world_from_body * points[index].place;
  return world_from_body * bundle::shaped(points[index], model, bundle::middle(*this), bend, print_scale).place;
}

}  // namespace lumihull::calib
