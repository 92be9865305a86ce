// calibration.html: what a calibration found, on one page.
#include "calibration_report.h"

#include <lumihull/internal/html.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "report_parts.h"

namespace lumihull::calib {
namespace {

using lumihull::internal::html_escaped;
using lumihull::internal::number;

constexpr std::size_t kMostRemoved = 200;

constexpr const char* kStyle =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:800px;margin:2em auto;padding:0 1em;color:#222;background:#fff}"
    "td,th{padding:.1em 1em .1em 0;text-align:left;vertical-align:top}td{font-variant-numeric:tabular-nums}"
    ".verdict{font-size:1.15em;border-left:4px solid #2c9c5a;padding-left:.8em}.dim{color:#777;font-size:.9em}"
    ".problem{border-left:4px solid #d9622b;padding-left:.8em}.scroll{overflow-x:auto}summary{cursor:pointer}"
    "h2{margin:1.6em 0 .4em}figure{margin:1em 0}figcaption{font-size:.85em}svg.scene{touch-action:none}"
    ".turns{cursor:grab}svg.scene polyline{fill:none;stroke-width:1}svg .camera{stroke:#3b78d8}svg "
    ".later{stroke:#8a8f98}"
    "svg .target{stroke:#2c9c5a}svg .dot{fill:#2c9c5a}svg .sigma{stroke:#d9622b;stroke-opacity:.6}"
    "svg text.name{font-size:10px;text-anchor:middle;paint-order:stroke;stroke:#fff;stroke-width:2px}"
    ".residual{stroke:#ff28c8;stroke-width:1.2}.seen{fill:#28e650}.onmapline{stroke:#fff;stroke-width:1.2}"
    "@media (prefers-color-scheme:dark){body{color:#e8e8e8;background:#15171c}svg text.name{stroke:#15171c}}";

std::string row(const std::string& name, const std::string& value) {
  return "<tr><td>" + html_escaped(name) + "</td><td>" + html_escaped(value) + "</td></tr>\n";
}

std::string cells(const std::vector<std::string>& values, const char* tag = "td") {
  std::string out = "<tr>";
  for (const std::string& value : values) out += std::string("<") + tag + ">" + html_escaped(value) + "</" + tag + ">";
  return out + "</tr>\n";
}

/// A length with a unit that suits it.
std::string length(double metres) {
  if (!std::isfinite(metres)) return "–";
  if (std::abs(metres) < 1e-4) return number("%.3g", 1e6 * metres) + " µm";
  if (std::abs(metres) < 1) return number("%.4g", 1e3 * metres) + " mm";
  return number("%.4g", metres) + " m";
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double rotation_sigma_deg(const CalibratedPhoto& photo) {
  return 180 / std::numbers::pi * report::longest_axis(photo.covariance.topLeftCorner<3, 3>());
}

std::string figures(const TargetModel& model) {
  const Calibration& c = model.calibration;
  std::size_t placed = 0, in_model = 0, targets = 0, points = 0;
  std::vector<double> centers, rotations, places;
  for (const CalibratedPhoto& p : c.photos) {
    in_model += p.in_model;
    if (!p.cam_from_world) continue;
    ++placed;
    points += std::size_t(p.points);
    centers.push_back(report::longest_axis(report::center_covariance(p)));
    rotations.push_back(rotation_sigma_deg(p));
  }
  for (const CalibratedBody& b : c.bodies) {
    targets += b.placed;
    for (const Eigen::Matrix3d& m : b.point_covariances) places.push_back(report::longest_axis(m));
  }
  const auto of = [](std::size_t part, std::size_t all) { return std::to_string(part) + " of " + std::to_string(all); };
  std::string out = "<table>\n";
  out +=
      row("photographs with a pose", of(placed, c.photos.size()) + ", the model made from " + std::to_string(in_model));
  out += row("targets or boards placed", of(targets, c.bodies.size()));
  out += row("points that count", std::to_string(points) + ", " + number("%.1f", 100 * c.share) + " % of those seen");
  out += row("RMS residual", number("%.4f", c.rms_px) + " px");
  out += row("residuals over their covariances", number("%.3f", c.sigma0) + " (1 is right)");
  out += row("two halves of the photographs",
             c.cross_validation_m < 0 ? "too few photographs to compare"
                                      : "differ by " + length(c.cross_validation_m) + " RMS, " +
                                            number("%.2f", c.cross_validation_sigma) + " of what is expected");
  if (!centers.empty()) {
    out += row("camera centres, one standard deviation", "median " + length(median(centers)) + ", largest " +
                                                             length(*std::max_element(centers.begin(), centers.end())));
    out += row("camera directions, one standard deviation",
               "median " + number("%.2g", median(rotations)) + "°, largest " +
                   number("%.2g", *std::max_element(rotations.begin(), rotations.end())) + "°");
  }
  if (!places.empty())
    out += row("targets' points, one standard deviation", "median " + length(median(places)) + ", largest " +
                                                              length(*std::max_element(places.begin(), places.end())));
  out += row("departure from flat or as printed", length(c.bend_m));
  if (c.print_scale != Eigen::Vector2d(1, 1))
    out += row("size of the print", number("%.5f", c.print_scale.x()) + " x " + number("%.5f", c.print_scale.y()));
  if (c.parts > 1) out += row("parts that share no target", std::to_string(c.parts));
  return out +
         "</table>\n<p class=\"dim\">Standard deviations are along the longest axis, against the targets' points "
         "as a whole (inner constraints).</p>\n";
}

std::string intrinsics(const Calibration& c) {
  std::string out = "<h2>Cameras</h2>\n<div class=\"scroll\"><table>\n";
  std::vector<std::string> heading{"", "picture"};
  for (const std::string& name : intrinsic_names()) heading.push_back(name);
  out += cells(heading, "th");
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const Camera& k = c.cameras[i];
    std::vector<std::string> line{std::to_string(i), std::to_string(k.width) + " x " + std::to_string(k.height)};
    const std::array<double, kIntrinsics> values{k.f, k.s, k.skew, k.u0, k.v0, k.k1, k.k2, k.k3, k.p1, k.p2};
    for (int p = 0; p < kIntrinsics; ++p) {
      const double sigma = std::sqrt(std::max(0.0, c.camera_covariances.at(i)(p, p)));
      const bool pixels = p == 0 || p == 2 || p == 3 || p == 4;
      line.push_back(number(pixels ? "%.3f" : "%.6g", values[std::size_t(p)]) +
                     (sigma > 0 ? " ± " + number("%.2g", sigma) : ""));
    }
    out += cells(line);
  }
  return out + "</table></div>\n<p class=\"dim\">Without ±: kept as it was.</p>\n";
}

std::string removed(const TargetModel& model) {
  const Calibration& c = model.calibration;
  std::string out = "<h2>What was removed, and why</h2>\n";
  if (c.removed.empty()) return out + "<p>Nothing.</p>\n";
  std::map<std::string, std::size_t> counts;
  for (const Removed& r : c.removed) ++counts[std::string(name_of(r.kind)) + ", " + name_of(r.why)];
  out += "<table>\n";
  for (const auto& [what, n] : counts) out += row(what, std::to_string(n));
  out += "</table>\n<details" + std::string(c.removed.size() <= 20 ? " open" : "") + "><summary>Each</summary><ul>\n";
  // What concerns more comes first.
  std::vector<const Removed*> order;
  for (const Removed& r : c.removed) order.push_back(&r);
  std::stable_sort(order.begin(), order.end(), [](const Removed* a, const Removed* b) { return a->kind > b->kind; });
  for (std::size_t i = 0; i < std::min(order.size(), kMostRemoved); ++i)
    out += "<li>" + html_escaped(order[i]->text) + "</li>\n";
  if (order.size() > kMostRemoved)
    out += "<li>… and " + std::to_string(order.size() - kMostRemoved) + " more: see targets.json</li>\n";
  return out + "</ul></details>\n";
}

std::string tables(const TargetModel& model) {
  const Calibration& c = model.calibration;
  std::string out = "<h2>Photographs</h2>\n<details" + std::string(c.photos.size() <= 40 ? " open" : "") +
                    "><summary>All " + std::to_string(c.photos.size()) + "</summary><div class=\"scroll\"><table>\n" +
                    cells({"", "name", "points", "RMS, px", "centre ±", "direction ±", ""}, "th");
  for (std::size_t i = 0; i < c.photos.size(); ++i) {
    const CalibratedPhoto& p = c.photos[i];
    if (p.cam_from_world)
      out += cells({std::to_string(i), model.photos[i].name, std::to_string(p.points), number("%.4f", p.rms_px),
                    length(report::longest_axis(report::center_covariance(p))),
                    number("%.2g", rotation_sigma_deg(p)) + "°", p.reason});
    else
      out += cells({std::to_string(i), model.photos[i].name, "no pose", "", "", "", p.reason});
  }
  out += "</table></div></details>\n<h2>Targets and boards</h2>\n<details" +
         std::string(c.bodies.size() <= 40 ? " open" : "") + "><summary>All " + std::to_string(c.bodies.size()) +
         "</summary><div class=\"scroll\"><table>\n" +
         cells({"", "name", "model", "points", "photographs", "RMS, px", "points ±"}, "th");
  for (std::size_t i = 0; i < c.bodies.size(); ++i) {
    const CalibratedBody& b = c.bodies[i];
    double worst = 0;
    for (const Eigen::Matrix3d& m : b.point_covariances) worst = std::max(worst, report::longest_axis(m));
    out += cells({std::to_string(i), b.name, name_of(b.body.model), std::to_string(b.body.points.size()),
                  std::to_string(b.photos), b.placed ? number("%.4f", b.rms_px) : "not placed",
                  b.placed ? length(worst) : ""});
  }
  return out + "</table></div></details>\n";
}

}  // namespace

std::string calibration_report_html(const Capture& capture, const TargetModel& model, Job& job) {
  const Calibration& c = model.calibration;
  job.begin("report", report::kWorstShown);
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>Calibration</title><style>" +
      std::string(kStyle) + lumihull::internal::SvgFigure::style_sheet() +
      "</style></head><body>\n<h1>Calibration</h1>\n" + "<p class=\"verdict\">" + html_escaped(c.verdict) + "</p>\n";
  for (const std::string& warning : c.warnings) page += "<p class=\"problem\">" + html_escaped(warning) + "</p>\n";
  page += figures(model);
  page += "<h2>Cameras and targets</h2>\n" + report::scene(model);
  page += "<h2>Residuals</h2>\n" + report::over_the_picture(model) + report::by_thing(model);
  page += "<h2>Photographs that fit worst</h2>\n" + report::worst_photographs(capture, model, job);
  page += removed(model) + intrinsics(c) + tables(model) + report::scene_script();
  job.end();
  return page + "</body></html>\n";
}

}  // namespace lumihull::calib
