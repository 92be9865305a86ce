// The capture itself: move, settle, release, store; and the way back into one that was killed.

#include <lumihull/base/error.h>
#include <lumihull/capture/session.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <thread>

#include "contact_sheet.h"
#include "photographs.h"
#include "stored_plan.h"
#include "way_out.h"

namespace lumihull::capture {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Waits in short pieces, so that a wish to stop is heard.
void wait(double seconds, Job& job) {
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  for (;;) {
    job.check();
    const auto now = Clock::now();
    if (now >= end) return;
    std::this_thread::sleep_for(std::min<Clock::duration>(end - now, std::chrono::milliseconds(20)));
  }
}

/// However a session ends: motors and solenoid off, cameras released.
class SafeEnd {
 public:
  SafeEnd(Robot& robot, std::span<CameraDevice* const> cameras) : robot_(robot), cameras_(cameras) {}
  SafeEnd(const SafeEnd&) = delete;
  SafeEnd& operator=(const SafeEnd&) = delete;
  ~SafeEnd() {
    robot_.make_safe();
    for (CameraDevice* camera : cameras_) camera->make_safe();
  }

 private:
  Robot& robot_;
  std::span<CameraDevice* const> cameras_;
};

/// The last move of a session that was killed may still be under way, with nobody who watches over it.
void end_old_move(Robot& robot, Operator& who, Job& job) {
  constexpr double kPatience_s = 5;
  try {
    if (!robot.state().moving) return;
    robot.make_safe();
    who.tell("the robot was still on the way of an earlier session; it was stopped");
    for (const auto start = Clock::now(); robot.state().moving && seconds_since(start) < kPatience_s;) wait(0.05, job);
  } catch (const Error& e) {
    if (e.code() == ErrorCode::cancelled) throw;  // the dry run finds all else
  }
}

class Session {
 public:
  Session(const Plan& plan, Robot& robot, std::span<CameraDevice* const> cameras, const fs::path& folder,
          const SessionOptions& options, Operator& who, Job& job, Journal& journal)
      : plan_(plan),
        robot_(robot),
        cameras_(cameras),
        folder_(folder),
        options_(options),
        who_(who),
        job_(job),
        journal_(journal),
        sheet_(folder) {}

  SessionResult run() {
    journal_.append({.kind = EventKind::session, .text = description()});
    try {
      go_on();
      journal_.append({.kind = result_.paused ? EventKind::paused : EventKind::finished});
      update_pages(result_.paused ? "paused" : left() == 0 ? "finished" : "ended", true);
    } catch (const Error& e) {
      leave_word(e);
      throw;
    }
    result_.views = state().views();
    result_.of = std::size_t(
        std::count_if(plan_.stops.begin(), plan_.stops.end(), [](const PlannedStop& s) { return s.photograph; }));
    result_.of *= plan_.cameras.size();
    result_.awaited = state().count(ShotStep::done);
    return result_;
  }

 private:
  const JournalState& state() const { return journal_.state(); }
  std::size_t cameras() const { return plan_.cameras.size(); }

  bool wanted(std::size_t shot) const {
    const ShotStep step = state().shots[shot].step;
    if (!options_.retake.empty() && plan_.stops[shot / cameras()].name != options_.retake) return false;
    return step == ShotStep::waiting || step == ShotStep::refused;
  }
  bool wanted_at(std::size_t stop) const {
    for (std::size_t c = 0; c < cameras(); ++c)
      if (wanted(stop * cameras() + c)) return true;
    return false;
  }
  std::size_t left() const {
    std::size_t n = 0;
    for (std::size_t i = 0; i < state().shots.size(); ++i) n += wanted(i);
    return n;
  }
  double settle_s(const PlannedStop& stop) const { return options_.settle_s.value_or(stop.settle_s); }
  double exposure_s(const PlannedStop& stop) const { return options_.exposure_s.value_or(stop.exposure_s); }

  double planned_seconds_left() const {
    double sum = 0;
    for (std::size_t stop = 0; stop < plan_.stops.size(); ++stop) {
      double here = 0;
      for (std::size_t c = 0; c < cameras(); ++c)
        if (wanted(stop * cameras() + c)) here += exposure_s(plan_.stops[stop]);
      if (wanted_at(stop)) sum += here + plan_.stops[stop].travel_s + settle_s(plan_.stops[stop]);
    }
    return sum;
  }

