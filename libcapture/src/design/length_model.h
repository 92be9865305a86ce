#pragma once

// The lengths of cables as a function of everything that calibration estimates, with derivatives.

#include <lumihull/capture/mechanism_calibration.h>

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture::design {

/// Where each parameter stands in the vector of small changes.
struct LengthLayout {
  int cables = 0, points = 0, groups = 0;
  bool gains = false;
  std::vector<int> point_of_cable;  ///< index of the attachment point

  int departure(int cable) const { return 3 * cable; }
  int attachment(int point) const { return 3 * (cables + point); }
  int offset(int cable) const { return 3 * (cables + points) + cable; }
  int camera() const { return 3 * (cables + points) + cables; }      ///< rotation vector, translation
  int bearing(int group) const { return camera() + 6 + group - 1; }  ///< of group > 0; the first one's is given
  int gain(int cable) const { return camera() + 6 + groups - 1 + cable; }
  int size() const { return camera() + 6 + groups - 1 + (gains ? cables : 0); }

  std::vector<std::string> names(const Mechanism& mechanism, const std::vector<int>& group_numbers) const;
};

struct LengthParameters {
  std::vector<Eigen::Vector3d> departures;   ///< cables
  std::vector<Eigen::Vector3d> attachments;  ///< points
  std::vector<double> offsets, gains;        ///< cables
  Pose cam_from_platform;
  std::vector<double> bearings;  ///< groups

  /// A small change applied; that of cam_from_platform is a motion after it.
  LengthParameters moved(const LengthLayout& layout, const Eigen::VectorXd& step) const;
};

/// One observation, ready for use.
struct LengthObservation {
  Pose cam_from_world;
  int group = 0;
  Eigen::VectorXd commanded;
  Eigen::Matrix<double, 6, 6> covariance;
};

/// Residuals r_i = | b_i - a_i | - g_i m_i - o_i, both points in the camera's frame.
/// jacobian: cables x layout.size(), by the parameters' small changes. pose_jacobian: cables x 6, by a small motion
/// (rotation vector, translation) applied after cam_from_world. Either may be null.
Eigen::VectorXd length_residuals(const LengthLayout& layout, const LengthParameters& parameters,
                                 const LengthObservation& observation, Eigen::MatrixXd* jacobian,
                                 Eigen::MatrixXd* pose_jacobian);

/// exp of a rotation vector.
Eigen::Quaterniond rotation_by(const Eigen::Vector3d& vector);

}  // namespace lumihull::capture::design
