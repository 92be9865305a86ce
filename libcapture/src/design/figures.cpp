#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/capture/mechanism_figures.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string_view>

namespace lumihull::capture {
namespace {

using lumihull::internal::map_color;
using lumihull::internal::number;
using lumihull::internal::SvgFigure;

constexpr double kDegree = std::numbers::pi / 180;
// Told apart by those who see few colours, too (Okabe & Ito 2008), then repeated.
constexpr std::array<std::string_view, 6> kCableColors = {"#0072b2", "#d55e00", "#009e73",
                                                          "#cc79a7", "#e69f00", "#56b4e9"};
constexpr double kFrameX = 78, kFrameY = 92;  // what a figure's frame needs beside the data, px
constexpr double kPerMetre = 36;              // px

std::string_view cable_color(std::size_t cable) { return kCableColors[cable % kCableColors.size()]; }

void need_indices(const Workspace& workspace, int azimuth, int step) {
  if (azimuth < 0 || azimuth >= workspace.azimuths || step < 0 || step >= workspace.polar_steps)
    throw Error(ErrorCode::invalid_argument, "expected an azimuth and a step of the workspace", "figure");
}

/// One projection; u and v are the world's axes across and up.
std::string projection(const Mechanism& mechanism, const Workspace& workspace, const KeepOut* object, const Pose& pose,
                       int u, int v, const std::string& title) {
  const Eigen::Vector3d low = mechanism.room.min(), high = mechanism.room.max();
  SvgFigure figure(title, kFrameX + kPerMetre * (high[u] - low[u]), kFrameY + kPerMetre * (high[v] - low[v]));
  static constexpr const char* kLabels[] = {"x, m", "y, m", "z, m"};
  figure.axes(low[u], high[u], low[v], high[v], kLabels[u], kLabels[v]);
  const auto segment = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, std::string_view style) {
    figure.line(a[u], a[v], b[u], b[v], style);
  };
  if (object) {
    const Eigen::Vector3d r = Eigen::Vector3d::Constant(object->radius_m),
                          top = object->base + Eigen::Vector3d(0, 0, object->height_m);
    if (v == 2)
      figure.box(object->base[u] - object->radius_m, object->base.z(), object->base[u] + object->radius_m, top.z(),
                 "#bbbbbb");
    figure.dot(top[u], top[v], kPerMetre * r.x(), "#bbbbbb");
  }
  constexpr int kArc = 90;
  for (int i = 0; i < kArc; ++i) {
    const auto at = [&](int k) {
      const double angle = (v == 2 ? std::numbers::pi : 2 * std::numbers::pi) * k / kArc;
      Eigen::Vector3d p = workspace.center;
      p[u] += workspace.radius_m * std::cos(angle), p[v] += workspace.radius_m * std::sin(angle);
      return p;
    };
    segment(at(i), at(i + 1), "level");
  }
  for (std::size_t i = 0; i < mechanism.cables.size(); ++i) {
    const Cable& cable = mechanism.cables[i];
    segment(cable.departure, pose * cable.attachment, cable_color(i));
    figure.dot(cable.departure[u], cable.departure[v], 4, cable_color(i));
  }
  for (std::size_t i = 0; i < mechanism.cables.size(); ++i)
    segment(pose * mechanism.cables[i].attachment,
            pose * mechanism.cables[(i + 1) % mechanism.cables.size()].attachment, "#222222");
  for (std::size_t i = 0; i < mechanism.cables.size(); ++i) {
    const Eigen::Vector3d d = mechanism.cables[i].departure, middle = 0.5 * (low + high);
    figure.text(d[u] + (d[u] < middle[u] ? 0.25 : -0.25), d[v] + (d[v] < middle[v] ? 0.25 : -0.25),
                mechanism.cables[i].name, "onmap");
  }
  segment(pose.translation, workspace.center, "grid");
  return figure.standalone();
}

struct MapStyle {
  std::string title, unit;
  const char* format;
  std::function<double(const PoseReport&)> value;
  bool low_is_good;
};

MapStyle style_of(WorkspaceValue value) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  switch (value) {
    case WorkspaceValue::least_tension:
      return {"Least tension of a cable", "N", "%.3g",
              [=](const PoseReport& p) { return p.balanced() ? p.tensions.tension_N.minCoeff() : none; }, false};
    case WorkspaceValue::clearance:
      return {"Least clearance", "cm", "%.3g", [](const PoseReport& p) { return 100 * least_clearance_m(p.clearance); },
              false};
    case WorkspaceValue::sight:
      return {"Angle between cables and the sight of the object", "°", "%.3g",
              [](const PoseReport& p) { return p.sight_rad / kDegree; }, false};
    case WorkspaceValue::rotation_sensitivity:
      return {"Turn of the platform for 1 mm of cable error", "°", "%.2g",
              [=](const PoseReport& p) { return p.balanced() ? p.sensitivity.rotation_each * 1e-3 / kDegree : none; },
              true};
    case WorkspaceValue::balance:
      break;
  }
  return {"Balance", "", "%.0f", {}, false};
}

