// plan.json.
#include "plan_json.h"

#include <lumihull/base/files.h>
#include <lumihull/internal/pose_json.h>

#include <utility>

#include "../mechanism/mechanism_json.h"

namespace lumihull::capture {
namespace {

using lumihull::internal::Json;
using lumihull::internal::JsonReader;

constexpr const char* kFormat = "lumihull-plan";
constexpr std::int64_t kVersion = 1;
constexpr std::size_t kMaxBytes = std::size_t(256) << 20;  // of the largest plan that is allowed, with room
constexpr std::size_t kMaxCables = 12;

KeepOut read_object(const JsonReader& json) {
  const JsonReader base = json.at("base");
  if (base.array_size(3) != 3) base.fail("three numbers");
  KeepOut object;
  for (std::size_t k = 0; k < 3; ++k) object.base[Eigen::Index(k)] = base.at(k).number();
  object.radius_m = json.at("radius_m").number();
  object.height_m = json.at("height_m").number();
  return object;
}

Json print_object(const KeepOut& object) {
  return {{"base", {object.base.x(), object.base.y(), object.base.z()}},
          {"radius_m", object.radius_m},
          {"height_m", object.height_m}};
}

PlannedStop read_stop(const JsonReader& json) {
  PlannedStop stop;
  stop.name = json.at("name").string(200);
  stop.theta_rad = json.at("theta_rad").number();
  stop.phi_rad = json.at("phi_rad").number();
  stop.roll_rad = json.at("roll_rad").number();
  stop.world_from_platform = lumihull::internal::read_pose(json.at("world_from_platform"));
  stop.cam_from_world = lumihull::internal::read_pose(json.at("cam_from_world"));
  const JsonReader lengths = json.at("lengths_m");
  const std::size_t count = lengths.array_size(kMaxCables);
  for (std::size_t i = 0; i < count; ++i) stop.lengths_m.push_back(lengths.at(i).number());
  stop.travel_s = json.at("travel_s").number();
  stop.settle_s = json.at("settle_s").number();
  stop.exposure_s = json.at("exposure_s").number();
  stop.photograph = json.at("photograph").boolean();
  if (json.has("pause")) stop.pause = json.at("pause").string(1000);
  return stop;
}

Json print_stop(const PlannedStop& stop) {
  Json json{{"name", stop.name},
            {"theta_rad", stop.theta_rad},
            {"phi_rad", stop.phi_rad},
            {"roll_rad", stop.roll_rad},
            {"world_from_platform", lumihull::internal::print_pose(stop.world_from_platform)},
            {"cam_from_world", lumihull::internal::print_pose(stop.cam_from_world)},
            {"lengths_m", stop.lengths_m},
            {"travel_s", stop.travel_s},
            {"settle_s", stop.settle_s},
            {"exposure_s", stop.exposure_s},
            {"photograph", stop.photograph}};
  if (!stop.pause.empty()) json["pause"] = stop.pause;
  return json;
}

}  // namespace

namespace internal {

Plan parse_plan(std::string_view text, const std::string& file) {
  const Json json = lumihull::internal::parse_json(text, file);
  const JsonReader top(json, file);
  lumihull::internal::check_format(top, kFormat, kVersion);
  Plan plan;
  plan.robot = top.at("robot").string(40);
  if (top.has("mechanism")) plan.mechanism = read_mechanism_fields(top.at("mechanism"));
  if (top.has("object")) plan.object = read_object(top.at("object"));
  const JsonReader cameras = top.at("cameras"), stops = top.at("stops");
  const std::size_t camera_count = cameras.array_size(kMaxPlannedCameras);
  for (std::size_t i = 0; i < camera_count; ++i) plan.cameras.push_back(cameras.at(i).string(200));
  const std::size_t count = stops.array_size(kMaxPlannedStops);
  plan.stops.reserve(count);
  for (std::size_t i = 0; i < count; ++i) plan.stops.push_back(read_stop(stops.at(i)));
  check(plan, file);
  return plan;
}

std::string print_plan(const Plan& plan, const std::string& file) {
  check(plan, file);
  Json json{{"format", kFormat}, {"version", kVersion}, {"robot", plan.robot}};
  if (plan.mechanism) json["mechanism"] = print_mechanism_fields(*plan.mechanism);
  if (plan.object) json["object"] = print_object(*plan.object);
  json["cameras"] = plan.cameras;
  Json stops = Json::array();
  for (const PlannedStop& stop : plan.stops) stops.push_back(print_stop(stop));
  json["stops"] = std::move(stops);
  return lumihull::internal::print_json(json, file);
}

}  // namespace internal

Plan read_plan(const std::filesystem::path& file) {
  return internal::parse_plan(read_file(file, kMaxBytes), file.string());
}

void write_plan(const Plan& plan, const std::filesystem::path& file) {
  write_file(file, internal::print_plan(plan, file.string()));
}

}  // namespace lumihull::capture
