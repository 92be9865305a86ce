// lumihull demo [FOLDER]: the whole way, from sheets of targets to a model that turns, with the virtual rig.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/target_sheet.h>
#include <lumihull/rig/simulate.h>
#include <lumihull/slf/capture_renderer.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/pipeline.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <set>

#include "apng.h"
#include "program.h"

namespace lumihull::program {

namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 36, kFrameWidth = 480, kFrameHeight = 480, kFrame_ms = 80;

struct Arguments {
  std::string folder = "lumihull-demo";
  int photos = 48, width = 1536;
};

rig::SimulateOptions session(const Arguments& a) {
  rig::SimulateOptions o;
  o.object = "bust";
  o.photos = a.photos;
  o.width = a.width;
  o.photo.blur_px = .6;
  // Light that changes slowly needs fewer rays than measurements of shading would.
  o.light.ambient_rays = 32, o.light.lamp_rays = 8;
  return o;
}

/// What one would print for a real session: the targets of the virtual one on letter paper.
void print_sheets(Program& program, const fs::path& folder, const calib::TargetSet& hung) {
  const fs::path stem = folder / "print" / "sheets";
  if (fs::exists(stem.string() + ".json")) return;
  fs::create_directories(stem.parent_path());
  calib::TargetDesign design = hung.designs.front();
  design.size_m = 0;  // as large as the paper allows
  std::set<int> ids;
  for (const calib::Board& board : hung.boards)
    for (const calib::BoardTarget& target : board.targets) ids.insert(target.id);
  calib::write_target_sheets(stem, design, {ids.begin(), ids.end()}, {calib::SheetFormat::pdf}, {}, program.job());
}

/// Pictures of a turn around the model, and all of them in one file that plays.
void turn(Program& program, const Capture& capture) {
  const fs::path folder = capture.folder() / "turntable", film = capture.folder() / "turntable.png";
  const fs::path model = capture.folder() / "light_field.glb";
  std::error_code ignored;
  if (fs::exists(film) && fs::last_write_time(film, ignored) >= fs::last_write_time(model, ignored)) return;
  fs::create_directories(folder);
  slf::CaptureRenderer renderer(capture, "light_field");
  slf::TurntableOptions options;
  options.frames = kFrames, options.width = kFrameWidth, options.height = kFrameHeight, options.elevation_deg = 15;
  std::vector<std::string> frames;
  Job& job = program.job();
  Job alone({}, job.threads());
  const auto path = renderer.turntable(options);
  job.begin("turning the model", path.size());
  for (const slf::PathView& p : path) {
    job.check();
    const slf::Rendering rendering = renderer.render(p.view, {.rays = 2}, alone);
    frames.push_back(encode_png(slf::composited(rendering.rgba, {255, 255, 255})));
    write_file(folder / (p.name + ".png"), frames.back());
    job.advance();
  }
  job.end();
  write_file(film, animated_png(frames, kFrame_ms));
}

void run(Program& program, const Arguments& a) {
  const auto started = std::chrono::steady_clock::now();
  const auto heading = [&](const std::string& what) {
    const std::chrono::duration<double> s = std::chrono::steady_clock::now() - started;
    char text[32];
    std::snprintf(text, sizeof text, "[%3.0f s] ", s.count());
    program.say(text + what);
  };
  const fs::path folder = a.folder;
  heading("A bust in a green enclosure with printed targets: " + std::to_string(a.photos) +
          " photographs from a cable robot (virtual rig)");
  rig::simulate(folder, session(a), program.job(), [&](const std::string& line) { program.say("        " + line); });
  print_sheets(program, folder, calib::TargetSet::load(folder / "sheets.json"));

  heading("Poses, silhouettes, hull, texture, light field, evaluation, report");
  Capture capture = Capture::open(folder);
  slf::set_option(capture, "calibrate", "targets", fs::absolute(folder / "sheets.json").string());
  slf::set_option(capture, "hull", "resolution", std::int64_t(200));
  // Highlights as light as the sheets' paper make holes, which a view may be wrong about where many see each place; with
  // few photographs all that hardly any view sees would stay.
  slf::set_option(capture, "hull", "tolerance", std::int64_t(a.photos < 40 ? 1 : 2));
  capture.set_hold_out(8);
  slf::run(capture, program.job(), false, [&](const slf::StageResult& result) {
    char text[64];
    std::snprintf(text, sizeof text, "        %-10s %.1f s", result.stage.c_str(), result.record.seconds);
    program.say(text + std::string(result.skipped ? " (done before)" : ""));
    for (const std::string& said : result.said) program.say("                   " + said);
  });
  heading("The model turns");
  turn(program, capture);
  heading("Done");
  const std::pair<const char*, const char*> results[] = {
      {"Report", "report.html"},    {"Calibration", "calibration.html"},
      {"Capture", "contact.html"},  {"Sheets to print", "print/sheets.pdf"},
      {"Model", "light_field.glb"}, {"It turns", "turntable.png"}};
  std::string json;
  for (const auto& [what, file] : results) {
    char line[40];
    std::snprintf(line, sizeof line, "%-16s ", (std::string(what) + ":").c_str());
    program.say(line + (folder / file).string() +
                (std::string(file) == "turntable.png" ? "  (a browser plays it)" : ""));
    json += (json.empty() ? "" : ", ") + json_text(file) + ": " + json_text((folder / file).string());
  }
  if (program.json) std::cout << "{" << json << "}\n";
}

}  // namespace

void add_demo(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb(
      "demo", "the whole way with the virtual rig: photographs, poses, model, report; goes on after a stop",
      [&program, a] { run(program, *a); });
  verb->add_option("folder", a->folder, "where it all goes [lumihull-demo]");
  verb->add_option("--photos", a->photos, "photographs [48]")->check(CLI::Range(8, 1000));
  verb->add_option("--width", a->width, "of a photograph, px [1536]")->check(CLI::Range(240, 6000));
}

}  // namespace lumihull::program
