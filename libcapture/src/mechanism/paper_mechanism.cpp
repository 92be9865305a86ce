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
  // Found by a random search: every view of the hemisphere at 2 N and more, no cable within 45 cm of the object's axis.
  const std::array<Eigen::Vector3d, 6> departures = {
      {{-1.16, -6, 4.65}, {1.85, 6, 4.91}, {5, -4.17, 4.92}, {-4.28, 6, 4.91}, {-5, -3.29, 4.02}, {5, 2, 4.7}}};
  const std::array<Eigen::Vector3d, 3> attachments = {{{-0.247, 0.038, 0}, {0.122, 0.218, 0}, {0.1, -0.229, 0}}};
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
