// Detections as JSON.
#include <lumihull/base/image.h>
#include <lumihull/calib/detections_json.h>
#include <lumihull/internal/json.h>

#include <algorithm>
#include <array>

#include "detections_file.h"

namespace lumihull::calib {
namespace {

using lumihull::internal::Json;
using lumihull::internal::JsonReader;

constexpr std::array<std::string_view, 6> kReasons{"no_code",          "homography", "duplicate",
                                                   "too_few_features", "unknown_id", "overexposed"};
constexpr const char* kFormat = "lumihull-detections";
constexpr std::int64_t kVersion = 1;
constexpr std::size_t kMostTargets = 100'000;

Json print_target(const TargetSet& set, const Detection& d) {
  Json json = Json::object();
  if (d.id < 0) {
    json["grid"] = d.design;
  } else {
    json["design"] = d.design;
    json["family"] = set.designs.at(std::size_t(d.design)).family.name();
    json["id"] = d.id;
  }
  json["corrected"] = d.corrected;
  json["erased"] = d.erased;
  json["rms_px"] = d.rms_px;
  Json h = Json::array();
  for (int i = 0; i < 9; ++i) h.push_back(d.pixel_from_target(i / 3, i % 3));
  json["pixel_from_target"] = std::move(h);
  Json features = Json::array();
  for (const Feature& f : d.features) {
    Json one{{"index", f.index},
             {"pixel", {f.pixel.x(), f.pixel.y()}},
             {"covariance", {f.covariance(0, 0), f.covariance(0, 1), f.covariance(1, 1)}}};
    const Eigen::Matrix3d& c = f.dual_conic;
    if (!c.isZero(0)) one["dual_conic"] = {c(0, 0), c(0, 1), c(1, 1), c(0, 2), c(1, 2)};
    features.push_back(std::move(one));
  }
  json["features"] = std::move(features);
  return json;
}

Feature read_feature(const JsonReader& json, int count) {
  Feature f;
  f.index = int(json.at("index").integer(0, count - 1));
  const JsonReader pixel = json.at("pixel"), covariance = json.at("covariance");
  if (pixel.array_size(2) != 2) pixel.fail("two numbers");
  f.pixel = {pixel.at(0).number(-1e6, 1e6), pixel.at(1).number(-1e6, 1e6)};
  if (covariance.array_size(3) != 3) covariance.fail("three numbers xx, xy, yy");
  const double xx = covariance.at(0).number(0), xy = covariance.at(1).number(), yy = covariance.at(2).number(0);
  if (!(xx * yy > xy * xy)) covariance.fail("a positive definite covariance xx, xy, yy");
  f.covariance << xx, xy, xy, yy;
  if (json.has("dual_conic")) {
    const JsonReader conic = json.at("dual_conic");
    if (conic.array_size(5) != 5) conic.fail("five numbers");
    std::array<double, 5> c;
    for (std::size_t i = 0; i < 5; ++i) c[i] = conic.at(i).number();
    f.dual_conic << c[0], c[1], c[3], c[1], c[2], c[4], c[3], c[4], 1;
  }
  return f;
}

Detection read_target(const JsonReader& json, const TargetSet& set) {
  Detection d;
  int count = 0;
  if (json.has("grid")) {
    d.id = -1;
    d.design = int(json.at("grid").integer(0, std::int64_t(set.grids.size()) - 1));
    count = set.grids[std::size_t(d.design)].columns * set.grids[std::size_t(d.design)].rows;
  } else {
    d.design = int(json.at("design").integer(0, std::int64_t(set.designs.size()) - 1));
    const TargetDesign& design = set.designs[std::size_t(d.design)];
    if (json.at("family").string() != design.family.name()) json.at("family").fail("\"" + design.family.name() + "\"");
    d.id = int(json.at("id").integer(0, INT32_MAX));
    if (!design.family.has(d.id)) json.at("id").fail("an id of family " + design.family.name());
    count = design.features();
  }
  d.corrected = int(json.at("corrected").integer(0, INT32_MAX));
  d.erased = int(json.at("erased").integer(0, INT32_MAX));
  d.rms_px = json.at("rms_px").number(0);
  const JsonReader h = json.at("pixel_from_target");
  if (h.array_size(9) != 9) h.fail("nine numbers");
  for (int i = 0; i < 9; ++i) d.pixel_from_target(i / 3, i % 3) = h.at(std::size_t(i)).number();
  const JsonReader features = json.at("features");
  const std::size_t n = features.array_size(std::size_t(count));
  for (std::size_t i = 0; i < n; ++i) {
    d.features.push_back(read_feature(features.at(i), count));
    if (i > 0 && d.features[i].index <= d.features[i - 1].index)
      features.at(i).at("index").fail("a larger index than the one before");
  }
  return d;
}

}  // namespace

std::span<const std::string_view> refusal_names() { return kReasons; }

std::string detections_json(const TargetSet& set, const PhotoDetections& detections) {
  Json targets = Json::array(), refused = Json::object();
  for (const Detection& d : detections.found.targets) targets.push_back(print_target(set, d));
  for (std::size_t i = 0; i < kReasons.size(); ++i)
    refused[std::string(kReasons[i])] =
        std::count_if(detections.found.refused.begin(), detections.found.refused.end(),
                      [&](const RefusedTarget& r) { return std::size_t(r.reason) == i; });
  const Json json{{"photo", detections.photo},
                  {"width", detections.width},
                  {"height", detections.height},
                  {"targets", std::move(targets)},
                  {"refused", std::move(refused)}};
  try {
    return json.dump();
  } catch (const nlohmann::json::exception&) {
    throw Error(ErrorCode::bad_input, "a name that is not UTF-8 can't be stored as JSON", detections.photo);
  }
}

namespace internal {

KeptDetections parse_detections(std::string_view text, const std::string& name, const TargetSet& set) {
  const Json document = lumihull::internal::parse_json(text, name);
  const JsonReader file(document, name);
  lumihull::internal::check_format(file, kFormat, kVersion);
  KeptDetections kept;
  kept.key = file.at("key").string(64);
  const JsonReader top = file.at("detections");
  PhotoDetections& out = kept.detections;
  out.photo = top.at("photo").string();
  out.width = int(top.at("width").integer(1, kMaxImageSide));
  out.height = int(top.at("height").integer(1, kMaxImageSide));
  const JsonReader targets = top.at("targets");
  const std::size_t n = targets.array_size(kMostTargets);
  for (std::size_t i = 0; i < n; ++i) out.found.targets.push_back(read_target(targets.at(i), set));
  return kept;
}

std::string print_detections(const TargetSet& set, const KeptDetections& kept) {
  return "{\"format\": \"" + std::string(kFormat) + "\", \"version\": " + std::to_string(kVersion) + ", \"key\": \"" +
         kept.key + "\", \"detections\":\n" + detections_json(set, kept.detections) + "}\n";
}

}  // namespace internal

}  // namespace lumihull::calib
