#pragma once

#include "settle.h"

namespace lumihull::calib::network {

/// Fills cross_validation_m and cross_validation_sigma: every other photograph of the model alone, from the whole
/// answer on; the points that both halves have, turned and shifted onto each other.
void cross_validate(const Network& network, SettleOptions options, Calibration& calibration, Job& job);

}  // namespace lumihull::calib::network
