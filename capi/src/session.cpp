#include <lumihull/capture/devices.h>
#include <lumihull/capture/serial.h>
#include <lumihull/capture/session.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>

#include "arguments.h"
#include "context.h"
#include "handles.h"
#include "mechanism_structs.h"

using namespace lumihull;
using namespace lumihull::capi;
using capture::PlannedStop;
using capture::Question;
using capture::ShotId;
using capture::ShotOutcome;
using capture::ShotState;

static_assert(LH_SHOT_DONE == int(ShotState::done) && LH_SHOT_REFUSED == int(ShotState::refused) &&
              LH_SHOT_UNKNOWN == int(ShotState::unknown));
static_assert(LH_QUESTION_MOTION == int(Question::About::motion) &&
              LH_QUESTION_POSITION == int(Question::About::position) &&
              LH_QUESTION_DOUBT == int(Question::About::doubt) && LH_QUESTION_TASK == int(Question::About::task));

namespace {

/// What an application's function wrote into a buffer; it may have forgotten the NUL.
template <std::size_t N>
std::string text_of(const char (&buffer)[N]) {
  return {buffer, strnlen(buffer, N)};
}

/// Calls an application's function; its failure is Error{io}, or cancelled.
template <class Call>
void ask_device(const char* device, const char* what, Call&& call) {
  char reason[256] = "";
  const lh_status status = call(reason);
  if (status == LH_OK) return;
  std::string why = text_of(reason);
  std::replace(why.begin(), why.end(), '\n', ' ');
  throw Error(status == LH_ECANCELLED ? ErrorCode::cancelled : ErrorCode::io,
              std::string(what) + " failed: " + (why.empty() ? lh_status_text(status) : why), device);
}

class OwnRobot : public capture::Robot {
 public:
  explicit OwnRobot(const lh_robot_functions& functions) : f_(functions) {}

  State state() override {
    lh_robot_state s{};
    s.struct_size = sizeof s;
    ask_device("robot", "state", [&](char* reason) { return f_.state(f_.user, &s, reason); });
    if (s.cables > LH_MAX_CABLES)
      throw Error(ErrorCode::io, "it told of " + std::to_string(s.cables) + " cables, at most 12 are possible",
                  "robot");
    return {
        s.ready != 0, s.moving != 0, s.position_known != 0, {s.lengths_m, s.lengths_m + s.cables}, text_of(s.fault)};
  }
  void move_to(const PlannedStop& stop, Job& job) override {
    job.check();
    const lh_stop there = stop_to(stop);
    ask_device("robot", "move_to", [&](char* reason) {
      return f_.move_to(f_.user, stop.name.c_str(), &there, stop.lengths_m.data(), reason);
    });
  }
  void set_roll(double roll_rad, Job& job) override {
    job.check();
    if (f_.set_roll)
      ask_device("robot", "set_roll", [&](char* reason) { return f_.set_roll(f_.user, roll_rad, reason); });
  }
  void declare_position(const PlannedStop& stop) override {
    if (!f_.declare_position) return;
    const lh_stop there = stop_to(stop);
    ask_device("robot", "declare_position", [&](char* reason) {
      return f_.declare_position(f_.user, stop.name.c_str(), &there, stop.lengths_m.data(), reason);
    });
  }
  void make_safe() noexcept override {
    if (f_.make_safe) f_.make_safe(f_.user);
  }

 private:
  lh_robot_functions f_;
};

ShotOutcome outcome_of(const lh_shot& shot) {
  if (shot.state < LH_SHOT_DONE || shot.state > LH_SHOT_UNKNOWN)
    throw Error(ErrorCode::io, "expected LH_SHOT_…, found " + std::to_string(shot.state), "camera");
  return {ShotState(shot.state), text_of(shot.file), text_of(shot.detail)};
}

class OwnCamera : public capture::CameraDevice {
 public:
  explicit OwnCamera(const lh_camera_functions& functions) : f_(functions) {}

