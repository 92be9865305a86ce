#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/internal/pose_json.h>
#include <lumihull/rig/exif.h>
#include <lumihull/rig/rig_camera.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "objects/noise.h"

namespace lumihull::rig {

namespace fs = std::filesystem;
using capture::ShotId;
using capture::ShotOutcome;
using capture::ShotState;
using internal::Json;
using internal::JsonReader;

namespace {

constexpr int kMoments = 9;            ///< of an exposure, equally spaced
constexpr double kSharp_px = .25;      ///< a shorter way during the exposure is not worth tracing (sigma .07 px)
constexpr double kBetweenShots_s = 1;  ///< until the file is there
constexpr float kCableRadius_m = .001f;
const Eigen::Vector3f kCableColor(.012f, .012f, .013f);

/// The mean of poses that hardly differ.
Pose mean_of(const std::vector<Pose>& cam_from_world) {
  Eigen::Vector3d center(0, 0, 0);
  Eigen::Vector4d q(0, 0, 0, 0);
  for (const Pose& pose : cam_from_world) {
    center += pose.center();
    const Eigen::Vector4d c = pose.rotation.coeffs();
    q += c.dot(cam_from_world[0].rotation.coeffs()) < 0 ? Eigen::Vector4d(-c) : c;
  }
  center /= double(cam_from_world.size());
  Pose mean;
  mean.rotation = Eigen::Quaterniond(q).normalized();
  mean.translation = -(mean.rotation * center);
  return mean;
}

/// The longest way of an image point between two moments: of points at the object's distance, in the middle and near
/// the corners.
double sway_of(const Camera& camera, const std::vector<Pose>& moments, double distance_m) {
  double longest = 0;
  const Pose& first = moments.front();
  for (const auto& [x, y] :
       {std::pair(.5, .5), std::pair(.1, .1), std::pair(.9, .1), std::pair(.1, .9), std::pair(.9, .9)}) {
    const auto ray = camera.ray({x * camera.width, y * camera.height});
    if (!ray) continue;
    const Eigen::Vector3d point = first.inverse() * (distance_m * ray->normalized());
    std::vector<Eigen::Vector2d> way;
    for (const Pose& pose : moments)
      if (const auto px = camera.project(pose * point)) way.push_back(*px);
    for (const auto& a : way)
      for (const auto& b : way) longest = std::max(longest, (a - b).norm());
  }
  return longest;
}

std::string raw_floats(const Image& image) {
  std::string out;
  for (int y = 0; y < image.height(); ++y)
    out.append(reinterpret_cast<const char*>(image.row<float>(y)), std::size_t(image.width()) * sizeof(float));
  return out;
}

}  // namespace

std::string exif_time(double seconds) {
  const auto s = 9 * 3600 + std::int64_t(seconds), day = s / 86400;
  char text[40];
  std::snprintf(text, sizeof text, "2007:%02d:%02d %02d:%02d:%02d", 8 + int(day / 28 % 5), 1 + int(day % 28),
                int(s / 3600 % 24), int(s / 60 % 60), int(s % 60));
  return text;
}

std::string camera_file(const Image& picture, const RigLens& lens, double time_s, double exposure_s, int orientation) {
  ExifTags tags;
  tags.orientation = orientation;
  tags.time = exif_time(time_s);
  tags.focal_length_mm = lens.focal_mm;
  tags.sensor_width_mm = lens.sensor_width_mm;
  char text[40];
  std::snprintf(text, sizeof text, "%g mm", lens.focal_mm);
  tags.lens = text;
  tags.width = picture.width(), tags.height = picture.height();
  tags.exposure_s = exposure_s;
  if (lens.photo.f_number > 0) tags.f_number = lens.photo.f_number;
  return with_exif(encode_jpeg(picture, lens.jpeg_quality), tags);
}

struct RigCamera::Exposure {
  ShotId id = 0;
  double time_s = 0, exposure_s = 0;
  Pose cam_from_world;
  std::vector<Pose> during;  ///< empty: it stood still
  std::vector<ThinLine> cables;
};

RigCamera::RigCamera(const Options& options, std::function<const Photographer&()> photographer, RigRobot& robot)
    : options_(options), photographer_(std::move(photographer)), robot_(robot) {
  options_.lens.camera.validate();
}

fs::path RigCamera::record(ShotId id, const char* extension) const {
  char name[32];
  std::snprintf(name, sizeof name, "%06u", unsigned(id));
  return options_.truth / "exposures" / (name + std::string(extension));
}

/// Takes the photograph; writes the masks; the file's bytes.
std::string RigCamera::develop(const Exposure& e, Job& job) const {
  PhotoOptions photo = options_.lens.photo;
  photo.depth = options_.depth;
  photo.lines = e.cables;
  const View view{options_.lens.camera, e.cam_from_world};
  const std::uint64_t seed = mix(mix(options_.seed, 3), e.id);
  const Photo taken = photographer_().photograph(view, photo, seed, job, e.during);
  if (options_.masks) write_file(record(e.id, ".png"), encode_mask(taken.mask));
  if (options_.depth) write_file(record(e.id, ".depth"), raw_floats(taken.depth));
  return camera_file(taken.picture, options_.lens, e.time_s, e.exposure_s,
                     exif_orientation(e.cam_from_world.rotation * Eigen::Vector3d::UnitZ()));
}

ShotOutcome RigCamera::shoot(ShotId id, double exposure_s, const fs::path& folder, Job& job) {
  Exposure e;
  e.id = id;
  e.time_s = robot_.now_s();
  e.exposure_s = exposure_s;
  const Pose plan_from_world = options_.world_from_plan.inverse();
  std::vector<Pose> moments;
  for (int i = 0; i < kMoments; ++i)
    moments.push_back(robot_.cam_from_world(e.time_s + exposure_s * i / (kMoments - 1)) * plan_from_world);
  e.cam_from_world = mean_of(moments);
  const double distance = (options_.world_from_plan * options_.center - e.cam_from_world.center()).norm();
  const double sway = sway_of(options_.lens.camera, moments, std::max(.1, distance));
  if (sway > kSharp_px) e.during = moments;
  if (options_.cables)
    for (const RigRobot::CableLine& line : robot_.cables(e.time_s + exposure_s / 2))
      e.cables.push_back({options_.world_from_plan * line.departure, options_.world_from_plan * line.end,
                          kCableRadius_m, kCableColor});
  fs::create_directories(options_.truth / "exposures");
  const std::string bytes = develop(e, job);
  const fs::path place = fs::absolute(folder) / ("IMG_" + std::to_string(id) + ".jpg");

  Json json{{"format", "lumihull-exposure"}, {"version", 1}};
  json["shot"] = id;
  json["camera"] = options_.name;
  json["stop"] = robot_.stop();
  json["time_s"] = e.time_s;
  json["exposure_s"] = e.exposure_s;
  json["sway_px"] = sway;
  json["cam_from_world"] = internal::print_pose(e.cam_from_world);
  json["during"] = Json::array();
  for (const Pose& pose : e.during) json["during"].push_back(internal::print_pose(pose));
  json["cables"] = Json::array();
  for (const ThinLine& line : e.cables)
    json["cables"].push_back({line.from.x(), line.from.y(), line.from.z(), line.to.x(), line.to.y(), line.to.z()});
  json["sha256"] = sha256(bytes);
  json["file"] = place.string();
  write_file(record(id, ".json"), json.dump(1) + "\n");
  robot_.pass(exposure_s + kBetweenShots_s);
  write_file(place, bytes);
  return {.state = ShotState::done, .file = place, .detail = {}};
}

ShotOutcome RigCamera::recall(ShotId id) {
  const auto known = read_exposure(options_.truth, id);
  if (!known) return {ShotState::refused, {}, "not on the camera's list"};
  robot_.pass_until(known->time_s + known->exposure_s + kBetweenShots_s);  // the robot may not have heard of it
  std::error_code error;
  if (!fs::exists(known->file, error) || sha256_of_file(known->file) != known->sha256) {
    Exposure e;
    e.id = id;
    e.time_s = known->time_s, e.exposure_s = known->exposure_s;
    e.cam_from_world = known->cam_from_world;
    e.during = known->during;
    for (const auto& [from, to] : known->cables) e.cables.push_back({from, to, kCableRadius_m, kCableColor});
    Job job;
    fs::create_directories(fs::path(known->file).parent_path());
    write_file(known->file, develop(e, job));
  }
  return {.state = ShotState::done, .file = known->file, .detail = {}};
}

std::optional<ExposureRecord> read_exposure(const fs::path& truth, ShotId id) {
  char name[32];
  std::snprintf(name, sizeof name, "%06u.json", unsigned(id));
  const fs::path file = truth / "exposures" / name;
  if (!fs::exists(file)) return std::nullopt;
  const Json json = internal::read_json(file);
  const JsonReader root(json, file.string());
  internal::check_format(root, "lumihull-exposure", 1);
  ExposureRecord e;
  e.id = id;
  e.camera = root.at("camera").string();
  e.stop = root.at("stop").string();
  e.sha256 = root.at("sha256").string();
  e.file = root.at("file").string();
  e.time_s = root.at("time_s").number();
  e.exposure_s = root.at("exposure_s").number(0);
  e.sway_px = root.at("sway_px").number(0);
  e.cam_from_world = internal::read_pose(root.at("cam_from_world"));
  const JsonReader during = root.at("during"), cables = root.at("cables");
  for (std::size_t i = 0; i < during.array_size(1000); ++i) e.during.push_back(internal::read_pose(during.at(i)));
  for (std::size_t i = 0; i < cables.array_size(12); ++i) {
    const JsonReader ends = cables.at(i);
    if (ends.array_size(6) != 6) ends.fail("six numbers");
    double x[6];
    for (std::size_t k = 0; k < 6; ++k) x[k] = ends.at(k).number();
    e.cables.emplace_back(Eigen::Vector3d(x[0], x[1], x[2]), Eigen::Vector3d(x[3], x[4], x[5]));
  }
  return e;
}

}  // namespace lumihull::rig
