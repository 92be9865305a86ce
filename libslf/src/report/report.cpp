#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/report.h>

#include <algorithm>
#include <filesystem>

#include "html.h"
#include "report_sections.h"
#include "stages/stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSheetPhotos = 48;  // pictures on the contact sheet: enough to see what went wrong, small to send
constexpr int kHullFrames = 4;
constexpr int kThumbnail = 220, kModelPicture = 420;

/// What lies outside the mask becomes pale, so that both the photograph and its silhouette are seen.
Image outlined(const Photo& photo) {
  Image out = photo.rgb;
  for (int y = 0; y < out.height(); ++y) {
    std::uint8_t* p = out.row<std::uint8_t>(y);
    const std::uint8_t* a = photo.alpha.row<std::uint8_t>(y);
    for (int x = 0; x < out.width(); ++x)
      for (int c = 0; c < 3; ++c) {
        const int pale = c == 1 ? 150 + p[3 * x + c] / 4 : 100 + p[3 * x + c] / 4;
        p[3 * x + c] = std::uint8_t((p[3 * x + c] * a[x] + pale * (255 - a[x])) / 255);
      }
  }
  return out;
}

void add_photographs(std::string& page, const Capture& capture, Job& job) {
  std::vector<std::size_t> shown;
  const std::size_t n = capture.shots.size(), count = std::min(n, kSheetPhotos);
  for (std::size_t i = 0; i < count; ++i) shown.push_back(i * n / count);
  page += "<h2>Photographs and silhouettes</h2>\n<p class=\"dim\">" + std::to_string(count) + " of " +
          std::to_string(n) + "; pale: not the object.</p>\n<div class=\"grid\">\n";
  for (const std::size_t shot : shown) {
    job.check();
    Photo photo;
    photo.rgb = capture.read_photo(shot, 3);
    if (photo.rgb.type() != PixelType::u8) photo.rgb = converted(photo.rgb, PixelType::u8, 3);
    const Shot& s = capture.shots[shot];
    std::string caption = s.name;
    if (capture.mask_state(s) != MaskSource::none) {
      photo.alpha = capture.read_mask(shot);
      photo.rgb = outlined(photo);
    } else {
      caption += ", no silhouette";
    }
    if (!capture.positioned(shot)) caption += ", not positioned";
    if (capture.held_out(shot)) caption += ", held out";
    page += figure(oriented(fitted(photo.rgb, kThumbnail), s.orientation), caption);
    job.advance();
  }
  page += "</div>\n";
}

std::vector<View> positioned_views(const Capture& capture) {
  std::vector<View> views;
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    if (capture.positioned(i)) views.push_back(capture.view(i));
  return views;
}

TurntableOptions around(int frames) {
  TurntableOptions o;
  o.frames = frames;
  o.width = o.height = kModelPicture;
  return o;
}

std::string degrees(int frame, int frames) { return formatted("%.0f°", 360.0 * frame / frames); }

void add_hull(std::string& page, const Capture& capture, Job& job) {
  const hull::Mesh mesh = hull::read_mesh(capture.hull_path());
  if (mesh.triangles.empty()) return;
  const hull::RayScene scene(mesh);
  page += "<h2>Visual hull</h2>\n<p>" + std::to_string(mesh.triangles.size()) + " triangles, " +
          std::to_string(mesh.vertices.size()) + " vertices, volume " + formatted("%.4g", hull::enclosed_volume(mesh)) +
          (capture.unit == Unit::metres ? " m³" : " in the capture's unit") + "</p>\n<div class=\"grid wide\">\n";
  Job quiet({}, job.threads());
  int frame = 0;
  for (const PathView& v : turntable(mesh, positioned_views(capture), around(kHullFrames))) {
    job.check();
    page += figure(render_shaded(mesh, scene, v.view, {}, quiet).rgba, degrees(frame++, kHullFrames));
    job.advance();
  }
  page += "</div>\n";
}

