#include "capture_json.h"

#include <lumihull/internal/camera_json.h>
#include <lumihull/internal/covariance_json.h>
#include <lumihull/internal/pose_json.h>

#include <set>

#include "text.h"

namespace lumihull::internal {

namespace {

constexpr std::size_t kMaxShots = 100'000;
constexpr std::size_t kMaxCameras = 100'000;
constexpr const char* kMaskSources[] = {"none", "keyed", "imported", "edited"};

std::string read_name(const JsonReader& json) {
  std::string name = json.string();
  if (!is_shot_name(name)) json.fail(kShotName);
  return name;
}

std::string read_digest(const JsonReader& json) {
  std::string digest = json.string(64);
  if (!digest.empty() && (digest.size() != 64 || digest.find_first_not_of("0123456789abcdef") != std::string::npos))
    json.fail("a SHA-256 of 64 hexadecimal digits");
  return digest;
}

CommandedShot read_commanded(const JsonReader& json) {
  CommandedShot c;
  c.stop = read_name(json.at("stop"));
  c.device = read_name(json.at("camera"));
  c.id = std::uint32_t(json.at("id").integer(0, UINT32_MAX));
  c.cam_from_world = read_pose(json.at("cam_from_world"));
  if (json.has("lengths_m")) {
    const JsonReader lengths = json.at("lengths_m");
    const std::size_t n = lengths.array_size(64);
    for (std::size_t i = 0; i < n; ++i) c.lengths_m.push_back(lengths.at(i).number());
  }
  c.settle_s = json.at("settle_s").number(0);
  c.exposure_s = json.at("exposure_s").number(0);
  c.attempts = int(json.at("attempts").integer(1, INT32_MAX));
  c.plan_sha256 = read_digest(json.at("plan_sha256"));
  c.state = json.at("state").string(40);
  return c;
}

Json print_commanded(const CommandedShot& c) {
  Json json{{"stop", c.stop}, {"camera", c.device}, {"id", c.id}, {"cam_from_world", print_pose(c.cam_from_world)}};
  if (!c.lengths_m.empty()) json["lengths_m"] = c.lengths_m;
  json["settle_s"] = c.settle_s;
  json["exposure_s"] = c.exposure_s;
  json["attempts"] = c.attempts;
  json["plan_sha256"] = c.plan_sha256;
  json["state"] = c.state;
  return json;
}

Shot read_shot(const JsonReader& json) {
  Shot shot;
  shot.name = read_name(json.at("name"));
  shot.file = json.at("file").string();
  if (shot.file.empty()) json.at("file").fail("a file name");
  if (json.has("sha256")) shot.stamp.sha256 = read_digest(json.at("sha256"));
  if (json.has("size")) shot.stamp.size = std::uint64_t(json.at("size").integer(0, INT64_MAX));
  if (json.has("mtime_ns")) shot.stamp.mtime_ns = json.at("mtime_ns").integer(INT64_MIN, INT64_MAX);
  if (json.has("camera")) shot.camera = int(json.at("camera").integer(0, kMaxCameras));
  if (json.has("orientation")) shot.orientation = int(json.at("orientation").integer(1, 8));
  if (json.has("time")) shot.time = json.at("time").string(40);
  if (json.has("commanded")) shot.commanded = read_commanded(json.at("commanded"));
  if (json.has("mask")) {
    const JsonReader mask = json.at("mask");
    const std::string source = mask.at("source").string();
    int i = 0;
    while (i < 4 && source != kMaskSources[i]) ++i;
    if (i == 4) mask.at("source").fail("\"none\", \"keyed\", \"imported\" or \"edited\"");
    shot.mask_source = MaskSource(i);
    shot.mask_sha256 = read_digest(mask.at("sha256"));
  }
  return shot;
}

Json print_shot(const Shot& shot, bool in_enclosure) {
  Json json{{"name", shot.name}, {"file", shot.file}};
  if (!shot.stamp.sha256.empty()) json["sha256"] = shot.stamp.sha256;
  if (shot.stamp.size) json["size"] = shot.stamp.size;
  if (shot.stamp.mtime_ns) json["mtime_ns"] = shot.stamp.mtime_ns;
  if (in_enclosure) return json;
  json["camera"] = shot.camera;
  if (shot.orientation != 1) json["orientation"] = shot.orientation;
  if (!shot.time.empty()) json["time"] = shot.time;
  if (shot.commanded) json["commanded"] = print_commanded(*shot.commanded);
  if (shot.mask_source != MaskSource::none)
    json["mask"] = {{"source", kMaskSources[int(shot.mask_source)]}, {"sha256", shot.mask_sha256}};
  return json;
}

std::vector<Shot> read_shots(const JsonReader& json, std::set<std::string>& names) {
  std::vector<Shot> shots;
  const std::size_t n = json.array_size(kMaxShots);
  for (std::size_t i = 0; i < n; ++i) {
    shots.push_back(read_shot(json.at(i)));
    if (!names.insert(shots.back().name).second) json.at(i).at("name").fail("a name that no other shot has");
  }
  return shots;
}

OptionValue read_option(const JsonReader& json) {
  const Json& v = json.value();
  if (v.is_boolean()) return v.get<bool>();
  if (v.is_number_integer()) return json.integer(INT64_MIN, INT64_MAX);
  if (v.is_number()) return json.number();
  if (v.is_string()) return json.string(1 << 20);  // regions of many photographs are named in one text
  if (v.is_array()) {
    std::vector<double> list;
    const std::size_t n = json.array_size(4096);
    for (std::size_t i = 0; i < n; ++i) list.push_back(json.at(i).number());
    return list;
  }
  json.fail("true, false, a number, a string or a list of numbers");
}

}  // namespace

void parse_capture_json(std::string_view text, const std::string& name, Capture& capture) {
  const Json document = parse_json(text, name);
  const JsonReader top(document, name);
  check_format(top, "lumihull-capture", 1);
  const std::string unit = top.at("unit").string();
  if (unit != "m" && unit != "unknown") top.at("unit").fail("\"m\" or \"unknown\"");
  capture.unit = unit == "m" ? Unit::metres : Unit::unknown;
  if (top.has("background_rgb")) {
    const JsonReader rgb = top.at("background_rgb");
    if (rgb.array_size(3) != 3) rgb.fail("three integers from 0 to 255");
    capture.background_rgb.emplace();
    for (std::size_t c = 0; c < 3; ++c) (*capture.background_rgb)[c] = std::uint8_t(rgb.at(c).integer(0, 255));
  }
  if (top.has("notes")) {
    const JsonReader notes = top.at("notes");
    const std::size_t n = notes.array_size(kMaxCameras);  // an importer may have a word on each
    for (std::size_t i = 0; i < n; ++i) capture.notes.push_back(notes.at(i).string());
  }
  std::set<std::string> names, enclosure_names;
  capture.shots = read_shots(top.at("shots"), names);
  if (top.has("enclosure")) capture.enclosure = read_shots(top.at("enclosure"), enclosure_names);
  if (top.has("options")) {
    const JsonReader stages = top.at("options");
    if (!stages.value().is_object()) stages.fail("an object");
    for (const auto& stage : stages.value().items()) {
      const JsonReader options = stages.at(stage.key());
      if (!options.value().is_object()) options.fail("an object");
      for (const auto& option : options.value().items())
        capture.options[stage.key()][option.key()] = read_option(options.at(option.key()));
    }
    if (capture.options.contains("evaluate") && stages.at("evaluate").has("hold_out"))
      if (const JsonReader n = stages.at("evaluate").at("hold_out"); n.integer(0, kMaxShots) == 1)
        n.fail("0 (none) or at least 2");
  }
  if (top.has("stages")) {
    const JsonReader stages = top.at("stages");
    if (!stages.value().is_object()) stages.fail("an object");
    for (const auto& item : stages.value().items()) {
      const JsonReader json = stages.at(item.key());
      StageRecord& record = capture.stages[item.key()];
      record.digest = read_digest(json.at("digest"));
      record.seconds = json.at("seconds").number(0);
      record.peak_bytes = std::uint64_t(json.at("peak_bytes").integer(0, INT64_MAX));
      record.finished = json.at("finished").string(40);
    }
  }
}

std::string print_capture_json(const Capture& capture, const std::string& name) {
  Json json{{"format", "lumihull-capture"}, {"version", 1}, {"unit", capture.unit == Unit::metres ? "m" : "unknown"}};
  if (capture.background_rgb) json["background_rgb"] = *capture.background_rgb;
  if (!capture.notes.empty()) json["notes"] = capture.notes;
  Json options = Json::object();
  for (const auto& [stage, values] : capture.options)
    for (const auto& [option, value] : values)
      std::visit([&, &stage = stage, &option = option](const auto& v) { options[stage][option] = v; }, value);
  if (!options.empty()) json["options"] = std::move(options);
  Json stages = Json::object();
  for (const auto& [stage, record] : capture.stages)
    stages[stage] = {{"digest", record.digest},
                     {"seconds", record.seconds},
                     {"peak_bytes", record.peak_bytes},
                     {"finished", record.finished}};
  if (!stages.empty()) json["stages"] = std::move(stages);
  Json shots = Json::array();
  for (const Shot& shot : capture.shots) shots.push_back(print_shot(shot, false));
  json["shots"] = std::move(shots);
  if (!capture.enclosure.empty()) {
    Json enclosure = Json::array();
    for (const Shot& shot : capture.enclosure) enclosure.push_back(print_shot(shot, true));
    json["enclosure"] = std::move(enclosure);
  }
  return print_json(json, name);
}

namespace {

/// Version 2: how well cameras and poses are known.
void read_quality(const JsonReader& top, const std::map<std::string, Shot*, std::less<>>& by_name, Capture& capture) {
  if (top.has("camera_covariances")) {
    const JsonReader list = top.at("camera_covariances");
    const std::size_t n = list.array_size(kMaxCameras);
    for (std::size_t i = 0; i < n; ++i) {
      const JsonReader one = list.at(i);
      const auto camera = int(one.at("camera").integer(0, std::int64_t(capture.cameras.size()) - 1));
      if (!capture.camera_covariances.emplace(camera, read_covariance<10>(one.at("covariance"))).second)
        one.at("camera").fail("each camera once");
    }
  }
  if (!top.has("pose_quality")) return;
  const JsonReader qualities = top.at("pose_quality");
  if (!qualities.value().is_object()) qualities.fail("an object with an entry for each calibrated shot");
  for (const auto& item : qualities.value().items()) {
    const JsonReader json = qualities.at(item.key());
    const auto shot = by_name.find(item.key());
    if (shot == by_name.end() || !shot->second->cam_from_world) json.fail("the name of a shot that has a pose");
    PoseQuality& quality = shot->second->pose_quality.emplace();
    quality.covariance = read_covariance<6>(json.at("covariance"));
    quality.points = int(json.at("points").integer(0, INT32_MAX));
    quality.rms_px = json.at("rms_px").number(0);
  }
}

}  // namespace

void parse_cameras_json(std::string_view text, const std::string& name, Capture& capture) {
  const Json document = parse_json(text, name);
  const JsonReader top(document, name);
  const std::int64_t version = check_format(top, "lumihull-cameras", 1, 2);

  const JsonReader cameras = top.at("cameras");
  const std::size_t n = cameras.array_size(kMaxCameras);
  for (std::size_t i = 0; i < n; ++i) capture.cameras.push_back(read_camera(cameras.at(i), true));

  std::map<std::string, Shot*, std::less<>> by_name;
  for (Shot& shot : capture.shots) {
    if (std::size_t(shot.camera) >= n)
      top.at("cameras").fail("a camera " + std::to_string(shot.camera) + ", which shot \"" + shot.name + "\" uses");
    by_name[shot.name] = &shot;
  }
  const JsonReader poses = top.at("cam_from_world");
  if (!poses.value().is_object()) poses.fail("an object with a pose for each positioned shot");
  for (const auto& item : poses.value().items()) {
    const JsonReader json = poses.at(item.key());
    const auto shot = by_name.find(item.key());
    if (shot == by_name.end()) json.fail("the name of a shot of capture.json");
    shot->second->cam_from_world = read_pose(json);
  }
  if (version >= 2) read_quality(top, by_name, capture);
}

std::string print_cameras_json(const Capture& capture, const std::string& name) {
  Json cameras = Json::array();
  for (const Camera& c : capture.cameras) cameras.push_back(print_camera(c));
  Json poses = Json::object(), qualities = Json::object(), covariances = Json::array();
  for (const Shot& shot : capture.shots) {
    if (!shot.cam_from_world) continue;
    poses[shot.name] = print_pose(*shot.cam_from_world);
    if (const auto& q = shot.pose_quality)
      qualities[shot.name] = {
          {"covariance", print_covariance<6>(q->covariance)}, {"points", q->points}, {"rms_px", q->rms_px}};
  }
  for (const auto& [camera, covariance] : capture.camera_covariances)
    covariances.push_back({{"camera", camera}, {"covariance", print_covariance<10>(covariance)}});
  // What holds nothing new stays readable for programs of before.
  const bool plain = qualities.empty() && covariances.empty();
  Json json{{"format", "lumihull-cameras"},
            {"version", plain ? 1 : 2},
            {"cameras", std::move(cameras)},
            {"cam_from_world", std::move(poses)}};
  if (!covariances.empty()) json["camera_covariances"] = std::move(covariances);
  if (!qualities.empty()) json["pose_quality"] = std::move(qualities);
  return print_json(json, name);
}

}  // namespace lumihull::internal
