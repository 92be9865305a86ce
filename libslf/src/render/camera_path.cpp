#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/internal/camera_json.h>
#include <lumihull/slf/camera_path.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

namespace lumihull::slf {
namespace {

using internal::Json;
using internal::JsonReader;

constexpr int kMostViews = 100000;
constexpr double kDegree = std::numbers::pi / 180;

void require(bool good, const char* what) {
  if (!good) throw Error(ErrorCode::invalid_argument, what, "turntable options");
}

Eigen::Vector3d vector_at(const JsonReader& r) {
  if (r.array_size(3) != 3) r.fail("three numbers");
  return {r.at(std::size_t(0)).number(), r.at(std::size_t(1)).number(), r.at(std::size_t(2)).number()};
}

Pose pose_at(const JsonReader& r) {
  if (r.has("eye")) {
    const Eigen::Vector3d eye = vector_at(r.at("eye")), target = vector_at(r.at("target")), up = vector_at(r.at("up"));
    const Eigen::Vector3d forward = target - eye;
    if (!(forward.cross(up).norm() > 1e-9 * forward.norm() * up.norm()))
      r.fail("an eye apart from its target, and an up that is not along the view");
    return look_at(eye, target, up);
  }
  const JsonReader pose = r.at("cam_from_world"), q = pose.at("rotation_wxyz");
  if (q.array_size(4) != 4) q.fail("four numbers");
  double w[4];
  for (std::size_t i = 0; i < 4; ++i) w[i] = q.at(i).number(-1e6, 1e6);
  const Eigen::Quaterniond rotation(w[0], w[1], w[2], w[3]);
  if (!(std::abs(rotation.norm() - 1) < 1e-3)) q.fail("a quaternion of length 1");
  return {rotation.normalized(), vector_at(pose.at("translation"))};
}

/// The direction that is most nearly across all of the axes whose sum of a aᵀ this is; askew: how nearly, 0 … 1 (1:
/// they tell of no direction).
struct Plumb {
  Eigen::Vector3d axis;
  double askew;
};
Plumb plumb_of(const Eigen::Matrix3d& axes) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(axes);
  const Eigen::Vector3d l = eigen.eigenvalues();
  return {eigen.eigenvectors().col(0), l[1] > 1e-3 * l[2] ? std::max(0., l[0]) / l[1] : 1};
}

}  // namespace

std::string frame_name(std::size_t i) {
  char name[32];
  std::snprintf(name, sizeof name, "frame_%04zu", i);
  return name;
}

Eigen::Vector3d up_axis(std::span<const View> views) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero(), across = up, out = up;
  Eigen::Matrix3d widths = Eigen::Matrix3d::Zero(), heights = widths;
  for (const View& view : views) {
    const Eigen::Matrix3d world_from_cam = view.cam_from_world.rotation.conjugate().toRotationMatrix();
    const Eigen::Vector3d x = world_from_cam.col(0), y = world_from_cam.col(1);
    up -= y, across += x, out -= world_from_cam.col(2);
    widths += x * x.transpose(), heights += y * y.transpose();
  }
  // The pictures' level sides are all across the plumb line, from whatever sides they were taken.
  constexpr double kLevel = .05;
  const Plumb landscape = plumb_of(widths), portrait = plumb_of(heights);
  if (std::min(landscape.askew, portrait.askew) < kLevel) {
    const bool upright = portrait.askew < .5 * landscape.askew;
    // Which way round: of landscape pictures -y; of portrait ones that cameras look down on things.
    return upright ? (portrait.axis.dot(out) < 0 ? Eigen::Vector3d(-portrait.axis) : portrait.axis)
                   : (landscape.axis.dot(up) < 0 ? Eigen::Vector3d(-landscape.axis) : landscape.axis);
  }
  if (across.norm() > 2 * up.norm()) up = across.dot(out) < 0 ? Eigen::Vector3d(-across) : across;
  return up.norm() > 1e-6 * double(views.size()) ? Eigen::Vector3d(up.normalized()) : Eigen::Vector3d::UnitZ();
}

std::vector<PathView> turntable(const hull::Mesh& mesh, std::span<const View> photographs,
                                const TurntableOptions& options) {
  const Eigen::Vector3d somewhere = mesh.vertices.empty()
                                        ? Eigen::Vector3d(1, 0, 0)
                                        : Eigen::Vector3d(mesh.vertices[0].cast<double>() + Eigen::Vector3d(1e6, 0, 0));
  return turntable(mesh, up_axis(photographs), photographs.empty() ? somewhere : photographs[0].center(), options);
}

