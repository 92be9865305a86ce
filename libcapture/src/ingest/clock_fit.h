#pragma once

// Pictures and shots that have times: the clock's offsets and drift, and the pairs that follow.

#include <lumihull/base/job.h>
#include <lumihull/capture/ingest.h>

#include <vector>

#include "chain.h"

namespace lumihull::capture {

/// Log-likelihood by which another alignment must be worse before a pair is believed.
inline constexpr double kMargin = 10;

struct ClockFit {
  std::vector<std::size_t> order;  ///< pictures in the order that was assumed; Pair::picture counts in it
  std::vector<double> offsets_s;   ///< the clocks
  double drift = 0;                ///< seconds a second
  double reference_s = 0;          ///< the shot time at which the offsets hold
  std::vector<Pair> pairs;
  Chains chains;

  /// How far a picture is from a shot by a clock.
  double residual(double picture_s, double shot_s, std::size_t clock) const {
    return picture_s - shot_s - drift * (shot_s - reference_s) - offsets_s[clock];
  }
};

/// The middle of the time in which a picture may have been taken: cut times are half their resolution early.
inline std::optional<double> middle_time(const CardPicture& p) {
  if (!p.clock_s) return std::nullopt;
  return *p.clock_s + p.resolution_s / 2;
}

/// order: of all pictures. may_be_set: whether the clock may have been set on the way.
ClockFit fit_clock(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures,
                   std::vector<std::size_t> order, bool may_be_set, const AlignOptions& options, Job& job);

}  // namespace lumihull::capture