  std::string description() const {
    char text[160];
    std::snprintf(text, sizeof text, "; retries %d%s%s", options_.retries,
                  options_.retake.empty() ? "" : "; retake of ", options_.retake.c_str());
    std::string out = (options_.devices.empty() ? "robot " + plan_.robot : options_.devices) + text;
    if (options_.settle_s) out += "; settle " + std::to_string(*options_.settle_s) + " s";
    if (options_.exposure_s) out += "; exposure " + std::to_string(*options_.exposure_s) + " s";
    return out;
  }

  std::string ask(const Question& question) {
    const std::string answer = who_.ask(question, job_);
    journal_.append({.kind = EventKind::consent, .answer = answer, .text = question.text});
    if (answer == "stop") throw Error(ErrorCode::cancelled, "stopped by the operator", question.text);
    return answer;
  }

  /// What failed is kept as far as the disk still takes it; the error itself matters more than what fails here.
  void leave_word(const Error& error) {
    const bool wish = error.code() == ErrorCode::cancelled;
    robot_.make_safe();
    try {
      journal_.append({.kind = wish ? EventKind::stopped : EventKind::fault, .text = error.what()});
      update_pages(std::string(wish ? "stopped: " : "stopped by a fault: ") + error.what(), true);
    } catch (const std::exception&) {
    }
  }

  // ---- what an earlier session left --------------------------------------------------------------------------------

  void go_on() {
    const bool begun = state().sessions > 1;
    for (std::size_t i = 0; i < state().shots.size(); ++i) settle_earlier(i);
    if (!options_.retake.empty()) journal_.append({.kind = EventKind::retake, .stop = options_.retake});
    if (left() == 0) return;
    agree_to_move(begun);
    planned_at_start_ = planned_seconds_left();
    started_ = Clock::now();
    job_.begin("photographing", left());
    update_pages("going on", true);
    for (std::size_t stop = 0; stop < plan_.stops.size() && !result_.paused; ++stop)
      if (wanted_at(stop)) visit(stop);
    if (!result_.paused) job_.end();
  }

  void settle_earlier(std::size_t i) {
    const ShotProgress& shot = state().shots[i];
    if (shot.step == ShotStep::firing || shot.step == ShotStep::unknown) resolve(i, "the session ended in between");
    if (shot.step == ShotStep::done && !shot.take.confirmed && cameras_[i % cameras()]->delivers_files()) {
      const ShotId id = shot.take.shot;
      ShotOutcome outcome = cameras_[i % cameras()]->recall(id);
      if (outcome.file.empty())
        if (const auto picture = internal::arrived_picture(folder_, id)) outcome.file = *picture;
      deliver(i, outcome);
    }
    if (shot.step == ShotStep::landed && !internal::put_in_place(folder_, shot.take)) {
      const std::string title = "photos/" + shot.take.file + " landed, but is gone or was changed";
      ask({Question::About::doubt,
           title + ": photograph " + plan_.stops[i / cameras()].name + " again?",
           {"again", "stop"}});
      journal_.append({.kind = EventKind::retake, .stop = plan_.stops[i / cameras()].name, .text = title});
    }
  }

  /// A shot in doubt: the device's own log, then what arrived, then the operator.
  void resolve(std::size_t i, const std::string& why) {
    const ShotId id = state().shots[i].take.shot;
    ShotOutcome outcome = cameras_[i % cameras()]->recall(id);
    if (outcome.state == ShotState::unknown) {
      if (const auto picture = internal::arrived_picture(folder_, id)) {
        outcome.state = ShotState::done;
        outcome.file = *picture;
      }
    }
    if (outcome.state == ShotState::refused) {
      journal_.append({.kind = EventKind::refused, .shot = id, .text = outcome.detail});
    } else if (outcome.state == ShotState::done) {
      journal_.append({.kind = EventKind::done, .shot = id});
      if (!outcome.file.empty()) land_photograph(journal_, folder_, id, outcome.file);
    } else {
      if (state().shots[i].step == ShotStep::firing)
        journal_.append(
            {.kind = EventKind::unknown, .shot = id, .text = outcome.detail.empty() ? why : outcome.detail});
      decide(i, "whether " + title(i) + " (shot " + std::to_string(id) + ") was taken is not known: " + why);
    }
  }