  bool delivers_files() const override { return f_.delivers_files; }
  ShotOutcome shoot(ShotId id, double exposure_s, const std::filesystem::path& folder, Job&) override {
    lh_shot shot = unknown();
    ask_device("camera", "shoot",
               [&](char* reason) { return f_.shoot(f_.user, id, exposure_s, folder.c_str(), &shot, reason); });
    return outcome_of(shot);
  }
  ShotOutcome recall(ShotId id) override {
    lh_shot shot = unknown();
    if (f_.recall) ask_device("camera", "recall", [&](char* reason) { return f_.recall(f_.user, id, &shot, reason); });
    return outcome_of(shot);
  }
  void make_safe() noexcept override {
    if (f_.make_safe) f_.make_safe(f_.user);
  }

 private:
  static lh_shot unknown() {
    lh_shot shot{};
    shot.struct_size = sizeof shot;
    shot.state = LH_SHOT_UNKNOWN;
    return shot;
  }
  lh_camera_functions f_;
};

class OwnOperator : public capture::Operator {
 public:
  explicit OwnOperator(const lh_operator& functions) : f_(functions) {}

  std::string ask(const Question& question, Job& job) override {
    job.check();
    std::vector<const char*> choices;
    for (const std::string& choice : question.choices) choices.push_back(choice.c_str());
    std::size_t answer = choices.size();
    const lh_status status =
        f_.ask(f_.user, int32_t(question.about), question.text.c_str(), choices.data(), choices.size(), &answer);
    if (status != LH_OK)
      throw Error(status == LH_ECANCELLED ? ErrorCode::cancelled : ErrorCode::invalid_argument,
                  "nobody answered: " + question.text, "operator");
    return question.choices[index(answer, choices.size(), "answer")];
  }
  void tell(const std::string& line) override {
    if (f_.tell) f_.tell(f_.user, line.c_str());
  }

 private:
  lh_operator f_;
};

std::unique_ptr<capture::Operator> operator_from(const lh_operator* user, bool agree_to_motion) {
  if (!user) return std::make_unique<capture::AbsentOperator>(agree_to_motion);
  const lh_operator functions = read_struct(user, "who");
  if (!functions.ask) invalid("expected a function `ask`, found NULL", "who");
  return std::make_unique<OwnOperator>(functions);
}

capture::SessionOptions options_from(const lh_session_options& o) {
  capture::SessionOptions options;
  if (o.names) options.names = o.names;
  if (o.settle_s != 0) options.settle_s = o.settle_s < 0 ? 0 : o.settle_s;
  if (o.exposure_s != 0) options.exposure_s = o.exposure_s;
  options.retries = o.retries < 0 ? 0 : or_default(int(o.retries), options.retries);
  if (o.retake) options.retake = o.retake;
  options.pause_after = o.pause_after;
  if (o.devices) options.devices = o.devices;
  return options;
}

/// The devices of a session: the application's own, and those that words tell, which are open as long as it lasts.
class SessionDevices {
 public:
  SessionDevices(lh_robot* robot, lh_camera_device* const* cameras, size_t n, const capture::Plan& plan,
                 const std::filesystem::path& folder, capture::Operator& who, Job& job)
      : by_word_(folder, who) {
    robot_ = given(robot, "robot").device.get();
    if (!robot_) {
      own_robot_ = by_word_.robot(robot->word, plan);
      robot_ = own_robot_.get();
    }
    for (lh_camera_device* camera : array(cameras, n, 1, "cameras")) {
      capture::CameraDevice* device = given(camera, "cameras").device.get();
      const std::size_t i = cameras_.size();
      const std::string name = i < plan.cameras.size() ? plan.cameras[i] : "camera " + std::to_string(i + 1);
      if (!device) device = own_cameras_.emplace_back(by_word_.camera(camera->word, name, *robot_, job)).get();
      cameras_.push_back(device);
    }
  }
  capture::Robot& robot() { return *robot_; }
  std::span<capture::CameraDevice* const> cameras() const { return cameras_; }

 private:
  capture::Devices by_word_;
  capture::Robot* robot_;
  std::unique_ptr<capture::Robot> own_robot_;
  std::vector<std::unique_ptr<capture::CameraDevice>> own_cameras_;
  std::vector<capture::CameraDevice*> cameras_;
};

}  // namespace

