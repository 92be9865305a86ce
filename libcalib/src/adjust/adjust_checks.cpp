#include "adjust_checks.h"

#include <lumihull/base/error.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace lumihull::calib::bundle {
namespace {

[[noreturn]] void refuse(const std::string& message, const std::string& subject) {
  throw Error(ErrorCode::invalid_argument, message, subject);
}

void check_pose(const Pose& pose, const std::string& subject) {
  if (!pose.rotation.coeffs().allFinite() || !pose.translation.allFinite()) refuse("the pose must be finite", subject);
  if (std::abs(pose.rotation.norm() - 1) > 1e-6) refuse("the pose's rotation must be a unit quaternion", subject);
}

void check_bodies(const Adjustment& problem) {
  for (const AdjustedBody& body : problem.bodies) {
    const std::string subject = "body '" + body.name + "'";
    if (body.points.empty()) refuse("a body needs points", subject);
    check_pose(body.world_from_body, subject);
    if (!body.bend.allFinite()) refuse("the bend must be finite", subject);
    if (!body.free_places.empty() && (body.model != BodyModel::free || body.free_places.size() != body.points.size()))
      refuse("free_places is for free bodies, a place for each point (or empty)", subject);
    for (const BodyPoint& point : body.points) {
      if (!point.place.allFinite() || !point.normal.allFinite() || !(point.radius >= 0) || !std::isfinite(point.radius))
        refuse("points must be finite, with a radius >= 0", subject);
      if (point.radius > 0 && !(point.normal.norm() > 0)) refuse("a circle needs a normal that is not zero", subject);
    }
    for (const Eigen::Vector3d& place : body.free_places)
      if (!place.allFinite()) refuse("points must be finite, with a radius >= 0", subject);
  }
}

void check_observations(const Adjustment& problem) {
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const Observation& o = problem.observations[i];
    const std::string subject = "observation " + std::to_string(i);
    if (o.shot >= problem.shots.size()) refuse("there is no shot " + std::to_string(o.shot), subject);
    if (o.camera >= problem.cameras.size()) refuse("there is no camera " + std::to_string(o.camera), subject);
    if (o.body >= problem.bodies.size()) refuse("there is no body " + std::to_string(o.body), subject);
    if (o.point >= problem.bodies[o.body].points.size())
      refuse("body '" + problem.bodies[o.body].name + "' has no point " + std::to_string(o.point), subject);
    if (!o.pixel.allFinite() || !o.covariance.allFinite()) refuse("pixel and covariance must be finite", subject);
    const Eigen::Matrix2d& c = o.covariance;
    if (!(c(0, 0) > 0) || !(c.determinant() > 0) || std::abs(c(0, 1) - c(1, 0)) > 1e-9 * std::sqrt(c(0, 0) * c(1, 1)))
      refuse("the covariance must be symmetric and positive definite", subject);
  }
}

void check_bars(const Adjustment& problem) {
  for (const ScaleBar& bar : problem.bars) {
    const std::string subject = "scale bar '" + bar.name + "'";
    for (const auto& [body, point] : {std::pair(bar.body_a, bar.point_a), std::pair(bar.body_b, bar.point_b)}) {
      if (body >= problem.bodies.size()) refuse("there is no body " + std::to_string(body), subject);
      if (point >= problem.bodies[body].points.size())
        refuse("body '" + problem.bodies[body].name + "' has no point " + std::to_string(point), subject);
    }
    if (bar.body_a == bar.body_b && bar.point_a == bar.point_b) refuse("its ends must be two points", subject);
    if (!(bar.length_m > 0) || !std::isfinite(bar.length_m) || !(bar.sigma_m > 0) || !std::isfinite(bar.sigma_m))
      refuse("length and sigma must be positive", subject);
  }
  if (!problem.print_scale.allFinite() || !(problem.print_scale.minCoeff() > 0))
    refuse("the print scale must be positive", "adjustment");
  const bool printed = std::any_of(problem.bodies.begin(), problem.bodies.end(),
                                   [](const AdjustedBody& body) { return body.model != BodyModel::free; });
  if (problem.free_print_scale && (problem.bars.empty() || !printed))
    refuse("a free print scale needs scale bars, and bodies that are not free", "adjustment");
}

