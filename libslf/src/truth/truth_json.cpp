#include <lumihull/internal/json.h>
#include <lumihull/slf/truth.h>

#include <cmath>
#include <cstdio>

#include "judge/evaluation_json.h"

namespace lumihull::slf {
namespace {

using internal::Json;

Json spread_json(const Spread& s) {
  return {{"count", s.count},          {"mean", number_json(s.mean)},
          {"rms", number_json(s.rms)}, {"median", number_json(s.median)},
          {"q95", number_json(s.q95)}, {"max", number_json(s.max)}};
}

Json poses_json(const PoseTruth& p) {
  const auto& q = p.motion.rotation;
  const auto& t = p.motion.translation;
  Json out{{"scale", p.scale},
           {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
           {"translation", {t.x(), t.y(), t.z()}},
           {"aligned_by", p.aligned_by_rotations ? "rotations" : "centres"},
           {"scale_error_ppm", number_json(p.scale_error_ppm)},
           {"center_mm", spread_json(p.center_mm)},
           {"rotation_deg", spread_json(p.rotation_deg)},
           {"consistency", number_json(p.consistency)},
           {"consistency_datum", std::isnan(p.consistency)  ? Json(nullptr)
                                 : p.consistency_by_targets ? Json("targets")
                                                            : Json("cameras")},
           {"not_placed", p.not_placed},
           {"not_in_truth", p.not_in_truth},
           {"not_in_capture", p.not_in_capture},
           {"shots", Json::array()}};
  for (const PoseTruth::Shot& s : p.shots)
    out["shots"].push_back({{"name", s.name},
                            {"center_mm", s.center_mm},
                            {"rotation_deg", s.rotation_deg},
                            {"mahalanobis2", number_json(s.mahalanobis2)}});
  return out;
}

Json targets_json(const TargetTruth& t) {
  Json out{{"point_mm", spread_json(t.point_mm)},
           {"wrong_ids", t.wrong_ids},
           {"not_solved", t.not_solved},
           {"targets", Json::array()}};
  for (const TargetTruth::Target& target : t.targets)
    out["targets"].push_back(
        {{"name", target.name}, {"design", target.design}, {"id", target.id}, {"rms_mm", target.rms_mm}});
  return out;
}

Json masks_json(const MaskTruth& m) {
  Json out{{"iou_mean", m.iou_mean},    {"iou_least", m.iou_least},          {"edge_px", spread_json(m.edge_px)},
           {"within_1.5_px", m.within}, {"bias_px", number_json(m.bias_px)}, {"holes", m.holes},
           {"islands", m.islands},      {"without_truth", m.without_truth},  {"shots", Json::array()}};
  for (const MaskTruth::Shot& s : m.shots)
    out["shots"].push_back({{"name", s.name},
                            {"iou", s.iou},
                            {"edge_px", spread_json(s.edge_px)},
                            {"within_1.5_px", s.within},
                            {"bias_px", number_json(s.bias_px)},
                            {"holes", s.holes},
                            {"hole_px", s.hole_px},
                            {"islands", s.islands},
                            {"island_px", s.island_px}});
  return out;
}

Json surface_json(const SurfaceTruth& s) {
  Json out{{"hull_to_truth_mm", spread_json(s.hull_to_truth_mm)},
           {"truth_to_hull_mm", spread_json(s.truth_to_hull_mm)},
           {"voxel_mm", number_json(s.voxel_mm)},
           {"volume_ratio", number_json(s.volume_ratio)},
           {"outside_mm", s.outside_mm},
           {"outside_share", s.outside_share},
           {"outside_max_mm", s.outside_max_mm},
           {"iou_mean", number_json(s.iou_mean)},
           {"iou_least", number_json(s.iou_least)},
           {"silhouettes", Json::array()}};
  for (const SurfaceTruth::Shot& shot : s.silhouettes)
    out["silhouettes"].push_back({{"name", shot.name}, {"iou", shot.iou}});
  return out;
}

template <class... Values>
std::string line(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace

std::string TruthComparison::to_json() const {
  Json out{{"truth", truth}, {"left_out", left_out}};
  if (poses) out["poses"] = poses_json(*poses);
  if (!lenses.empty()) {
    out["lenses"] = Json::array();
    for (const LensTruth& l : lenses)
      out["lenses"].push_back({{"camera", l.camera},
                               {"focal_error_percent", l.focal_error_percent},
                               {"principal_point_px", {l.principal_point_px.x(), l.principal_point_px.y()}},
                               {"projection_rms_px", number_json(l.projection_rms_px)},
                               {"projection_max_px", number_json(l.projection_max_px)}});
  }
  if (targets) out["targets"] = targets_json(*targets);
  if (masks) out["masks"] = masks_json(*masks);
  if (surface) out["surface"] = surface_json(*surface);
  if (views) out["test_views"] = test_views_json(*views);
  return internal::print_json(out, truth);
}

std::vector<std::string> TruthComparison::summary() const {
  std::vector<std::string> out;
  if (poses) {
    const PoseTruth& p = *poses;
    out.push_back(
        line("poses: %zu of %zu placed; centres RMS %.3g mm, median %.3g, at most %.3g; rotations RMS %.3g°, "
             "at most %.3g°",
             p.shots.size(), p.shots.size() + p.not_placed.size(), p.center_mm.rms, p.center_mm.median, p.center_mm.max,
             p.rotation_deg.rms, p.rotation_deg.max));
    if (!std::isnan(p.scale_error_ppm)) out.push_back(line("scale: %.1f ppm too large", p.scale_error_ppm));
    if (!std::isnan(p.consistency))
      out.push_back(line("covariances: mean Mahalanobis² / 6 is %.2f (%s aligned)", p.consistency,
                         p.consistency_by_targets ? "targets" : "cameras"));
  }
  for (const LensTruth& l : lenses)
    out.push_back(
        line("camera %d: focal length %+.4f %%, principal point (%+.2f, %+.2f) px, projection RMS %.3g px, at "
             "most %.3g",
             l.camera, l.focal_error_percent, l.principal_point_px.x(), l.principal_point_px.y(), l.projection_rms_px,
             l.projection_max_px));
  if (targets)
    out.push_back(line("targets: %zu, points RMS %.3g mm, at most %.3g; %zu wrong ids, %zu not solved",
                       targets->targets.size(), targets->point_mm.rms, targets->point_mm.max, targets->wrong_ids.size(),
                       targets->not_solved.size()));
  if (masks)
    out.push_back(
        line("masks: %zu, IoU %.4f, at least %.4f; edges 95 %% within %.2f px, %.1f %% within 1.5 px, bias "
             "%+.2f px; %zu holes, %zu islands",
             masks->shots.size(), masks->iou_mean, masks->iou_least, masks->edge_px.q95, 100 * masks->within,
             masks->bias_px, masks->holes, masks->islands));
  if (surface) {
    const SurfaceTruth& s = *surface;
    out.push_back(line(
        "surface: hull to truth mean %.3g mm, RMS %.3g, 95 %% %.3g, at most %.3g; truth to hull mean %.3g, "
        "RMS %.3g, 95 %% %.3g, at most %.3g (voxel %.3g mm)",
        s.hull_to_truth_mm.mean, s.hull_to_truth_mm.rms, s.hull_to_truth_mm.q95, s.hull_to_truth_mm.max,
        s.truth_to_hull_mm.mean, s.truth_to_hull_mm.rms, s.truth_to_hull_mm.q95, s.truth_to_hull_mm.max, s.voxel_mm));
    out.push_back(
        line("         volume ratio %.4f; %.3f %% of the true surface more than %g mm outside, at most %.3g mm; "
             "silhouettes' IoU %.4f, at least %.4f",
             s.volume_ratio, 100 * s.outside_share, s.outside_mm, s.outside_max_mm, s.iou_mean, s.iou_least));
  }
  if (views) {
    for (const auto& [method, q] : views->methods)
      out.push_back(line("new views, %s: PSNR %.2f dB, SSIM %.4f; inside %.2f dB, %.4f", method.c_str(), q.psnr, q.ssim,
                         q.psnr_inside, q.ssim_inside));
    for (const auto& [method, path] : views->highlights)
      out.push_back(line("highlights, %s: %zu of %zu, along %.0f %% of their way, %.1f px off", method.c_str(),
                         path.found, path.places, 100 * path.share, path.rms_px));
  }
  for (const std::string& what : left_out) out.push_back("left out: " + what);
  return out;
}

}  // namespace lumihull::slf
