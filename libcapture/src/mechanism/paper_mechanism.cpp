// The mechanism that the paper describes, and one for its largest object.
#include <lumihull/capture/design.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace lumihull::capture {

namespace {

using Points = std::array<Eigen::Vector3d, 6>;

/// Cables 1 and 2, 3 and 4, 5 and 6 share an attachment point.
Mechanism in_pairs(const Eigen::AlignedBox3d& room, const Points& departures,
                   const std::array<Eigen::Vector3d, 3>& attachments) {
  Mechanism mechanism;
  mechanism.name = "six cables, three attachment points";
  mechanism.room = room;
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

}  // namespace

Mechanism paper_mechanism() {
  // Found by design_mechanism with its goals, on 12 x 7 poses at 1.5 m, object of 0.4 m radius, seed 23
  // (src/design/README.md says what it reaches).
  return in_pairs({Eigen::Vector3d(-5, -6, -1), Eigen::Vector3d(5, 6, 5)},
                  {{{-5, 1.0913, 1.9667},
                    {5, -3.2498, 4.9835},
                    {4.7272, 6, 2.6971},
                    {-5, -2.9765, 4.9895},
                    {0.2904, 6, 4.9765},
                    {1.9131, -6, 2.2411}}},
                  {{{-0.1675, -0.1854, 0}, {-0.0623, 0.2419, 0}, {0.2418, -0.0629, 0}}});
}

Mechanism large_mechanism() {
  // The same on 12 x 7 poses at 2.7 m, object of 1.5 m radius, 12,000 evaluations, seed 29.
  return in_pairs({Eigen::Vector3d(-8, -9, -1), Eigen::Vector3d(8, 9, 9)},
                  {{{-0.1947, 9, 7.8797},
                    {1.0680, -9, 8.9882},
                    {-8, 3.5285, 8.9969},
                    {8, -4.8650, 4.9762},
                    {8, 2.5851, 8.9892},
                    {-8, -1.6763, 6.6624}}},
                  {{{0.1942, 0.1574, 0}, {0.0703, -0.2399, 0}, {-0.2449, 0.0499, 0}}});
}

Pose cam_from_platform(const Mechanism& mechanism, double bearing_rad) {
  const Eigen::AngleAxisd back(-bearing_rad, Eigen::Vector3d::UnitZ());
  return mechanism.cam_from_platform * Pose{Eigen::Quaterniond(back), Eigen::Vector3d::Zero()};
}

}  // namespace lumihull::capture
