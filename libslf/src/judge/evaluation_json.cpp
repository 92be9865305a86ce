#include "evaluation_json.h"

#include <cmath>

namespace lumihull::slf {

using internal::Json;

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

namespace {

Json methods_json(const std::map<std::string, PictureQuality>& methods) {
  Json out = Json::object();
  for (const auto& [name, q] : methods)
    out[name] = {{"psnr", number_json(q.psnr)},
                 {"ssim", number_json(q.ssim)},
                 {"psnr_inside", number_json(q.psnr_inside)},
                 {"ssim_inside", number_json(q.ssim_inside)}};
  return out;
}

}  // namespace

Json test_views_json(const TestViewEvaluation& views) {
  Json t = {{"views", views.views}, {"methods", methods_json(views.methods)}};
  for (const auto& [name, path] : views.highlights)
    t["highlights"][name] = {{"tracks", path.tracks},
                             {"places", path.places},
                             {"found", path.found},
                             {"true_length_px", number_json(path.true_length_px)},
                             {"share", number_json(path.share)},
                             {"rms_px", number_json(path.rms_px)}};
  return t;
}

std::string Evaluation::to_json() const {
  Json out;
  out["photos_used"] = photos_used;
  out["photos_held_out"] = photos_held_out;
  out["silhouette_iou"] = number_json(mean.silhouette_iou);
  if (!std::isnan(mean.keyed_iou)) out["keyed_iou"] = mean.keyed_iou;
  out["triangles"] = triangles;
  out["model_bytes"] = model_bytes;
  if (light_field_bytes) out["light_field_bytes"] = light_field_bytes;
  out["methods"] = methods_json(mean.methods);
  out["stages"] = Json::object();
  for (const auto& [name, record] : stages)
    out["stages"][name] = {{"seconds", record.seconds}, {"peak_bytes", record.peak_bytes}};
  out["views"] = Json::array();
  for (const ViewEvaluation& view : views) {
    Json v = {{"name", view.name}, {"silhouette_iou", number_json(view.silhouette_iou)}};
    if (!std::isnan(view.keyed_iou)) v["keyed_iou"] = view.keyed_iou;
    v["methods"] = methods_json(view.methods);
    out["views"].push_back(std::move(v));
  }
  if (test_views.views) out["test_views"] = test_views_json(test_views);
  return out.dump(1);
}

}  // namespace lumihull::slf
