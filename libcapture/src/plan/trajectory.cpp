// Stops on a hemisphere: rows, azimuths, tilt, bearing.
#include <lumihull/base/error.h>
#include <lumihull/capture/statics.h>
#include <lumihull/capture/trajectory.h>
#include <lumihull/capture/workspace.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "expect.h"

namespace lumihull::capture {
namespace {

using internal::expect_between;

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

struct Place {
  double theta, phi;
  int azimuth, row;
};

/// Steps of at most `step` in a range; a hair more counts as equal.
int steps_in(double range, double step) { return int(std::ceil(range / step - 1e-9)); }

int row_count(const HemisphereOptions& o) {
  return o.spacing_rad > 0 ? 1 + steps_in(o.phi_to_rad - o.phi_from_rad, o.spacing_rad) : o.rows;
}

double row_phi(const HemisphereOptions& o, int row, int rows) {
  return rows > 1 ? o.phi_from_rad + (o.phi_to_rad - o.phi_from_rad) * row / (rows - 1) : o.phi_to_rad;
}

int azimuth_count(const HemisphereOptions& o, double phi) {
  const double equator = o.spacing_rad > 0 ? steps_in(2 * kPi, o.spacing_rad) : o.azimuths;
  if (!o.thin) return int(equator);
  return std::max(1, int(std::ceil(equator * std::abs(std::sin(phi)) - 1e-9)));
}

std::vector<Place> places(const HemisphereOptions& o) {
  check(o);
  std::vector<Place> all;
  const int rows = row_count(o);
  for (int row = 0; row < rows; ++row) {
    const double phi = row_phi(o, row, rows);
    const int n = azimuth_count(o, phi);
    for (int i = 0; i < n; ++i) all.push_back({2 * kPi * i / n, phi, i, row});
  }
  return all;
}

std::string place_name(const Place& place) {
  char text[48];
  std::snprintf(text, sizeof text, "a%03d-e%02d", place.azimuth, place.row);
  return text;
}

/// Azimuths on the circle covered by arcs of twice the tolerance, one after the other from azimuth 0; each gets the
/// middle of its arc. `places` are sorted by theta.
std::vector<double> bearings(const std::vector<Place>& places, double tolerance) {
  std::vector<double> roll(places.size());
  for (std::size_t first = 0; first < places.size();) {
    std::size_t end = first;
    while (end < places.size() && places[end].theta <= places[first].theta + 2 * tolerance + 1e-9) ++end;
    const double middle = 0.5 * (places[first].theta + places[end - 1].theta);
    for (; first < end; ++first) roll[first] = middle;
  }
  return roll;
}

}  // namespace

void check(const HemisphereOptions& o) {
  for (int k = 0; k < 3; ++k) expect_between(o.center[k], -1e5, 1e5, "centre of the views, m");
  expect_between(o.radius_m, 1e-3, 1000, "radius, m");
  expect_between(o.azimuths, 1, 100000, "azimuths");
  expect_between(o.rows, 1, 10000, "rows");
  if (o.spacing_rad != 0) expect_between(o.spacing_rad, 1e-4, kPi, "spacing, rad");
  expect_between(o.phi_from_rad, 0, kPi, "first polar angle, rad");
  expect_between(o.phi_to_rad, o.phi_from_rad, kPi, "last polar angle, rad");
  expect_between(o.tilt_factor, -10, 10, "tilt factor");
  expect_between(o.tilt_offset_rad, -kPi, kPi, "tilt offset, rad");
  expect_between(o.bearing_tolerance_rad, 0, kPi / 2, "bearing tolerance, rad");
  expect_between(o.settle_s, 0, 86400, "settling, s");
  expect_between(o.exposure_s, 1e-6, 86400, "exposure, s");
  std::size_t stops = 0;
  const int rows = row_count(o);
  for (int row = 0; row < rows && stops <= kMaxPlannedStops; ++row)
    stops += std::size_t(azimuth_count(o, row_phi(o, row, rows)));
  if (stops > kMaxPlannedStops)
    throw Error(ErrorCode::invalid_argument,
                "expected at most " + std::to_string(kMaxPlannedStops) + " stops: fewer steps, or wider spacing",
                "trajectory");
}

PlannedStop platform_stop(const Mechanism& mechanism, const Vector3d& center, const Pose& world_from_platform,
                          double roll_rad) {
  PlannedStop stop;
  stop.roll_rad = roll_rad;
  stop.world_from_platform = world_from_platform;
  stop.cam_from_world = cam_from_platform(mechanism, roll_rad) * world_from_platform.inverse();
  const CableVector lengths = cable_lengths(mechanism, world_from_platform);
  stop.lengths_m.assign(lengths.data(), lengths.data() + lengths.size());
  const Vector3d out = world_from_platform.translation - center;
  const double across = std::hypot(out.x(), out.y());
  stop.phi_rad = std::atan2(across, out.z());
  stop.theta_rad = across > 1e-12 ? std::atan2(out.y(), out.x()) : roll_rad;
  if (stop.theta_rad < 0) stop.theta_rad += 2 * kPi;
  return stop;
}

std::vector<PlannedStop> hemisphere_stops(const Mechanism& mechanism, const HemisphereOptions& options) {
  std::vector<Place> all = places(options);
  std::stable_sort(all.begin(), all.end(), [](const Place& a, const Place& b) {
    return a.theta != b.theta ? a.theta < b.theta : a.phi < b.phi;
  });
  const std::vector<double> shared = bearings(all, options.bearing_tolerance_rad);
  std::vector<PlannedStop> stops;
  stops.reserve(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Place& place = all[i];
    const Pose pose = platform_pose(options.center, options.radius_m, place.theta, place.phi, options.tilt_factor,
                                    options.tilt_offset_rad);
    const double roll = options.bearing == Bearing::fixed     ? 0
                        : options.bearing == Bearing::gravity ? shared[i]
                                                              : place.theta;
    PlannedStop stop = platform_stop(mechanism, options.center, pose, roll);
    stop.name = place_name(place);
    stop.theta_rad = place.theta, stop.phi_rad = place.phi;  // exactly, at the zenith, too
    stop.settle_s = options.settle_s, stop.exposure_s = options.exposure_s;
    stops.push_back(std::move(stop));
  }
  return stops;
}

std::vector<PlannedStop> hemisphere_views(const HemisphereOptions& options, Orientation orientation) {
  std::vector<Place> all = places(options);
  std::stable_sort(all.begin(), all.end(), [](const Place& a, const Place& b) {
    if (a.row != b.row) return a.row > b.row;
    return a.row % 2 == 0 ? a.theta < b.theta : a.theta > b.theta;
  });
  std::vector<PlannedStop> stops;
  stops.reserve(all.size());
  for (const Place& place : all) {
    const double st = std::sin(place.theta), ct = std::cos(place.theta), sp = std::sin(place.phi),
                 cp = std::cos(place.phi);
    const Vector3d out(sp * ct, sp * st, cp), up(-cp * ct, -cp * st, sp), along(-st, ct, 0);
    PlannedStop stop;
    stop.name = place_name(place);
    stop.theta_rad = place.theta, stop.phi_rad = place.phi;
    stop.roll_rad = orientation == Orientation::portrait ? kPi / 2 : 0;
    stop.cam_from_world = look_at(options.center + options.radius_m * out, options.center,
                                  orientation == Orientation::portrait ? along : up);
    stop.world_from_platform = stop.cam_from_world.inverse();
    stop.settle_s = options.settle_s, stop.exposure_s = options.exposure_s;
    stops.push_back(std::move(stop));
  }
  return stops;
}

}  // namespace lumihull::capture