  void decide(std::size_t i, const std::string& text) {
    const ShotId id = state().shots[i].take.shot;
    const std::string answer =
        ask({Question::About::doubt, text + ". Photograph it again, or was it taken?", {"again", "taken", "stop"}});
    journal_.append({.kind = EventKind::decided, .shot = id, .answer = answer});
  }

  std::string title(std::size_t i) const { return internal::shot_title(state(), i); }

  // ---- where the robot is ------------------------------------------------------------------------------------------

  void agree_to_move(bool begun) {
    const Robot::State robot = robot_.state();
    if (!robot.fault.empty()) throw Error(ErrorCode::io, "the robot reports: " + robot.fault, "robot");
    std::size_t next = 0;
    while (!wanted_at(next)) ++next;
    if (const auto last = state().arrived_at)  // the bearing is locked: it stays as it was
      if (!state().moving || plan_.stops[*state().at_stop].roll_rad == plan_.stops[*last].roll_rad)
        roll_rad_ = plan_.stops[*last].roll_rad;
    if (!plan_.mechanism) {
      if (!state().moving) at_ = state().at_stop;
    } else if (robot.position_known && (at_ = internal::stop_of_lengths(plan_, robot.lengths_m))) {
      if (state().at_stop != at_ || state().moving)
        journal_.append({.kind = EventKind::declared, .stop = plan_.stops[*at_].name});
    } else if (robot.position_known && state().at_stop) {
      const std::size_t to = *state().at_stop, from = state().arrived_at.value_or(to);
      between_ = internal::pose_between(plan_, from, to, robot.lengths_m);
    }
    if (plan_.mechanism && !at_ && !between_) declare(next);
    keep_out_first_ = begun;
    char text[240];
    std::snprintf(text, sizeof text, "%s: %zu photographs to take, about %.0f min. The robot will move%s%s; first to ",
                  begun ? "go on" : "begin", left(), std::ceil(planned_seconds_left() / 60),
                  at_ || between_ ? " from " : "",
                  at_        ? plan_.stops[*at_].name.c_str()
                  : between_ ? "a place between two stops"
                             : "");
    ask({Question::About::motion, text + plan_.stops[next].name + ". Is the way free?", {"move", "stop"}});
  }

  void declare(std::size_t next) {
    Question question{Question::About::position,
                      "the robot's position is not known. Drive the platform to one of these stops, and say which",
                      {}};
    const auto offer = [&](std::size_t stop) {
      if (std::find(question.choices.begin(), question.choices.end(), plan_.stops[stop].name) == question.choices.end())
        question.choices.push_back(plan_.stops[stop].name);
    };
    if (state().arrived_at) offer(*state().arrived_at);
    if (state().at_stop) offer(*state().at_stop);
    offer(next);
    offer(0);
    question.choices.push_back("stop");
    const std::string answer = ask(question);
    at_ = state().stop_index(answer);
    if (!at_) throw Error(ErrorCode::invalid_argument, "expected one of the stops that were offered", answer);
    robot_.declare_position(plan_.stops[*at_]);
    journal_.append({.kind = EventKind::declared, .stop = answer});
  }

  /// The stop before which the plan has the camera turned to what it is at `stop`.
  std::size_t turning_stop(std::size_t stop) const {
    while (stop > 0 && plan_.stops[stop - 1].roll_rad == plan_.stops[stop].roll_rad) --stop;
    return stop;
  }

  void go_to(std::size_t stop) {
    if (plan_.mechanism && roll_rad_ != plan_.stops[stop].roll_rad)
      if (const std::size_t turn = turning_stop(stop); turn != stop) travel(turn);
    travel(stop);
  }

  void travel(std::size_t stop) {
    // The plan's own ways were checked: they are taken where nothing but places to pass lies in between.
    bool as_planned = at_ == stop || !plan_.mechanism || (at_ && *at_ < stop && !keep_out_first_);
    for (std::size_t i = at_.value_or(stop) + 1; i < stop; ++i) as_planned &= !plan_.stops[i].photograph;
    if (!plan_.mechanism) {
      go({plan_.stops[stop]}, stop);
    } else if (!as_planned) {
      go(unplanned_way(stop), stop);
    } else {
      const std::size_t from = *at_;
      for (std::size_t i = std::min(from + 1, stop); i <= stop; ++i) go({plan_.stops[i]}, i);
    }
  }

