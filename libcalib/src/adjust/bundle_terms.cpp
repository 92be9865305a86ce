// What observations, scale bars and bends weigh, and how that changes with the unknowns.
#include <lumihull/calib/circle_projection.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "body_shape.h"
#include "bundle_problem.h"

namespace lumihull::calib::bundle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Row3 = Eigen::Matrix<double, 1, 3>;

Circle3 circle_at(const Vector3d& center, const Vector3d& normal, double radius) {
  Circle3 circle;
  circle.center = center;
  circle.u = normal.unitOrthogonal();
  circle.v = normal.cross(circle.u);
  circle.radius = radius;
  return circle;
}

void store(double* out, const Vector3d& v) { out[0] = v.x(), out[1] = v.y(), out[2] = v.z(); }

}  // namespace

bool BundleProblem::predict(const Seen& seen, Vector2d& pixel) const {
  const ViewOf& view = views_[seen.shot * start_.cameras.size() + seen.camera];
  const PlacedPoint& placed = placed_[seen.point];
  const Vector3d in_camera = view.rotation * placed.place + view.translation;
  const double radius = placed.radius;
  if (radius > 0) {
    const auto center = projected_circle_center(moved_.cameras[seen.camera],
                                                circle_at(in_camera, view.rotation * placed.normal, radius));
    if (!center) return false;
    pixel = *center;
    return true;
  }
  LeanLens::Seen at;
  if (!lenses_[seen.camera].see(in_camera, seen.pixel, at)) return false;
  pixel = at.pixel;
  return true;
}

Vector2d BundleProblem::residual(std::size_t observation) const {
  const Observation& o = start_.observations[observation];
  Seen seen;
  seen.shot = o.shot, seen.camera = o.camera, seen.body = o.body, seen.pixel = o.pixel;
  seen.point = std::uint32_t(first_point_[o.body]) + o.point;
  Vector2d pixel;
  if (!predict(seen, pixel)) return Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return o.pixel - pixel;
}

double BundleProblem::evaluate(std::size_t term, double* residual, double* jacobian) const {
  if (term < seen_.size()) return evaluate_observation(seen_[term], residual, jacobian);
  term -= seen_.size();
  if (term < start_.bars.size()) return evaluate_bar(start_.bars[term], residual, jacobian);
  const Vector3d& bend = moved_.bends[bent_bodies_[term - start_.bars.size()]];
  const double weight = 1 / options_.bend_sigma;
  store(residual, weight * bend);
  if (jacobian) {
    Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>> j(jacobian);
    j.setZero();
    j.rightCols<3>().diagonal().setConstant(weight);
  }
  return weight * weight * bend.squaredNorm();
}

