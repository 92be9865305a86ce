#include <lumihull/internal/json.h>
#include <lumihull/slf/evaluate.h>

#include <cmath>

namespace lumihull::slf {
namespace {

using internal::Json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json methods_json(const std::map<std::string, PictureQuality>& methods) {
  Json out = Json::object();
  for (const auto& [name, q] : methods)
    out[name] = {{"psnr", number(q.psnr)},
                 {"ssim", number(q.ssim)},
                 {"psnr_inside", number(q.psnr_inside)},
                 {"ssim_inside", number(q.ssim_inside)}};
  return out;
}

}  // namespace

std::string Evaluation::to_json() const {
  Json out;
  out["photos_used"] = photos_used;
  out["photos_held_out"] = photos_held_out;
  out["silhouette_iou"] = number(mean.silhouette_iou);
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
    Json v = {{"name", view.name}, {"silhouette_iou", number(view.silhouette_iou)}};
    if (!std::isnan(view.keyed_iou)) v["keyed_iou"] = view.keyed_iou;
    v["methods"] = methods_json(view.methods);
    out["views"].push_back(std::move(v));
  }
  if (test_views.views) {
    Json& t = out["test_views"];
    t = {{"views", test_views.views}, {"methods", methods_json(test_views.methods)}};
    for (const auto& [name, path] : test_views.highlights)
      t["highlights"][name] = {{"lamp", path.lamp},           {"views", path.views},
                               {"found", path.found},         {"true_length_px", number(path.true_length_px)},
                               {"share", number(path.share)}, {"rms_px", number(path.rms_px)}};
  }
  return out.dump(1);
}

}  // namespace lumihull::slf
