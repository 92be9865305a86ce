#include "truth_files.h"

#include <lumihull/internal/camera_json.h>
#include <lumihull/internal/json.h>
#include <lumihull/internal/pose_json.h>

#include <Eigen/LU>
#include <set>
#include <utility>

#include "stages/stage.h"

namespace lumihull::slf::truth {
namespace {

namespace fs = std::filesystem;
using internal::Json;
using internal::JsonReader;

constexpr std::size_t kMostViews = 100'000, kMostTargets = 1'000'000;

/// [[r r r t], …]
Pose read_rows(const JsonReader& json) {
  if (json.array_size(3) != 3) json.fail("three rows of four numbers");
  Eigen::Matrix3d r;
  Eigen::Vector3d t;
  for (std::size_t i = 0; i < 3; ++i) {
    const JsonReader row = json.at(i);
    if (row.array_size(4) != 4) row.fail("four numbers");
    for (std::size_t k = 0; k < 3; ++k) r(Eigen::Index(i), Eigen::Index(k)) = row.at(k).number(-2, 2);
    t[Eigen::Index(i)] = row.at(3).number();
  }
  if ((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-6 || r.determinant() < 0)
    json.fail("a rotation matrix in the first three columns");
  return Pose::from_matrix(r, t);
}

TrueCameras of_rig(const JsonReader& top) {
  internal::check_format(top, "lumihull-rig-truth", 1);
  if (top.has("unit") && top.at("unit").string() != "m") top.at("unit").fail("\"m\"");
  std::optional<Camera> shared;
  if (top.has("camera")) shared = internal::read_camera(top.at("camera"), true);
  TrueCameras out;
  const JsonReader views = top.at("views");
  const std::size_t n = views.array_size(kMostViews);
  for (std::size_t i = 0; i < n; ++i) {
    const JsonReader view = views.at(i);
    const std::string name = view.at("name").string();
    const Camera camera = view.has("camera") || !shared ? internal::read_camera(view.at("camera"), true) : *shared;
    if (!out.views.emplace(name, View{camera, read_rows(view.at("cam_from_world"))}).second)
      view.at("name").fail("each name once");
    out.names.push_back(name);
  }
  return out;
}

TrueCameras of_capture(const JsonReader& top) {
  internal::check_format(top, "lumihull-cameras", 1, 2);
  const JsonReader cameras = top.at("cameras");
  if (cameras.array_size(1000) != 1) cameras.fail("one camera, for which of several took a view is not told here");
  const Camera camera = internal::read_camera(cameras.at(std::size_t(0)), true);
  const JsonReader poses = top.at("cam_from_world");
  if (!poses.value().is_object()) poses.fail("an object with a pose for each view");
  TrueCameras out;
  for (const auto& item : poses.value().items()) {
    out.views.emplace(item.key(), View{camera, internal::read_pose(poses.at(item.key()))});
    out.names.push_back(item.key());
  }
  return out;
}

}  // namespace

std::optional<TrueCameras> read_true_cameras(const fs::path& folder) {
  const fs::path file = folder / "cameras.json";
  if (!file_exists(file)) return std::nullopt;
  const Json document = internal::read_json(file);
  const JsonReader top(document, file.string());
  const std::string format = top.at("format").string();
  if (format == "lumihull-cameras") return of_capture(top);
  if (format != "lumihull-rig-truth") top.at("format").fail("\"lumihull-rig-truth\" or \"lumihull-cameras\"");
  return of_rig(top);
}

std::optional<std::vector<TrueTarget>> read_true_targets(const fs::path& folder) {
  const fs::path file = folder / "targets.json";
  if (!file_exists(file)) return std::nullopt;
  const Json document = internal::read_json(file);
  const JsonReader top(document, file.string());
  internal::check_format(top, "lumihull-rig-targets", 1);
  const JsonReader list = top.at("targets");
  const std::size_t n = list.array_size(kMostTargets);
  std::vector<TrueTarget> out;
  std::set<std::pair<int, int>> taken;
  for (std::size_t i = 0; i < n; ++i) {
    const JsonReader target = list.at(i);
    TrueTarget& t = out.emplace_back();
    t.design = int(target.at("design").integer(0, 1'000'000));
    t.id = int(target.at("id").integer(0, 100'000'000));
    t.world_from_target = internal::read_pose(target.at("world_from_target"));
    if (!taken.emplace(t.design, t.id).second) target.at("id").fail("each target once");
  }
  return out;
}

}  // namespace lumihull::slf::truth
