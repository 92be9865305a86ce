#include "model.h"

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/capture_renderer.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/pipeline.h>

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

Json model_of(const fs::path& folder, const rig::SimulateOptions& options, Job& job,
              const std::function<void(Capture&)>& change) {
  const auto say = [](const std::string& line) { std::fprintf(stderr, "  %s\n", line.c_str()); };
  const Stopwatch photographing;
  const rig::Simulated made = rig::simulate(folder, options, job, say);
  const Json rig_seconds = photographing.seconds();
  Capture capture = Capture::open(folder);
  if (!options.known_cameras)
    slf::set_option(capture, "calibrate", "targets", (fs::absolute(folder) / "sheets.json").string());
  slf::set_option(capture, "hull", "resolution", std::int64_t(150));
  slf::set_option(capture, "evaluate", "truth", (fs::absolute(folder) / "truth").string());
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

Image overview(const Capture& capture, Job& job, int height) {
  std::vector<Image> pictures;
  const auto shots = slf::training_shots(capture);
  if (shots.empty()) return {};
  const std::size_t shot = shots[shots.size() / 3];
  const Image photo = converted(capture.read_photo(shot, 3), PixelType::u8, 3);
  pictures.push_back(photo);
  pictures.push_back(capture.read_mask(shot));
  if (fs::exists(calib::target_model_path(capture))) {
    const calib::TargetModel model = calib::TargetModel::of(capture);
    const auto found = calib::TargetDetector(model.set).detect(photo, job);
    pictures.push_back(calib::draw_detections(photo, model.set, found));
  }
  slf::TurntableOptions turn;
  turn.frames = 8;
  turn.width = 4 * height / 3, turn.height = height;
  turn.elevation_deg = 20;
  const auto add = [&](const char* method, std::size_t frame) {
    slf::CaptureRenderer renderer(capture, method);
    const auto path = renderer.turntable(turn);
    pictures.push_back(renderer.render(path.at(frame).view, {3, false}, job).rgba);
  };
  add("shaded", 1);
  add("light_field", 1);
  add("light_field", 4);
  return side_by_side(pictures, height);
}

}  // namespace lumihull::experiments
