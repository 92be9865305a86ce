#include "model.h"

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/slf/capture_renderer.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/pipeline.h>

#include <algorithm>
#include <cstdio>

namespace lumihull::experiments {

namespace fs = std::filesystem;

namespace {

constexpr double kPaperSecondsAPhoto = 14;  // of the robot (section 5.1)

Json stage_seconds(const Capture& capture, std::size_t photos) {
  Json out = Json::object();
  double sum = 0;
  for (const auto name : slf::stage_names()) {
    const auto record = capture.stages.find(name);
    if (record == capture.stages.end()) continue;
    out[std::string(name)] = {{"seconds", record->second.seconds},
                              {"seconds_a_photo", record->second.seconds / double(photos)},
                              {"peak_MB", double(record->second.peak_bytes) / 1e6}};
    sum += record->second.seconds;
  }
  out["all"] = {{"seconds", sum}, {"seconds_a_photo", sum / double(photos)}};
  out["paper_robot_seconds_a_photo"] = kPaperSecondsAPhoto;
  return out;
}

}  // namespace

Json model_of(const fs::path& folder, const rig::SimulateOptions& options, const Size& size, Job& job,
              const std::function<void(Capture&)>& change) {
  const auto say = [](const std::string& line) { std::fprintf(stderr, "  %s\n", line.c_str()); };
  const Stopwatch photographing;
  const rig::Simulated made = rig::simulate(folder, options, job, say);
  const Json rig_seconds = photographing.seconds();
  Capture capture = Capture::open(folder);
  if (!options.known_cameras)
    slf::set_option(capture, "calibrate", "targets", (fs::absolute(folder) / "sheets.json").string());
  // So many photographs of the empty enclosure know its colours well, and gloss has colours just beside them.
  slf::set_option(capture, "key", "foreground_share", 1.0);
  slf::set_option(capture, "hull", "resolution", std::int64_t(150));
  slf::set_option(capture, "evaluate", "truth", (fs::absolute(folder) / "truth").string());
  // Highlights have the colour of the sheets' paper, and what is keyed away there in one view would be cut away for
  // good.
  if (options.sheets) slf::set_option(capture, "hull", "tolerance", std::int64_t(2));
  if (!size.full) {
    slf::set_option(capture, "lightfield", "map_px", 1.0);
    slf::set_option(capture, "evaluate", "rays", std::int64_t(2));
  }
  if (change) change(capture);
  capture.save();
  const Stopwatch modelling;
  slf::run(capture, job, false, [&](const slf::StageResult& result) {
    say(result.stage + (result.skipped ? ": -" : ""));
    for (const std::string& line : result.said) say("  " + line);
  });
  Json out{{"photographs", made.photographs},
           {"width_px", options.width},
           {"radius_m", made.radius_m},
           {"carrier", made.carrier},
           {"least_targets_in_view", made.least_targets},
           {"photographs_with_cables", made.with_cables},
           {"rig_seconds", rig_seconds},
           {"model_seconds", modelling.seconds()},
           {"stages", stage_seconds(capture, made.photographs)}};
  const Json evaluation = Json::parse(read_file(folder / "evaluate" / "evaluation.json"));
  out["truth"] = evaluation.at("truth");
  return out;
}

namespace {

/// EXIF's number of the turn that brings a photograph upright, by the pose that the robot was told; its world's z is
/// up.
int upright(const Shot& shot) {
  if (!shot.commanded) return 1;
  const Eigen::Vector3d up = shot.commanded->cam_from_world.rotation * Eigen::Vector3d::UnitZ();
  if (up.x() > 0.7) return 8;
  if (up.x() < -0.7) return 6;
  return up.y() > 0.7 ? 3 : 1;
}

/// The part of a picture that holds the mask, with a margin.
Image cropped(const Image& picture, const Image& mask) {
  int x0 = mask.width(), x1 = 0, y0 = mask.height(), y1 = 0;
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask.row<std::uint8_t>(y)[x] >= 128)
        x0 = std::min(x0, x), x1 = std::max(x1, x + 1), y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
  if (x1 <= x0) return picture;
  const int margin = std::max(x1 - x0, y1 - y0) / 10 + 1;
  x0 = std::max(0, x0 - margin), y0 = std::max(0, y0 - margin);
  x1 = std::min(mask.width(), x1 + margin), y1 = std::min(mask.height(), y1 + margin);
  const int n = picture.channels();
  Image out(x1 - x0, y1 - y0, n);
  for (int y = y0; y < y1; ++y)
    std::copy_n(picture.row<std::uint8_t>(y) + n * x0, n * (x1 - x0), out.row<std::uint8_t>(y - y0));
  return out;
}

}  // namespace

Image overview(const Capture& capture, Job& job, int height) {
  const auto shots = slf::training_shots(capture);
  if (shots.empty()) return {};
  // Lower views of the front and of another side.
  std::vector<std::size_t> low = shots;
  const auto height_of = [&](std::size_t i) {
    const auto& c = capture.shots[i].commanded;
    return c ? c->cam_from_world.center().z() : 0;
  };
  std::stable_sort(low.begin(), low.end(), [&](std::size_t a, std::size_t b) { return height_of(a) < height_of(b); });
  const std::size_t first = low[low.size() / 3], second = low[low.size() / 2];
  const int turn = upright(capture.shots[first]);
  const Image photo = converted(capture.read_photo(first, 3), PixelType::u8, 3);
  std::vector<Image> pictures{oriented(photo, turn), oriented(capture.read_mask(first), turn)};
  if (fs::exists(calib::target_model_path(capture))) {
    const calib::TargetModel model = calib::TargetModel::of(capture);
    const auto found = calib::TargetDetector(model.set).detect(photo, job);
    pictures.push_back(oriented(calib::draw_detections(photo, model.set, found), turn));
  }
  const auto add = [&](const char* method, std::size_t shot) {
    slf::CaptureRenderer renderer(capture, method);
    const Image picture = renderer.render(capture.view(shot), {3, false}, job).rgba;
    Image alpha(picture.width(), picture.height(), 1);
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x) alpha.row<std::uint8_t>(y)[x] = picture.row<std::uint8_t>(y)[4 * x + 3];
    pictures.push_back(oriented(cropped(picture, alpha), upright(capture.shots[shot])));
  };
  add("shaded", first);
  add("light_field", first);
  add("light_field", second);
  return side_by_side(pictures, height);
}

}  // namespace lumihull::experiments