std::size_t root_of(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

void check(const Adjustment& problem) {
  if (problem.cameras.empty() || problem.shots.empty() || problem.bodies.empty() || problem.observations.empty())
    refuse("needs at least a camera, a shot, a body and observations", "adjustment");
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    problem.cameras[c].camera.validate();
    check_pose(problem.cameras[c].cam_from_rig, "camera " + std::to_string(c));
  }
  if (problem.cameras.front().on_rig)
    refuse("the first camera holds the rig's frame: it can't be estimated on the rig", "camera 0");
  for (const AdjustedShot& shot : problem.shots) check_pose(shot.rig_from_world, "shot '" + shot.name + "'");
  check_bodies(problem);
  check_observations(problem);
  check_bars(problem);
}

void check_observed(const Adjustment& problem, const BundleProblem& bundle) {
  const std::size_t shots = problem.shots.size(), cameras = problem.cameras.size();
  std::vector<char> seen(bundle.sizes.size(), 0), camera_seen(cameras, 0);
  std::vector<char> free_body_seen(problem.bodies.size(), 0);
  std::vector<std::size_t> parent(bundle.sizes.size());
  std::iota(parent.begin(), parent.end(), std::size_t(0));
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (!bundle.counts(i)) continue;
    const Observation& o = problem.observations[i];
    const auto block = std::size_t(bundle.body_block(o.body, o.point));
    seen[o.shot] = seen[block] = camera_seen[o.camera] = free_body_seen[o.body] = 1;
    parent[root_of(parent, block)] = root_of(parent, o.shot);
  }
  const auto lost = [](const std::string& what) {
    throw Error(ErrorCode::degenerate, "has no observation that can be predicted from the start", what);
  };
  for (std::size_t s = 0; s < shots; ++s)
    if (!seen[s]) lost(bundle.name(s));
  for (std::size_t b = 0; b < problem.bodies.size(); ++b)
    if (!free_body_seen[b]) lost("body '" + problem.bodies[b].name + "'");
  for (std::size_t c = 0; c < cameras; ++c)
    if (!camera_seen[c] && (bundle.camera_block(c) >= 0 || bundle.rig_block(c) >= 0))
      lost("camera " + std::to_string(c));
  for (const ScaleBar& bar : problem.bars)
    if (bundle.body_block(bar.body_a, bar.point_a) < 0 || bundle.body_block(bar.body_b, bar.point_b) < 0)
      lost("an end of scale bar '" + bar.name + "'");

  std::vector<std::size_t> parts;  // a shot of each; a part without shots can't be
  for (std::size_t s = 0; s < shots; ++s) {
    const std::size_t root = root_of(parent, s);
    if (std::none_of(parts.begin(), parts.end(), [&](std::size_t p) { return root_of(parent, p) == root; }))
      parts.push_back(s);
  }
  if (parts.size() == 1) return;
  std::string names;
  for (std::size_t i = 0; i < std::min<std::size_t>(parts.size(), 5); ++i)
    names += (i ? ", " : "") + bundle.name(parts[i]);
  throw Error(ErrorCode::degenerate,
              "the photographs fall into " + std::to_string(parts.size()) +
                  " parts that have no body in common; one of each: " + names + (parts.size() > 5 ? ", …" : ""),
              bundle.name(parts[1]));
}

void check_determined(const BundleProblem& bundle, const NormalEquations& equations) {
  for (std::size_t b = 0; b < bundle.sizes.size(); ++b) {
    const Eigen::MatrixXd h = equations.diagonal_block(b);
    const Eigen::VectorXd unit = h.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.asDiagonal() * h * unit.asDiagonal(),
                                                               Eigen::EigenvaluesOnly);
    if (eigen.eigenvalues()[0] > 1e-12) continue;
    throw Error(ErrorCode::degenerate, "too little is seen of it: its observations leave it a way to move",
                bundle.name(b));
  }
}

}  // namespace lumihull::calib::bundle
