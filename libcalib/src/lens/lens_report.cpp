// What a calibration found, as one page: tables, and residuals and uncertainty over the picture.
#include <lumihull/base/error.h>
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/internal/html.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::calib {
namespace {

using lumihull::internal::html_escaped;
using lumihull::internal::number;
using lumihull::internal::SvgFigure;

/// More vectors than this would make a page that no browser likes; every nth is drawn then.
constexpr std::size_t kMostDrawn = 6000;

struct Seen {
  Eigen::Vector2d pixel, error;
  int view = 0;
  bool outlier = false;
};

std::string vectors(const LensCalibration& c, const std::vector<Seen>& seen) {
  const double w = c.camera.width, h = c.camera.height;
  SvgFigure figure("Residuals over the picture", 760, 760 * std::clamp(h / w, 0.3, 2.0) + 40);
  const double times = lumihull::internal::magnification(c.rms_px, 0.02 * w);
  const std::size_t step = seen.size() / kMostDrawn + 1;
  figure.note("measured less predicted, " + number("%g", times) + " times as large" +
              (step > 1 ? ", every " + std::to_string(step) + "th" : "") + "; orange: outliers; green: means of cells");
  figure.axes(0, w, h, 0, "u, px", "v, px");
  for (std::size_t i = 0; i < seen.size(); i += step) {
    const Seen& s = seen[i];
    if (!s.error.allFinite()) continue;
    // Outliers may be as far off as the picture is wide: they end at a tenth of it.
    Eigen::Vector2d tip = times * s.error;
    if (tip.norm() > 0.1 * w) tip *= 0.1 * w / tip.norm();
    figure.line(s.pixel.x(), s.pixel.y(), s.pixel.x() + tip.x(), s.pixel.y() + tip.y(), s.outlier ? "wrong" : "arrow");
    figure.dot(s.pixel.x(), s.pixel.y(), 1.6, s.outlier ? "outlier" : "point");
  }
  // What is systematic stands out in means: 10 cells across, where there are at least 5 points.
  constexpr int kColumns = 10, kRows = 8;
  std::vector<Eigen::Vector3d> cells(kColumns * kRows, Eigen::Vector3d::Zero());
  for (const Seen& s : seen) {
    const int x = int(kColumns * s.pixel.x() / w), y = int(kRows * s.pixel.y() / h);
    if (!s.outlier && x >= 0 && y >= 0 && x < kColumns && y < kRows)
      cells[std::size_t(y * kColumns + x)] += s.error.homogeneous();
  }
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Eigen::Vector3d& cell = cells[std::size_t(i)];
    if (cell.z() < 5) continue;
    const double x = w * (i % kColumns + 0.5) / kColumns, y = h * (i / kColumns + 0.5) / kRows;
    figure.line(x, y, x + times * cell.x() / cell.z(), y + times * cell.y() / cell.z(), "mean");
    figure.dot(x, y, 2.5, "#2c9c5a");
  }
  return figure.str();
}

std::string by_radius(const LensCalibration& c, const std::vector<Seen>& seen) {
  SvgFigure figure("Residuals by distance from the principal point", 760, 340);
  const Eigen::Vector2d center(c.camera.u0, c.camera.v0);
  double farthest = 1, limit = 1e-6;
  for (const Seen& s : seen) {
    if (s.outlier) continue;
    farthest = std::max(farthest, (s.pixel - center).norm());
    limit = std::max(limit, s.error.cwiseAbs().maxCoeff());
  }
  figure.note("the part along the radius; green: mean of a twelfth, dashed: plus and minus its standard deviation");
  figure.axes(0, farthest, -limit, limit, "distance, px", "residual outwards, px");
  constexpr int kBins = 12;
  std::array<double, kBins> n{}, sum{}, squares{};
  const std::size_t step = seen.size() / kMostDrawn + 1;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Seen& s = seen[i];
    const Eigen::Vector2d out = s.pixel - center;
    const double r = out.norm();
    if (s.outlier || !(r > 0)) continue;
    const double along = s.error.dot(out) / r;
    const std::size_t bin = std::size_t(std::min(kBins - 1, int(kBins * r / farthest)));
    n[bin] += 1, sum[bin] += along, squares[bin] += along * along;
    if (i % step == 0) figure.dot(r, along, 1.6, "point");
  }
  for (int i = 0; i < kBins; ++i) {
    const std::size_t b = std::size_t(i);
    if (n[b] < 3) continue;
    const double mean = sum[b] / n[b], deviation = std::sqrt(std::max(0.0, squares[b] / n[b] - mean * mean));
    const double x0 = farthest * i / kBins, x1 = farthest * (i + 1) / kBins;
    figure.line(x0, mean, x1, mean, "mean");
    for (const double sign : {-1.0, 1.0})
      figure.line(x0, mean + sign * deviation, x1, mean + sign * deviation, "level");
  }
  return figure.str();
}

std::string by_view(const LensCalibration& c, std::span<const BoardView> views, const std::vector<Seen>& seen) {
  std::vector<double> sum(views.size(), 0), n(views.size(), 0);
  for (const Seen& s : seen)
    if (!s.outlier) sum[std::size_t(s.view)] += s.error.squaredNorm(), n[std::size_t(s.view)] += 1;
  double most = c.rms_px;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (n[i] > 0) most = std::max(most, std::sqrt(sum[i] / n[i]));
  SvgFigure figure("RMS of each view", 760, 300);
  figure.note("dashed: of all points that count");
  const double last = double(views.size()) - 0.5;  // a bar stands about its view's number
  figure.axes(-0.5, last, 0, 1.1 * most, "view", "RMS, px", 1);
  for (std::size_t i = 0; i < views.size(); ++i)
    if (n[i] > 0) figure.box(double(i) - 0.35, 0, double(i) + 0.35, std::sqrt(sum[i] / n[i]), "bar");
  figure.line(-0.5, c.rms_px, last, c.rms_px, "level");
  return figure.str();
}

