#include <lumihull/internal/json.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/report.h>

#include <filesystem>
#include <optional>

#include "stage.h"

namespace lumihull::slf {

namespace {

using internal::JsonReader;

double number_or_nan(const JsonReader& json, std::string_view key) {
  if (!json.has(key) || json.at(key).value().is_null()) return std::numeric_limits<double>::quiet_NaN();
  return json.at(key).number();
}

std::map<std::string, PictureQuality> read_methods(const JsonReader& json) {
  std::map<std::string, PictureQuality> out;
  if (!json.value().is_object()) json.fail("an object");
  for (const auto& item : json.value().items()) {
    const JsonReader m = json.at(item.key());
    out[item.key()] = {.psnr = number_or_nan(m, "psnr"),
                       .ssim = number_or_nan(m, "ssim"),
                       .psnr_inside = number_or_nan(m, "psnr_inside"),
                       .ssim_inside = number_or_nan(m, "ssim_inside")};
  }
  return out;
}

ViewEvaluation read_view(const JsonReader& json) {
  ViewEvaluation view;
  if (json.has("name")) view.name = json.at("name").string();
  view.silhouette_iou = number_or_nan(json, "silhouette_iou");
  view.keyed_iou = number_or_nan(json, "keyed_iou");
  view.methods = read_methods(json.at("methods"));
  return view;
}

TestViewEvaluation read_test_views(const JsonReader& json) {
  TestViewEvaluation out;
  out.views = std::size_t(json.at("views").integer(0, 1'000'000));
  out.methods = read_methods(json.at("methods"));
  if (!json.has("highlights")) return out;
  const JsonReader highlights = json.at("highlights");
  if (!highlights.value().is_object()) highlights.fail("an object");
  for (const auto& item : highlights.value().items()) {
    const JsonReader h = highlights.at(item.key());
    HighlightPath& path = out.highlights[item.key()];
    path.tracks = std::size_t(h.at("tracks").integer(0, 1'000'000'000));
    path.places = std::size_t(h.at("places").integer(0, 1'000'000'000));
    path.found = std::size_t(h.at("found").integer(0, 1'000'000'000));
    path.true_length_px = number_or_nan(h, "true_length_px");
    path.share = number_or_nan(h, "share");
    path.rms_px = number_or_nan(h, "rms_px");
  }
  return out;
}

/// What the stage `evaluate` found, if it ran: evaluate/evaluation.json.
std::optional<Evaluation> read_evaluation(const Capture& capture) {
  const std::filesystem::path file = evaluation_path(capture);
  if (!file_exists(file)) return std::nullopt;
  const internal::Json document = internal::read_json(file);
  const JsonReader top(document, file.string());
  Evaluation evaluation;
  evaluation.photos_used = std::size_t(top.at("photos_used").integer(0, 1'000'000));
  evaluation.photos_held_out = std::size_t(top.at("photos_held_out").integer(0, 1'000'000));
  evaluation.triangles = std::size_t(top.at("triangles").integer(0, INT64_MAX));
  evaluation.model_bytes = std::uint64_t(top.at("model_bytes").integer(0, INT64_MAX));
  evaluation.mean = read_view(top);
  if (top.has("light_field_bytes"))
    evaluation.light_field_bytes = std::uint64_t(top.at("light_field_bytes").integer(0, INT64_MAX));
  if (top.has("test_views")) evaluation.test_views = read_test_views(top.at("test_views"));
  const JsonReader views = top.at("views");
  const std::size_t n = views.array_size(1'000'000);
  for (std::size_t i = 0; i < n; ++i) evaluation.views.push_back(read_view(views.at(i)));
  return evaluation;
}

bool needed(const Capture&, std::string&) { return true; }

void inputs(const Capture& capture, InputDigest& digest) {
  for (const auto& [name, record] : capture.stages)
    if (name != "report") digest.add(name, record.digest + record.finished);
  add_photos(capture, digest);
  add_masks(capture, digest);
  digest.add_file("hull", capture.hull_path());
  digest.add_file("model", textured_path(capture));
  digest.add_file("light field", light_field_path(capture));
  digest.add_file("evaluation", evaluation_path(capture));
}

std::filesystem::path report_path(const Capture& capture) { return capture.folder() / "report.html"; }

bool present(const Capture& capture) { return file_exists(report_path(capture)); }

std::vector<std::string> run(Capture& capture, Job& job) {
  const std::optional<Evaluation> evaluation = read_evaluation(capture);
  write_report(capture, {.file = report_path(capture), .evaluation = evaluation ? &*evaluation : nullptr}, job);
  return {report_path(capture).string()};
}

}  // namespace

const StageDefinition& report_stage() {
  static const StageDefinition stage{"report", 2, {}, needed, inputs, present, run};
  return stage;
}

}  // namespace lumihull::slf
