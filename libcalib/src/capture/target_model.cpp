// A calibration as a capture's folder holds it, and its figures.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/internal/camera_json.h>

#include <cmath>
#include <map>

#include "target_model_json.h"

namespace lumihull::calib {

namespace fs = std::filesystem;
using lumihull::internal::Json;

namespace {

constexpr std::size_t kMostBytes = std::size_t(1) << 30;

Json print_intrinsics(const Camera& camera, const Eigen::Matrix<double, kIntrinsics, kIntrinsics>& covariance) {
  Json json = lumihull::internal::print_camera(camera), deviations = Json::object();
  for (int i = 0; i < kIntrinsics; ++i)
    if (covariance(i, i) > 0) deviations[intrinsic_names()[std::size_t(i)]] = std::sqrt(covariance(i, i));
  json["standard_deviations"] = std::move(deviations);
  return json;
}

/// "matrix5x5 17", or a body's name.
std::string target_name(const TargetModel& model, const Removed& r) {
  if (r.design >= 0 && r.id >= 0)
    return model.set.designs.at(std::size_t(r.design)).family.name() + " " + std::to_string(r.id);
  return r.body >= 0 ? model.calibration.bodies.at(std::size_t(r.body)).name : "";
}

}  // namespace

fs::path target_model_path(const Capture& capture) { return capture.folder() / "targets.json"; }

TargetModel TargetModel::load(const fs::path& file) {
  return internal::parse_target_model(read_file(file, kMostBytes), file.string());
}

void TargetModel::save(const fs::path& file) const {
  const std::string text = internal::print_target_model(*this, file.string());
  internal::parse_target_model(text, file.string());  // what could not be read again must not replace what can
  write_file(file, text);
}

TargetModel TargetModel::of(const Capture& capture) {
  const fs::path file = target_model_path(capture);
  std::error_code ignored;
  if (!fs::exists(file, ignored))
    throw Error(ErrorCode::not_found, "the file is missing; run the stage \"calibrate\" first", file.string());
  TargetModel model = load(file);
  Calibration& c = model.calibration;
  c.cameras = capture.cameras;
  for (std::size_t i = 0; i < capture.cameras.size(); ++i) {
    const auto at = capture.camera_covariances.find(int(i));
    c.camera_covariances.push_back(
        at == capture.camera_covariances.end() ? Eigen::Matrix<double, kIntrinsics, kIntrinsics>::Zero() : at->second);
  }
  std::map<std::string_view, const Shot*> shots;
  for (const Shot& shot : capture.shots) shots[shot.name] = &shot;
  for (std::size_t i = 0; i < model.photos.size(); ++i) {
    const auto at = shots.find(model.photos[i].name);
    if (at == shots.end()) continue;  // taken out of the capture since
    c.photos[i].cam_from_world = at->second->cam_from_world;
    if (at->second->cam_from_world) c.photos[i].cam_from_part = at->second->cam_from_world;
    if (at->second->pose_quality) c.photos[i].covariance = at->second->pose_quality->covariance;
  }
  return model;
}

std::string calibration_json(const TargetModel& model) {
  const Calibration& c = model.calibration;
  std::size_t placed = 0, targets = 0;
  for (const CalibratedPhoto& p : c.photos) placed += p.cam_from_world.has_value();
  for (const CalibratedBody& b : c.bodies) targets += b.placed;
  Json intrinsics = Json::array(), removed = Json::array();
  for (std::size_t i = 0; i < c.cameras.size(); ++i)
    intrinsics.push_back(print_intrinsics(c.cameras[i], c.camera_covariances.at(i)));
  for (const Removed& r : c.removed) {
    Json one{{"kind", name_of(r.kind)}, {"why", name_of(r.why)}};
    if (r.photo >= 0) one["photo"] = model.photos.at(std::size_t(r.photo)).name;
    if (const std::string name = target_name(model, r); !name.empty()) one["target"] = name;
    if (r.feature >= 0) one["feature"] = r.feature;
    if (r.off_px > 0) one["off_px"] = r.off_px;
    one["text"] = r.text;
    removed.push_back(std::move(one));
  }
  Json json{{"photos", c.photos.size()}, {"photos_placed", placed}, {"targets", targets},         {"rms_px", c.rms_px},
            {"share", c.share},          {"sigma0", c.sigma0},      {"cross_validation", nullptr}};
  if (c.cross_validation_m >= 0)
    json["cross_validation"] = {{"distance_m", c.cross_validation_m}, {"sigma", c.cross_validation_sigma}};
  json["intrinsics"] = std::move(intrinsics);
  json["removed"] = std::move(removed);
  json["parts"] = c.parts;
  json["print_scale"] = {c.print_scale.x(), c.print_scale.y()};
  json["bend_m"] = c.bend_m;
  json["warnings"] = c.warnings;
  json["verdict"] = c.verdict;
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace lumihull::calib
