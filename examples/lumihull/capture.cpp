// lumihull capture FOLDER --plan plan.json --robot WORD --camera WORD: drives robot and cameras through a plan; the
// same command goes on where it was stopped or killed.

#include <lumihull/base/error.h>
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/capture/devices.h>
#include <lumihull/capture/session.h>
#include <lumihull/rig/rig_devices.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "program.h"
#include "terminal_operator.h"

namespace lumihull::program {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string folder, plan, robot;
  std::vector<std::string> cameras, intrinsics;
  capture::SessionOptions options;
  double settle = -1, exposure = -1, least_free_mb = 200;
  bool dry_run = false, yes = false;
};

/// [CAMERA=]FILE; without a name it is every camera's.
std::map<std::string, Camera> intrinsics_of(const Arguments& a, const capture::Plan& plan) {
  std::map<std::string, Camera> out;
  for (const std::string& word : a.intrinsics) {
    const std::size_t equals = word.find('=');
    const Camera camera = calib::load_intrinsics(equals == std::string::npos ? word : word.substr(equals + 1)).camera;
    if (equals != std::string::npos)
      out[word.substr(0, equals)] = camera;
    else
      for (const std::string& name : plan.cameras) out.emplace(name, camera);
  }
  return out;
}

void say_dry_run(Program& program, const capture::DryRun& found) {
  for (const std::string& text : found.problems) program.say("problem: " + text);
  for (const std::string& text : found.notes) program.say("note: " + text);
  char line[120];
  std::snprintf(line, sizeof line, "%zu photographs to take, %.0f min by the plan", found.left, found.seconds / 60);
  program.say(line);
  if (program.json) {
    const auto list = [](const std::vector<std::string>& texts) {
      std::string out;
      for (const std::string& text : texts) out += (out.empty() ? "" : ", ") + json_text(text);
      return "[" + out + "]";
    };
    std::cout << "{\"problems\": " << list(found.problems) << ", \"notes\": " << list(found.notes)
              << ", \"left\": " << found.left << ", \"seconds\": " << found.seconds << "}\n";
  }
  if (!found.problems.empty())
    throw Error(ErrorCode::bad_input, std::to_string(found.problems.size()) + " problems; nothing was moved",
                "dry run");
}

void run(Program& program, Arguments& a) {
  const fs::path stored = capture::plan_path(a.folder);
  if (a.plan.empty() && !fs::exists(stored))
    throw Error(ErrorCode::invalid_argument, "a new capture needs --plan (`lumihull plan` makes one)", a.folder);
  const capture::Plan plan = capture::read_plan(a.plan.empty() ? stored : fs::path(a.plan));
  if (a.cameras.size() == 1) a.cameras.resize(plan.cameras.size(), a.cameras.front());

  capture::SessionOptions options = a.options;
  if (a.settle >= 0) options.settle_s = a.settle;
  if (a.exposure >= 0) options.exposure_s = a.exposure;
  options.least_free_bytes = std::uint64_t(a.least_free_mb * 1e6);
  options.intrinsics = intrinsics_of(a, plan);
  options.devices = "robot " + a.robot + "; cameras";
  for (const std::string& word : a.cameras) options.devices += " " + word;

  const auto say = [&](const std::string& line) { program.say(line); };
  TerminalOperator who(say, a.yes, program.job());
  rig::RigDevices rig(a.folder, a.dry_run, say);
  capture::Devices devices(a.folder, who);
  devices.bring("rig", rig.brought(program.job()));
  const auto robot = devices.robot(a.robot, plan);
  std::vector<std::unique_ptr<capture::CameraDevice>> owned;
  std::vector<capture::CameraDevice*> cameras;
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    const std::string name = i < plan.cameras.size() ? plan.cameras[i] : "camera " + std::to_string(i + 1);
    owned.push_back(devices.camera(a.cameras[i], name, *robot, program.job()));
    cameras.push_back(owned.back().get());
  }
  options.settle = rig.settle();
  if (a.dry_run) return say_dry_run(program, capture::dry_run(plan, *robot, cameras, a.folder, options));

  const capture::SessionResult result = capture::capture(plan, *robot, cameras, a.folder, options, who, program.job());
  rig.write_truth(program.job());
  program.say(a.folder + ": " + std::to_string(result.views) + " of " + std::to_string(result.of) + " photographs, " +
              std::to_string(result.taken) + " taken now" +
              (result.awaited ? ", " + std::to_string(result.awaited) + " still on the camera's card" : "") +
              (result.paused ? "; paused: the same command goes on" : ""));
  program.say("contact sheet " + (fs::path(a.folder) / "contact.html").string());
  if (program.json)
    std::cout << "{\"views\": " << result.views << ", \"of\": " << result.of << ", \"taken\": " << result.taken
              << ", \"awaited\": " << result.awaited << ", \"paused\": " << (result.paused ? "true" : "false") << "}\n";
}

}  // namespace

void add_capture(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb("capture", "drive robot and cameras through a plan; goes on where it was stopped",
                                [&program, a] { run(program, *a); });
  verb->add_option("capture", a->folder, "folder of the capture, new or begun")->required();
  verb->add_option("--plan", a->plan, "what `lumihull plan` wrote; a capture that was begun has it");
  verb->add_option("--robot", a->robot, "simulate, turntable, hand, serial:PORT, or rig")->required();
  verb->add_option(
          "--camera", a->cameras,
          "simulate, hand, serial[:PORT], gphoto2[:PORT], folder:DIR, or rig[:OBJECT[:WIDTH]], the virtual rig's; once "
          "for all, or once for each of the plan")
      ->required();
  verb->add_flag("--dry-run", a->dry_run, "check everything, move nothing");
  verb->add_option("--retake", a->options.retake, "photograph this stop once more, and nothing else");
  verb->add_option("--pause-after", a->options.pause_after, "stop after so many photographs; 0 = go on to the end");
  verb->add_flag("--yes", a->yes, "agree that the robot moves; doubts are still asked about");
  verb->add_option("--names", a->options.names, "names of photographs: {stop}, {camera}, {number} [{stop}-{camera}]");
  verb->add_option("--settle", a->settle, "seconds to wait at each stop, instead of the plan's")
      ->check(CLI::Range(0.0, 3600.0));
  verb->add_option("--exposure", a->exposure, "seconds, above 0, instead of the plan's")
      ->check(CLI::PositiveNumber)
      ->check(CLI::Range(0.0, 3600.0));
  verb->add_option("--retries", a->options.retries, "of a shot that the camera refuses [2]")
      ->check(CLI::Range(0, 1000));
  verb->add_option("--least-free", a->least_free_mb, "stop where less is free on the disk, MB [200]")
      ->check(CLI::Range(0.0, 1e9));
  verb->add_option("--intrinsics", a->intrinsics, "[CAMERA=]FILE of a calibrated lens (`lumihull intrinsics`)");
}

}  // namespace lumihull::program
