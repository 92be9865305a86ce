// targets.json: the solved targets and how good the calibration is.
#include "target_model_json.h"

#include <lumihull/internal/camera_json.h>
#include <lumihull/internal/covariance_json.h>
#include <lumihull/internal/pose_json.h>

#include <array>
#include <map>

#include "../targets/target_set_json.h"

namespace lumihull::calib {
namespace {

using lumihull::internal::Json;
using lumihull::internal::JsonReader;

constexpr const char* kFormat = "lumihull-target-model";
constexpr std::int64_t kVersion = 1;
constexpr std::size_t kMostEntries = 1'000'000;
constexpr std::size_t kLongText = 1 << 16;  // a warning may name many photographs
constexpr std::array<const char*, 4> kKinds{"observation", "detection", "target", "photo"};
constexpr std::array<const char*, 9> kWhys{"outlier",  "wrong_id", "moved",         "same_id",      "other_scene",
                                           "mirrored", "too_few",  "not_connected", "unknown_board"};
constexpr std::array<const char*, 3> kModels{"rigid", "bending", "free"};

template <std::size_t N>
int read_word(const JsonReader& json, const std::array<const char*, N>& words) {
  const std::string word = json.string(40);
  std::string known;
  for (std::size_t i = 0; i < N; ++i) {
    if (word == words[i]) return int(i);
    known += (i ? ", \"" : "\"") + std::string(words[i]) + "\"";
  }
  json.fail("one of " + known);
}

template <int N>
Eigen::Matrix<double, N, 1> read_vector(const JsonReader& json) {
  if (json.array_size(std::size_t(N)) != std::size_t(N)) json.fail(std::to_string(N) + " numbers");
  Eigen::Matrix<double, N, 1> v;
  for (int i = 0; i < N; ++i) v(i) = json.at(std::size_t(i)).number(-1e12, 1e12);
  return v;
}

template <class Vector>
Json list(const Vector& v) {
  Json json = Json::array();
  for (int i = 0; i < int(v.size()); ++i) json.push_back(v(i));
  return json;
}

// ---- bodies
// ----------------------------------------------------------------------------------------------------------

Json print_point(const CalibratedBody& body, std::size_t k) {
  const BodyPoint& printed = body.body.points.at(k);
  Json json = Json::object();
  if (k < body.features.size()) {
    json["design"] = body.features[k].design;
    json["id"] = body.features[k].id;
    json["feature"] = body.features[k].feature;
  }
  json["printed"] = list(printed.place);
  if (printed.radius > 0) {
    json["radius"] = printed.radius;
    json["normal"] = list(printed.normal);
  }
  if (body.placed && k < body.points.size()) json["point"] = list(body.points[k]);
  if (body.placed && k < body.point_covariances.size())
    json["covariance"] = lumihull::internal::print_covariance<3>(body.point_covariances[k]);
  return json;
}

Json print_body(const CalibratedBody& b) {
  Json json{{"name", b.name}};
  if (b.board >= 0) json["board"] = b.board;
  if (b.design >= 0) json["design"] = b.design;
  if (b.id >= 0) json["id"] = b.id;
  json["model"] = kModels.at(std::size_t(b.body.model));
  json["placed"] = b.placed;
  json["part"] = b.part;
  json["photos"] = b.photos;
  json["rms_px"] = b.rms_px;
  if (b.placed) json["world_from_body"] = lumihull::internal::print_pose(b.body.world_from_body);
  if (b.part > 0 && b.part_from_body) json["part_from_body"] = lumihull::internal::print_pose(*b.part_from_body);
  if (!b.body.bend.isZero(0)) json["bend"] = list(b.body.bend);
  Json points = Json::array();
  for (std::size_t k = 0; k < b.body.points.size(); ++k) points.push_back(print_point(b, k));
  json["points"] = std::move(points);
  return json;
}

void read_point(const JsonReader& json, const TargetSet& set, CalibratedBody& body) {
  CalibratedBody::PointName& name = body.features.emplace_back();
  name.design = int(json.at("design").integer(0, std::int64_t(set.designs.size()) - 1));
  const TargetDesign& design = set.designs[std::size_t(name.design)];
  name.id = int(json.at("id").integer(0, INT32_MAX));
  if (!design.family.has(name.id)) json.at("id").fail("an id of family " + design.family.name());
  name.feature = int(json.at("feature").integer(0, design.features() - 1));
  BodyPoint& printed = body.body.points.emplace_back();
  printed.place = read_vector<3>(json.at("printed"));
  if (json.has("radius")) {
    printed.radius = json.at("radius").positive();
    printed.normal = read_vector<3>(json.at("normal"));
    if (std::abs(printed.normal.norm() - 1) > 1e-6) json.at("normal").fail("a vector of length 1");
  }
  if (!body.placed) return;
  body.points.push_back(read_vector<3>(json.at("point")));
  body.point_covariances.push_back(
      json.has("covariance") ? lumihull::internal::read_covariance<3>(json.at("covariance")) : Eigen::Matrix3d::Zero());
}

CalibratedBody read_body(const JsonReader& json, const TargetSet& set) {
  CalibratedBody b;
  b.name = json.at("name").string();
  if (json.has("board")) b.board = int(json.at("board").integer(0, std::int64_t(set.boards.size()) - 1));
  if (json.has("design")) b.design = int(json.at("design").integer(0, std::int64_t(set.designs.size()) - 1));
  if (json.has("id")) b.id = int(json.at("id").integer(0, INT32_MAX));
  b.body.name = b.name;
  b.body.model = BodyModel(read_word(json.at("model"), kModels));
  b.placed = json.at("placed").boolean();
  b.photos = int(json.at("photos").integer(0, INT32_MAX));
  b.rms_px = json.at("rms_px").number(0);
  b.part = b.placed ? 0 : -1;  // files of before did not say more
  if (json.has("part")) b.part = int(json.at("part").integer(-1, INT32_MAX));
  if (b.placed != (b.part == 0))
    json.at("part").fail(b.placed ? "0, for it is placed" : "another part than 0, for it is not placed");
  if (b.placed) b.part_from_body = b.body.world_from_body = lumihull::internal::read_pose(json.at("world_from_body"));
  if (b.part > 0) b.part_from_body = lumihull::internal::read_pose(json.at("part_from_body"));
  if (json.has("bend")) b.body.bend = read_vector<3>(json.at("bend"));
  const JsonReader points = json.at("points");
  const std::size_t n = points.array_size(kMostEntries);
  for (std::size_t i = 0; i < n; ++i) read_point(points.at(i), set, b);
  if (b.body.model == BodyModel::free && b.placed) b.body.free_places = b.points;
  return b;
}

// ---- what was known before, photographs, what was left out
// -----------------------------------------------------------

Json print_start(const CameraStart& s) {
  Json json{{"width", s.width}, {"height", s.height}};
  if (s.camera) json["camera"] = lumihull::internal::print_camera(*s.camera);
  if (s.focal_px > 0) json["focal_px"] = s.focal_px;
  return json;
}

CameraStart read_start(const JsonReader& json) {
  CameraStart s;
  s.width = int(json.at("width").integer(1, kMaxImageSide));
  s.height = int(json.at("height").integer(1, kMaxImageSide));
  if (json.has("camera")) s.camera = lumihull::internal::read_camera(json.at("camera"), true);
  if (json.has("focal_px")) s.focal_px = json.at("focal_px").positive();
  return s;
}

Json print_photo(const TargetModel::Photo& photo, const CalibratedPhoto& p) {
  Json json{{"name", photo.name}, {"camera", photo.camera}, {"in_model", p.in_model}, {"part", p.part},
            {"points", p.points}, {"rms_px", p.rms_px},     {"reason", p.reason}};
  // Poses in the world are those of cameras.json.
  if (p.part > 0 && p.cam_from_part) json["cam_from_part"] = lumihull::internal::print_pose(*p.cam_from_part);
  return json;
}

CalibratedPhoto read_photo(const JsonReader& json) {
  CalibratedPhoto p;
  p.in_model = json.at("in_model").boolean();
  p.part = int(json.at("part").integer(-1, INT32_MAX));
  p.points = int(json.at("points").integer(0, INT32_MAX));
  p.rms_px = json.at("rms_px").number(0);
  p.reason = json.at("reason").string(kLongText);
  if (json.has("cam_from_part")) p.cam_from_part = lumihull::internal::read_pose(json.at("cam_from_part"));
  return p;
}

Json print_removed(const Removed& r, const std::vector<TargetModel::Photo>& photos) {
  Json json{{"kind", name_of(r.kind)}, {"why", name_of(r.why)}};
  if (r.photo >= 0) json["photo"] = photos.at(std::size_t(r.photo)).name;
  if (r.body >= 0) json["body"] = r.body;
  if (r.design >= 0) json["design"] = r.design;
  if (r.id >= 0) json["id"] = r.id;
  if (r.feature >= 0) json["feature"] = r.feature;
  if (r.off_px > 0) json["off_px"] = r.off_px;
  json["text"] = r.text;
  return json;
}

Removed read_removed(const JsonReader& json, const TargetModel& model, const std::map<std::string, int>& photo_of) {
  Removed r;
  r.kind = Removed::Kind(read_word(json.at("kind"), kKinds));
  r.why = Removed::Why(read_word(json.at("why"), kWhys));
  if (json.has("photo")) {
    const auto at = photo_of.find(json.at("photo").string());
    if (at == photo_of.end()) json.at("photo").fail("the name of a photograph of this file");
    r.photo = at->second;
  }
  if (json.has("body")) r.body = int(json.at("body").integer(0, std::int64_t(model.calibration.bodies.size()) - 1));
  if (json.has("design")) r.design = int(json.at("design").integer(0, std::int64_t(model.set.designs.size()) - 1));
  if (json.has("id")) r.id = int(json.at("id").integer(0, INT32_MAX));
  if (json.has("feature")) r.feature = int(json.at("feature").integer(0, INT32_MAX));
  if (json.has("off_px")) r.off_px = json.at("off_px").number(0);
  r.text = json.at("text").string(kLongText);
  return r;
}

/// A list that must be there.
template <class Read>
auto read_list(const JsonReader& top, std::string_view field, Read read) {
  const JsonReader json = top.at(field);
  std::vector<decltype(read(top))> items;
  const std::size_t n = json.array_size(kMostEntries);
  for (std::size_t i = 0; i < n; ++i) items.push_back(read(json.at(i)));
  return items;
}

}  // namespace

const char* name_of(Removed::Kind kind) { return kKinds.at(std::size_t(kind)); }
const char* name_of(Removed::Why why) { return kWhys.at(std::size_t(why)); }
const char* name_of(BodyModel model) { return kModels.at(std::size_t(model)); }

namespace internal {

TargetModel parse_target_model(std::string_view text, const std::string& name) {
  const Json document = lumihull::internal::parse_json(text, name);
  const JsonReader top(document, name);
  lumihull::internal::check_format(top, kFormat, kVersion);
  TargetModel model;
  Calibration& c = model.calibration;
  model.set = read_target_set(top.at("set"));
  model.starts = read_list(top, "starts", read_start);
  c.photos = read_list(top, "photos", [&](const JsonReader& json) {
    model.photos.push_back(
        {json.at("name").string(), int(json.at("camera").integer(0, std::int64_t(model.starts.size()) - 1))});
    return read_photo(json);
  });
  std::map<std::string, int> photo_of;
  for (std::size_t i = 0; i < model.photos.size(); ++i)
    if (!photo_of.emplace(model.photos[i].name, int(i)).second)
      top.at("photos").at(i).at("name").fail("a name that no other photograph has");
  c.bodies = read_list(top, "bodies", [&](const JsonReader& json) { return read_body(json, model.set); });
  c.removed = read_list(top, "removed", [&](const JsonReader& json) { return read_removed(json, model, photo_of); });
  c.warnings = read_list(top, "warnings", [](const JsonReader& json) { return json.string(kLongText); });
  c.verdict = top.at("verdict").string(kLongText);
  c.rms_px = top.at("rms_px").number(0);
  c.share = top.at("share").number(0, 1);
  c.sigma0 = top.at("sigma0").number(0);
  c.print_scale = read_vector<2>(top.at("print_scale"));
  c.parts = int(top.at("parts").integer(0, INT32_MAX));
  c.bend_m = top.at("bend_m").number(0);
  if (top.has("cross_validation")) {
    const JsonReader cross = top.at("cross_validation");
    c.cross_validation_m = cross.at("distance_m").number(0);
    c.cross_validation_sigma = cross.at("sigma").number(0);
  }
  return model;
}

std::string print_target_model(const TargetModel& model, const std::string& name) {
  const Calibration& c = model.calibration;
  Json starts = Json::array(), photos = Json::array(), bodies = Json::array(), removed = Json::array();
  for (const CameraStart& s : model.starts) starts.push_back(print_start(s));
  for (std::size_t i = 0; i < model.photos.size(); ++i) photos.push_back(print_photo(model.photos[i], c.photos.at(i)));
  for (const CalibratedBody& b : c.bodies) bodies.push_back(print_body(b));
  for (const Removed& r : c.removed) removed.push_back(print_removed(r, model.photos));
  Json json{{"format", kFormat}, {"version", kVersion}, {"verdict", c.verdict}, {"rms_px", c.rms_px},
            {"share", c.share},  {"sigma0", c.sigma0},  {"parts", c.parts},     {"print_scale", list(c.print_scale)},
            {"bend_m", c.bend_m}};
  if (c.cross_validation_m >= 0)
    json["cross_validation"] = {{"distance_m", c.cross_validation_m}, {"sigma", c.cross_validation_sigma}};
  json["warnings"] = c.warnings;
  json["set"] = json_of(model.set);
  json["starts"] = std::move(starts);
  json["bodies"] = std::move(bodies);
  json["removed"] = std::move(removed);
  json["photos"] = std::move(photos);
  return lumihull::internal::print_json(json, name);
}

}  // namespace internal
}  // namespace lumihull::calib
