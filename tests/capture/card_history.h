#pragma once

// Invented captures: what a robot commanded, what a camera made of it, and which picture is whose.

#include <lumihull/capture/ingest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace lumihull::test {

struct HistoryOptions {
  std::size_t shots = 100;
  int rhythm = 0;               ///< 0: 8 to 20 s between shots; 1: 14 s, to 0.05 s; 2: 3 to 5 s
  double missing = 0;           ///< probability that a commanded exposure leaves no picture
  std::size_t missing_run = 0;  ///< so many in a row besides
  double extra = 0;             ///< pictures of somebody's, per shot
  std::size_t others = 0;       ///< pictures of another day
  double unknown = 0;           ///< probability that the outcome is not known; half of them made a picture
  double offset_s = 0;
  double drift_ppm = 0;
  double zone_jump_s = 0;  ///< the clock jumps so far in the middle, or about it
  double set_jump_s = 0;   ///< and again elsewhere
  bool fractions = false;
  double untimed_pictures = 0, untimed_shots = 0;  ///< probabilities
  int first_counter = 1;
};

struct History {
  std::vector<capture::ExpectedShot> shots;
  std::vector<capture::CardPicture> pictures;
  std::vector<std::ptrdiff_t> shot_of;  ///< of each picture; -1: of none
};

inline History make_history(const HistoryOptions& o, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const auto chance = [&](double p) { return uniform(0, 1) < p; };
  std::normal_distribution<double> normal;
  History h;
  struct Exposure {
    double time_s;
    std::ptrdiff_t shot;
  };
  std::vector<Exposure> exposures;
  std::vector<double> alone;  // times of shots without a picture
  const double start = 1.55e9 + uniform(0, 1e7);
  double t = start;
  const std::size_t run_at = o.missing_run ? std::size_t(uniform(0, double(o.shots))) : 0;
  for (std::size_t j = 0; j < o.shots; ++j) {
    t += o.rhythm == 0 ? uniform(8, 20) : o.rhythm == 1 ? 14 + uniform(-0.05, 0.05) : uniform(3, 5);
    capture::ExpectedShot shot;
    shot.stop = "s" + std::to_string(j);
    shot.camera = "a";
    if (!chance(o.untimed_shots)) shot.time_unix_s = t;
    bool made = !chance(o.missing) && !(o.missing_run && j >= run_at && j < run_at + o.missing_run);
    if (chance(o.unknown)) {
      shot.state = capture::ShotState::unknown;
      made = chance(0.5);
    }
    const double real = t + 0.2 + 0.08 * normal(random);  // the shutter's lag
    if (made)
      exposures.push_back({real, std::ptrdiff_t(j)});
    else
      alone.push_back(t);
    h.shots.push_back(shot);
  }
  const double end = t;
  const auto extra_count = std::size_t(std::floor(o.extra * double(o.shots) + uniform(0, 1)));
  for (std::size_t n = 0; n < extra_count; ++n) {
    // Nobody fires the camera at the very moment of a commanded exposure that fails.
    const double when = uniform(start - 30, end + 30);
    if (std::none_of(alone.begin(), alone.end(), [&](double a) { return std::abs(a - when) < 2.5; }))
      exposures.push_back({when, -1});
  }
  for (std::size_t n = 0; n < o.others; ++n) exposures.push_back({start - 86400 + uniform(0, 3600), -1});
  std::stable_sort(exposures.begin(), exposures.end(),
                   [](const Exposure& a, const Exposure& b) { return a.time_s < b.time_s; });

  const double zone_at = uniform(start, end), set_at = uniform(start, end);
  int counter = o.first_counter;
  for (const Exposure& e : exposures) {
    capture::CardPicture p;
    p.files = {"100LUMIX/P" + std::to_string(counter) + ".JPG"};
    p.counter = counter;
    counter = counter == 9999 ? 1 : counter + 1;
    double clock = e.time_s + o.offset_s + o.drift_ppm * 1e-6 * (e.time_s - start);
    if (e.time_s > zone_at) clock += o.zone_jump_s;
    if (e.time_s > set_at) clock += o.set_jump_s;
    p.resolution_s = o.fractions ? 0.01 : 1;
    if (!chance(o.untimed_pictures)) p.clock_s = std::floor(clock / p.resolution_s) * p.resolution_s;
    h.pictures.push_back(p);
    h.shot_of.push_back(e.shot);
  }
  return h;
}

/// A history of any kind, of 2 to `most_shots` shots.
inline HistoryOptions any_history(std::uint64_t seed, double most_shots = 400) {
  std::mt19937_64 random(seed * 7919 + 1);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const auto pick = [&](std::initializer_list<double> values) {
    return *(values.begin() + std::ptrdiff_t(random() % values.size()));
  };
  HistoryOptions o;
  o.shots = std::size_t(std::exp(uniform(std::log(2.0), std::log(most_shots))));
  o.rhythm = int(random() % 3);
  o.missing = pick({0, 0, 0.02, 0.1, 0.25});
  o.missing_run = random() % 4 == 0 ? std::size_t(uniform(0, 0.3) * double(o.shots)) : 0;
  o.extra = pick({0, 0, 0.02, 0.1});
  o.others = random() % 3 == 0 ? random() % 30 : 0;
  o.unknown = pick({0, 0, 0.05, 0.2});
  o.offset_s = uniform(-3e8, 3e8);
  o.drift_ppm = pick({0, 0, 20, -100, 200});
  o.zone_jump_s = random() % 4 == 0 ? pick({3600, -3600, 7200, -900}) : 0;
  o.set_jump_s = random() % 6 == 0 ? uniform(-1e5, 1e5) : 0;
  o.fractions = random() % 2 == 0;
  o.first_counter = random() % 3 == 0 ? 9990 : 1 + int(random() % 9999);
  return o;
}

}  // namespace lumihull::test