std::vector<PathView> turntable(const hull::Mesh& mesh, const Eigen::Vector3d& axis, const Eigen::Vector3d& first,
                                const TurntableOptions& o) {
  require(o.frames >= 1 && o.frames <= kMostViews, "frames: expected 1 to 100000");
  require(o.elevation_deg >= -90 && o.elevation_deg <= 90, "elevation_deg: expected -90 to 90");
  require(o.distance >= 0 && std::isfinite(o.distance), "distance: expected 0 or more");
  require(std::isfinite(o.start_deg), "start_deg: expected a number");
  require(o.width >= 1 && o.width <= kMaxImageSide && o.height >= 1 && o.height <= kMaxImageSide &&
              std::int64_t(o.width) * o.height <= kMaxImagePixels,
          "width, height: expected a picture of at most 400 megapixels");
  require(o.field_of_view_deg >= 1 && o.field_of_view_deg <= 150, "field_of_view_deg: expected 1 to 150");
  if (mesh.triangles.empty()) throw Error(ErrorCode::degenerate, "the mesh has no triangles to turn around");

  require(axis.allFinite() && axis.norm() > 0 && first.allFinite(), "up, first: expected finite vectors, and an axis");
  const Eigen::Vector3d up = axis.normalized();
  Eigen::AlignedBox3d box;
  for (const auto& t : mesh.triangles)
    for (const auto v : t) box.extend(mesh.vertices[v].cast<double>());
  const Eigen::Vector3d middle = box.center();
  Eigen::Vector3d right = first - middle;
  right -= right.dot(up) * up;
  if (!(right.norm() > 1e-9 * box.diagonal().norm())) right = up.unitOrthogonal();
  right.normalize();
  const Eigen::Vector3d across = up.cross(right);

  Camera camera;
  camera.width = o.width, camera.height = o.height;
  camera.f = 0.5 * o.height / std::tan(0.5 * o.field_of_view_deg * kDegree);
  camera.u0 = 0.5 * o.width, camera.v0 = 0.5 * o.height;
  double distance = o.distance;
  if (distance == 0) {
    double radius = 0;
    for (const auto& t : mesh.triangles)
      for (const auto v : t) radius = std::max(radius, (mesh.vertices[v].cast<double>() - middle).norm());
    const double half = std::atan(0.5 * std::min(o.width, o.height) / camera.f);
    distance = std::max(1.03 * radius / std::sin(half), 1e-12);
  }
  std::vector<PathView> path;
  const double elevation = o.elevation_deg * kDegree;
  for (int i = 0; i < o.frames; ++i) {
    const double azimuth = o.start_deg * kDegree + 2 * std::numbers::pi * i / o.frames;
    const Eigen::Vector3d outwards = std::cos(azimuth) * right + std::sin(azimuth) * across;
    const Eigen::Vector3d eye = middle + distance * (std::cos(elevation) * outwards + std::sin(elevation) * up);
    // Straight from above there is no up: the picture's top is then what lies behind.
    const Eigen::Vector3d top = std::cos(elevation) * up - std::sin(elevation) * outwards;
    path.push_back({frame_name(std::size_t(i)), {camera, look_at(eye, middle, top)}});
  }
  return path;
}

std::vector<PathView> read_camera_path(const std::filesystem::path& file) {
  const Json document = internal::read_json(file);
  const JsonReader top(document, file.string());
  internal::check_format(top, "lumihull-camera-path", 1);
  const JsonReader views = top.at("views");
  const std::size_t count = views.array_size(kMostViews);
  if (count == 0) views.fail("at least one view");
  std::vector<PathView> path;
  std::set<std::string> names;
  for (std::size_t i = 0; i < count; ++i) {
    const JsonReader r = views.at(i);
    PathView view;
    view.name = r.has("name") ? r.at("name").string(200) : frame_name(i);
    if (view.name.empty() || view.name[0] == '.' || view.name.find('/') != std::string::npos)
      r.at("name").fail("a file name without '/' that does not begin with a dot");
    if (!names.insert(view.name).second) r.fail("names that are not repeated (\"" + view.name + "\")");
    view.view = {internal::read_camera(r, false), pose_at(r)};
    path.push_back(std::move(view));
  }
  return path;
}

void write_camera_path(const std::filesystem::path& file, std::span<const PathView> views) {
  Json list = Json::array();
  for (const PathView& v : views) {
    const Pose& p = v.view.cam_from_world;
    Json view{{"name", v.name}};
    view.update(internal::print_camera(v.view.camera));
    view["cam_from_world"] = {{"rotation_wxyz", {p.rotation.w(), p.rotation.x(), p.rotation.y(), p.rotation.z()}},
                              {"translation", {p.translation.x(), p.translation.y(), p.translation.z()}}};
    list.push_back(std::move(view));
  }
  const Json document{{"format", "lumihull-camera-path"}, {"version", 1}, {"views", list}};
  write_file(file, internal::print_json(document, file.string()));
}

std::vector<PathView> views_of_shots(const Capture& capture, std::span<const std::size_t> shots) {
  std::vector<PathView> path;
  for (const std::size_t shot : shots) path.push_back({capture.shots.at(shot).name, capture.view(shot)});
  return path;
}

}  // namespace lumihull::slf
