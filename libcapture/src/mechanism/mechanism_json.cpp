// mechanism.json.
#include "mechanism_json.h"

#include <lumihull/base/files.h>
#include <lumihull/internal/pose_json.h>

#include <utility>

namespace lumihull::capture {
namespace {

using lumihull::internal::Json;
using lumihull::internal::JsonReader;

constexpr const char* kFormat = "lumihull-mechanism";
constexpr std::int64_t kVersion = 1;
constexpr std::size_t kMaxBytes = std::size_t(1) << 20;
constexpr std::size_t kMaxCables = 12;

// One list of the plain numbers for reading and for writing.
template <class C, class Each>
void each_number(C& cable, const Each& each) requires std::same_as<std::remove_const_t<C>, Cable> {
  each("min_length_m", cable.min_length_m);
  each("max_length_m", cable.max_length_m);
  each("min_tension_N", cable.min_tension_N);
  each("max_tension_N", cable.max_tension_N);
  each("stiffness_N", cable.stiffness_N);
  each("density_kg_m", cable.density_kg_m);
}

template <class L, class Each>
void each_number(L& limits, const Each& each) requires std::same_as<std::remove_const_t<L>, MotionLimits> {
  each("speed_m_s", limits.speed_m_s);
  each("acceleration_m_s2", limits.acceleration_m_s2);
  each("jerk_m_s3", limits.jerk_m_s3);
  each("cable_speed_m_s", limits.cable_speed_m_s);
  each("cable_acceleration_m_s2", limits.cable_acceleration_m_s2);
}

template <class M, class Each>
void each_number(M& mechanism, const Each& each) requires std::same_as<std::remove_const_t<M>, Mechanism> {
  each("mass_kg", mechanism.mass_kg);
  each("platform_radius_m", mechanism.platform_radius_m);
  each("cable_radius_m", mechanism.cable_radius_m);
  each("gravity_m_s2", mechanism.gravity_m_s2);
}

template <class T>
void read_numbers(const JsonReader& json, T& into) {
  each_number(into, [&](const char* field, double& value) { value = json.at(field).number(); });
}

template <class T>
void print_numbers(const T& from, Json& json) {
  each_number(from, [&](const char* field, double value) { json[field] = value; });
}

Eigen::Vector3d read_point(const JsonReader& json) {
  if (json.array_size(3) != 3) json.fail("three numbers");
  return {json.at(0).number(), json.at(1).number(), json.at(2).number()};
}

Json print_point(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }

}  // namespace

namespace internal {

Mechanism read_mechanism_fields(const JsonReader& json) {
  Mechanism mechanism;
  mechanism.name = json.at("name").string(256);
  const JsonReader cables = json.at("cables");
  const std::size_t count = cables.array_size(kMaxCables);
  for (std::size_t i = 0; i < count; ++i) {
    const JsonReader from = cables.at(i);
    Cable cable;
    cable.name = from.at("name").string(64);
    cable.departure = read_point(from.at("departure"));
    cable.attachment = read_point(from.at("attachment"));
    read_numbers(from, cable);
    mechanism.cables.push_back(std::move(cable));
  }
  mechanism.center_of_mass = read_point(json.at("center_of_mass"));
  mechanism.room = {read_point(json.at("room").at("min")), read_point(json.at("room").at("max"))};
  read_numbers(json, mechanism);
  read_numbers(json.at("limits"), mechanism.limits);
  mechanism.cam_from_platform = lumihull::internal::read_pose(json.at("cam_from_platform"));
  return mechanism;
}

Json print_mechanism_fields(const Mechanism& mechanism) {
  Json cables = Json::array(), limits = Json::object();
  for (const Cable& cable : mechanism.cables) {
    Json to{{"name", cable.name},
            {"departure", print_point(cable.departure)},
            {"attachment", print_point(cable.attachment)}};
    print_numbers(cable, to);
    cables.push_back(std::move(to));
  }
  print_numbers(mechanism.limits, limits);
  Json json{
      {"name", mechanism.name},
      {"cables", std::move(cables)},
      {"center_of_mass", print_point(mechanism.center_of_mass)},
      {"room", {{"min", print_point(mechanism.room.min())}, {"max", print_point(mechanism.room.max())}}},
  };
  print_numbers(mechanism, json);
  json["limits"] = std::move(limits);
  json["cam_from_platform"] = lumihull::internal::print_pose(mechanism.cam_from_platform);
  return json;
}

Mechanism parse_mechanism(std::string_view text, const std::string& file) {
  const Json json = lumihull::internal::parse_json(text, file);
  const JsonReader top(json, file);
  lumihull::internal::check_format(top, kFormat, kVersion);
  Mechanism mechanism = read_mechanism_fields(top);
  check(mechanism, file);
  return mechanism;
}

std::string print_mechanism(const Mechanism& mechanism, const std::string& file) {
  check(mechanism, file);
  Json json{{"format", kFormat}, {"version", kVersion}};
  json.update(print_mechanism_fields(mechanism));
  return lumihull::internal::print_json(json, file);
}

}  // namespace internal

Mechanism read_mechanism(const std::filesystem::path& file) {
  return internal::parse_mechanism(read_file(file, kMaxBytes), file.string());
}

void write_mechanism(const Mechanism& mechanism, const std::filesystem::path& file) {
  write_file(file, internal::print_mechanism(mechanism, file.string()));
}

}  // namespace lumihull::capture
