#include <lumihull/base/error.h>
#include <lumihull/slf/photos.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>

#include "html.h"
#include "report_sections.h"
#include "stages/stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kCompared = 12;  // photographs whose comparison pictures are shown
constexpr int kPanel = 360;            // px

std::string in_words(std::string method) {
  std::replace(method.begin(), method.end(), '_', ' ');
  return html_escaped(method);
}

std::string cells(const PictureQuality& q) {
  return "<td>" + formatted("%.2f", q.psnr) + "</td><td>" + formatted("%.4f", q.ssim) + "</td><td>" +
         formatted("%.2f", q.psnr_inside) + "</td><td>" + formatted("%.4f", q.ssim_inside) + "</td>";
}

constexpr const char* kQualityHeads = "<th>PSNR, dB</th><th>SSIM</th><th>PSNR inside</th><th>SSIM inside</th>";

/// What a method needs to render.
std::string size_of_model(const std::string& method, const Capture& capture, const Evaluation& e) {
  if (method == "light_field") return megabytes(e.light_field_bytes);
  if (method == "mean_texture") return megabytes(e.model_bytes);
  if (method != "lumigraph") return "–";
  std::uint64_t bytes = 0;
  for (const std::size_t i : training_shots(capture)) bytes += capture.shots[i].stamp.size;
  return megabytes(bytes) + " of photographs";
}

void add_means(std::string& page, const Capture& capture, const Evaluation& e) {
  page += std::string("<div class=\"scroll\"><table><tr><th>mean</th><th>size</th>") + kQualityHeads + "</tr>\n";
  for (const auto& [method, q] : e.mean.methods)
    page += "<tr><td>" + in_words(method) + "</td><td>" + size_of_model(method, capture, e) + "</td>" + cells(q) +
            "</tr>\n";
  page += "</table></div>\n";
}

void add_each(std::string& page, const Evaluation& e) {
  page +=
      std::string("<details><summary>Each photograph</summary><div class=\"scroll\"><table><tr><th>photograph</th>") +
      "<th>method</th>" + kQualityHeads + "<th>hull's IoU</th></tr>\n";
  for (const ViewEvaluation& v : e.views)
    for (const auto& [method, q] : v.methods)
      page += "<tr><td>" + html_escaped(v.name) + "</td><td>" + in_words(method) + "</td>" + cells(q) + "<td>" +
              formatted("%.4f", v.silhouette_iou) + "</td></tr>\n";
  page += "</table></div></details>\n";
}

}  // namespace

void add_test_views(std::string& page, const TestViewEvaluation& t) {
  page += "<h3>Test views</h3>\n<p>Means over " + std::to_string(t.views) +
          " views that are no photographs of the capture" +
          (t.highlights.empty() ? "" : "; highlights: how they move over the surface from view to view") +
          ".</p>\n<div class=\"scroll\"><table><tr><th>method</th><th>PSNR, dB</th><th>PSNR inside</th>"
          "<th>highlights seen</th><th>of their way</th><th>off by</th></tr>\n";
  std::set<std::string> names;
  for (const auto& [name, q] : t.methods) names.insert(name);
  for (const auto& [name, path] : t.highlights) names.insert(name);
  for (const std::string& name : names) {
    const auto q = t.methods.find(name);
    const auto path = t.highlights.find(name);
    page += "<tr><td>" + in_words(name) + "</td>";
    page += q == t.methods.end() ? "<td></td><td></td>"
                                 : "<td>" + formatted("%.2f", q->second.psnr) + "</td><td>" +
                                       formatted("%.2f", q->second.psnr_inside) + "</td>";
    page += path == t.highlights.end()
                ? "<td></td><td></td><td></td>"
                : "<td>" + std::to_string(path->second.found) + " of " + std::to_string(path->second.places) +
                      "</td><td>" + formatted("%.0f %%", 100 * path->second.share) + "</td><td>" +
                      formatted("%.1f px", path->second.rms_px) + "</td>";
    page += "</tr>\n";
  }
  page += "</table></div>\n";
}

namespace {

/// One of the three pictures side by side that the evaluation wrote, made smaller and upright.
Image panel(const Image& three, int which, int orientation) {
  const int w = three.width() / 3;
  Image out(w, three.height(), 3);
  for (int y = 0; y < three.height(); ++y)
    std::copy_n(three.row<std::uint8_t>(y) + 3 * w * which, 3 * w, out.row<std::uint8_t>(y));
  return oriented(fitted(out, kPanel), orientation);
}

Image stacked(const Image& above, const Image& below) {
  Image out(above.width(), above.height() + below.height(), 3);
  for (int y = 0; y < out.height(); ++y)
    std::copy_n(y < above.height() ? above.row<std::uint8_t>(y) : below.row<std::uint8_t>(y - above.height()),
                3 * out.width(), out.row<std::uint8_t>(y));
  return out;
}

/// The photograph, then each method's rendering above its difference.
void add_comparison(std::string& page, const fs::path& folder, const ViewEvaluation& v, int orientation, Job& job) {
  std::string figures;
  for (const auto& [method, q] : v.methods) {
    const fs::path file = folder / (v.name + "." + method + ".png");
    if (method.find('/') != std::string::npos || !file_exists(file)) continue;
    job.check();
    Image three = read_image(file, {.channels = 3});
    if (three.type() != PixelType::u8) three = converted(three, PixelType::u8, 3);
    if (three.width() % 3)
      throw Error(ErrorCode::bad_input, "expected three pictures of one size side by side; evaluate again",
                  file.string());
    if (figures.empty()) figures = figure(panel(three, 0, orientation), "photograph");
    std::string name = method;
    std::replace(name.begin(), name.end(), '_', ' ');
    figures += figure(stacked(panel(three, 1, orientation), panel(three, 2, orientation)),
                      name + ", " + formatted("%.2f", q.psnr_inside) + " dB inside");
  }
  if (!figures.empty())
    page += "<h3>" + html_escaped(v.name) + "</h3>\n<div class=\"grid compared\">\n" + figures + "</div>\n";
}

}  // namespace

void add_evaluation(std::string& page, const Capture& capture, const Evaluation& e, Job& job) {
  page += "<h2>Held-out photographs</h2>\n<p>" + std::to_string(e.photos_used) + " photographs used, " +
          std::to_string(e.photos_held_out) + " held out. Silhouettes of the rendered hull: IoU " +
          formatted("%.4f", e.mean.silhouette_iou) +
          (std::isnan(e.mean.keyed_iou) ? "" : "; keyed silhouettes: IoU " + formatted("%.4f", e.mean.keyed_iou)) +
          ".</p>\n";
  add_means(page, capture, e);
  if (!e.views.empty()) add_each(page, e);
  if (e.test_views.views) add_test_views(page, e.test_views);

  // Names come from a file: only those of the capture's own photographs lead to pictures.
  std::map<std::string, int> orientations;
  for (const Shot& shot : capture.shots) orientations[shot.name] = shot.orientation;
  const std::size_t n = e.views.size(), shown = std::min(n, kCompared);
  if (shown == 0) return;
  page += "<p class=\"dim\">Below" +
          (shown < n ? ", for " + std::to_string(shown) + " of the " + std::to_string(n) : std::string()) +
          ": the photograph; renderings, under each four times its difference.</p>\n";
  for (std::size_t i = 0; i < shown; ++i) {
    const ViewEvaluation& v = e.views[i * n / shown];
    if (const auto shot = orientations.find(v.name); shot != orientations.end())
      add_comparison(page, capture.folder() / "evaluate", v, shot->second, job);
  }
}

}  // namespace lumihull::slf
