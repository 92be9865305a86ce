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
  // Found by design_mechanism with its goals, on 12 x 7 poses at 1.5 m, object of 0.4 m radius, seed 21
  // (src/design/README.md says what it reaches).
  const std::array<Eigen::Vector3d, 6> departures = {{{-5, 1.175, 2.0468},
                                                      {5, -3.4536, 4.9954},
                                                      {-5, -2.6951, 4.8928},
                                                      {5, 5.8369, 2.6583},
                                                      {1.8312, -6, 2.2389},
                                                      {0.4329, 6, 4.999}}};
  const std::array<Eigen::Vector3d, 3> attachments = {
      {{-0.1698, -0.1831, 0}, {-0.0578, 0.2429, 0}, {0.2422, -0.0606, 0}}};
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
