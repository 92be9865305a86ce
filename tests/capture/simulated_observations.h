#pragma once

// What calibration of a mechanism would be given, with the truth that made it.

#include <lumihull/capture/mechanism_calibration.h>

#include <cstdint>
#include <vector>

namespace lumihull::test {

struct SimulatedOptions {
  std::uint64_t seed = 1;
  int observations = 240;
  int groups = 24;                 ///< of the bearing's angle
  bool all_over_the_room = false;  ///< else on a hemisphere of 1.5 m, at the paper's tilt
  double position_noise_m = 0.5e-3, rotation_noise_rad = 0.3e-3, length_noise_m = 0;
  double guess_error_m = 0.05, guess_error_rad = 0.03;  ///< of departures and camera; attachments a fifth of it
  double largest_gain_error = 0;
};

struct SimulatedMechanism {
  capture::Mechanism guess, truth;
  std::vector<double> offsets_m, gains, bearings_rad;  ///< true ones; bearings of each group
};

SimulatedMechanism simulated_mechanism(const SimulatedOptions& options);

/// Pictures at new poses for each `seed`, with the noise of the options; bearing groups are azimuths.
std::vector<capture::MechanismObservation> simulated_observations(const SimulatedMechanism& mechanism,
                                                                  const SimulatedOptions& options, std::uint64_t seed);

/// RMS over observations and cables of commanded_lengths(calibration, pose by camera and bearing) - commanded.
double length_error_m(const capture::MechanismCalibration& calibration,
                      const std::vector<capture::MechanismObservation>& observations);

}  // namespace lumihull::test
