// The paper's experiments on the robot: repeatability and stability.
#include <lumihull/base/error.h>
#include <lumihull/capture/experiments.h>
#include <lumihull/internal/svg_figure.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "ways.h"

namespace lumihull::capture {
namespace {

using lumihull::internal::SvgFigure;

constexpr std::array<const char*, 4> kColors = {"#3b78d8", "#d9622b", "#2c9c5a", "#8b55c7"};

void expect_series(std::span<const double> time_s, std::span<const double> displacement, double allowed) {
  const auto finite = [](double x) { return std::isfinite(x); };
  if (time_s.empty() || time_s.size() != displacement.size() || !std::all_of(time_s.begin(), time_s.end(), finite) ||
      !std::all_of(displacement.begin(), displacement.end(), finite) || !std::is_sorted(time_s.begin(), time_s.end()) ||
      !(allowed > 0))
    throw Error(ErrorCode::invalid_argument,
                "expected as many displacements as ascending times, all finite, and a positive limit", "stability");
}

}  // namespace

Plan repeatability_plan(const Mechanism& mechanism, const RepeatabilityOptions& o) {
  check(mechanism);
  if (!(o.side_m > 0 && o.side_m < 1000) || o.visits < 1 || 4 * std::size_t(o.visits) > kMaxPlannedStops ||
      !o.center.allFinite() || !(o.settle_s >= 0) || !(o.exposure_s > 0))
    throw Error(ErrorCode::invalid_argument,
                "expected a positive side, at least one visit, and times that are not negative", "repeatability");
  const internal::WayFinder finder(mechanism, nullptr, o.center, o.limits);
  std::array<PlannedStop, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) {
    Pose pose;
    pose.translation = o.center + 0.5 * o.side_m * Eigen::Vector3d(k == 0 || k == 3 ? -1 : 1, k < 2 ? -1 : 1, 0);
    const PoseJudgement judged = judge_pose(mechanism, pose, nullptr, o.limits);
    if (!judged.ok())
      throw Error(ErrorCode::degenerate,
                  "corner " + std::to_string(k) + " can't be taken: " + judged.obstacles.front().text, mechanism.name);
    corners[k] = platform_stop(mechanism, o.center, pose, 0);
    corners[k].settle_s = o.settle_s, corners[k].exposure_s = o.exposure_s;
  }
  for (std::size_t k = 0; k < 4; ++k) {
    PlannedStop &from = corners[k], &to = corners[(k + 1) % 4];
    const internal::Way way = finder.straight(from.world_from_platform, to.world_from_platform);
    if (!way.open)
      throw Error(ErrorCode::degenerate,
                  "no straight way from corner " + std::to_string(k) + " to the next one: " + way.why, mechanism.name);
    to.travel_s = way.duration_s;
  }
  Plan plan;
  plan.robot = "cables";
  plan.mechanism = mechanism;
  plan.cameras = {"camera"};
  for (int visit = 0; visit < o.visits; ++visit)
    for (std::size_t k = 0; k < 4; ++k) {
      PlannedStop stop = corners[k];
      char name[32];
      std::snprintf(name, sizeof name, "p%zu-v%02d", k, visit);
      stop.name = name;
      if (plan.stops.empty()) stop.travel_s = 0;
      plan.stops.push_back(std::move(stop));
    }
  check(plan, mechanism.name);
  return plan;
}

PoseSpread pose_spread(std::span<const Pose> poses) {
  if (poses.empty()) throw Error(ErrorCode::invalid_argument, "expected at least one pose", "repeatability");
  PoseSpread spread;
  spread.mean.translation.setZero();
  // The rotation with the least sum of squared sines of half the angles: the largest eigenvector of the sum of q qᵀ.
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Pose& pose : poses) {
    if (!pose.translation.allFinite() || !(std::abs(pose.rotation.norm() - 1) < 1e-6))
      throw Error(ErrorCode::invalid_argument, "expected finite poses with rotations of length 1", "repeatability");
    spread.mean.translation += pose.translation / double(poses.size());
    sum += pose.rotation.coeffs() * pose.rotation.coeffs().transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
  spread.mean.rotation = Eigen::Quaterniond(Eigen::Vector4d(solver.eigenvectors().col(3))).normalized();
  for (const Pose& pose : poses) {
    spread.distance_m.push_back((pose.translation - spread.mean.translation).norm());
    spread.angle_rad.push_back(pose.rotation.angularDistance(spread.mean.rotation));
    spread.largest_distance_m = std::max(spread.largest_distance_m, spread.distance_m.back());
    spread.largest_angle_rad = std::max(spread.largest_angle_rad, spread.angle_rad.back());
  }
  return spread;
}

std::optional<double> settle_time_s(std::span<const double> time_s, std::span<const double> displacement,
                                    double allowed) {
  expect_series(time_s, displacement, allowed);
  std::size_t k = time_s.size();
  while (k > 0 && std::abs(displacement[k - 1]) <= allowed) --k;
  if (k == time_s.size()) return {};
  return time_s[k];
}

std::string repeatability_svg(std::span<const PoseSpread> places) {
  double most_mm = 1e-3, most_deg = 1e-3;
  std::size_t visits = 1;
  for (const PoseSpread& place : places) {
    most_mm = std::max(most_mm, 1000 * place.largest_distance_m);
    most_deg = std::max(most_deg, place.largest_angle_rad * 180 / std::numbers::pi);
    visits = std::max(visits, place.distance_m.size());
  }
  SvgFigure figure("Repeatability", 760, 420);
  figure.axes(0, 1.1 * most_mm, 0, 1.1 * most_deg, "distance to the mean position, mm",
              "angle to the mean rotation, degrees");
  figure.note(std::to_string(places.size()) + " places, up to " + std::to_string(visits) + " visits each");
  for (std::size_t p = 0; p < places.size(); ++p)
    for (std::size_t i = 0; i < places[p].distance_m.size(); ++i)
      figure.dot(1000 * places[p].distance_m[i], places[p].angle_rad[i] * 180 / std::numbers::pi, 3, kColors[p % 4]);
  return figure.standalone();
}

std::string stability_svg(std::span<const double> time_s, std::span<const double> displacement_px, double allowed_px) {
  expect_series(time_s, displacement_px, allowed_px);
  double most = 2 * allowed_px;
  for (const double d : displacement_px) most = std::max(most, std::abs(d));
  const auto settled = settle_time_s(time_s, displacement_px, allowed_px);
  SvgFigure figure("Displacement after the stop", 900, 420);
  const bool distances = std::all_of(displacement_px.begin(), displacement_px.end(), [](double d) { return d >= 0; });
  const double lowest = distances ? 0 : -1.05 * most;
  figure.axes(time_s.front(), time_s.back(), lowest, 1.05 * most, "s", "px");
  char note[100];
  if (settled)
    std::snprintf(note, sizeof note, "within %g px from %.2f s on", allowed_px, *settled);
  else
    std::snprintf(note, sizeof note, "not within %g px at the end", allowed_px);
  figure.note(note);
  for (const double level : {-allowed_px, allowed_px})
    if (level > lowest) figure.line(time_s.front(), level, time_s.back(), level, "level");
  if (settled) figure.line(*settled, distances ? 0 : -most, *settled, most, "mean");
  for (std::size_t i = 1; i < time_s.size(); ++i)
    figure.line(time_s[i - 1], displacement_px[i - 1], time_s[i], displacement_px[i], kColors[0]);
  return figure.standalone();
}

}  // namespace lumihull::capture
