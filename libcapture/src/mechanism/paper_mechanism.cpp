// The mechanism that the paper describes.
#include <lumihull/capture/mechanism.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace lumihull::capture {

Mechanism paper_mechanism() {
  Mechanism mechanism;
  mechanism.name = "six cables, three attachment points";
  mechanism.room = {Eigen::Vector3d(-5, -6, -1), Eigen::Vector3d(5, 6, 5)};
  // Found by design_mechanism with its goals, on 12 x 7 poses at 1.5 m, object of 0.4 m radius, seed 23
  // (src/design/README.md says what it reaches).
  const std::array<Eigen::Vector3d, 6> departures = {{{-5, 1.0913, 1.9667},
                                                      {5, -3.2498, 4.9835},
                                                      {4.7272, 6, 2.6971},
                                                      {-5, -2.9765, 4.9895},
                                                      {0.2904, 6, 4.9765},
                                                      {1.9131, -6, 2.2411}}};
  const std::array<Eigen::Vector3d, 3> attachments = {
      {{-0.1675, -0.1854, 0}, {-0.0623, 0.2419, 0}, {0.2418, -0.0629, 0}}};
  for (std::size_t i = 0; i < departures.size(); ++i) {
    Cable cable;
    cable.name = std::to_string(i + 1);
    cable.departure = departures[i];
    cable.attachment = attachments[i / 2];
    mechanism.cables.push_back(cable);
  }
  // The optical axis is 45 degrees off the central axis; the picture is upright (portrait): its x axis points down.
  const double s = std::numbers::sqrt2 / 2;
  Eigen::Matrix3d rotation;
  rotation << s, 0, -s, 0, -1, 0, -s, 0, -s;
  mechanism.cam_from_platform = Pose::from_matrix(rotation, Eigen::Vector3d::Zero());
  return mechanism;
}

Pose cam_from_platform(const Mechanism& mechanism, double bearing_rad) {
  const Eigen::AngleAxisd back(-bearing_rad, Eigen::Vector3d::UnitZ());
  return mechanism.cam_from_platform * Pose{Eigen::Quaterniond(back), Eigen::Vector3d::Zero()};
}

}  // namespace lumihull::capture
