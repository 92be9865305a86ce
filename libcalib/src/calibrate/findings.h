#pragma once

#include "network.h"

namespace lumihull::calib::network {

/// Names what does not count, of a part that is settled: misread targets, outliers, targets that could not be placed.
void name_what_was_left_out(Network& network, int part);

/// Names photographs without a pose, and why.
void name_unplaced_photos(Network& network, int part, std::vector<CalibratedPhoto>& photos);

/// Bars that the solved points do not agree with, in words.
void check_bars(const std::vector<ScaleBar>& bars, Calibration& calibration);

/// One sentence: whether a calibration is good; and what is weak in it.
void judge_calibration(Calibration& calibration, std::span<const PhotoTargets> photos);

}  // namespace lumihull::calib::network