lh_status lh_robot_create(lh_context* ctx, const lh_robot_functions* user, lh_robot** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const lh_robot_functions functions = read_struct(&given(user, "functions"), "functions");
    if (!functions.state || !functions.move_to) invalid("expected functions `state` and `move_to`", "functions");
    give(out, std::make_unique<OwnRobot>(functions), "");
  });
}

lh_status lh_camera_device_create(lh_context* ctx, const lh_camera_functions* user, lh_camera_device** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const lh_camera_functions functions = read_struct(&given(user, "functions"), "functions");
    if (!functions.shoot) invalid("expected a function `shoot`", "functions");
    give(out, std::make_unique<OwnCamera>(functions), "");
  });
}

lh_status lh_robot_by_word(lh_context* ctx, const char* word, lh_robot** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const std::string w(text(word, "word"));
    capture::check_robot_word(w);
    give(out, nullptr, w);
  });
}

lh_status lh_camera_device_by_word(lh_context* ctx, const char* word, lh_camera_device** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const std::string w(text(word, "word"));
    capture::check_camera_word(w);
    give(out, nullptr, w);
  });
}

lh_status lh_serial_link_open(lh_context* ctx, const char* device, uint32_t baud, lh_serial_link** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    capture::SerialOptions options;
    options.device = path(device, "device");
    options.baud = or_default(unsigned(baud), options.baud);
    give(out, capture::open_serial_link(options));
  });
}

void lh_serial_link_destroy(lh_serial_link* link) { delete link; }

lh_status lh_robot_serial(lh_context* ctx, const lh_serial_link* link, const lh_mechanism* mechanism, lh_robot** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, capture::open_serial_robot(given(link, "link").value, given(mechanism, "mechanism").value), "");
  });
}

lh_status lh_camera_device_serial(lh_context* ctx, const lh_serial_link* link, lh_camera_device** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, capture::open_serial_camera(given(link, "link").value), "");
  });
}

void lh_robot_destroy(lh_robot* robot) { delete robot; }
void lh_camera_device_destroy(lh_camera_device* camera) { delete camera; }

lh_status lh_session_dry_run(lh_context* ctx, const lh_plan* plan, lh_robot* robot, lh_camera_device* const* cameras,
                             size_t n, const char* folder, const lh_session_options* user, char* buffer, size_t size,
                             size_t* needed) {
  return guarded(ctx, [&](Job& job) {
    const lh_session_options o = read_struct(user, "options");
    capture::AbsentOperator nobody(o.agree_to_motion);
    const capture::Plan& p = given(plan, "plan").value.plan;
    const std::filesystem::path place = path(folder, "folder");
    SessionDevices devices(robot, cameras, n, p, place, nobody, job);
    const capture::DryRun found = capture::dry_run(p, devices.robot(), devices.cameras(), place, options_from(o));
    nlohmann::ordered_json json;
    json["problems"] = found.problems;
    json["notes"] = found.notes;
    json["left"] = found.left;
    json["seconds"] = found.seconds;
    give_text(json.dump(), buffer, size, needed);
  });
}

lh_status lh_session_run(lh_context* ctx, const lh_plan* plan, lh_robot* robot, lh_camera_device* const* cameras,
                         size_t n, const char* folder, const lh_session_options* user, const lh_operator* who,
                         lh_session_result* result) {
  return guarded(ctx, [&](Job& job) {
    const lh_session_options o = read_struct(user, "options");
    const auto person = operator_from(who, o.agree_to_motion);
    if (result) checked_struct_size(result->struct_size, "result");
    const capture::Plan& p = given(plan, "plan").value.plan;
    const std::filesystem::path place = path(folder, "folder");
    SessionDevices devices(robot, cameras, n, p, place, *person, job);
    const capture::SessionResult r =
        capture::capture(p, devices.robot(), devices.cameras(), place, options_from(o), *person, job);
    lh_session_result value{};
    value.views = r.views, value.of = r.of;
    value.taken = r.taken, value.awaited = r.awaited;
    value.paused = r.paused;
    if (result) write_struct(result, value, "result");
  });
}
