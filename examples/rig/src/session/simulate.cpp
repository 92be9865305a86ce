// A whole session with the virtual rig, through libcapture's own.

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/capture/session.h>
#include <lumihull/rig/exif.h>
#include <lumihull/rig/simulate.h>
#include <lumihull/rig/trajectory.h>

#include <cmath>
#include <cstdio>

#include "lens_photos.h"
#include "objects/noise.h"
#include "session_truth.h"
#include "simulate_options.h"
#include "truth.h"

namespace lumihull::rig {

namespace fs = std::filesystem;
using capture::PlannedStop;

namespace {

/// Agrees to everything that moves; what is in doubt is taken again. The camera's own list leaves no doubts.
class WillingOperator : public capture::Operator {
 public:
  explicit WillingOperator(const std::function<void(const std::string&)>& say) : say_(say) {}
  std::string ask(const capture::Question& question, Job&) override { return question.choices.front(); }
  void tell(const std::string& line) override {
    if (say_) say_("note: " + line);
  }

 private:
  const std::function<void(const std::string&)>& say_;
};

/// The folder is new, or was begun with these options. Nothing is made.
void check_folder(const fs::path& folder, const SimulateOptions& options) {
  const fs::path file = folder / "simulate.json";
  const std::string text = options_json(options);
  if (fs::exists(file)) {
    if (read_file(file) != text)
      throw Error(ErrorCode::invalid_argument, "was begun with other options; name another folder", folder.string());
    return;
  }
  if (fs::exists(folder) && (!fs::is_directory(folder) || !fs::is_empty(folder)))
    throw Error(ErrorCode::invalid_argument, "expected a folder that is new, empty, or begun by `simulate`",
                folder.string());
}

/// After all is planned: what can't be is said before anything is made.
void begin(const fs::path& folder, const SimulateOptions& options) {
  std::error_code error;
  fs::create_directories(folder / "truth", error);
  if (error) throw Error(ErrorCode::io, "can't make the folder: " + error.message(), folder.string());
  write_file(folder / "simulate.json", options_json(options));
}

class Simulation {
 public:
  Simulation(const fs::path& folder, const SimulateOptions& options, Job& job,
             const std::function<void(const std::string&)>& say)
      : folder_(folder), options_(options), job_(job), say_(say) {}

  Simulated run() {
    std::optional<capture::Plan> stored;
    if (fs::exists(capture::plan_path(folder_))) stored = capture::read_plan(capture::plan_path(folder_));
    session_ = plan_session(options_, stored, job_);
    if (!fs::exists(folder_ / "simulate.json")) begin(folder_, options_);
    describe();
    if (!session_.targets.placed.empty()) session_.targets.set.save(folder_ / "sheets.json");
    photograph();
    photograph_empty();
    photograph_board(folder_ / "lens", session_.lens, options_.lens_photos, 3600 * 24, mix(options_.seed, 8), job_);
    const std::vector<NamedExposure> exposures = exposures_of(folder_);
    write_session_truth(folder_, session_, exposures, job_);
    for (const NamedExposure& e : exposures) out_.with_cables += cable_in(e.exposure);
    if (options_.test_views > 0) photograph_test_views();
    complete_capture(exposures);
    return out_;
  }

 private:
  void say(const std::string& line) const {
    if (say_) say_(line);
  }

  void describe() {
    out_.sheets = session_.targets.placed.size();
    out_.least_targets = session_.least_targets;
    out_.radius_m = session_.radius_m;
    out_.room_radius_m = session_.scene.enclosure.radius;
    out_.notes = session_.notes;
    const bool exact =
        !session_.plan.mechanism && (options_.carrier == Carrier::ideal || options_.carrier == Carrier::automatic);
    out_.carrier = session_.plan.mechanism ? "cables" : exact ? "an ideal robot" : session_.plan.robot;
    say(session_.said + "; robot: " + out_.carrier);
    for (const std::string& note : session_.notes) say("note: " + note);
  }

  /// A job of the rig's own: a photograph's parts are no steps of the session.
  const Photographer& photographer() {
    Job light({}, job_.threads());
    if (!photographer_) photographer_.emplace(session_.scene, options_.light, light);
    return *photographer_;
  }

  void photograph() {
    const capture::Plan& plan = session_.plan;
    RigRobot robot(plan, {session_.errors, folder_ / "truth" / "robot.txt", false});
    if (robot.stop().empty()) robot.declare_position(plan.stops.front());  // it was set up there
    std::vector<std::unique_ptr<RigCamera>> owned;
    std::vector<capture::CameraDevice*> cameras;
    for (const std::string& name : plan.cameras) {
      owned.push_back(std::make_unique<RigCamera>(
          camera_of(options_, session_, name, folder_ / "truth"),
          [this]() -> const Photographer& { return photographer(); }, robot));
      cameras.push_back(owned.back().get());
    }
    capture::SessionOptions o;
    if (plan.cameras.size() == 1) o.names = "{stop}";
    o.devices = "virtual rig";
    o.settle = [&robot](double seconds, Job&) { robot.settle(seconds); };
    WillingOperator who(say_);
    const capture::SessionResult result = capture::capture(plan, robot, cameras, folder_, o, who, job_);
    out_.photographs = result.views;
    out_.taken = result.taken;
  }