double BundleProblem::evaluate_observation(const Seen& seen, double* residual, double* jacobian) const {
  constexpr double kLost = -1;
  const ViewOf& view = views_[seen.shot * start_.cameras.size() + seen.camera];
  const PlacedPoint& placed = placed_[seen.point];
  const Vector3d in_camera = view.rotation * placed.place + view.translation;
  const double radius = placed.radius;
  const LeanLens& lens = lenses_[seen.camera];

  Vector2d pixel, enlarged(0, 0);
  Matrix26d by_pose;
  double by_intrinsics[2 * kIntrinsics];
  const bool free_lens = camera_blocks_[seen.camera] >= 0;
  LeanLens::Seen at;
  if (!(radius > 0)) {
    if (!lens.see(in_camera, seen.pixel, at)) return kLost;
    pixel = at.pixel;
    if (jacobian) {
      Vector3d u, v;
      lens.by_point(in_camera, at, u, v);
      by_pose << in_camera.cross(u).transpose(), u.transpose(), in_camera.cross(v).transpose(), v.transpose();
      if (free_lens) lens.by_parameters(at, by_intrinsics, by_intrinsics + kIntrinsics);
    }
  } else if (!jacobian) {
    if (!predict(seen, pixel)) return kLost;
  } else {
    Eigen::Matrix<double, 2, kIntrinsics> parameters;
    const auto center =
        projected_circle_center(lens.camera(), circle_at(in_camera, view.rotation * placed.normal, radius), &by_pose,
                                free_lens ? &parameters : nullptr);
    if (!center) return kLost;
    pixel = *center;
    Eigen::Map<Eigen::Matrix<double, 2, kIntrinsics, Eigen::RowMajor>>{by_intrinsics} = parameters;
    // The circle's centre is seen off by about radius², and the print scale enlarges the radius.
    if (print_block_ >= 0 && lens.see(in_camera, seen.pixel, at))
      enlarged = (pixel - at.pixel) / moved_.print_scale.mean();
  }

  const Vector2d off = pixel - seen.pixel;
  const double r0 = seen.w00 * off.x(), r1 = seen.w10 * off.x() + seen.w11 * off.y();
  double cost = r0 * r0 + r1 * r1, weight = 1;
  if (options_.robust_sigma > 0) {  // Cauchy: b² log(1 + s / b²)
    const double b2 = options_.robust_sigma * options_.robust_sigma;
    weight = std::sqrt(1 / (1 + cost / b2));
    cost = b2 * std::log1p(cost / b2);
  }
  residual[0] = weight * r0, residual[1] = weight * r1;
  if (!jacobian) return cost;

  const double w00 = weight * seen.w00, w10 = weight * seen.w10, w11 = weight * seen.w11;
  by_pose.row(1) = w10 * by_pose.row(0) + w11 * by_pose.row(1);
  by_pose.row(0) *= w00;
  if (free_lens)
    for (int i = 0; i < kIntrinsics; ++i) {
      by_intrinsics[kIntrinsics + i] = w10 * by_intrinsics[i] + w11 * by_intrinsics[kIntrinsics + i];
      by_intrinsics[i] *= w00;
    }
  fill_jacobian(seen, in_camera, by_pose, by_intrinsics, {w00 * enlarged.x(), w10 * enlarged.x() + w11 * enlarged.y()},
                jacobian);
  return cost;
}

/// by_pose, by_intrinsics (2 x 10), enlarged: whitened, by motions in the camera's frame. They are passed on to all
/// blocks of the term, in its order.
void BundleProblem::fill_jacobian(const Seen& seen, const Vector3d& in_camera, const Matrix26d& by_pose,
                                  const double* by_intrinsics, const Vector2d& enlarged, double* jacobian) const {
  const AdjustedBody& body = start_.bodies[seen.body];
  const int body_block = blocks_of_points_[seen.point];
  const int rig_block = rig_blocks_[seen.camera], camera_block = camera_blocks_[seen.camera];
  const int print_block = body.model == BodyModel::free ? -1 : print_block_;
  const int width = 6 + columns(rig_block) + columns(camera_block) + columns(body_block) + columns(print_block);
  const Matrix3d& to_camera = views_[seen.shot * start_.cameras.size() + seen.camera].rotation;
  const Vector3d& place = placed_[seen.point].place;

  Matrix35d place_by, turn_by;
  if (body.model == BodyModel::bending || print_block >= 0)
    shaped(*points_[seen.point], body.model, middles_[seen.body], moved_.bends[seen.body], moved_.print_scale,
           &place_by, &turn_by);

  for (int r = 0; r < 2; ++r) {
    double* out = jacobian + r * width;
    Vector3d turn = by_pose.row(r).head<3>(), shift = by_pose.row(r).tail<3>();
    // A free circle's normal and size hang on all of its body's points: derivatives are as if it were a point where its
    // ellipse's centre is seen, so that turning and scaling all changes nothing.
    if (body.model == BodyModel::free) {
      shift -= in_camera * (in_camera.dot(shift) / in_camera.squaredNorm());
      turn = in_camera.cross(shift);
    }
    if (is_rigged(seen.camera)) {
      // A motion (ω, t) of the rig is one of the camera by (R ω, R t - R ω x t_camera).
      const Matrix3d& rotation = rig_rotations_[seen.camera];
      store(out, rotation.transpose() * (turn + shift.cross(moved_.cam_from_rig[seen.camera].translation)));
      store(out + 3, rotation.transpose() * shift);
    } else {
      store(out, turn);
      store(out + 3, shift);
    }
    out += 6;
    if (rig_block >= 0) {
      store(out, turn);
      store(out + 3, shift);
      out += 6;
    }
    if (camera_block >= 0)
      for (const int i : free_intrinsics_[seen.camera]) *out++ = by_intrinsics[r * kIntrinsics + i];

    const Vector3d world_shift = to_camera.transpose() * shift;
    if (body.model == BodyModel::free) {
      store(out, world_shift);
      continue;
    }
    // What turning about the point itself does: nothing to a point, a little to a circle.
    const Vector3d world_turn = to_camera.transpose() * (turn + shift.cross(in_camera));
    store(out, (place - bodies_[seen.body].center).cross(world_shift) + world_turn);
    store(out + 3, world_shift);
    out += 6;
    if (body.model == BodyModel::rigid && print_block < 0) continue;
    const Matrix3d& from_body = bodies_[seen.body].rotation;
    const Row3 shift_in_body = world_shift.transpose() * from_body, turn_in_body = world_turn.transpose() * from_body;
    const Eigen::Matrix<double, 1, 5> by_shape = shift_in_body * place_by + turn_in_body * turn_by;
    if (body.model == BodyModel::bending) {
      store(out, by_shape.head<3>().transpose());
      out += 3;
    }
    if (print_block >= 0) out[0] = by_shape[3] + 0.5 * enlarged[r], out[1] = by_shape[4] + 0.5 * enlarged[r];
  }
}

