#include "length_model.h"

#include <cmath>

namespace lumihull::capture::design {

std::vector<std::string> LengthLayout::names(const Mechanism& mechanism, const std::vector<int>& group_numbers) const {
  static constexpr const char* kAxes[] = {" x", " y", " z"};
  std::vector<std::string> out(static_cast<std::size_t>(size()));
  const auto name = [&](int at, const std::string& words) { out[std::size_t(at)] = words; };
  for (int i = 0; i < cables; ++i) {
    const std::string& cable = mechanism.cables[std::size_t(i)].name;
    for (int k = 0; k < 3; ++k) name(departure(i) + k, "departure " + cable + kAxes[k]);
    name(offset(i), "offset " + cable);
    if (gains) name(gain(i), "gain " + cable);
  }
  for (int p = points - 1; p >= 0; --p) {
    std::string of;
    for (int i = 0; i < cables; ++i)
      if (point_of_cable[std::size_t(i)] == p) of += (of.empty() ? "" : "+") + mechanism.cables[std::size_t(i)].name;
    for (int k = 0; k < 3; ++k) name(attachment(p) + k, "attachment " + of + kAxes[k]);
  }
  for (int k = 0; k < 3; ++k) {
    name(camera() + k, std::string("camera's rotation") + kAxes[k]);
    name(camera() + 3 + k, std::string("camera's position") + kAxes[k]);
  }
  for (int g = 1; g < groups; ++g) name(bearing(g), "bearing " + std::to_string(group_numbers[std::size_t(g)]));
  return out;
}

Eigen::Quaterniond rotation_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle < 1e-12) return Eigen::Quaterniond(1, 0.5 * vector.x(), 0.5 * vector.y(), 0.5 * vector.z()).normalized();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle));
}

LengthParameters LengthParameters::moved(const LengthLayout& layout, const Eigen::VectorXd& step) const {
  LengthParameters out = *this;
  for (int i = 0; i < layout.cables; ++i) {
    const auto c = std::size_t(i);
    out.departures[c] += step.segment<3>(layout.departure(i));
    out.offsets[c] += step[layout.offset(i)];
    if (layout.gains) out.gains[c] += step[layout.gain(i)];
  }
  for (int p = 0; p < layout.points; ++p) out.attachments[std::size_t(p)] += step.segment<3>(layout.attachment(p));
  const Eigen::Quaterniond turn = rotation_by(step.segment<3>(layout.camera()));
  out.cam_from_platform.rotation = (turn * cam_from_platform.rotation).normalized();
  out.cam_from_platform.translation = turn * cam_from_platform.translation + step.segment<3>(layout.camera() + 3);
  for (int g = 1; g < layout.groups; ++g) out.bearings[std::size_t(g)] += step[layout.bearing(g)];
  return out;
}

Eigen::VectorXd length_residuals(const LengthLayout& layout, const LengthParameters& parameters,
                                 const LengthObservation& observation, Eigen::MatrixXd* jacobian,
                                 Eigen::MatrixXd* pose_jacobian) {
  const double bearing = parameters.bearings[std::size_t(observation.group)];
  const Eigen::Matrix3d camera = parameters.cam_from_platform.rotation.toRotationMatrix(),
                        turned = camera * Eigen::AngleAxisd(-bearing, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                        world = observation.cam_from_world.rotation.toRotationMatrix();
  Eigen::VectorXd residuals(layout.cables);
  if (jacobian) jacobian->setZero(layout.cables, layout.size());
  if (pose_jacobian) pose_jacobian->resize(layout.cables, 6);
  for (int i = 0; i < layout.cables; ++i) {
    const auto c = std::size_t(i);
    const int point = layout.point_of_cable[c];
    const Eigen::Vector3d arm = turned * parameters.attachments[std::size_t(point)],
                          attachment = arm + parameters.cam_from_platform.translation,
                          departure = world * parameters.departures[c] + observation.cam_from_world.translation,
                          cable = attachment - departure;
    const double length = cable.norm(), commanded = observation.commanded[i];
    residuals[i] = length - parameters.gains[c] * commanded - parameters.offsets[c];
    if (!jacobian && !pose_jacobian) continue;
    const Eigen::Vector3d u = cable / std::max(length, 1e-9);
    if (pose_jacobian) {
      pose_jacobian->row(i).head<3>() = -departure.cross(u).transpose();
      pose_jacobian->row(i).tail<3>() = -u.transpose();
    }
    if (!jacobian) continue;
    auto row = jacobian->row(i);
    row.segment<3>(layout.departure(i)) = -(world.transpose() * u).transpose();
    row.segment<3>(layout.attachment(point)) = (turned.transpose() * u).transpose();
    row[layout.offset(i)] = -1;
    if (layout.gains) row[layout.gain(i)] = -commanded;
    row.segment<3>(layout.camera()) = attachment.cross(u).transpose();
    row.segment<3>(layout.camera() + 3) = u.transpose();
    // d/dr of Rz(-r) b is -z x (Rz(-r) b); z is the bearing's axis, seen by the camera.
    if (observation.group > 0) row[layout.bearing(observation.group)] = -u.dot(camera.col(2).cross(arm));
  }
  return residuals;
}

}  // namespace lumihull::capture::design
