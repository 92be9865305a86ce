#pragma once

#include <lumihull/base/api.h>
#include <lumihull/calib/calibrate.h>

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::calib {

/// A distance between two points of targets that somebody measured.
struct TargetBar {
  struct End {
    std::string family;  ///< of the target; empty: the only one with this id
    int id = 0;
    int point =
        0;  ///< as TargetDesign::feature counts: circles row by row from the top left, corners clockwise from there
  };
  End a, b;
  double length_m = 0;
  double sigma_m = kSigma_m;                  ///< its standard deviation
  std::string text;                           ///< as it was written: names it in messages
  static constexpr double kSigma_m = 0.5e-3;  ///< of a steel tape, read by eye
};

/// From "END,END,LENGTH" or "END,END,LENGTH,SIGMA", several of them separated by semicolons. END: ID.POINT, or
/// FAMILY:ID.POINT where two families have the id; lengths in metres, or with mm, cm or m behind. Empty: none.
/// Errors: invalid_argument (subject "bar"), saying what was expected and what was found.
LUMIHULL_API std::vector<TargetBar> bars_from_text(std::string_view text);

/// A bar between the bodies (of `bodies_of`) that carry its targets. Errors: invalid_argument (no body has such a
/// target or point, two have it, or both ends are one point), naming the bar.
LUMIHULL_API ScaleBar bar_between(const TargetBar& bar, const TargetSet& set, std::span<const CalibratedBody> bodies);

}  // namespace lumihull::calib