std::string_view balance_color(Balance balance) {
  switch (balance) {
    case Balance::controlled:
      return "#5ec962";
    case Balance::loose:
      return "#f0d060";
    case Balance::singular:
      return "#999999";
    case Balance::unbalanced:
      break;
  }
  return "#d9622b";
}

}  // namespace

std::string draw_mechanism(const Mechanism& mechanism, const Workspace& workspace, const KeepOut* object, int azimuth,
                           int step) {
  check(mechanism);
  check(workspace);
  need_indices(workspace, azimuth, step);
  const Pose pose = workspace.pose(azimuth, step);
  const std::string above = projection(mechanism, workspace, object, pose, 0, 1, "From above"),
                    front = projection(mechanism, workspace, object, pose, 0, 2, "From the front");
  const Eigen::Vector3d size = mechanism.room.sizes();
  const double width = kFrameX + kPerMetre * size.x();
  const std::string whole =
      number("%.0f", 2 * width) + " " + number("%.0f", kFrameY + kPerMetre * std::max(size.y(), size.z()));
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + whole +
         "\"><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>" + above + "<g transform=\"translate(" +
         number("%.0f", width) + " 0)\">" + front + "</g></svg>\n";
}

std::string draw_map(const WorkspaceReport& report, WorkspaceValue value) {
  const Workspace& w = report.workspace;
  const MapStyle style = style_of(value);
  SvgFigure figure(style.title, 760, 330);
  const double dt = 360.0 / w.azimuths, dp = (w.phi(1) - w.phi(0)) / kDegree;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  int balanced = 0, crossings = 0;
  for (const PoseReport& p : report.poses) {
    balanced += p.balanced(), crossings += p.crossing.has_value();
    const double x = style.value ? style.value(p) : 0;
    if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
  }
  if (style.value)
    figure.note(number(style.format, low) + style.unit + " (" + (style.low_is_good ? "bright" : "dark") + ") to " +
                number(style.format, high) + style.unit + " (" + (style.low_is_good ? "dark" : "bright") +
                "); grey: not balanced");
  else
    figure.note(std::to_string(balanced) + " of " + std::to_string(report.poses.size()) +
                " poses balanced (green; yellow: beyond the tensions' limits), " + std::to_string(crossings) +
                " crossings (dots)");
  figure.axes(-dt / 2, 360 - dt / 2, w.last_phi_rad / kDegree + dp / 2, w.first_phi_rad / kDegree - dp / 2,
              "azimuth θ of the view, degrees", "φ from the zenith, degrees", 30);
  for (int a = 0; a < w.azimuths; ++a)
    for (int s = 0; s < w.polar_steps; ++s) {
      const PoseReport& p = report.at(a, s);
      const double x = style.value ? style.value(p) : 0, t = high > low ? (x - low) / (high - low) : 0.5;
      const std::string color = !style.value       ? std::string(balance_color(p.tensions.balance))
                                : std::isfinite(x) ? map_color(style.low_is_good ? 1 - t : t)
                                                   : "#cccccc";
      const double theta = a * dt, phi = w.phi(s) / kDegree;
      figure.box(theta - dt / 2, phi - dp / 2, theta + dt / 2, phi + dp / 2, color);
    }
  for (int a = 0; a < w.azimuths; ++a)
    for (int s = 0; s < w.polar_steps; ++s)
      if (report.at(a, s).crossing) {
        const bool down = s + 1 < w.polar_steps;
        figure.dot((a + (down ? 0 : 0.5)) * dt, w.phi(s) / kDegree + (down ? dp / 2 : 0), 3.5, "#000000");
      }
  return figure.standalone();
}

