// Cameras and poses for COLMAP and NeRF programs.

#include <lumihull/base/error.h>
#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/internal/json.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "colmap_model.h"
#include "import_common.h"
#include "lens_models.h"

namespace lumihull {

namespace fs = std::filesystem;

namespace {

/// The simplest of the models with `terms` radial coefficients that is good enough, or the best of them.
internal::ForwardCamera expressed(const Capture& capture, int index, std::initializer_list<int> terms,
                                  const ExportOptions& options, ExportReport& report) {
  const std::string name = "camera " + std::to_string(index);
  const internal::ForwardRefit best =
      internal::simplest_refit(capture.cameras.at(std::size_t(index)), terms, options.max_refit_error_px, name);
  report.largest_refit_error_px = std::max(report.largest_refit_error_px, best.largest_error_px);
  char text[100];
  std::snprintf(text, sizeof text, "%.3g px", best.largest_error_px);
  if (best.largest_error_px > 0) report.notes.push_back(name + ": refitted, largest error " + text);
  return best.camera;
}

/// Indices of the positioned shots, and a note of the others.
std::vector<std::size_t> positioned_shots(const Capture& capture, ExportReport& report) {
  std::vector<std::size_t> shots;
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    if (capture.positioned(i)) shots.push_back(i);
  if (shots.empty())
    throw Error(ErrorCode::bad_input, "no photograph has a pose: there is nothing to export",
                capture.folder().string());
  if (const std::size_t left = capture.shots.size() - shots.size(); left > 0)
    report.notes.push_back(std::to_string(left) + " photographs without a pose were left out");
  report.photos = int(shots.size());
  return shots;
}

void add_tracks(std::span<const Track> tracks, const std::map<std::size_t, std::size_t>& image_of,
                internal::ColmapModel& model) {
  for (const Track& track : tracks) {
    internal::ColmapPoint point;
    point.place = track.point;
    for (const Track::Sight& sight : track.sights) {
      const auto at = image_of.find(sight.shot);
      if (at == image_of.end()) continue;
      internal::ColmapImage& image = model.images[at->second];
      const internal::ForwardCamera& camera = model.cameras.at(image.camera);
      const Eigen::Vector3d p = image.cam_from_world * track.point;
      point.error_px += (camera.project(p.hnormalized()) - sight.pixel).norm();
      point.track.emplace_back(at->second, image.points.size());
      image.points.push_back({sight.pixel, model.points.size()});
    }
    if (point.track.empty()) continue;
    point.error_px /= double(point.track.size());
    model.points.push_back(std::move(point));
  }
}

}  // namespace

ExportReport export_colmap(const Capture& capture, const fs::path& folder, const ExportOptions& options,
                           std::span<const Track> tracks) {
  using namespace internal;
  std::error_code error;
  if (fs::exists(folder, error) && (!fs::is_directory(folder, error) || !fs::is_empty(folder, error)))
    throw Error(ErrorCode::invalid_argument, "the folder is in use: name a new or empty one", folder.string());
  ExportReport report;
  ColmapModel model;
  std::set<std::string> names;
  std::map<std::size_t, std::size_t> image_of;
  for (const std::size_t i : positioned_shots(capture, report)) {
    const Shot& shot = capture.shots[i];
    const std::string name = fs::path(shot.file).filename().string();
    if (!names.insert(name).second)
      throw Error(ErrorCode::unsupported, "two photographs are called " + name + ": COLMAP's names must differ",
                  shot.name);
    image_of[i] = model.images.size();
    model.images.push_back({name, shot.camera + 1, *shot.cam_from_world, {}});
    if (!model.cameras.contains(shot.camera + 1))
      model.cameras[shot.camera + 1] = expressed(capture, shot.camera, {2, 6}, options, report);
  }
  if (std::any_of(names.begin(), names.end(), [](const auto& n) { return n.find(' ') != std::string::npos; }))
    report.notes.push_back("some photographs' names hold blanks, at which COLMAP cuts them off");

  add_tracks(tracks, image_of, model);

  make_folder(folder);
  // images.txt comes last: COLMAP reads no folder without it.
  write_file(folder / "cameras.txt", print_colmap_cameras(model));
  write_file(folder / "points3D.txt", print_colmap_points(model));
  write_file(folder / "images.txt", print_colmap_images(model));
  return report;
}

ExportReport export_nerf(const Capture& capture, const fs::path& file, const ExportOptions& options) {
  using namespace internal;
  ExportReport report;
  std::map<int, ForwardCamera> cameras;
  Json frames = Json::array();
  std::error_code ignored;
  const fs::path base = fs::weakly_canonical(fs::absolute(file).parent_path(), ignored);
  bool distorted = false;
  for (const std::size_t i : positioned_shots(capture, report)) {
    const Shot& shot = capture.shots[i];
    if (!cameras.contains(shot.camera)) cameras[shot.camera] = expressed(capture, shot.camera, {2, 3}, options, report);
    const ForwardCamera& c = cameras[shot.camera];
    Json frame;
    frame["file_path"] =
        fs::weakly_canonical(capture.photo_path(shot), ignored).lexically_relative(base).generic_string();
    frame["w"] = c.width;
    frame["h"] = c.height;
    frame["fl_x"] = c.fx;
    frame["fl_y"] = c.fy;
    frame["cx"] = c.cx;
    frame["cy"] = c.cy;
    if (c.lens != ForwardCamera::Lens::none) {
      distorted = true;
      frame["k1"] = c.k[0];
      frame["k2"] = c.k[1];
      frame["p1"] = c.p1;
      frame["p2"] = c.p2;
      if (c.k[2] != 0) frame["k3"] = c.k[2];
    }
    const Pose world_from_cam = shot.cam_from_world->inverse();
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topRows<3>() = world_from_cam.matrix();
    m.col(1) = -m.col(1);  // OpenGL's y up and z backwards
    m.col(2) = -m.col(2);
    Json rows = Json::array();
    for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
    frame["transform_matrix"] = rows;
    frames.push_back(std::move(frame));
  }
  Json document;
  document["camera_model"] = distorted ? "OPENCV" : "PINHOLE";
  document["frames"] = std::move(frames);
  write_file(file, print_json(document, file.string()));
  return report;
}

}  // namespace lumihull
