#pragma once

// Least squares over the lengths of all observations, weighted by what poses' errors do to them.

#include "length_model.h"

namespace lumihull::capture::design {

struct LengthFit {
  LengthParameters parameters;
  std::vector<std::size_t> rejected;          ///< ascending
  Eigen::MatrixXd covariance;                 ///< of the small changes, not scaled by sigma0
  std::vector<Eigen::VectorXd> unobservable;  ///< unit vectors of small changes (gains times 10 m) that stay unknown
  double rms_m = 0, sigma0 = 0;
};

/// Levenberg-Marquardt from a start some centimetres and degrees off. attachments_guess fixes the frame of the
/// platform: its mean height and its turn about z. Directions of which the observations tell less than 0.3 m or rad
/// keep the start's values.
LengthFit fit_lengths(const LengthLayout& layout, const LengthParameters& start,
                      std::span<const LengthObservation> observations, double length_sigma_m);

}  // namespace lumihull::capture::design
