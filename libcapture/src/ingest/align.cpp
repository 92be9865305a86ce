// Which picture is which shot's: by the clock where there are times, else by the order that is left.

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "clock_fit.h"

namespace lumihull::capture {
namespace {

constexpr double kLeastGain = 4;           ///< a pair worth less is too far off to be believed
constexpr std::size_t kLeastPerClock = 6;  ///< fewer pairs may fit a clock by chance

using Couple = std::pair<std::size_t, std::size_t>;  // picture, shot

/// What one fit says: pairs that are sure, and pairs that are not.
struct Verdict {
  ClockFit fit;
  std::map<std::size_t, std::size_t> sure;  ///< place in fit.order -> index of the pair
  std::vector<Couple> open;                 ///< places and shots
};

Verdict judge(ClockFit fit, std::size_t shots, std::size_t pictures, bool clock_known) {
  Verdict out;
  std::set<Couple> plausible;
  std::vector<int> of_place(fit.order.size(), 0), of_shot(shots, 0);
  for (std::size_t n = 0; n < fit.pairs.size(); ++n)
    if (fit.chains.through[n] >= fit.chains.best - kMargin &&
        plausible.insert({fit.pairs[n].picture, fit.pairs[n].shot}).second) {
      ++of_place[fit.pairs[n].picture];
      ++of_shot[fit.pairs[n].shot];
    }
  const std::vector<std::size_t>& path = fit.chains.path;
  const bool complete = path.size() == shots && path.size() == pictures;
  for (std::size_t first = 0, end = 0; first < path.size(); first = end) {
    while (end < path.size() && fit.pairs[path[end]].clock == fit.pairs[path[first]].clock) ++end;
    for (std::size_t i = first; i < end; ++i) {
      const Pair& p = fit.pairs[path[i]];
      const bool sure = of_place[p.picture] == 1 && of_shot[p.shot] == 1 && p.gain >= kLeastGain &&
                        (complete || clock_known || end - first >= kLeastPerClock);
      if (!sure) continue;
      out.sure[p.picture] = path[i];
      plausible.erase({p.picture, p.shot});
    }
  }
  out.open.assign(plausible.begin(), plausible.end());
  out.fit = std::move(fit);
  return out;
}

/// By time; pictures without one stay behind the one before them.
std::vector<std::size_t> order_of_times(std::span<const CardPicture> pictures) {
  std::vector<std::size_t> order(pictures.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::vector<double> key;
  for (const CardPicture& p : pictures) key.push_back(p.clock_s ? *p.clock_s : key.empty() ? -1e300 : key.back());
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key[a] < key[b]; });
  return order;
}

/// Counters tell the order and the clock may have been set; or a counter was reset, and times tell the order. What
/// explains more is believed, what only one of two equals says is left open.
Verdict best_order(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures,
                   const AlignOptions& options, Job& job) {
  std::vector<std::size_t> counted(pictures.size());
  std::iota(counted.begin(), counted.end(), std::size_t(0));
  const auto verdict = [&](std::vector<std::size_t> order, bool may_be_set) {
    return judge(fit_clock(shots, pictures, std::move(order), may_be_set, options, job), shots.size(), pictures.size(),
                 options.clock_offset_s.has_value());
  };
  Verdict first = verdict(counted, true);
  std::vector<std::size_t> timed = order_of_times(pictures);
  if (timed == counted) return first;
  Verdict second = verdict(timed, false);
  if (second.fit.chains.best > first.fit.chains.best) std::swap(first, second);
  if (second.fit.chains.best < first.fit.chains.best - kMargin) return first;
  std::set<Couple> others;
  for (const auto& [place, n] : second.sure) others.insert({second.fit.order[place], second.fit.pairs[n].shot});
  for (auto at = first.sure.begin(); at != first.sure.end();) {
    const std::size_t shot = first.fit.pairs[at->second].shot;
    if (others.count({first.fit.order[at->first], shot})) {
      ++at;
      continue;
    }
    first.open.push_back({at->first, shot});
    at = first.sure.erase(at);
  }
  return first;
}

/// Pairs that are open, joined where they share a picture or a shot.
std::vector<Ambiguity> groups_of(const Verdict& v) {
  std::map<std::size_t, std::size_t> group_of_place, group_of_shot;
  std::vector<std::set<std::size_t>> places, shots;
  for (const auto& [place, shot] : v.open) {
    const auto a = group_of_place.find(place), b = group_of_shot.find(shot);
    std::size_t g = places.size();
    if (a != group_of_place.end())
      g = a->second;
    else if (b != group_of_shot.end())
      g = b->second;
    else {
      places.emplace_back();
      shots.emplace_back();
    }
    if (a != group_of_place.end() && b != group_of_shot.end() && a->second != b->second) {
      const std::size_t gone = b->second;
      for (const std::size_t p : places[gone]) group_of_place[p] = g;
      for (const std::size_t s : shots[gone]) group_of_shot[s] = g;
      places[g].merge(places[gone]);
      shots[g].merge(shots[gone]);
      places[gone].clear();
      shots[gone].clear();
    }
    places[g].insert(place);
    shots[g].insert(shot);
    group_of_place[place] = g;
    group_of_shot[shot] = g;
  }
  std::vector<Ambiguity> out;
  for (std::size_t g = 0; g < places.size(); ++g) {
    if (places[g].empty()) continue;
    Ambiguity one;
    one.shots.assign(shots[g].begin(), shots[g].end());
    for (const std::size_t p : places[g]) one.pictures.push_back(v.fit.order[p]);
    one.why = one.shots.size() == 1 && one.pictures.size() == 1
                  ? "their times are near one another, but too little speaks for it"
                  : "their times fit in more than one way";
    out.push_back(std::move(one));
  }
  return out;
}

/// Fills in what lies between pairs that are sure.
class Gaps {
 public:
  Gaps(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures, const Verdict& v, bool clock_known,
       Alignment& out)
      : shots_(shots),
        pictures_(pictures),
        clock_known_(clock_known),
        v_(v),
        out_(out),
        open_place_(v.fit.order.size(), 0),
        open_shot_(shots.size(), 0) {
    for (const auto& [place, shot] : v.open) open_place_[place] = open_shot_[shot] = 1;
  }