void add_model(std::string& page, const Capture& capture, int frames, const fs::path& model, Job& job) {
  const TexturedMesh textured = read_glb(model);
  const hull::RayScene scene(textured.mesh);
  page += "<h2>Textured model</h2>\n<p>" + std::to_string(textured.mesh.triangles.size()) + " triangles, texture " +
          std::to_string(textured.texture.width()) + " × " + std::to_string(textured.texture.height()) + ", " +
          megabytes(fs::file_size(model)) + "</p>\n<div class=\"grid wide\">\n";
  Job quiet({}, job.threads());
  int frame = 0;
  for (const PathView& v : turntable(textured.mesh, positioned_views(capture), around(frames))) {
    job.check();
    page += figure(render_texture(textured, scene, v.view, {3, false, true}, quiet).rgba, degrees(frame++, frames));
    job.advance();
  }
  page += "</div>\n";
}

void add_stages(std::string& page, const Capture& capture) {
  page +=
      "<h2>Stages</h2>\n<div class=\"scroll\"><table><tr><th>stage</th><th>time</th><th>peak memory</th>"
      "<th>finished</th></tr>\n";
  for (const auto& [name, record] : capture.stages)
    page += "<tr><td>" + html_escaped(name) + "</td><td>" + formatted("%.1f s", record.seconds) + "</td><td>" +
            megabytes(record.peak_bytes) + "</td><td>" + html_escaped(record.finished) + "</td></tr>\n";
  page += "</table></div>\n";
}

}  // namespace

void write_report(const Capture& capture, const ReportOptions& options, Job& job) {
  if (options.turntable_frames < 0 || options.turntable_frames > 36)
    throw Error(ErrorCode::invalid_argument, "turntable_frames: expected 0 to 36");
  const fs::path folder = fs::absolute(capture.folder()).lexically_normal();
  const std::string name = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  const auto count_if = [&](auto&& is) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < capture.shots.size(); ++i) n += is(i);
    return n;
  };
  const fs::path light_field = light_field_path(capture), model = textured_path(capture);
  const bool has_hull = file_exists(capture.hull_path()),
             has_light_field = file_exists(light_field) && options.turntable_frames > 0,
             has_model = file_exists(model) && options.turntable_frames > 0;

  const auto frames = std::size_t(options.turntable_frames);
  job.begin("report", std::min(capture.shots.size(), kSheetPhotos) + (has_hull ? std::size_t(kHullFrames) : 0) +
                          (has_light_field ? frames + 2 * std::size_t(kFanPictures) : 0) + (has_model ? frames : 0));
  std::string page =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>" +
      html_escaped(name) + "</title><style>" + page_style() + "</style></head><body>\n<h1>" + html_escaped(name) +
      "</h1>\n<p>" + std::to_string(capture.shots.size()) + " photographs, " +
      std::to_string(count_if([&](std::size_t i) { return capture.positioned(i); })) + " positioned, " +
      std::to_string(count_if([&](std::size_t i) { return capture.held_out(i); })) +
      " held out; unit: " + (capture.unit == Unit::metres ? "metres" : "unknown") + ".</p>\n";
  if (file_exists(capture.folder() / "calibration.html"))
    page += "<p><a href=\"calibration.html\">How good the cameras' poses are</a></p>\n";
  if (file_exists(truth_page_path(capture)))
    page += "<p><a href=\"evaluate/truth.html\">All of it beside the truth</a></p>\n";
  for (const std::string& note : capture.notes) page += "<p class=\"dim\">" + html_escaped(note) + "</p>\n";
  if (has_light_field)
    add_light_field(page, light_field, positioned_views(capture), around(options.turntable_frames), job);
  if (const auto& e = options.evaluation; e && (e->photos_held_out > 0 || e->test_views.views > 0))
    add_evaluation(page, capture, *e, job);
  if (has_model) add_model(page, capture, options.turntable_frames, model, job);
  if (has_hull) add_hull(page, capture, job);
  if (!capture.shots.empty()) add_photographs(page, capture, job);
  if (!capture.stages.empty()) add_stages(page, capture);
  page += "</body></html>\n";
  write_file(options.file.empty() ? capture.folder() / "report.html" : options.file, page);
  job.end();
}

}  // namespace lumihull::slf
