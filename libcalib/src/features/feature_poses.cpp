// Poses without targets, by COLMAP's features, and what gives them a scale.
#include <lumihull/base/error.h>
#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/calib/feature_poses.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>

#include "colmap_program.h"

namespace lumihull::calib {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(at, start), text.size());
    std::string part = text.substr(start, end - start);
    part.erase(0, part.find_first_not_of(' '));
    part.erase(part.find_last_not_of(' ') + 1);
    if (!part.empty()) parts.push_back(std::move(part));
    start = end + 1;
  }
  return parts;
}

std::size_t shot_named(const Capture& capture, const std::string& name) {
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    if (capture.shots[i].name == name) return i;
  throw Error(ErrorCode::invalid_argument, "no photograph is called \"" + name + "\"", "scale_distance");
}

/// Links to the photographs, a folder for each camera: names that COLMAP keeps apart, whatever theirs are.
void link_photos(const Capture& capture, const fs::path& folder) {
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    const Shot& shot = capture.shots[i];
    const fs::path beside = folder / std::to_string(shot.camera), photo = fs::absolute(capture.photo_path(shot));
    fs::create_directories(beside);
    fs::create_symlink(photo, beside / (std::to_string(i) + photo.extension().string()));
  }
}

/// Which shot a photograph is, by its path without links.
std::map<fs::path, std::size_t> shots_by_path(const Capture& capture) {
  std::map<fs::path, std::size_t> shots;
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    shots.emplace(fs::canonical(capture.photo_path(capture.shots[i])), i);
  return shots;
}

/// The point nearest to rays (origin, unit direction) in the least-squares sense; nullopt where they are nearly
/// parallel.
std::optional<Eigen::Vector3d> nearest_point(const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& rays) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const auto& [origin, direction] : rays) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    a += across;
    b += across * origin;
  }
  constexpr double kLeastParallax = 1e-3;  // squared sine of about 2 degrees, mean over the rays
  if (!(internal::symmetric_axes(a).values(0) > kLeastParallax * double(rays.size()))) return std::nullopt;
  return a.ldlt().solve(b);
}

/// Printed lengths over triangulated ones: the median over all pairs of points of all targets.
std::optional<double> scale_by_targets(const Capture& capture, const TargetSet& set, Job& job, std::size_t& targets) {
  const CaptureDetections seen = detect_capture(capture, set, {}, job);
  std::map<std::pair<int, int>, std::map<int, std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>>> rays;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    if (!capture.positioned(i)) continue;
    const View view = capture.view(i);
    const Pose world_from_cam = view.cam_from_world.inverse();
    for (const Detection& d : seen.photos[i].targets)
      for (const Feature& f : d.features)
        if (const auto ray = view.camera.ray(f.pixel); ray && d.id >= 0)
          rays[{d.design, d.id}][f.index].emplace_back(view.center(), world_from_cam.rotation * ray->normalized());
  }
  std::vector<double> ratios;
  targets = 0;
  for (const auto& [target, features] : rays) {
    std::vector<std::pair<Eigen::Vector2d, Eigen::Vector3d>> points;
    for (const auto& [feature, of_photos] : features)
      if (of_photos.size() >= 2)
        if (const auto point = nearest_point(of_photos))
          points.emplace_back(set.designs[std::size_t(target.first)].feature(feature), *point);
    targets += points.size() >= 2;
    for (std::size_t a = 0; a < points.size(); ++a)
      for (std::size_t b = 0; b < a; ++b)
        ratios.push_back((points[a].first - points[b].first).norm() / (points[a].second - points[b].second).norm());
  }
  if (ratios.empty()) return std::nullopt;
  const auto middle = ratios.begin() + std::ptrdiff_t(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return std::isfinite(*middle) && *middle > 0 ? std::optional(*middle) : std::nullopt;
}

/// The work of one run. Removes the folder at the end; where something failed all but the log, and a database that
/// the same inputs can be taken up from.
class Workshop {
 public:
  explicit Workshop(const ColmapRun& run) : folder_(run.work) {
    std::error_code error;
    bool same = false;
    if (fs::exists(run.mark(), error) && fs::exists(folder_ / "database.db", error))
      same = read_file(run.mark()) == run.inputs;
    if (same)
      clear();
    else
      fs::remove_all(folder_, error);
    fs::create_directories(folder_, error);
    if (error) throw Error(ErrorCode::io, "can't make the folder: " + error.message(), folder_.string());
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;
  ~Workshop() {
    std::error_code ignored;
    if (done_)
      fs::remove_all(folder_, ignored);
    else
      clear();
  }
  const fs::path& folder() const { return folder_; }
  void done() { done_ = true; }

 private:
  void clear() const {
    std::error_code ignored;
    for (const char* part : {"photos", "models", "imported"}) fs::remove_all(folder_ / part, ignored);
  }
  fs::path folder_;
  bool done_ = false;
};

/// All that features and matches depend on.
std::string inputs_digest(const Capture& capture, const ColmapRun& run) {
  std::string text = run.program + (run.sequential ? " sequential\n" : " all pairs\n");
  if (run.known_camera) text += colmap_camera(*run.known_camera).text;
  for (const Shot& shot : capture.shots) text += std::to_string(shot.camera) + " " + shot.stamp.sha256 + "\n";
  return sha256(text);
}

}  // namespace