  /// Some of the stops once more, without the object.
  void photograph_empty() {
    if (options_.empty_photos == 0) return;
    std::vector<const PlannedStop*> stops;
    for (const PlannedStop& stop : session_.plan.stops)
      if (stop.photograph) stops.push_back(&stop);
    const RigRobot robot(session_.plan, {session_.errors, {}, false});
    std::vector<Pose> poses;
    std::vector<std::string> names;
    const std::size_t n = std::size_t(options_.empty_photos);
    for (std::size_t i = 0; i < n; ++i) {
      char name[32];
      std::snprintf(name, sizeof name, "empty_%04zu", i + 1);
      names.emplace_back(name);
      const Pose pose = robot.foreseen(*stops[i * stops.size() / n], 2 + int(i)).cam_from_world;
      poses.push_back(pose * session_.world_from_plan.inverse());
    }
    fs::create_directories(folder_ / "enclosure");
    bool all = true;
    for (const std::string& name : names) all = all && fs::exists(folder_ / "enclosure" / (name + ".jpg"));
    if (all) return;
    const Photographer photographer(session_.scene.emptied(), options_.light, job_);
    job_.begin("photographs of the empty enclosure", n);
    parallel_for(
        job_, n,
        [&](std::size_t i) {
          const fs::path file = folder_ / "enclosure" / (names[i] + ".jpg");
          if (fs::exists(file)) return;
          Job alone({}, 1);  // one photograph a thread: encoding is serial
          const Photo photo = photographer.photograph({session_.lens.camera, poses[i]}, session_.lens.photo,
                                                      mix(mix(options_.seed, 4), i), alone);
          const int held = exif_orientation(poses[i].rotation * Eigen::Vector3d::UnitZ());
          write_file(file, camera_file(photo.picture, session_.lens, 12 * 3600 + 20 * double(i), .5, held));
        },
        true);
    job_.end();
  }

  /// What a renderer should show along an arc, as nobody photographed it.
  void photograph_test_views() {
    const fs::path truth = folder_ / "truth", pictures = truth / "test_views";
    fs::create_directories(pictures / "masks");
    Hemisphere around;
    around.target = session_.scene.center().cast<double>();
    around.radius = session_.radius_m;
    around.phi_first = options_.phi_from_rad, around.phi_last = options_.phi_to_rad;
    around.jitter = 0;
    // Where the brightest lamp's highlight is seen all the way.
    const Eigen::Vector3f to_lamp = session_.scene.lamps[0].position - session_.scene.center();
    NamedShots shots;
    shots.cam_from_world = arc_trajectory(options_.test_views, around, std::atan2(to_lamp.y(), to_lamp.x()));
    for (int i = 0; i < options_.test_views; ++i) {
      char name[32];
      std::snprintf(name, sizeof name, "test_%04d", i + 1);
      shots.names.emplace_back(name);
    }
    PhotoOptions exact = session_.lens.photo;
    exact.full_well = 0;
    exact.reduce = 1;
    const Photographer& camera = photographer();
    job_.begin("test views", shots.names.size());
    parallel_for(
        job_, shots.names.size(),
        [&](std::size_t i) {
          if (fs::exists(pictures / "masks" / (shots.names[i] + ".png"))) return;
          Job alone({}, 1);
          const Photo photo = camera.photograph({session_.lens.camera, shots.cam_from_world[i]}, exact, 0, alone);
          write_png(pictures / (shots.names[i] + ".png"), photo.picture);
          write_file(pictures / "masks" / (shots.names[i] + ".png"), encode_mask(photo.mask));
        },
        true);
    job_.end();
    write_camera_path(truth / "test_views.json", session_.lens.camera, shots);
    const HighlightFinder finder(session_.scene);
    if (finder.any()) {
      write_highlights(truth / "test_highlights.json", finder, session_.lens.camera, shots,
                       session_.lens.photo.exposure, job_);
      photograph_highlights(pictures, camera, session_.lens.camera, shots, exact, job_);
    }
  }

  bool cable_in(const ExposureRecord& e) const {
    for (const auto& [from, to] : e.cables)
      for (int i = 0; i <= 400; ++i) {
        const Eigen::Vector3d p = e.cam_from_world * (from + i / 400. * (to - from));
        const auto px = p.z() > .02 ? session_.lens.camera.project(p) : std::nullopt;
        if (px && session_.lens.camera.contains(*px)) return true;
      }
    return false;
  }

  /// The empty room, and with known cameras the truth, into capture.json.
  void complete_capture(const std::vector<NamedExposure>& exposures) {
    Capture capture = Capture::open(folder_);
    bool changed = false;
    for (int i = int(capture.enclosure.size()); i < options_.empty_photos; ++i) {
      char name[32];
      std::snprintf(name, sizeof name, "empty_%04d", i + 1);
      Shot shot;
      shot.name = name;
      shot.file = "enclosure/" + shot.name + ".jpg";
      shot.stamp = Capture::stamp(folder_ / shot.file);
      capture.enclosure.push_back(std::move(shot));
      changed = true;
    }
    if (!capture.background_rgb) {
      capture.background_rgb = {255, 255, 255};
      capture.notes.push_back("photographs by the virtual rig; the truth is in truth/");
      changed = true;
    }
    if (options_.known_cameras && capture.unit != Unit::metres) {
      capture.unit = Unit::metres;
      capture.cameras = {session_.lens.camera};
      for (Shot& shot : capture.shots) {
        shot.camera = 0;
        for (const NamedExposure& e : exposures)
          if (e.name == shot.name) shot.cam_from_world = e.exposure.cam_from_world;
      }
      changed = true;
    }
    if (changed) capture.save();
  }

  const fs::path& folder_;
  const SimulateOptions& options_;
  Job& job_;
  const std::function<void(const std::string&)>& say_;
  RigSession session_;
  std::optional<Photographer> photographer_;
  Simulated out_;
};

}  // namespace

Simulated simulate(const fs::path& folder, const SimulateOptions& options, Job& job,
                   const std::function<void(const std::string&)>& say) {
  check(options);
  check_folder(folder, options);
  return Simulation(folder, options, job, say).run();
}

}  // namespace lumihull::rig