double BundleProblem::evaluate_bar(const ScaleBar& bar, double* residual, double* jacobian) const {
  const std::size_t a = first_point_[bar.body_a] + bar.point_a, b = first_point_[bar.body_b] + bar.point_b;
  const Vector3d apart = placed_[b].place - placed_[a].place;
  const double length = apart.norm(), weight = 1 / bar.sigma_m;
  if (!(length > 0)) return -1;
  residual[0] = weight * (length - bar.length_m);
  if (jacobian) {
    const int block_a = blocks_of_points_[a], block_b = blocks_of_points_[b];
    const int width = columns(block_a) + (block_b == block_a ? 0 : columns(block_b)) + columns(print_block_);
    std::fill_n(jacobian, width, 0.0);
    const auto add = [&](std::size_t body, std::size_t point, const Vector3d& direction, double* out) {
      const AdjustedBody& model = start_.bodies[body];
      if (model.model == BodyModel::free) {
        for (int i = 0; i < 3; ++i) out[i] += direction[i];
        return;
      }
      const Vector3d turn = (placed_[point].place - bodies_[body].center).cross(direction);
      for (int i = 0; i < 3; ++i) out[i] += turn[i], out[3 + i] += direction[i];
      Matrix35d place_by;
      shaped(*points_[point], model.model, middles_[body], moved_.bends[body], moved_.print_scale, &place_by);
      const Eigen::Matrix<double, 1, 5> by_shape =
          (bodies_[body].rotation.transpose() * direction).transpose() * place_by;
      if (model.model == BodyModel::bending)
        for (int i = 0; i < 3; ++i) out[6 + i] += by_shape[i];
      if (print_block_ >= 0)
        for (int i = 0; i < 2; ++i) jacobian[width - 2 + i] += by_shape[3 + i];
    };
    const Vector3d direction = weight / length * apart;
    add(bar.body_a, a, -direction, jacobian);
    add(bar.body_b, b, direction, block_b == block_a ? jacobian : jacobian + columns(block_a));
  }
  return residual[0] * residual[0];
}

double BundleProblem::chi2() const {
  double sum = 0, residual[kTermRows];
  for (const Seen& seen : seen_) {
    Vector2d pixel;
    if (!predict(seen, pixel)) continue;
    const Vector2d off = pixel - seen.pixel;
    const double r1 = seen.w10 * off.x() + seen.w11 * off.y();
    sum += seen.w00 * off.x() * seen.w00 * off.x() + r1 * r1;
  }
  for (std::size_t t = seen_.size(); t < terms.size(); ++t) sum += evaluate(t, residual, nullptr);
  return sum;
}

}  // namespace lumihull::calib::bundle