  /// Straight up, over the object and down; where tensions do not allow that, along the plan's own ways, which were
  /// checked and may be gone back.
  std::vector<PlannedStop> unplanned_way(std::size_t stop) {
    const Pose& from = at_ ? plan_.stops[*at_].world_from_platform : between_.value();
    const std::size_t second = state().at_stop.value_or(stop), first = state().arrived_at.value_or(second);
    const std::size_t low = std::min(first, second), high = std::max(first, second);
    try {
      return internal::way_out(plan_, from, plan_.stops[stop]);
    } catch (const Error& e) {
      if (e.code() != ErrorCode::degenerate) throw;
      if (!at_ && high - low > 1)
        throw Error(e.code(), e.message() + ": drive the platform by hand to a stop nearer to it, and declare that one",
                    e.subject());
      who_.tell("to " + std::string(e.what()) + ": the robot goes along the plan's own ways instead");
    }
    // From between two neighbours: to that of the two which lies towards where it should go.
    const std::size_t begin = at_ ? *at_ : stop >= high ? high : low;
    std::vector<PlannedStop> way;
    if (!at_ && begin != stop) way.push_back(plan_.stops[begin]);
    for (std::size_t i = begin; i != stop;) way.push_back(plan_.stops[i < stop ? ++i : --i]);
    if (way.empty()) way.push_back(plan_.stops[stop]);
    return way;
  }

  void go(const std::vector<PlannedStop>& way, std::size_t stop) {
    const PlannedStop& there = plan_.stops[stop];
    const bool move = at_ != stop, turn = roll_rad_ != there.roll_rad;
    job_.check();
    if (move) {
      if (!there.pause.empty()) ask({Question::About::task, there.pause, {"done", "stop"}});
      journal_.append({.kind = EventKind::moving, .stop = there.name});
      for (const PlannedStop& part : way) robot_.move_to(part, job_);
      keep_out_first_ = false;
    }
    if (turn) {
      roll_rad_.reset();
      robot_.set_roll(there.roll_rad, job_);
      roll_rad_ = there.roll_rad;
    }
    if (move || turn) journal_.append({.kind = EventKind::arrived, .stop = there.name});
    at_ = stop;
  }

  // ---- photographs -------------------------------------------------------------------------------------------------

  void visit(std::size_t stop) {
    go_to(stop);
    if (options_.settle)
      options_.settle(settle_s(plan_.stops[stop]), job_);
    else
      wait(settle_s(plan_.stops[stop]), job_);
    for (std::size_t c = 0; c < cameras() && !result_.paused; ++c) {
      if (!wanted(stop * cameras() + c)) continue;
      take(stop, c);
      ++result_.taken;
      job_.advance();
      update_pages("going on", false);
      result_.paused = options_.pause_after && result_.taken >= options_.pause_after && left() > 0;
      job_.check();
    }
  }

  void check_space() const {
    std::error_code error;
    const fs::space_info space = fs::space(folder_, error);
    if (!error && space.available < options_.least_free_bytes)
      throw Error(ErrorCode::io,
                  "only " + std::to_string(space.available / 1'000'000) +
                      " MB are left on the disk; make room, then go on with the same command",
                  folder_.string());
  }

