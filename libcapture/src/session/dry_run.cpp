// Everything that can be checked before anything moves.

#include <fcntl.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/session.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "photographs.h"
#include "stored_plan.h"
#include "way_out.h"

namespace lumihull::capture {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostNamed = 5;      ///< problems of one kind that are told one by one
constexpr double kBytesAPhotograph = 8e6;  ///< of the paper's camera: 6 megapixels, JPEG or RAW

class Checks {
 public:
  Checks(const Plan& plan, const fs::path& folder, const SessionOptions& options)
      : plan_(plan), folder_(folder), options_(options) {}

  DryRun run(Robot& robot, std::span<CameraDevice* const> cameras) {
    attempt([&] { check(plan_); });
    if (!out_.problems.empty()) return out_;  // what follows would stumble over the same
    if (cameras.size() != plan_.cameras.size())
      problem("the plan has " + std::to_string(plan_.cameras.size()) + " cameras, " + std::to_string(cameras.size()) +
              " are connected");
    check_options();
    check_robot(robot);
    if (plan_.mechanism) check_ways();
    check_folder();
    return out_;
  }

 private:
  void problem(const std::string& text) { out_.problems.push_back(text); }
  void note(const std::string& text) { out_.notes.push_back(text); }

  template <class Body>
  void attempt(Body body) {
    try {
      body();
    } catch (const Error& e) {
      problem(e.what());
    }
  }

  void check_options() {
    if (options_.retries < 0 || options_.retries > 1000) problem("retries: expected 0 to 1000");
    if (const auto s = options_.settle_s; s && !(*s >= 0 && *s <= 3600)) problem("settle time: expected 0 to 3600 s");
    if (const auto s = options_.exposure_s; s && !(*s > 0 && *s <= 3600))
      problem("exposure: expected above 0, at most 3600 s, as in a plan");
    if (!(options_.page_every_s >= 0) || !(options_.retry_after_s >= 0 && options_.retry_after_s <= 3600))
      problem("times between pages and retries: expected 0 s or more");
    for (const auto& [name, camera] : options_.intrinsics) {
      if (std::find(plan_.cameras.begin(), plan_.cameras.end(), name) == plan_.cameras.end())
        problem("intrinsics are given for \"" + name + "\", which is no camera of the plan");
      attempt([&, &camera = camera] { camera.validate(); });
    }
  }

  void check_robot(Robot& robot) {
    attempt([&] {
      const Robot::State state = robot.state();
      if (!state.fault.empty()) problem("the robot reports: " + state.fault);
      if (!state.ready) problem("the robot is not ready");
      if (state.moving) problem("the robot is moving");
      if (!state.position_known) note("the robot does not know where it is: the operator will be asked");
    });
  }

  void check_ways() {
    std::size_t bad = 0;
    const auto complain = [&](const std::string& text) {
      if (++bad <= kMostNamed) problem(text);
    };
    for (std::size_t i = 0; i < plan_.stops.size(); ++i) {
      const PlannedStop& stop = plan_.stops[i];
      if (const auto obstacle = internal::obstacle_at(plan_, stop.world_from_platform))
        complain(stop.name + ": " + *obstacle);
      if (i == 0) continue;
      const PlannedStop& before = plan_.stops[i - 1];
      if (const auto obstacle = internal::obstacle_between(plan_, before.world_from_platform, stop.world_from_platform))
        complain("from " + before.name + " to " + stop.name + ": " + *obstacle);
    }
    if (bad > kMostNamed) problem("and " + std::to_string(bad - kMostNamed) + " more stops or ways like these");
  }

  void check_folder() {
    fs::path existing = fs::absolute(folder_).lexically_normal();
    std::error_code error;
    while (!fs::exists(existing, error) && existing.has_relative_path()) existing = existing.parent_path();
    if (!fs::is_directory(existing, error)) return problem(existing.string() + ": a file is in the way of the folder");
    if (::faccessat(AT_FDCWD, existing.c_str(), W_OK | X_OK, AT_EACCESS) != 0)
      problem(existing.string() + ": the folder can't be written to");

    std::optional<JournalState> state;
    attempt([&] { state = internal::stored_state(folder_, plan_); });
    if (!state) {
      if (!out_.problems.empty()) return;
      state.emplace();
      state->head = internal::head_of(plan_, options_.names, "");
      attempt([&] { internal::photograph_names(state->head); });
      if (!out_.problems.empty()) return;
      state->shots.resize(plan_.stops.size() * plan_.cameras.size(), {.step = ShotStep::waiting});
      if (fs::exists(folder_ / "capture.json", error))
        problem(folder_.string() + ": holds a capture that was not begun by `capture`; name another folder");
    } else {
      note("goes on: " + std::to_string(state->views()) + " photographs are there");
      if (!options_.names.empty() && options_.names != state->head.name_template &&
          options_.names != SessionOptions{}.names)
        note("photographs are named by the template that the capture was begun with: " + state->head.name_template);
    }
    if (!options_.retake.empty()) {
      const auto stop = state->stop_index(options_.retake);
      if (!stop || state->head.passed.contains(options_.retake))
        problem("retake: the plan has no photograph at a stop \"" + options_.retake + "\"");
    }
    count(*state);
    check_places(*state);
    const fs::space_info space = fs::space(existing, error);
    if (!error && space.available < options_.least_free_bytes)
      problem(existing.string() + ": " + std::to_string(space.available / 1'000'000) + " MB are free on its disk, " +
              std::to_string(options_.least_free_bytes / 1'000'000) + " MB are asked for");
    else if (!error && double(space.available) < kBytesAPhotograph * double(out_.left))
      note(existing.string() + ": " + std::to_string(space.available / 1'000'000) +
           " MB free may be too little for the photographs to come");
  }

  void count(const JournalState& state) {
    const std::size_t cameras = plan_.cameras.size();
    for (std::size_t stop = 0; stop < plan_.stops.size(); ++stop) {
      std::size_t here = 0;
      for (std::size_t c = 0; c < cameras; ++c) {
        const ShotStep step = state.shots[stop * cameras + c].step;
        here += plan_.stops[stop].photograph && step != ShotStep::done && step != ShotStep::landed;
      }
      if (!options_.retake.empty()) here = plan_.stops[stop].name == options_.retake ? cameras : 0;
      if (here == 0) continue;
      out_.left += here;
      out_.seconds += plan_.stops[stop].travel_s + options_.settle_s.value_or(plan_.stops[stop].settle_s) +
                      double(here) * options_.exposure_s.value_or(plan_.stops[stop].exposure_s);
    }
  }

  /// Whatever the extension: a photograph of that name would be confusing even where it does not collide.
  void check_places(const JournalState& state) {
    const std::vector<std::string> names = internal::photograph_names(state.head);
    std::set<std::string> wanted(names.begin(), names.end());
    std::size_t bad = 0;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder_ / "photos", error)) {
      if (state.files.contains(entry.path().filename().string()) || !wanted.contains(entry.path().stem().string()))
        continue;
      if (++bad <= kMostNamed)
        problem(entry.path().string() + ": a file that this capture did not take is in the way: move it away");
    }
    if (bad > kMostNamed) problem("and " + std::to_string(bad - kMostNamed) + " more files in the way");
  }

  const Plan& plan_;
  const fs::path& folder_;
  const SessionOptions& options_;
  DryRun out_;
};

}  // namespace

DryRun dry_run(const Plan& plan, Robot& robot, std::span<CameraDevice* const> cameras, const fs::path& folder,
               const SessionOptions& options) {
  return Checks(plan, folder, options).run(robot, cameras);
}

}  // namespace lumihull::capture
