#pragma once

#include "network.h"

namespace lumihull::calib::network {

/// Names what does not count, of a part that is settled: misread targets, outliers, targets that could not be placed.
void name_what_was_left_out(Network& network, int part);

/// Names photographs without a pose, and why.
void name_unplaced_photos(Network& network, int part, std::vector<CalibratedPhoto>& photos);

/// Bars that the solved points do not agree with, in words; how many.
int check_bars(const CalibrateOptions& options, Calibration& calibration);

/// One sentence: whether a calibration is good; and what is weak in it.
void judge_calibration(Calibration& calibration, std::span<const PhotoTargets> photos, int contradicting_bars);

}  // namespace lumihull::calib::network