  void take(std::size_t stop, std::size_t c) {
    const PlannedStop& there = plan_.stops[stop];
    const std::size_t i = stop * cameras() + c;
    for (int refusals = 0; wanted(i);) {
      check_space();
      job_.check();
      const ShotId id = state().shots[i].step == ShotStep::refused ? state().shots[i].take.shot : state().last_id + 1;
      const fs::path incoming = internal::incoming_folder(folder_, id);
      std::error_code error;
      fs::create_directories(incoming, error);
      if (error) throw Error(ErrorCode::io, "can't make the folder: " + error.message(), incoming.string());
      journal_.append({.kind = EventKind::firing,
                       .stop = there.name,
                       .camera = plan_.cameras[c],
                       .shot = id,
                       .settle_s = settle_s(there),
                       .exposure_s = exposure_s(there),
                       .lengths_m = there.lengths_m});
      // An exposure under way is waited for even after Ctrl-C: else it would be in doubt.
      Job shutter({}, job_.threads());
      const ShotOutcome outcome = cameras_[c]->shoot(id, exposure_s(there), incoming, shutter);
      switch (outcome.state) {
        case ShotState::done:
          journal_.append({.kind = EventKind::done, .shot = id});
          if (cameras_[c]->delivers_files()) deliver(i, outcome);
          break;
        case ShotState::refused:
          journal_.append({.kind = EventKind::refused, .shot = id, .text = outcome.detail});
          fs::remove(incoming, error);  // nothing came: only where it is empty
          if (refusals++ >= options_.retries)
            throw Error(ErrorCode::io,
                        "the camera refused " + std::to_string(refusals) +
                            " times: " + (outcome.detail.empty() ? "no reason given" : outcome.detail),
                        title(i));
          wait(options_.retry_after_s, job_);
          break;
        case ShotState::unknown:
          journal_.append({.kind = EventKind::unknown, .shot = id, .text = outcome.detail});
          resolve(i, outcome.detail.empty() ? "the camera did not answer" : outcome.detail);
          break;
      }
    }
    if (!cameras_[c]->delivers_files() && state().shots[i].step == ShotStep::done) {
      std::error_code ignored;
      fs::remove(internal::incoming_folder(folder_, state().shots[i].take.shot), ignored);
    }
  }

  /// The file of a shot that was taken, where the camera brings it.
  void deliver(std::size_t i, const ShotOutcome& outcome) {
    const ShotId id = state().shots[i].take.shot;
    std::string why = "its file did not come" + (outcome.detail.empty() ? "" : ": " + outcome.detail);
    if (!outcome.file.empty()) {
      try {
        land_photograph(journal_, folder_, id, outcome.file);
        return;
      } catch (const Error& e) {
        if (e.code() != ErrorCode::bad_input || state().shots[i].step == ShotStep::landed ||
            internal::arrived_picture(folder_, id))
          throw;
        why = e.what();
      }
    }
    decide(i, title(i) + " (shot " + std::to_string(id) + ") was taken, but " + why);
  }

  // ---- for people --------------------------------------------------------------------------------------------------

  void update_pages(const std::string& status, bool now) {
    if (!now && seconds_since(last_pages_) < options_.page_every_s) return;
    update_capture(folder_, plan_, state(), options_.intrinsics);
    double seconds = planned_seconds_left();
    const double planned = planned_at_start_ - seconds;  // what was done, by the plan
    if (planned > 0 && result_.taken > 0) seconds *= seconds_since(started_) / planned;
    sheet_.write(plan_, state(), status, status == "going on" ? seconds : -1);
    last_pages_ = Clock::now();
  }

  const Plan& plan_;
  Robot& robot_;
  std::span<CameraDevice* const> cameras_;
  const fs::path& folder_;
  const SessionOptions& options_;
  Operator& who_;
  Job& job_;
  Journal& journal_;
  internal::ContactSheet sheet_;
  SessionResult result_;
  std::optional<std::size_t> at_;  ///< the stop where the robot is
  std::optional<Pose> between_;    ///< where it is, if at no stop
  std::optional<double> roll_rad_;
  bool keep_out_first_ = false;  ///< after a restart: the first way leads straight up
  double planned_at_start_ = 0;
  Clock::time_point started_ = Clock::now(), last_pages_{};
};

}  // namespace

SessionResult capture(const Plan& plan, Robot& robot, std::span<CameraDevice* const> cameras, const fs::path& folder,
                      const SessionOptions& options, Operator& who, Job& job) {
  const SafeEnd safe_end(robot, cameras);
  end_old_move(robot, who, job);
  const DryRun checked = dry_run(plan, robot, cameras, folder, options);
  if (!checked.problems.empty())
    throw Error(
        ErrorCode::bad_input,
        checked.problems.front() +
            (checked.problems.size() > 1 ? " (and " + std::to_string(checked.problems.size() - 1) + " more)" : ""),
        "dry run");
  for (const std::string& note : checked.notes) who.tell(note);
  const SessionLock lock(folder);
  Journal journal = internal::stored_state(folder, plan) ? Journal::open(journal_path(folder))
                                                         : internal::begin(folder, plan, options.names);
  return Session(plan, robot, cameras, folder, options, who, job, journal).run();
}

}  // namespace lumihull::capture
