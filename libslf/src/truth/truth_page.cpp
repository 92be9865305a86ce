// The page about a capture beside the truth.
#include <lumihull/internal/html.h>
#include <lumihull/internal/svg_figure.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "parts.h"
#include "report/html.h"
#include "report/report_sections.h"
#include "stages/stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;
using internal::SvgFigure;

constexpr std::size_t kWorst = 4;  // cases that are shown
constexpr int kSide = 520;         // px, of a picture

std::string row(const std::string& name, const std::string& value) {
  return "<tr><td>" + name + "</td><td>" + value + "</td></tr>\n";
}

/// Figures of several spreads side by side; `format` of one number.
struct Column {
  std::string name;
  const Spread* spread;
  const char* format;
};
std::string spreads(const std::vector<Column>& columns) {
  std::string out = "<div class=\"scroll\"><table><tr><th></th>";
  for (const Column& c : columns) out += "<th>" + c.name + "</th>";
  out += "</tr>\n";
  const std::pair<const char*, double Spread::*> rows[] = {{"mean", &Spread::mean},
                                                           {"RMS", &Spread::rms},
                                                           {"median", &Spread::median},
                                                           {"95 %", &Spread::q95},
                                                           {"largest", &Spread::max}};
  for (const auto& [name, member] : rows) {
    out += std::string("<tr><td>") + name + "</td>";
    for (const Column& c : columns) out += "<td>" + formatted(c.format, c.spread->*member) + "</td>";
    out += "</tr>\n";
  }
  return out + "</table></div>\n";
}

/// A bar for each of some things in the capture's order; `level`: a dashed line, where it is not NaN.
std::string bars(const std::string& title, const std::string& note, const std::string& what, const std::string& unit,
                 const std::vector<double>& values, double level = kUnknown) {
  double most = std::isnan(level) ? 0 : level;
  for (const double v : values)
    if (std::isfinite(v)) most = std::max(most, v);
  SvgFigure figure(title, 760, 260);
  figure.note(note);
  figure.axes(0, double(std::max<std::size_t>(1, values.size())), 0, most > 0 ? 1.1 * most : 1, what, unit);
  const double gap = values.size() > 200 ? 0 : 0.15;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isfinite(values[i])) figure.box(double(i) + gap, 0, double(i) + 1 - gap, values[i], "bar");
  if (!std::isnan(level)) figure.line(0, level, double(values.size()), level, "level");
  return figure.str();
}

template <class T, class Value>
std::vector<double> column(const std::vector<T>& list, Value&& value) {
  std::vector<double> out;
  for (const T& t : list) out.push_back(value(t));
  return out;
}

/// Indices of the largest values.
std::vector<std::size_t> worst(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
  order.resize(std::min(order.size(), kWorst));
  return order;
}

std::string names(const std::string& what, const std::vector<std::string>& list) {
  if (list.empty()) return "";
  constexpr std::size_t kMost = 50;
  std::string out = "<p class=\"dim\">" + what + " (" + std::to_string(list.size()) + "): ";
  for (std::size_t i = 0; i < std::min(list.size(), kMost); ++i) out += (i ? ", " : "") + html_escaped(list[i]);
  return out + (list.size() > kMost ? ", …" : "") + "</p>\n";
}

std::string poses(const PoseTruth& p) {
  std::string out = "<h2>Poses</h2>\n<p>" + std::to_string(p.shots.size()) + " photographs, aligned by " +
                    (p.aligned_by_rotations ? "their rotations (the centres lie on a line, or are too few)"
                                            : "their centres, least squares") +
                    ".</p>\n<table>\n";
  if (!std::isnan(p.scale_error_ppm)) out += row("scale: too large by", formatted("%.1f ppm", p.scale_error_ppm));
  if (!std::isnan(p.consistency))
    out += row(std::string("mean Mahalanobis² / 6 (") +
                   (p.consistency_by_targets ? "targets at rest" : "cameras aligned, weighted") + "), 1 is right",
               formatted("%.2f", p.consistency));
  out += "</table>\n" + spreads({{"centres, mm", &p.center_mm, "%.4g"}, {"rotations, °", &p.rotation_deg, "%.4g"}});
  out += bars("Errors of camera centres", "dashed: RMS", "photograph", "mm",
              column(p.shots, [](const auto& s) { return s.center_mm; }), p.center_mm.rms);
  out += bars("Errors of rotations", "dashed: RMS", "photograph", "°",
              column(p.shots, [](const auto& s) { return s.rotation_deg; }), p.rotation_deg.rms);
  if (!std::isnan(p.consistency))
    out += bars("Errors over what the covariances state", "Mahalanobis² / 6; dashed: as it should be in the mean",
                "photograph", "", column(p.shots, [](const auto& s) { return s.mahalanobis2 / 6; }), 1);
  return out + names("Without a pose", p.not_placed) + names("Not in the truth", p.not_in_truth) +
         names("Not in the capture", p.not_in_capture);
}

