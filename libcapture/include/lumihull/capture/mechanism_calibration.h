#pragma once

#include <lumihull/base/job.h>
#include <lumihull/capture/mechanism.h>
#include <lumihull/capture/statics.h>

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture {

/// The platform stood still, cables at commanded lengths, and photogrammetry told where the camera was.
struct MechanismObservation {
  std::string name;                 ///< of the photograph, for messages
  Pose cam_from_world;              ///< measured
  int bearing_group = 0;            ///< the bearing stayed locked for all observations of a group (an azimuth); >= 0
  double bearing_rad = 0;           ///< its nominal angle, right to some degrees; the first one of a group counts
  std::vector<double> commanded_m;  ///< of each cable, as the winches count them
  /// Of (rotation vector, translation) of a small motion applied after cam_from_world: rad, m, as `calibrate` gives it.
  std::optional<Eigen::Matrix<double, 6, 6>> covariance;
};

struct MechanismCalibrationOptions {
  bool gains = false;  ///< also estimate each winch's metres per commanded metre; else 1
  /// Cables whose attachment points coincide in the guess keep one point between them.
  bool shared_attachments = true;
  double position_sigma_m = 0.5e-3;    ///< of a pose without covariance: of the camera's centre, each axis
  double rotation_sigma_rad = 0.3e-3;  ///< of a pose without covariance, each axis
  double length_sigma_m = 0.05e-3;     ///< of a commanded length (winch, cable)
  double largest_rms_m = 0.01;         ///< beyond it lengths and poses do not belong together
};

struct MechanismCalibration {
  /// The guess with departures, attachments and cam_from_platform replaced. The frame of the platform has z along the
  /// bearing's axis through its origin; its height and turn about z are those in which the attachments fit the guess's
  /// best, and the bearing's angle of the first group is the nominal one.
  Mechanism mechanism;
  std::vector<double> offsets_m;     ///< o_i: straight length = gain * commanded + offset
  std::vector<double> gains;         ///< g_i; 1 where not estimated
  std::vector<int> bearing_groups;   ///< ascending
  std::vector<double> bearings_rad;  ///< of each of these groups

  double length_rms_m = 0;            ///< of the residuals of lengths, over the observations that count
  double sigma0 = 0;                  ///< residuals over what poses' covariances and length_sigma_m expect: about 1
  std::vector<std::size_t> rejected;  ///< indices of observations whose pose contradicts the others; ascending

  std::vector<std::string> parameters;  ///< P names: "departure 1 x", "offset 1", "attachment 1 x", "bearing 3", …
  /// P x P, m² and rad², times sigma0² where that is above 1; of parameters that are not observable it is what the
  /// observable part says of them, i.e. too small. Every attachment point counts once; cam_from_platform is a small
  /// motion applied after it.
  Eigen::MatrixXd covariance;
  /// In words: combinations of parameters that these observations do not tell; they keep the guess's values.
  std::vector<std::string> unobservable;
};

/// Departure points, attachment points, length offsets, cam_from_platform and the bearing's angle of each group from
/// poses of the camera and commanded lengths: the least squares of
///   | p_k + Q_k b_i - a_i | - g_i m_ik - o_i,   world_from_platform_k = cam_from_world_k⁻¹
///   cam_from_platform(bearing_k)
/// over all cables i and observations k, weighted with what the covariances of the poses let expect (the errors of one
/// pose go into all of its lengths), robustly against a few wrong poses. Levenberg-Marquardt; the covariance from the
/// normal equations.
/// Errors: invalid_argument (an option out of its range; a guess without pairs of different points), bad_input naming
/// the observation (numbers not finite, wrong number of lengths, a covariance that is none), degenerate (too few
/// observations, poses that hardly differ, lengths that do not belong to the poses).
LUMIHULL_API MechanismCalibration calibrate_mechanism(const Mechanism& guess,
                                                      std::span<const MechanismObservation> observations,
                                                      const MechanismCalibrationOptions& options = {});

/// What to command so that the platform stands there: (l_i - o_i) / g_i, m.
LUMIHULL_API CableVector commanded_lengths(const MechanismCalibration& calibration, const Pose& world_from_platform);

}  // namespace lumihull::capture
