// What calibration left between measured and predicted pixels, as figures.
#include <lumihull/internal/html.h>
#include <lumihull/internal/svg_figure.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "report_parts.h"

namespace lumihull::calib::report {
namespace {

using lumihull::internal::html_escaped;
using lumihull::internal::number;
using lumihull::internal::SvgFigure;

bool counts(const CalibrationResidual& r) { return !r.removed && r.error.allFinite(); }

/// Sum of squares and number.
struct Mean {
  double squares = 0;
  std::size_t n = 0;
  void add(const Eigen::Vector2d& error) { squares += error.squaredNorm(), ++n; }
  double rms() const { return n > 0 ? std::sqrt(squares / double(n)) : 0; }
};

/// A picture's cells: about square, 24 along its width.
struct Cells {
  int columns = 24, rows = 16;
  double width = 1, height = 1;
  explicit Cells(const Camera& camera) : width(camera.width), height(camera.height) {
    rows = std::clamp(int(std::lround(columns * height / width)), 4, 96);
  }
  /// -1 outside of the picture.
  int of(const Eigen::Vector2d& px) const {
    const int x = int(std::floor(columns * px.x() / width)), y = int(std::floor(rows * px.y() / height));
    return x >= 0 && y >= 0 && x < columns && y < rows ? y * columns + x : -1;
  }
  int count() const { return columns * rows; }
  void paint(SvgFigure& figure, int cell, std::string_view style) const {
    const double x = width * (cell % columns) / columns, y = height * (cell / columns) / rows;
    figure.box(x, y, x + width / columns, y + height / rows, style);
  }
  Eigen::Vector2d middle(int cell) const {
    return {width * (cell % columns + 0.5) / columns, height * (cell / columns + 0.5) / rows};
  }
};

constexpr const char* kUnseen = "#8884";

std::string camera_title(const TargetModel& model, std::size_t camera) {
  return model.calibration.cameras.size() == 1 ? "" : " of camera " + std::to_string(camera);
}

std::string coverage(const TargetModel& model, std::size_t camera) {
  const Camera& k = model.calibration.cameras[camera];
  const Cells cells(k);
  std::vector<std::size_t> n(std::size_t(cells.count()), 0);
  std::size_t most = 0, empty = 0;
  for (const CalibrationResidual& r : model.calibration.residuals) {
    if (r.removed || std::size_t(model.photos.at(std::size_t(r.photo)).camera) != camera) continue;
    if (const int cell = cells.of(r.pixel); cell >= 0) most = std::max(most, ++n[std::size_t(cell)]);
  }
  for (const std::size_t count : n) empty += count == 0;
  SvgFigure figure("Where in the picture was measured" + camera_title(model, camera), 760,
                   600 * std::clamp(k.height / double(k.width), 0.3, 2.0) + 40);
  figure.note("points in each cell, brighter: more, at most " + std::to_string(most) + "; grey: none (" +
              number("%.0f", 100.0 * double(empty) / cells.count()) + " %): the lens is a guess there");
  figure.axes(0, k.width, k.height, 0, "u, px", "v, px");
  for (int i = 0; i < cells.count(); ++i) {
    const std::size_t count = n[std::size_t(i)];
    cells.paint(
        figure, i,
        count == 0 ? kUnseen : lumihull::internal::map_color(std::log1p(double(count)) / std::log1p(double(most))));
  }
  return figure.str();
}

std::string residual_map(const TargetModel& model, std::size_t camera) {
  const Camera& k = model.calibration.cameras[camera];
  const Cells cells(k);
  std::vector<Mean> means(std::size_t(cells.count()));
  std::vector<Eigen::Vector2d> sums(std::size_t(cells.count()), Eigen::Vector2d::Zero());
  for (const CalibrationResidual& r : model.calibration.residuals) {
    if (!counts(r) || std::size_t(model.photos.at(std::size_t(r.photo)).camera) != camera) continue;
    const int cell = cells.of(r.pixel);
    if (cell < 0) continue;
    means[std::size_t(cell)].add(r.error);
    sums[std::size_t(cell)] += r.error;
  }
  constexpr std::size_t kEnough = 5;
  double low = 1e300, high = 0;
  for (const Mean& m : means)
    if (m.n >= kEnough) low = std::min(low, m.rms()), high = std::max(high, m.rms());
  SvgFigure figure("Residuals over the picture" + camera_title(model, camera), 760,
                   600 * std::clamp(k.height / double(k.width), 0.3, 2.0) + 40);
  if (high == 0) {
    figure.note("too few points for a map");
    return figure.str();
  }
  const double times = lumihull::internal::magnification(model.calibration.rms_px, 0.03 * k.width);
  figure.note("RMS in cells of 5 points or more, " + number("%.3g", low) + " (dark) to " + number("%.3g", high) +
              " px (bright); white: mean error, " + number("%g", times) +
              " times as large; a pattern: the lens does not fit");
  figure.axes(0, k.width, k.height, 0, "u, px", "v, px");
  for (int i = 0; i < cells.count(); ++i) {
    const Mean& m = means[std::size_t(i)];
    cells.paint(
        figure, i,
        m.n < kEnough ? kUnseen : lumihull::internal::map_color(high > low ? (m.rms() - low) / (high - low) : 0));
  }
  for (int i = 0; i < cells.count(); ++i) {
    const Mean& m = means[std::size_t(i)];
    if (m.n < kEnough) continue;
    const Eigen::Vector2d from = cells.middle(i), to = from + times * sums[std::size_t(i)] / double(m.n);
    figure.line(from.x(), from.y(), to.x(), to.y(), "onmapline");
    figure.dot(from.x(), from.y(), 1.5, "#ffffff");
  }
  return figure.str();
}

std::string bars(const std::string& title, const std::string& what, const std::vector<Mean>& means, double rms) {
  double most = rms;
  for (const Mean& m : means) most = std::max(most, m.rms());
  SvgFigure figure(title, 760, 280);
  figure.note("dashed: of all points that count; numbers are those of the tables below");
  figure.axes(0, double(std::max<std::size_t>(1, means.size())), 0, most > 0 ? 1.1 * most : 1, what, "RMS, px");
  const double gap = means.size() > 200 ? 0 : 0.15;
  for (std::size_t i = 0; i < means.size(); ++i)
    if (means[i].n > 0) figure.box(double(i) + gap, 0, double(i) + 1 - gap, means[i].rms(), "bar");
  figure.line(0, rms, double(means.size()), rms, "level");
  return figure.str();
}

std::string by_size(const TargetModel& model) {
  double largest = 0;
  for (const CalibrationResidual& r : model.calibration.residuals)
    if (counts(r)) largest = std::max(largest, r.size_px);
  if (!(largest > 0)) return "";
  constexpr std::size_t kBins = 24;
  std::array<Mean, kBins> pixels;
  std::array<Mean, kBins> sigmas;
  for (const CalibrationResidual& r : model.calibration.residuals) {
    if (!counts(r) || !(r.size_px > 0)) continue;
    const std::size_t bin = std::min(kBins - 1, std::size_t(kBins * r.size_px / largest));
    pixels[bin].add(r.error);
    sigmas[bin].add({r.sigmas, 0});
  }
  double most = 0;
  for (const Mean& m : pixels)
    if (m.n >= 5) most = std::max(most, m.rms());
  if (!(most > 0)) return "";
  SvgFigure figure("Residuals by the circles' size", 760, 300);
  figure.note("bars: RMS, px; numbers: residuals over their standard deviations (2-D: √2 is right)");
  figure.axes(0, largest, 0, 1.2 * most, "minor axis as seen, px", "RMS, px");
  for (std::size_t i = 0; i < kBins; ++i) {
    if (pixels[i].n < 5) continue;
    const double x0 = largest * double(i) / kBins, x1 = largest * double(i + 1) / kBins;
    figure.box(x0 + 0.1 * (x1 - x0), 0, x1 - 0.1 * (x1 - x0), pixels[i].rms(), "bar");
    figure.text(0.5 * (x0 + x1), pixels[i].rms() + 0.05 * most, number("%.2f", sigmas[i].rms()), "small");
  }
  return figure.str();
}

/// The photograph, small, with its residuals.
std::string drawn(const Capture& capture, const TargetModel& model, std::size_t photo) {
  const Calibration& c = model.calibration;
  constexpr int kSide = 760;
  Image small = capture.read_photo(photo, 3);
  const double full_width = small.width(), full_height = small.height();
  if (small.type() != PixelType::u8) small = converted(small, PixelType::u8, 3);
  small = fitted(small, kSide);
  const double scale = small.width() / full_width, high = full_height * scale;
  const double times = lumihull::internal::magnification(c.photos[photo].rms_px, 12 / scale);
  const std::string w = std::to_string(small.width()), h = std::to_string(small.height());
  std::string out = "<figure><svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + w + " " + h + "\" width=\"" +
                    w + "\" height=\"" + h + "\" role=\"img\"><image width=\"" + w + "\" height=\"" + h +
                    "\" href=\"data:image/jpeg;base64," + lumihull::internal::base64(encode_jpeg(small, 80)) + "\"/>\n";
  for (const CalibrationResidual& r : c.residuals) {
    if (std::size_t(r.photo) != photo) continue;
    const Eigen::Vector2d from = scale * r.pixel;
    Eigen::Vector2d arrow = r.error.allFinite() ? Eigen::Vector2d(scale * times * r.error) : Eigen::Vector2d(0, 0);
    if (arrow.norm() > 0.2 * high) arrow *= 0.2 * high / arrow.norm();  // what was removed may be far off
    const std::string style = r.removed ? "wrong" : "residual";
    out += "<line class=\"" + style + "\" x1=\"" + number("%.1f", from.x()) + "\" y1=\"" + number("%.1f", from.y()) +
           "\" x2=\"" + number("%.1f", from.x() + arrow.x()) + "\" y2=\"" + number("%.1f", from.y() + arrow.y()) +
           "\"/><circle r=\"1.5\" class=\"" + (r.removed ? "outlier" : "seen") + "\" cx=\"" + number("%.1f", from.x()) +
           "\" cy=\"" + number("%.1f", from.y()) + "\"/>\n";
  }
  return out + "</svg><figcaption>" + html_escaped(model.photos[photo].name) + ": RMS " +
         number("%.4f", c.photos[photo].rms_px) + " px, " + std::to_string(c.photos[photo].points) +
         " points; residuals " + number("%g", times) + " times as large, orange: removed</figcaption></figure>\n";
}

}  // namespace

std::string over_the_picture(const TargetModel& model) {
  std::string out;
  constexpr std::size_t kMostCameras = 4;
  const std::size_t n = model.calibration.cameras.size();
  for (std::size_t i = 0; i < std::min(n, kMostCameras); ++i) out += coverage(model, i) + residual_map(model, i);
  if (n > kMostCameras)
    out +=
        "<p class=\"dim\">The first " + std::to_string(kMostCameras) + " of " + std::to_string(n) + " cameras.</p>\n";
  return out;
}

std::string by_thing(const TargetModel& model) {
  const Calibration& c = model.calibration;
  std::vector<Mean> photos(c.photos.size()), bodies(c.bodies.size());
  for (const CalibrationResidual& r : c.residuals) {
    if (!counts(r)) continue;
    photos.at(std::size_t(r.photo)).add(r.error);
    bodies.at(std::size_t(r.body)).add(r.error);
  }
  return bars("Residuals by photograph", "photograph", photos, c.rms_px) +
         bars("Residuals by target", "target or board", bodies, c.rms_px) + by_size(model);
}

std::string worst_photographs(const Capture& capture, const TargetModel& model, Job& job) {
  const Calibration& c = model.calibration;
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < c.photos.size(); ++i)
    if (c.photos[i].cam_from_world && c.photos[i].points > 0) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return c.photos[a].rms_px > c.photos[b].rms_px; });
  std::string out;
  for (std::size_t i = 0; i < std::min<std::size_t>(order.size(), kWorstShown); ++i) {
    job.check();
    out += drawn(capture, model, order[i]);
    job.advance();
  }
  return out;
}

}  // namespace lumihull::calib::report
