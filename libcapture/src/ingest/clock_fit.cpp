#include "clock_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clock_vote.h"

namespace lumihull::capture {
namespace {

constexpr std::size_t kFirstClocks =
    12;                                 ///< offsets of all times; those of a regular capture are rivals of one another
constexpr std::size_t kMoreClocks = 6;  ///< of what the first ones leave over: clocks that were set in between
constexpr std::size_t kMostClocks = 60;
constexpr int kMostRounds = 8;
constexpr double kMostDrift = 5e-4;
// Of residuals. Whole seconds may be cut alike for a hundred pictures that follow a beat and otherwise for the next
// one: their spread is not what it looks like.
constexpr double kLeastSpread_s = 0.2, kLeastOfSeconds_s = 0.45, kMostSpread_s = 0.6;
constexpr double kUnknownCost = 0.6931;  ///< an exposure in doubt is as likely as not

// A clock that is set by whole quarters of an hour (summer time, time zones) is likelier than one set at random, but
// not by much: among many rivals some step comes near a quarter by chance.
constexpr double kZoneStep_s = 900, kMostZone_s = 14 * 3600, kZoneSlack_s = 1;
constexpr double kZoneCost = 40, kSetCost = 50, kNever = 1e12;

double step_cost(double from_s, double to_s) {
  const double step = std::abs(to_s - from_s), quarters = std::round(step / kZoneStep_s);
  const bool zone = quarters >= 1 && step < kMostZone_s && std::abs(step - quarters * kZoneStep_s) < kZoneSlack_s;
  return zone ? kZoneCost : kSetCost;
}

double median(std::vector<double> values, double fallback) {
  if (values.empty()) return fallback;
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Fitter {
 public:
  Fitter(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures, std::vector<std::size_t> order,
         bool may_be_set, const AlignOptions& options, Job& job)
      : shots_(shots), pictures_(pictures), may_be_set_(may_be_set), options_(options), job_(job) {
    fit_.order = std::move(order);
    for (std::size_t j = 0; j < shots.size(); ++j)
      if (shots[j].time_unix_s && shots[j].state != ShotState::refused) timed_.push_back({*shots[j].time_unix_s, j});
    std::stable_sort(timed_.begin(), timed_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<double> intervals;
    for (std::size_t i = 1; i < timed_.size(); ++i)
      if (timed_[i].first > timed_[i - 1].first) intervals.push_back(timed_[i].first - timed_[i - 1].first);
    interval_s_ = median(intervals, 10);
    constexpr double kCoarse_s = 0.5;
    for (const CardPicture& p : pictures)
      if (p.resolution_s > kCoarse_s) least_spread_s_ = kLeastOfSeconds_s;
    if (!timed_.empty()) fit_.reference_s = timed_.front().first;
  }

  ClockFit run() {
    for (int round = 0; round < kMostRounds; ++round) {
      job_.check();
      const double drift = fit_.drift, spread = spread_s_, missing = missing_cost_, extra = extra_cost_;
      if (round == 0 || moved_) find_clocks();
      chain();
      estimate();
      moved_ = std::abs(fit_.drift - drift) * span_s() > 0.05;
      if (!moved_ && std::abs(spread_s_ - spread) < 0.02 && std::abs(missing_cost_ - missing) < 0.1 &&
          std::abs(extra_cost_ - extra) < 0.1)
        break;
    }
    chain();
    return std::move(fit_);
  }

 private:
  double span_s() const { return timed_.empty() ? 0 : timed_.back().first - timed_.front().first; }
  std::optional<double> time(std::size_t place) const { return middle_time(pictures_[fit_.order[place]]); }

  /// Of offsets with at least half of the most votes: on both sides of `near` the 1st, 2nd, 3rd, 5th, 8th, …
  static std::vector<ClockOffset> around(double near, std::vector<ClockOffset> voted) {
    std::vector<ClockOffset> out;
    if (voted.empty()) return out;
    std::erase_if(voted, [most = voted[0].votes](const ClockOffset& o) { return 2 * o.votes < most; });
    std::sort(voted.begin(), voted.end(),
              [](const ClockOffset& a, const ClockOffset& b) { return a.offset_s < b.offset_s; });
    const auto split = std::partition_point(
        voted.begin(), voted.end(), [&](const ClockOffset& o) { return o.offset_s < near - kVoteWindow_s / 2; });
    const auto below = std::size_t(split - voted.begin());
    for (std::size_t step = 1, next = 2; step <= voted.size(); step = std::exchange(next, step + next)) {
      if (step <= below) out.push_back(voted[below - step]);
      if (below + step - 1 < voted.size()) out.push_back(voted[below + step - 1]);
    }
    return out;
  }

  /// Offsets of those pictures and shots that `used` does not name, added to the clocks: the first `most` by votes, or
  /// those around `near`. Returns how many are new.
  std::size_t add_clocks(const std::vector<char>& used_places, const std::vector<char>& used_shots, std::size_t most,
                         std::optional<double> near = std::nullopt) {
    std::vector<double> ours, theirs;
    for (std::size_t i = 0; i < fit_.order.size(); ++i)
      if (const auto t = time(i); t && !used_places[i]) ours.push_back(*t);
    for (const auto& [t, j] : timed_)
      if (!used_shots[j]) theirs.push_back(t + fit_.drift * (t - fit_.reference_s));
    constexpr std::size_t kMostNear = 200;
    std::vector<ClockOffset> voted = vote_offsets(ours, theirs, near ? kMostNear : most);
    if (near) voted = around(*near, std::move(voted));
    std::size_t added = 0;
    for (const ClockOffset& o : voted) {
      if (options_.clock_offset_s && std::abs(o.offset_s - *options_.clock_offset_s) > options_.clock_tolerance_s)
        continue;
      const bool known = std::any_of(fit_.offsets_s.begin(), fit_.offsets_s.end(),
                                     [&](double k) { return std::abs(k - o.offset_s) < kVoteWindow_s; });
      if (known || fit_.offsets_s.size() >= kMostClocks) continue;
      fit_.offsets_s.push_back(o.offset_s);
      ++added;
    }
    return added;
  }

  void find_clocks() {
    fit_.offsets_s.clear();
    std::vector<char> places(fit_.order.size(), 0), shots(shots_.size(), 0);
    add_clocks(places, shots, kFirstClocks);
    settle_clocks(0);
    for (int again = 0; again < 3; ++again) {
      job_.check();
      chain();
      for (const std::size_t n : fit_.chains.path) {
        places[fit_.pairs[n].picture] = 1;
        shots[fit_.pairs[n].shot] = 1;
      }
      const std::size_t before = fit_.offsets_s.size();
      if (add_clocks(places, shots, kMoreClocks) == 0) break;
      settle_clocks(before);
    }
    constexpr int kMostSteps = 40;
    for (int step = 0; step < kMostSteps && add_rivals(); ++step) job_.check();
  }

  /// Each stretch of the chain may have rivals of its own that all the rest outvoted: a regular capture looks the same
  /// one beat later. True where one of them is better, so that this is to be asked again.
  bool add_rivals() {
    chain();
    const double best = fit_.chains.best;
    forget_hopeless();
    const std::size_t before = fit_.offsets_s.size();
    for (std::size_t clock = 0; clock < before; ++clock) {
      std::vector<char> others(fit_.order.size(), 1);
      std::size_t own = 0;
      for (const std::size_t n : fit_.chains.path)
        if (fit_.pairs[n].clock == clock) {
          others[fit_.pairs[n].picture] = 0;
          ++own;
        }
      if (own > 0) add_clocks(others, std::vector<char>(shots_.size(), 0), 0, fit_.offsets_s[clock]);
    }
    settle_clocks(before);
    if (fit_.offsets_s.size() > before) chain();
    return fit_.chains.best > best + 1e-6;
  }

  /// Takes out clocks that no chain near the best one follows.
  void forget_hopeless() {
    constexpr double kHopeless = 60;
    std::vector<double> through(fit_.offsets_s.size(), -1);
    for (std::size_t n = 0; n < fit_.pairs.size(); ++n)
      through[fit_.pairs[n].clock] = std::max(through[fit_.pairs[n].clock], fit_.chains.through[n]);
    std::vector<double> kept;
    for (std::size_t clock = 0; clock < through.size(); ++clock)
      if (through[clock] >= fit_.chains.best - kHopeless) kept.push_back(fit_.offsets_s[clock]);
    if (kept.size() == fit_.offsets_s.size()) return;
    fit_.offsets_s = std::move(kept);
    chain();
  }

  /// Each clock's offset from its own best chain: else a rival would look worse than it is.
  void settle_clocks(std::size_t first) {
    constexpr int kSteps = 2;
    const std::vector<double> free{0};
    for (std::size_t clock = first; clock < fit_.offsets_s.size(); ++clock)
      for (int step = 0; step < kSteps; ++step) {
        std::vector<Pair> pairs;
        pairs_of(clock, pairs);
        for (Pair& p : pairs) p.clock = 0;
        const Chains own = heaviest_chains(pairs, shots_.size(), 1, free);
        std::vector<double> residuals;
        for (const std::size_t n : own.path) residuals.push_back(residual(pairs[n], clock));
        fit_.offsets_s[clock] += mean(residuals);
      }
  }

  static double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return values.empty() ? 0 : sum / double(values.size());
  }

  double residual(const Pair& p, std::size_t clock) const {
    return fit_.residual(*time(p.picture), *shots_[p.shot].time_unix_s, clock);
  }

  /// Log-likelihood of "this picture is that shot's" less that of "an extra picture and a shot without one".
  double gain(double residual_s, const ExpectedShot& shot) const {
    const double missing = shot.state == ShotState::unknown ? kUnknownCost : missing_cost_;
    const double density = std::log(std::max(1.0, interval_s_ / (2.5 * spread_s_)));
    return missing + extra_cost_ + density - residual_s * residual_s / (2 * spread_s_ * spread_s_);
  }

  /// Appends the pairs that a clock allows, by picture.
  void pairs_of(std::size_t clock, std::vector<Pair>& out) const {
    constexpr double kReach_s = 4;
    for (std::size_t i = 0; i < fit_.order.size(); ++i) {
      const auto t = time(i);
      if (!t) continue;
      const double slack = kReach_s + std::abs(fit_.drift) * span_s();
      const double low = *t - fit_.offsets_s[clock] - slack, high = low + 2 * slack;
      auto at =
          std::lower_bound(timed_.begin(), timed_.end(), low, [](const auto& a, double v) { return a.first < v; });
      for (; at != timed_.end() && at->first <= high; ++at) {
        const double g = gain(fit_.residual(*t, at->first, clock), shots_[at->second]);
        if (g > 0) out.push_back({i, at->second, clock, g});
      }
    }
  }

  void chain() {
    const std::size_t clocks = fit_.offsets_s.size();
    fit_.pairs.clear();
    for (std::size_t clock = 0; clock < clocks; ++clock) pairs_of(clock, fit_.pairs);
    std::stable_sort(fit_.pairs.begin(), fit_.pairs.end(),
                     [](const Pair& a, const Pair& b) { return a.picture < b.picture; });
    std::vector<double> cost(clocks * clocks, 0);
    for (std::size_t a = 0; a < clocks; ++a)
      for (std::size_t b = 0; b < clocks; ++b)
        if (a != b) cost[a * clocks + b] = may_be_set_ ? step_cost(fit_.offsets_s[a], fit_.offsets_s[b]) : kNever;
    fit_.chains = heaviest_chains(fit_.pairs, shots_.size(), clocks, cost);
  }

  /// Offsets, drift, spread and frequencies of faults from the chain.
  void estimate() {
    const std::vector<std::size_t>& path = fit_.chains.path;
    if (path.empty()) return;
    estimate_drift();
    for (std::size_t clock = 0; clock < fit_.offsets_s.size(); ++clock) {
      std::vector<double> own;
      for (const std::size_t n : path)
        if (fit_.pairs[n].clock == clock) own.push_back(residual(fit_.pairs[n], clock));
      fit_.offsets_s[clock] += mean(own);
    }
    constexpr std::size_t kEnough = 8;
    if (path.size() >= kEnough) {
      std::vector<double> sizes;
      for (const std::size_t n : path) sizes.push_back(std::abs(residual(fit_.pairs[n], fit_.pairs[n].clock)));
      spread_s_ = std::clamp(1.4826 * median(sizes, 0), least_spread_s_, kMostSpread_s);
    }
    // What lies beyond the first and the last pair may be of another day: it tells nothing of this capture.
    const Pair &first = fit_.pairs[path.front()], &last = fit_.pairs[path.back()];
    const double extra = double(last.picture - first.picture + 1 - path.size());
    double missing = 0;
    std::size_t next = 0;
    for (std::size_t j = 0; j < shots_.size(); ++j) {
      const bool has = next < path.size() && fit_.pairs[path[next]].shot == j;
      next += has;
      missing += !has && shots_[j].state == ShotState::done && shots_[j].time_unix_s.has_value();
    }
    const auto cost = [](double faults, std::size_t of) {
      return -std::log(std::min(0.3, (faults + 0.5) / (double(of) + 10)));
    };
    missing_cost_ = cost(missing, shots_.size());
    extra_cost_ = cost(extra, last.picture - first.picture + 1);
  }

  void estimate_drift() {
    constexpr std::size_t kEnough = 8;
    constexpr double kLeastSpan_s = 600;
    const std::vector<std::size_t>& path = fit_.chains.path;
    if (path.size() < kEnough || span_s() < kLeastSpan_s) return;
    double over = 0, under = 0;
    for (std::size_t clock = 0; clock < fit_.offsets_s.size(); ++clock) {
      std::vector<double> s, r;
      for (const std::size_t n : path)
        if (fit_.pairs[n].clock == clock) {
          s.push_back(*shots_[fit_.pairs[n].shot].time_unix_s);
          r.push_back(residual(fit_.pairs[n], clock));
        }
      const double s0 = mean(s), r0 = mean(r);
      for (std::size_t i = 0; i < s.size(); ++i) {
        over += (s[i] - s0) * (r[i] - r0);
        under += (s[i] - s0) * (s[i] - s0);
      }
    }
    if (under > 0) fit_.drift = std::clamp(fit_.drift + over / under, -kMostDrift, kMostDrift);
  }

  std::span<const ExpectedShot> shots_;
  std::span<const CardPicture> pictures_;
  bool may_be_set_;
  const AlignOptions& options_;
  Job& job_;
  std::vector<std::pair<double, std::size_t>> timed_;  ///< shots by time
  double interval_s_ = 10, spread_s_ = kLeastOfSeconds_s, least_spread_s_ = kLeastSpread_s, missing_cost_ = 4,
         extra_cost_ = 4;
  bool moved_ = false;
  ClockFit fit_;
};

}  // namespace

ClockFit fit_clock(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures,
                   std::vector<std::size_t> order, bool may_be_set, const AlignOptions& options, Job& job) {
  return Fitter(shots, pictures, std::move(order), may_be_set, options, job).run();
}

}  // namespace lumihull::capture
