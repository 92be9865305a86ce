#include <lumihull/base/error.h>
#include <lumihull/capture/mechanism_calibration.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "length_fit.h"

namespace lumihull::capture {
namespace {

using design::LengthLayout;
using design::LengthObservation;
using design::LengthParameters;

constexpr double kSamePoint = 1e-6;    // m
constexpr double kLeastSpread = 0.05;  // m, of the cameras' positions

[[noreturn]] void fail(ErrorCode code, const std::string& message, const std::string& subject = "calibration") {
  throw Error(code, message, subject);
}

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", 1e3 * metres);
  return text;
}

void check_options(const MechanismCalibrationOptions& o) {
  const auto positive = [](double value, const char* name) {
    if (!(value > 0) || !std::isfinite(value))
      fail(ErrorCode::invalid_argument, std::string("expected ") + name + " > 0 and finite", "options");
  };
  positive(o.position_sigma_m, "position_sigma_m");
  positive(o.rotation_sigma_rad, "rotation_sigma_rad");
  positive(o.length_sigma_m, "length_sigma_m");
  positive(o.largest_rms_m, "largest_rms_m");
}

std::string name_of(const MechanismObservation& observation, std::size_t index) {
  return "observation " + (observation.name.empty() ? std::to_string(index) : observation.name);
}

void check_observation(const MechanismObservation& o, std::size_t index, std::size_t cables) {
  const auto bad = [&](const std::string& message) { fail(ErrorCode::bad_input, message, name_of(o, index)); };
  if (!o.cam_from_world.translation.allFinite() || !o.cam_from_world.rotation.coeffs().allFinite() ||
      std::abs(o.cam_from_world.rotation.norm() - 1) > 1e-6)
    bad("expected a finite pose with a unit quaternion");
  if (!std::isfinite(o.bearing_rad)) bad("expected a finite angle of the bearing");
  if (o.bearing_group < 0) bad("expected a bearing group >= 0");
  if (o.commanded_m.size() != cables)
    bad("expected " + std::to_string(cables) + " commanded lengths, not " + std::to_string(o.commanded_m.size()));
  for (const double m : o.commanded_m)
    if (!std::isfinite(m)) bad("expected finite commanded lengths");
  if (!o.covariance) return;
  const Eigen::Matrix<double, 6, 6>& c = *o.covariance;
  if (!c.allFinite() || (c - c.transpose()).cwiseAbs().maxCoeff() > 1e-6 * c.cwiseAbs().maxCoeff() ||
      !(Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(c, Eigen::EigenvaluesOnly).eigenvalues()[0] >=
        -1e-9 * c.cwiseAbs().maxCoeff()))
    bad("expected a covariance that is symmetric and not negative");
}

/// Attachments that coincide are one point, where that is wanted.
LengthLayout layout_of(const Mechanism& guess, const MechanismCalibrationOptions& options,
                       std::vector<Eigen::Vector3d>& points) {
  LengthLayout layout;
  layout.cables = int(guess.cables.size());
  layout.gains = options.gains;
  for (const Cable& cable : guess.cables) {
    const auto same = [&](const Eigen::Vector3d& p) {
      return options.shared_attachments && (p - cable.attachment).norm() < kSamePoint;
    };
    const auto found = std::find_if(points.begin(), points.end(), same);
    layout.point_of_cable.push_back(int(found - points.begin()));
    if (found == points.end()) points.push_back(cable.attachment);
  }
  layout.points = int(points.size());
  return layout;
}

std::string described(const Eigen::VectorXd& direction, const std::vector<std::string>& names) {
  std::vector<int> order(names.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = int(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  std::string out;
  const double largest = std::abs(direction[order[0]]);
  std::size_t strong = 0;
  for (const int i : order) strong += std::abs(direction[i]) > 0.3 * largest;
  for (std::size_t i = 0; i < std::min<std::size_t>(strong, 4); ++i)
    out += (i == 0 ? "" : ", ") + names[std::size_t(order[i])];
  return out + (strong > 4 ? " and others, together" : strong > 1 ? ", together" : "");
}

}  // namespace

MechanismCalibration calibrate_mechanism(const Mechanism& guess, std::span<const MechanismObservation> observations,
                                         const MechanismCalibrationOptions& options) {
  check_options(options);
  check(guess, "the guess");
  LengthParameters start;
  LengthLayout layout = layout_of(guess, options, start.attachments);
  double off_axis = 0;
  for (const Eigen::Vector3d& b : start.attachments) off_axis = std::max(off_axis, b.head<2>().norm());
  if (layout.points < 2 || off_axis < 1e-3)
    fail(ErrorCode::invalid_argument, "expected attachment points that differ and lie off the bearing's axis",
         "the guess");

  std::map<int, double> bearings;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    check_observation(observations[k], k, guess.cables.size());
    bearings.emplace(observations[k].bearing_group, observations[k].bearing_rad);
  }
  std::map<int, int> index_of_group;
  MechanismCalibration result;
  for (const auto& [group, bearing] : bearings) {
    index_of_group[group] = int(result.bearing_groups.size());
    result.bearing_groups.push_back(group);
    start.bearings.push_back(bearing);
  }
  layout.groups = std::max(1, int(bearings.size()));
  const std::size_t needed = std::size_t(layout.size() - 2 + layout.cables - 1) / std::size_t(layout.cables) + 1;
  if (observations.size() < needed)
    fail(ErrorCode::degenerate, "expected at least " + std::to_string(needed) + " observations for " +
                                    std::to_string(layout.size() - 2) + " unknowns, not " +
                                    std::to_string(observations.size()));

  Eigen::Matrix<double, 6, 6> usual = Eigen::Matrix<double, 6, 6>::Zero();
  usual.diagonal().head<3>().setConstant(options.rotation_sigma_rad * options.rotation_sigma_rad);
  usual.diagonal().tail<3>().setConstant(options.position_sigma_m * options.position_sigma_m);
  std::vector<LengthObservation> ready;
  Eigen::AlignedBox3d box;
  for (const MechanismObservation& o : observations) {
    ready.push_back({o.cam_from_world, index_of_group[o.bearing_group],
                     Eigen::Map<const Eigen::VectorXd>(o.commanded_m.data(), Eigen::Index(o.commanded_m.size())),
                     o.covariance.value_or(usual)});
    box.extend(o.cam_from_world.center());
  }
  if (box.diagonal().norm() < kLeastSpread)
    fail(ErrorCode::degenerate, "the cameras stand within " + millimetres(box.diagonal().norm()) +
                                    " of each other; expected poses all over the workspace");

  // Offsets and gains of the guess are what its geometry leaves on average: a winch may count from anywhere.
  for (const Cable& cable : guess.cables) start.departures.push_back(cable.departure);
  start.offsets.assign(guess.cables.size(), 0);
  start.gains.assign(guess.cables.size(), 1);
  start.cam_from_platform = guess.cam_from_platform;
  std::vector<std::vector<double>> left(guess.cables.size());
  for (const LengthObservation& o : ready) {
    const Eigen::VectorXd r = design::length_residuals(layout, start, o, nullptr, nullptr);
    for (std::size_t i = 0; i < left.size(); ++i) left[i].push_back(r[Eigen::Index(i)]);
  }
  for (std::size_t i = 0; i < left.size(); ++i) {
    const auto middle = left[i].begin() + std::ptrdiff_t(left[i].size() / 2);
    std::nth_element(left[i].begin(), middle, left[i].end());
    start.offsets[i] = *middle;
  }

  const design::LengthFit fit = design::fit_lengths(layout, start, ready, options.length_sigma_m);
  if (!(fit.rms_m <= options.largest_rms_m))
    fail(ErrorCode::degenerate,
         "lengths and poses do not belong together: they differ by " + millimetres(fit.rms_m) +
             " (RMS) in the best fit; is it another mechanism, another unit, or a guess far off?");
  if (3 * fit.rejected.size() > observations.size())
    fail(ErrorCode::degenerate, std::to_string(fit.rejected.size()) + " of " + std::to_string(observations.size()) +
                                    " poses contradict the others; expected less than a third");
  result.parameters = layout.names(guess, result.bearing_groups);
  if (4 * fit.unobservable.size() > std::size_t(layout.size()))
    fail(ErrorCode::degenerate, std::to_string(fit.unobservable.size()) + " combinations of " +
                                    std::to_string(layout.size()) +
                                    " unknowns are not told by these poses; expected poses all over the workspace");

  result.mechanism = guess;
  for (std::size_t i = 0; i < guess.cables.size(); ++i) {
    result.mechanism.cables[i].departure = fit.parameters.departures[i];
    result.mechanism.cables[i].attachment = fit.parameters.attachments[std::size_t(layout.point_of_cable[i])];
    result.mechanism.room.extend(fit.parameters.departures[i]);
  }
  result.mechanism.cam_from_platform = fit.parameters.cam_from_platform;
  result.offsets_m = fit.parameters.offsets;
  result.gains = fit.parameters.gains;
  result.bearings_rad = fit.parameters.bearings;
  result.length_rms_m = fit.rms_m;
  result.sigma0 = fit.sigma0;
  result.rejected = fit.rejected;
  result.covariance = fit.covariance * std::max(1.0, fit.sigma0 * fit.sigma0);
  for (const Eigen::VectorXd& direction : fit.unobservable)
    result.unobservable.push_back(described(direction, result.parameters));
  return result;
}

CableVector commanded_lengths(const MechanismCalibration& calibration, const Pose& world_from_platform) {
  CableVector lengths = cable_lengths(calibration.mechanism, world_from_platform);
  if (calibration.offsets_m.size() != std::size_t(lengths.size()) ||
      calibration.gains.size() != std::size_t(lengths.size()))
    fail(ErrorCode::invalid_argument, "expected an offset and a gain for each cable");
  for (Eigen::Index i = 0; i < lengths.size(); ++i)
    lengths[i] = (lengths[i] - calibration.offsets_m[std::size_t(i)]) / calibration.gains[std::size_t(i)];
  return lengths;
}

}  // namespace lumihull::capture