std::string lenses(const std::vector<LensTruth>& list) {
  std::string out =
      "<h2>Lenses</h2>\n<table><tr><th>camera</th><th>focal length</th><th>principal point, px</th>"
      "<th>projection, RMS</th><th>largest</th></tr>\n";
  for (const LensTruth& l : list)
    out += "<tr><td>" + std::to_string(l.camera) + "</td><td>" + formatted("%+.4f %%", l.focal_error_percent) +
           "</td><td>" + formatted("%+.3f", l.principal_point_px.x()) + ", " +
           formatted("%+.3f", l.principal_point_px.y()) + "</td><td>" + formatted("%.4f px", l.projection_rms_px) +
           "</td><td>" + formatted("%.4f px", l.projection_max_px) + "</td></tr>\n";
  return out +
         "</table>\n<p class=\"dim\">Projection: pixels of rays at infinity over the picture, a rotation of the "
         "camera taken off.</p>\n";
}

std::string targets(const TargetTruth& t) {
  std::string out = "<h2>Targets</h2>\n" + spreads({{"points, mm", &t.point_mm, "%.4g"}});
  out += bars("Errors of targets", "RMS of each target's points; dashed: of all", "target", "mm",
              column(t.targets, [](const auto& x) { return x.rms_mm; }), t.point_mm.rms);
  return out + names("Wrong ids", t.wrong_ids) + names("Not solved", t.not_solved);
}

/// The part of the photograph that holds both silhouettes, pale: red where the mask is too large, blue where it lacks.
Image mask_errors(const Image& photo, const Image& mask, const Image& truth) {
  Eigen::AlignedBox2i box;
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask.row<std::uint8_t>(y)[x] >= 128 || truth.row<std::uint8_t>(y)[x] >= 128)
        box.extend(Eigen::Vector2i(x, y));
  if (box.isEmpty()) box.extend(Eigen::Vector2i(0, 0));
  constexpr int kMargin = 8;
  const int x0 = std::max(0, box.min().x() - kMargin), y0 = std::max(0, box.min().y() - kMargin);
  const int x1 = std::min(mask.width(), box.max().x() + kMargin + 1),
            y1 = std::min(mask.height(), box.max().y() + kMargin + 1);
  Image out(x1 - x0, y1 - y0, 3);
  for (int y = y0; y < y1; ++y) {
    const std::uint8_t *p = photo.row<std::uint8_t>(y), *m = mask.row<std::uint8_t>(y), *t = truth.row<std::uint8_t>(y);
    std::uint8_t* o = out.row<std::uint8_t>(y - y0);
    for (int x = x0; x < x1; ++x, o += 3) {
      const bool found = m[x] >= 128, real = t[x] >= 128;
      for (int c = 0; c < 3; ++c) o[c] = std::uint8_t(found == real ? (p[3 * x + c] + (real ? 96 : 255)) / 2 : 0);
      if (found != real) o[found ? 0 : 2] = 255;
    }
  }
  return out;
}

std::string masks(const Capture& capture, const fs::path& folder, const MaskTruth& m, Job& job) {
  std::string out = "<h2>Masks</h2>\n<table>\n" + row("photographs", std::to_string(m.shots.size())) +
                    row("IoU, mean and least", formatted("%.4f", m.iou_mean) + ", " + formatted("%.4f", m.iou_least)) +
                    row("edges within 1.5 px", formatted("%.2f %%", 100 * m.within)) +
                    row("too large by", formatted("%+.3f px", m.bias_px)) +
                    row("holes, islands", std::to_string(m.holes) + ", " + std::to_string(m.islands)) + "</table>\n" +
                    spreads({{"edges, px", &m.edge_px, "%.3f"}});
  out += bars("Silhouettes' edges", "95 % are nearer than that; dashed: 1.5 px", "photograph", "px",
              column(m.shots, [](const auto& s) { return s.edge_px.q95; }), MaskTruth::kEdgePx);
  out += bars("What silhouettes miss", "1 - IoU", "photograph", "",
              column(m.shots, [](const auto& s) { return 1 - s.iou; }));
  out +=
      "<p class=\"dim\">The worst: red is object in the mask only, blue in the truth only.</p>\n<div class=\"grid "
      "wide\">\n";
  for (const std::size_t i : worst(column(m.shots, [](const auto& s) { return 1 - s.iou; }))) {
    job.check();
    const auto shot = std::find_if(capture.shots.begin(), capture.shots.end(),
                                   [&](const Shot& s) { return s.name == m.shots[i].name; });
    if (shot == capture.shots.end()) continue;
    const auto index = std::size_t(shot - capture.shots.begin());
    Image photo = capture.read_photo(index, 3);
    if (photo.type() != PixelType::u8) photo = converted(photo, PixelType::u8, 3);
    const Image mask = capture.read_mask(index);
    const Image picture = mask_errors(photo, mask, truth::true_mask(folder / "masks" / (shot->name + ".png"), mask));
    out += figure(oriented(fitted(picture, kSide), shot->orientation),
                  shot->name + ": IoU " + formatted("%.4f", m.shots[i].iou) + ", 95 % of the edges within " +
                      formatted("%.2f px", m.shots[i].edge_px.q95));
    job.advance();
  }
  return out + "</div>\n" + names("Without a true mask", m.without_truth);
}