std::optional<ScaleDistance> ScaleDistance::from_text(const std::string& text) {
  const std::vector<std::string> words = split(text, text.find(',') == std::string::npos ? ' ' : ',');
  if (words.empty()) return std::nullopt;
  ScaleDistance out;
  if (words.size() == 3) {
    out.photo_a = words[0], out.photo_b = words[1];
    const auto [end, error] = std::from_chars(words[2].data(), words[2].data() + words[2].size(), out.metres);
    if (error == std::errc() && end == words[2].data() + words[2].size() && std::isfinite(out.metres) &&
        out.metres > 0 && out.photo_a != out.photo_b)
      return out;
  }
  throw Error(
      ErrorCode::invalid_argument,
      "expected NAME_A,NAME_B,METRES: two photographs and the distance of their cameras, found \"" + text + "\"",
      "scale_distance");
}

FeatureReport poses_from_features(Capture& capture, const FeatureOptions& options, Job& job) {
  if (capture.shots.size() < 3)
    throw Error(ErrorCode::degenerate, "expected at least 3 photographs, found " + std::to_string(capture.shots.size()),
                capture.folder().string());
  std::array<std::size_t, 2> scaled{};
  if (options.scale_distance)
    scaled = {shot_named(capture, options.scale_distance->photo_a),
              shot_named(capture, options.scale_distance->photo_b)};
  capture.refresh_stamps(job);

  ColmapRun run;
  run.program = options.program;
  run.work = capture.folder() / "features";
  run.photos = run.work / "photos";
  run.photo_count = capture.shots.size();
  run.sequential = options.sequential;
  if (capture.cameras.size() == 1) run.known_camera = camera_starts(capture, {})[0].camera;
  run.inputs = inputs_digest(capture, run);
  Workshop workshop(run);
  link_photos(capture, run.photos);
  const fs::path model = run.model(job);

  RefitImportOptions import;
  import.output = workshop.folder() / "imported";
  import.reference = true;
  const Capture found = import_colmap(model, run.photos, import, job);

  Capture stored = capture;
  stored.unit = Unit::unknown;
  stored.camera_covariances.clear();
  for (Shot& shot : stored.shots) shot.cam_from_world.reset(), shot.pose_quality.reset();
  FeatureReport report;
  const auto shot_of = shots_by_path(stored);
  for (const Shot& shot : found.shots) {
    Shot& mine = stored.shots[shot_of.at(shot.file)];  // import follows links
    mine.cam_from_world = shot.cam_from_world;
    stored.cameras.at(std::size_t(mine.camera)) = found.cameras.at(std::size_t(shot.camera));
    ++report.placed;
  }
  report.said.push_back(std::to_string(report.placed) + " of " + std::to_string(stored.shots.size()) +
                        " photographs placed by their features");
  for (const std::string& note : found.notes) report.said.push_back(note);

  char line[200];
  if (options.scale_distance) {
    for (const std::size_t shot : scaled)
      if (!stored.positioned(shot))
        throw Error(ErrorCode::degenerate, "the photograph that gives the scale could not be placed",
                    stored.shots[shot].name);
    const double length = (stored.view(scaled[0]).center() - stored.view(scaled[1]).center()).norm();
    if (!(length > 0)) throw Error(ErrorCode::degenerate, "the photographs that give the scale are from one place");
    report.scale = options.scale_distance->metres / length;
    std::snprintf(line, sizeof line, "scale from the distance of two photographs, %g m",
                  options.scale_distance->metres);
    report.said.emplace_back(line);
  } else if (options.targets) {
    std::size_t targets = 0;
    report.scale = scale_by_targets(stored, *options.targets, job, targets);
    report.said.push_back(report.scale ? "scale from " + std::to_string(targets) + " targets"
                                       : "warning: no target is seen from two sides: the scale stays unknown");
  }
  if (!report.scale)
    report.said.push_back("unit unknown: the distance of two photographs' cameras gives it (scale_distance)");
  if (report.scale) {
    stored.unit = Unit::metres;
    for (Shot& shot : stored.shots)
      if (shot.cam_from_world) shot.cam_from_world->translation *= *report.scale;
  }
  stored.save();
  capture = std::move(stored);
  std::error_code ignored;
  for (const char* stale : {"targets.json", "calibration.html"}) fs::remove(capture.folder() / stale, ignored);
  workshop.done();
  return report;
}

}  // namespace lumihull::calib