std::string uncertainty_map(const LensCalibration& c) {
  const double w = c.camera.width, h = c.camera.height;
  constexpr int kColumns = 40, kRows = 30;
  const std::vector<double> sigma = projection_uncertainty(c, kColumns, kRows);
  double low = 1e300, high = 0;
  for (const double s : sigma)
    if (std::isfinite(s)) low = std::min(low, s), high = std::max(high, s);
  SvgFigure figure("Uncertainty of projections", 760, 760 * std::clamp(h / w, 0.3, 2.0) + 40);
  figure.note("standard deviation (px, larger axis) of a distant point's pixel, the best rotation taken off: " +
              number("%.3g", low) + " to " + number("%.3g", high));
  figure.axes(0, w, h, 0, "u, px", "v, px");
  for (int i = 0; i < kColumns * kRows; ++i) {
    const double x = w * (i % kColumns) / kColumns, y = h * (i / kColumns) / kRows, s = sigma[std::size_t(i)];
    // Logarithmic: corners are often ten times worse than the middle.
    const double t =
        high > low && s > 0 ? std::log(s / std::max(low, 1e-300)) / std::log(high / std::max(low, 1e-300)) : 0;
    figure.box(x, y, x + w / kColumns, y + h / kRows, std::isfinite(s) ? lumihull::internal::map_color(t) : "#808080");
  }
  for (int y = 2; y < kRows; y += 5)
    for (int x = 2; x < kColumns; x += 7)
      figure.text(w * (x + 0.5) / kColumns, h * (y + 0.5) / kRows, number("%.2g", sigma[std::size_t(y * kColumns + x)]),
                  "onmap");
  return figure.str();
}

std::string row(const std::string& name, const std::string& value) {
  return "<tr><td>" + html_escaped(name) + "</td><td>" + html_escaped(value) + "</td></tr>\n";
}

}  // namespace

std::string lens_report_html(const LensCalibration& c, std::span<const BoardView> views, const std::string& title) {
  c.camera.validate();
  std::vector<Seen> seen;
  std::size_t outliers = 0;
  for (const LensCalibration::Residual& r : c.residuals) {
    if (r.view < 0 || std::size_t(r.view) >= views.size() || r.match < 0 ||
        std::size_t(r.match) >= views[std::size_t(r.view)].matches.size())
      throw Error(ErrorCode::invalid_argument, "the views are not those that were calibrated from");
    seen.push_back({views[std::size_t(r.view)].matches[std::size_t(r.match)].pixel, r.error, r.view, r.outlier});
    outliers += r.outlier;
  }
  std::size_t used = 0;
  for (const auto& pose : c.cam_from_board) used += pose.has_value();

  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>" +
      html_escaped(title) +
      "</title><style>body{font:15px/1.5 system-ui,sans-serif;max-width:800px;margin:2em auto;padding:0 "
      "1em;color:#222;background:#fff}td{padding:.1em 1.5em .1em 0}td:last-child{font-variant-numeric:tabular-nums}"
      ".problem{border-left:4px solid #d9622b;padding-left:.8em}@media "
      "(prefers-color-scheme:dark){body{color:#e8e8e8;background:#15171c}}" +
      SvgFigure::style_sheet() + "</style></head><body>\n<h1>" + html_escaped(title) + "</h1>\n";
  for (const std::string& problem : c.problems) page += "<p class=\"problem\">" + html_escaped(problem) + "</p>\n";
  page += "<table>\n";
  page += row("picture", std::to_string(c.camera.width) + " x " + std::to_string(c.camera.height) + " px");
  const Camera& k = c.camera;
  const std::array<double, kIntrinsics> values{k.f, k.s, k.skew, k.u0, k.v0, k.k1, k.k2, k.k3, k.p1, k.p2};
  for (int i = 0; i < kIntrinsics; ++i) {
    const double sigma = std::sqrt(std::max(0.0, c.covariance(i, i)));
    page += row(intrinsic_names()[std::size_t(i)],
                number(i == 0 || i == 3 || i == 4 ? "%.4f" : "%.7g", values[std::size_t(i)]) +
                    (sigma > 0 ? " ± " + number("%.2g", sigma) : " (fixed)"));
  }
  page += row("views, points, outliers", std::to_string(used) + " of " + std::to_string(views.size()) + ", " +
                                             std::to_string(seen.size() - outliers) + ", " + std::to_string(outliers));
  page += row("RMS residual", number("%.4f", c.rms_px) + " px");
  page += row("residuals over their covariances", number("%.3f", c.sigma0));
  if (c.cross_validation_px >= 0)
    page += row("two halves of the views differ by at most", number("%.4f", c.cross_validation_px) + " px, " +
                                                                 number("%.2f", c.cross_validation_sigma) +
                                                                 " of what is expected");
  page += "</table>\n";
  page += vectors(c, seen) + by_radius(c, seen) + by_view(c, views, seen) + uncertainty_map(c);
  page += "<h2>Views</h2>\n<table>\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::size_t n = 0, out = 0;
    double sum = 0;
    for (const Seen& s : seen)
      if (s.view == int(i)) ++n, out += s.outlier, sum += s.outlier ? 0 : s.error.squaredNorm();
    page += row(std::to_string(i) + ": " + views[i].name,
                n > out ? std::to_string(n - out) + " points, " + std::to_string(out) + " outliers, RMS " +
                              number("%.4f", std::sqrt(sum / double(n - out))) + " px"
                        : "left out");
  }
  return page + "</table>\n</body></html>\n";
}

}  // namespace lumihull::calib
