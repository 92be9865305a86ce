// What the events of a journal mean: which may follow, and what they change.

#include <lumihull/base/error.h>

#include <algorithm>

#include "journal_lines.h"

namespace lumihull::capture {

std::optional<std::size_t> JournalState::stop_index(std::string_view name) const {
  // Mostly the stop where the robot is, or the next one.
  const std::size_t n = head.stops.size(), from = at_stop.value_or(0);
  for (std::size_t k = 0; k < n; ++k)
    if (head.stops[(from + k) % n] == name) return (from + k) % n;
  return std::nullopt;
}

std::size_t JournalState::count(ShotStep step) const {
  return std::size_t(std::count_if(shots.begin(), shots.end(), [&](const ShotProgress& s) { return s.step == step; }));
}

std::size_t JournalState::views() const {
  return std::size_t(
      std::count_if(shots.begin(), shots.end(), [](const ShotProgress& s) { return !s.landed.empty(); }));
}

namespace internal {

namespace {

/// Looks before it changes anything.
class Applier {
 public:
  Applier(JournalState& state, const JournalEvent& event, const std::string& subject)
      : state_(state), event_(event), subject_(subject) {}

  void run() {
    if ((event_.kind == EventKind::begin) != (state_.events == 0)) fail("\"begin\" once, as the first event");
    switch (event_.kind) {
      case EventKind::begin:
      case EventKind::consent:
      case EventKind::fault:
      case EventKind::paused:
      case EventKind::stopped:
      case EventKind::finished:
        break;
      case EventKind::session:
        ++state_.sessions;
        break;
      case EventKind::moving:
      case EventKind::declared:
        state_.at_stop = stop();
        state_.moving = event_.kind == EventKind::moving;
        break;
      case EventKind::arrived:
        if (state_.at_stop != stop()) fail("\"moving\" to this stop before");
        state_.moving = false;
        state_.arrived_at = state_.at_stop;
        break;
      case EventKind::firing:
        firing();
        break;
      case EventKind::done:
        of_shot({ShotStep::firing, ShotStep::unknown}).step = ShotStep::done;
        break;
      case EventKind::refused:
        ended(of_shot({ShotStep::firing, ShotStep::unknown}), ShotStep::refused);
        break;
      case EventKind::unknown:
        ended(of_shot({ShotStep::firing}), ShotStep::unknown);
        break;
      case EventKind::decided:
        decided();
        break;
      case EventKind::file:
        landed();
        break;
      case EventKind::retake:
        retake();
        break;
    }
    ++state_.events;
    state_.last = event_.kind;
    state_.last_time = event_.time;
  }

 private:
  [[noreturn]] void fail(const std::string& expected) const {
    throw Error(ErrorCode::bad_input, "an event that can't follow: expected " + expected, subject_);
  }

  std::size_t stop() const {
    const auto index = state_.stop_index(event_.stop);
    if (!index) fail("a stop of the plan, found \"" + event_.stop + "\"");
    return *index;
  }

  ShotProgress& of_shot(std::initializer_list<ShotStep> allowed) {
    const auto found = state_.by_id.find(event_.shot);
    if (found == state_.by_id.end() || state_.shots[found->second].take.shot != event_.shot)
      fail("the number of a shot that is under way");
    ShotProgress& shot = state_.shots[found->second];
    if (std::find(allowed.begin(), allowed.end(), shot.step) == allowed.end())
      fail("a shot in another state for this event");
    return shot;
  }

  void ended(ShotProgress& shot, ShotStep step) {
    shot.step = step;
    shot.detail = event_.text;
  }

  void firing() {
    const auto& cameras = state_.head.cameras;
    const auto camera = std::find(cameras.begin(), cameras.end(), event_.camera);
    if (camera == cameras.end()) fail("a camera of the plan, found \"" + event_.camera + "\"");
    const std::size_t index = state_.index(stop(), std::size_t(camera - cameras.begin()));
    ShotProgress& shot = state_.shots[index];
    if (shot.step != ShotStep::waiting && shot.step != ShotStep::refused)
      fail("a photograph that is still to be taken");
    const bool again = shot.step == ShotStep::refused;
    if (again ? event_.shot != shot.take.shot : event_.shot <= state_.last_id)
      fail(again ? "the number of the refused shot" : "a new number");
    if (!again) shot.take = {};
    shot.step = ShotStep::firing;
    shot.detail.clear();
    shot.take.shot = event_.shot;
    ++shot.take.attempts;
    shot.take.time = event_.time;
    shot.take.settle_s = event_.settle_s;
    shot.take.exposure_s = event_.exposure_s;
    shot.take.lengths_m = event_.lengths_m;
    state_.by_id[event_.shot] = index;
    state_.last_id = std::max(state_.last_id, event_.shot);
  }

  void decided() {
    if (event_.answer != "taken" && event_.answer != "again") fail("\"taken\" or \"again\"");
    // Also of one that was taken, where the file never came.
    ShotProgress& shot = of_shot({ShotStep::unknown, ShotStep::done});
    shot.step = event_.answer == "taken" ? ShotStep::done : ShotStep::waiting;
    shot.take.confirmed = event_.answer == "taken";
  }

  void landed() {
    if (event_.file.empty() || state_.files.contains(event_.file)) fail("a file name that was not given before");
    ShotProgress& shot = of_shot({ShotStep::done});
    state_.files.insert(event_.file);
    shot.step = ShotStep::landed;
    shot.take.file = event_.file;
    shot.take.size = event_.size;
    shot.take.sha256 = event_.sha256;
    shot.landed.push_back(shot.take);
  }

  void retake() {
    const std::size_t at = stop();
    for (std::size_t c = 0; c < state_.head.cameras.size(); ++c) {
      ShotProgress& shot = state_.shots[state_.index(at, c)];
      if (shot.step == ShotStep::done || shot.step == ShotStep::landed) shot.step = ShotStep::waiting;
    }
  }

  JournalState& state_;
  const JournalEvent& event_;
  const std::string& subject_;
};

}  // namespace

void apply(JournalState& state, const JournalEvent& event, const std::string& subject) {
  Applier(state, event, subject).run();
}

}  // namespace internal
}  // namespace lumihull::capture