  void fill() {
    std::size_t place = 0, shot = 0, clock = kNoClock;
    for (const auto& [p, n] : v_.sure) {  // along the chain both rise
      const Pair& pair = v_.fit.pairs[n];
      gap(place, p, shot, pair.shot, clock == pair.clock);
      place = p + 1;
      shot = pair.shot + 1;
      clock = pair.clock;
    }
    gap(place, v_.fit.order.size(), shot, shots_.size(), clock_known_ && !v_.sure.empty());
  }

 private:
  static constexpr std::size_t kNoClock = std::size_t(-1);

  const CardPicture& picture(std::size_t place) const { return pictures_[v_.fit.order[place]]; }

  /// Whether the camera's counter ran on without a hole over places a … b.
  bool counted_on(std::size_t a, std::size_t b) const {
    for (std::size_t p = a; p < b; ++p) {
      const int now = picture(p).counter, next = picture(p + 1).counter;
      if ((now < 0) != (next < 0)) return false;
      if (now >= 0 && next != now + 1 && !(now == 9999 && next <= 1)) return false;
    }
    return true;
  }

  void leave_open(const std::vector<std::size_t>& places, const std::vector<std::size_t>& shots, std::string why) {
    Ambiguity one;
    one.shots = shots;
    for (const std::size_t p : places) one.pictures.push_back(v_.fit.order[p]);
    one.why = std::move(why);
    out_.ambiguous.push_back(std::move(one));
  }

