#pragma once

// Adjustments of what is placed, and what does not fit.

#include <array>

#include "network.h"

namespace lumihull::calib::network {

struct SettleOptions {
  std::array<bool, kIntrinsics> free{};
  BodyModel model = BodyModel::rigid;
  double robust_sigma = 0;
  /// Circles are taken for points, measured where their centres are seen from the poses as they are: near enough while
  /// these still move, and many times faster.
  bool as_points = false;
  int max_iterations = 20;
  bool covariances = false;
  bool rig = false;
  bool free_print_scale = false;
  std::vector<ScaleBar> bars;
};

/// An adjustment's answer and which of the network's things it is about.
struct Settled {
  AdjustResult result;
  std::vector<int> shot_of_photo;  ///< -1: did not take part
  std::vector<int> body_of;        ///< by the network's body
  std::vector<Pose> cam_from_rig;  ///< of each camera
};

/// Adjusts the photographs for which `use` is true and the bodies of one part, and takes the answer over: cameras,
/// poses, bodies. Nothing where too little is there to adjust.
std::optional<Settled> settle(Network& network, int part, const std::vector<bool>& use, const SettleOptions& options,
                              Job& job);

/// Measured less predicted, px; nullopt where photograph or body has no pose, or the point can't be seen.
std::optional<Eigen::Vector2d> error_of(const Network& network, const Seen& seen);

/// sqrt(rᵀ Σ⁻¹ r)
double in_sigmas(const Seen& seen, const Eigen::Vector2d& error);

/// Robust standard deviation of the residuals that count, in units of their covariances' (median of a Rayleigh).
double residual_scale(const Network& network, int part);

/// Marks anew what counts of a part: observations within `outlier_sigma` of the residuals' robust scale, detections
/// most of whose observations do. Returns the number of observations whose mark changed. scale: that robust scale,
/// >= 1.
int judge(Network& network, int part, double outlier_sigma, double* scale);

/// Looks for photographs and bodies whose other tilt, or place, fits clearly better, and takes it. How many were
/// changed.
int second_look(Network& network, int part, Job& job);

/// Detections of a body that do not count but agree on another place: it becomes a body of its own, named for why. True
/// where one was found.
bool find_second_places(Network& network, int part, Job& job);

}  // namespace lumihull::calib::network