std::string surface(const SurfaceTruth& s) {
  std::string out = "<h2>Surface</h2>\n" + spreads({{"hull to truth, mm", &s.hull_to_truth_mm, "%.4g"},
                                                    {"truth to hull, mm", &s.truth_to_hull_mm, "%.4g"}});
  out +=
      "<table>\n" + row("a voxel", formatted("%.3g mm", s.voxel_mm)) +
      row("RMS in voxels, both ways", formatted("%.2f", s.hull_to_truth_mm.rms / s.voxel_mm) + ", " +
                                          formatted("%.2f", s.truth_to_hull_mm.rms / s.voxel_mm)) +
      row("volume, hull / truth", formatted("%.4f", s.volume_ratio)) +
      row("true surface outside of the hull by more than " + formatted("%g mm", s.outside_mm),
          formatted("%.3f %%", 100 * s.outside_share)) +
      row("farthest outside", formatted("%.3g mm", s.outside_max_mm)) +
      row("silhouettes' IoU, mean and least", formatted("%.4f", s.iou_mean) + ", " + formatted("%.4f", s.iou_least)) +
      "</table>\n";
  return out + bars("Silhouettes of hull and true surface", "1 - IoU; dashed: the mean", "photograph", "",
                    column(s.silhouettes, [](const auto& x) { return 1 - x.iou; }), 1 - s.iou_mean);
}

/// The pictures that the comparison left of its test views: some of them, by each method.
std::string views(const Capture& capture, const TestViewEvaluation& t, Job& job) {
  std::string out;
  add_test_views(out, t);
  std::vector<std::pair<std::string, fs::path>> files;
  const fs::path folder = capture.folder() / "evaluate" / "test_views";
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".mean_texture.png")) files.emplace_back(name.substr(0, name.size() - 17), entry.path());
  }
  std::sort(files.begin(), files.end());
  const std::size_t shown = std::min<std::size_t>(files.size(), kWorst);
  if (shown) out += "<p class=\"dim\">Truth, rendering, four times the difference.</p>\n";
  for (std::size_t i = 0; i < shown; ++i) {
    const std::string& name = files[(2 * i + 1) * files.size() / (2 * shown)].first;
    out += "<h3>" + html_escaped(name) + "</h3>\n<div class=\"strips\">\n";
    for (const auto& [method, quality] : t.methods) {
      const fs::path file = folder / (name + "." + method + ".png");
      if (!file_exists(file)) continue;
      job.check();
      Image picture = read_image(file, {.channels = 3});
      if (picture.type() != PixelType::u8) picture = converted(picture, PixelType::u8, 3);
      std::string caption = method;
      std::replace(caption.begin(), caption.end(), '_', ' ');
      out += figure(fitted(picture, 2 * kSide), caption);
    }
    out += "</div>\n";
  }
  return out;
}

}  // namespace

std::string truth_html(const Capture& capture, const TruthComparison& c, Job& job) {
  job.begin("page", c.masks ? std::min(kWorst, c.masks->shots.size()) : 0);
  const fs::path folder = fs::absolute(capture.folder()).lexically_normal();
  const std::string name = html_escaped((folder.has_filename() ? folder : folder.parent_path()).filename().string());
  std::string page =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>" +
      name + " beside the truth</title><style>" + page_style() + SvgFigure::style_sheet() +
      "</style></head><body>\n<h1>" + name + " beside the truth</h1>\n<ul>\n";
  for (const std::string& line : c.summary()) page += "<li>" + html_escaped(line) + "</li>\n";
  page += "</ul>\n";
  if (c.poses) page += poses(*c.poses);
  if (!c.lenses.empty()) page += lenses(c.lenses);
  if (c.targets) page += targets(*c.targets);
  if (c.masks) page += masks(capture, c.truth, *c.masks, job);
  if (c.surface) page += surface(*c.surface);
  if (c.views) page += views(capture, *c.views, job);
  job.end();
  return page + "</body></html>\n";
}

}  // namespace lumihull::slf