  /// one_clock: the same clock ran before and after.
  void gap(std::size_t first_place, std::size_t end_place, std::size_t first_shot, std::size_t end_shot,
           bool one_clock) {
    std::vector<std::size_t> places, shots;
    bool open = false, untimed_shot = false, untimed_picture = false, doubt = false;
    for (std::size_t p = first_place; p < end_place; ++p) {
      open = open || open_place_[p];
      if (open_place_[p]) continue;
      places.push_back(p);
      untimed_picture = untimed_picture || !picture(p).clock_s;
    }
    for (std::size_t s = first_shot; s < end_shot; ++s) {
      if (shots_[s].state == ShotState::refused) continue;
      open = open || open_shot_[s];
      if (open_shot_[s]) continue;
      shots.push_back(s);
      untimed_shot = untimed_shot || !shots_[s].time_unix_s;
      doubt = doubt || shots_[s].state == ShotState::unknown;
    }
    constexpr std::size_t kFew = 2;
    // Where the clock was set, or may have been, what fits nothing that was found may fit what was not.
    if (!one_clock && !clock_known_ && !untimed_shot && !untimed_picture && places.size() + shots.size() > 0 &&
        (open || std::min(places.size(), shots.size()) >= kFew))
      return leave_open(places, shots, "their times fit no clock that is sure: was it set in between?");
    // Those whose times have spoken against all of the other side need no further look.
    const auto settled_place = [&](std::size_t p) { return picture(p).clock_s && !untimed_shot; };
    const auto settled_shot = [&](std::size_t s) { return shots_[s].time_unix_s && !untimed_picture; };
    for (const std::size_t p : places)
      if (settled_place(p)) out_.extra.push_back(v_.fit.order[p]);
    for (const std::size_t s : shots)
      if (settled_shot(s)) without_picture(s);
    std::erase_if(places, settled_place);
    std::erase_if(shots, settled_shot);
    if (places.empty() || shots.empty()) {
      for (const std::size_t p : places) out_.extra.push_back(v_.fit.order[p]);
      for (const std::size_t s : shots) without_picture(s);
      return;
    }
    const std::size_t from = first_place > 0 ? first_place - 1 : 0, to = std::min(end_place, v_.fit.order.size() - 1);
    bool contradicted = false;
    for (std::size_t i = 0; i < std::min(places.size(), shots.size()); ++i)
      contradicted = contradicted || (picture(places[i]).clock_s && shots_[shots[i]].time_unix_s);
    if (places.size() == shots.size() && !open && !doubt && !contradicted && counted_on(from, to)) {
      for (std::size_t i = 0; i < places.size(); ++i)
        out_.matches.push_back({shots[i], v_.fit.order[places[i]], true, 0});
      return;
    }
    leave_open(places, shots,
               std::to_string(shots.size()) + " shots and " + std::to_string(places.size()) +
                   " pictures, and not all of them have times");
  }

  void without_picture(std::size_t s) {
    (shots_[s].state == ShotState::unknown ? out_.not_made : out_.missing).push_back(s);
  }

  std::span<const ExpectedShot> shots_;
  std::span<const CardPicture> pictures_;
  bool clock_known_;
  const Verdict& v_;
  Alignment& out_;
  std::vector<char> open_place_, open_shot_;
};

void check_input(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures,
                 const AlignOptions& options) {
  constexpr double kMostSeconds = 1e11;  // the year 5138
  const auto good = [](double t) { return std::isfinite(t) && std::abs(t) <= kMostSeconds; };
  for (const ExpectedShot& s : shots)
    if (s.time_unix_s && !good(*s.time_unix_s))
      throw Error(ErrorCode::invalid_argument, "expected a time in seconds since 1970", s.stop);
  for (const CardPicture& p : pictures)
    if ((p.clock_s && !good(*p.clock_s)) || !(p.resolution_s >= 0 && p.resolution_s <= 60))
      throw Error(ErrorCode::invalid_argument, "expected a time in seconds since 1970 and a resolution up to 60 s",
                  p.files.empty() ? std::string() : p.files[0].string());
  if (options.clock_offset_s && !good(*options.clock_offset_s))
    throw Error(ErrorCode::invalid_argument, "expected a number of seconds", "clock_offset_s");
  if (!std::isfinite(options.clock_tolerance_s) || options.clock_tolerance_s <= 0)
    throw Error(ErrorCode::invalid_argument, "expected a positive number of seconds", "clock_tolerance_s");
}

}  // namespace

Alignment align_pictures(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures,
                         const AlignOptions& options, Job& job) {
  check_input(shots, pictures, options);
  const Verdict v = best_order(shots, pictures, options, job);
  Alignment out;
  out.ambiguous = groups_of(v);
  out.drift_ppm = v.fit.drift * 1e6;
  double squares = 0;
  std::size_t clock = std::size_t(-1);
  for (const auto& [place, n] : v.sure) {
    const Pair& p = v.fit.pairs[n];
    const double r = v.fit.residual(*middle_time(pictures[v.fit.order[place]]), *shots[p.shot].time_unix_s, p.clock);
    out.matches.push_back({p.shot, v.fit.order[place], false, r});
    squares += r * r;
    if (p.clock != clock) out.clocks.push_back({v.fit.order[place], v.fit.offsets_s[p.clock], 0});
    clock = p.clock;
    ++out.clocks.back().matches;
  }
  if (!out.matches.empty()) out.residual_s = std::sqrt(squares / double(out.matches.size()));
  Gaps(shots, pictures, v, options.clock_offset_s.has_value(), out).fill();
  std::sort(out.matches.begin(), out.matches.end(),
            [](const PictureOfShot& a, const PictureOfShot& b) { return a.shot < b.shot; });
  std::sort(out.missing.begin(), out.missing.end());
  std::sort(out.not_made.begin(), out.not_made.end());
  std::sort(out.extra.begin(), out.extra.end());
  return out;
}

}  // namespace lumihull::capture