std::string draw_tensions(const WorkspaceReport& report, const Mechanism& mechanism, int azimuth) {
  const Workspace& w = report.workspace;
  need_indices(w, azimuth, 0);
  SvgFigure figure("Tensions at the azimuth " + number("%.0f", w.theta(azimuth) / kDegree) + "°", 760, 320);
  double most = 1;
  for (int s = 0; s < w.polar_steps; ++s)
    if (report.at(azimuth, s).balanced()) most = std::max(most, report.at(azimuth, s).tensions.tension_N.maxCoeff());
  figure.axes(w.first_phi_rad / kDegree, w.last_phi_rad / kDegree, 0, 1.05 * most, "φ from the zenith, degrees",
              "tension, N");
  for (std::size_t i = 0; i < mechanism.cables.size(); ++i) {
    const auto at = [&](int s) { return report.at(azimuth, s).tensions.tension_N[Eigen::Index(i)]; };
    for (int s = 0; s < w.polar_steps; ++s) {
      if (!report.at(azimuth, s).balanced()) continue;
      figure.dot(w.phi(s) / kDegree, at(s), 3, cable_color(i));
      if (s + 1 < w.polar_steps && report.at(azimuth, s + 1).balanced())
        figure.line(w.phi(s) / kDegree, at(s), w.phi(s + 1) / kDegree, at(s + 1), cable_color(i));
    }
    const double share = (double(i) + 0.5) / double(mechanism.cables.size());
    const double x = (w.first_phi_rad + share * (w.last_phi_rad - w.first_phi_rad)) / kDegree;
    figure.dot(x, 1.02 * most, 4, cable_color(i));
    figure.text(x + 0.02 * (w.last_phi_rad - w.first_phi_rad) / kDegree, 1.02 * most, mechanism.cables[i].name, "onmap",
                "start");
  }
  return figure.standalone();
}

std::string draw_tilt_ranges(const Mechanism& mechanism, const Workspace& workspace, double least_tension_N, Job& job) {
  check(mechanism);
  check(workspace);
  const auto steps = std::size_t(workspace.polar_steps);
  std::vector<TiltRange> narrow(steps), wide(steps);
  job.begin("tilt", steps);
  parallel_for(
      job, steps,
      [&](std::size_t s) {
        narrow[s] = {-std::numbers::pi / 2, std::numbers::pi / 2}, wide[s] = {0, 0};
        for (int a = 0; a < workspace.azimuths; ++a) {
          TiltRange r = tilt_range(mechanism, workspace, a, int(s), least_tension_N);
          if (!std::isfinite(r.low_rad)) r = {0, 0};
          narrow[s] = {std::max(narrow[s].low_rad, r.low_rad), std::min(narrow[s].high_rad, r.high_rad)};
          wide[s] = {std::min(wide[s].low_rad, r.low_rad), std::max(wide[s].high_rad, r.high_rad)};
        }
      },
      true);
  job.end();
  SvgFigure figure("How far the platform tilts", 760, 420);
  figure.note(
      "blue: at every azimuth; grey: at the best azimuth; green: wanted with the camera's offset; orange: without");
  const double first = workspace.first_phi_rad / kDegree, last = workspace.last_phi_rad / kDegree;
  figure.axes(first, last, -90, 90, "φ from the zenith, degrees", "tilt φ_t, degrees (positive: top outwards)");
  const auto line = [&](const std::function<double(std::size_t)>& y, std::string_view style) {
    for (std::size_t s = 0; s + 1 < steps; ++s)
      figure.line(workspace.phi(int(s)) / kDegree, y(s) / kDegree, workspace.phi(int(s) + 1) / kDegree,
                  y(s + 1) / kDegree, style);
  };
  line([&](std::size_t s) { return wide[s].low_rad; }, "#aaaaaa");
  line([&](std::size_t s) { return wide[s].high_rad; }, "#aaaaaa");
  line([&](std::size_t s) { return narrow[s].low_rad; }, "#0072b2");
  line([&](std::size_t s) { return narrow[s].high_rad; }, "#0072b2");
  line([&](std::size_t s) { return workspace.tilt_factor * workspace.phi(int(s)) + workspace.tilt_offset_rad; },
       "#009e73");
  line([&](std::size_t s) { return workspace.phi(int(s)); }, "#d55e00");
  return figure.standalone();
}

}  // namespace lumihull::capture
