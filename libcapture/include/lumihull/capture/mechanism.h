#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace lumihull::capture {

/// One cable: from its departure point on a wall (where it leaves the last pulley) to the end-effector.
struct Cable {
  std::string name;            ///< unique in the mechanism, for messages
  Eigen::Vector3d departure;   ///< a_i, in the world, m
  Eigen::Vector3d attachment;  ///< b_i, in the platform's frame, m
  double min_length_m = 0.05;  ///< what the winch may wind up to
  double max_length_m = 20;    ///< what the drum holds
  double min_tension_N = 1;    ///< below it the cable sags
  double max_tension_N = 200;  ///< winch or cable, whichever is weaker
  double stiffness_N = 0;      ///< EA: Young's modulus x cross-section; 0: does not stretch
  double density_kg_m = 0;     ///< mass of a metre; 0: weightless
};

/// How fast an end-effector may be moved.
struct MotionLimits {
  double speed_m_s = 0.6, acceleration_m_s2 = 0.4, jerk_m_s3 = 0.8;  ///< of the platform
  double cable_speed_m_s = 0.8, cable_acceleration_m_s2 = 0.6;       ///< of each winch
};

/// A suspended cable-driven parallel mechanism that carries a camera (paper, section 2).
///
/// World: z up, metres; the object's centre is the centre of the hemisphere of views. The platform's frame has its
/// origin where the camera's centre would be without offset and coincides with the world's axes at rotation identity.
struct Mechanism {
  std::string name;
  std::vector<Cable> cables;                                 ///< 3 … 12
  double mass_kg = 5.75;                                     ///< paper, 2.3
  Eigen::Vector3d center_of_mass = Eigen::Vector3d::Zero();  ///< in the platform's frame, m
  Eigen::AlignedBox3d room;                                  ///< walls, floor and ceiling, in the world
  double platform_radius_m = 0.3;  ///< of a sphere about the origin that holds the end-effector
  double cable_radius_m = 0.001;
  double gravity_m_s2 = 9.80665;  ///< along -z
  MotionLimits limits;

  /// Where the camera sits while the bearing's angle is zero. The bearing turns it about the platform's z axis, the
  /// end-effector's central axis, from which the optical axis is offset; gravity turns it, a solenoid locks it (paper,
  /// 2.3). At the angle theta it looks towards where it looked before, turned by theta: an end-effector that is
  /// tilted without torsion needs theta = the azimuth of the view.
  Pose cam_from_platform;
};

/// cam_from_platform * Rz(-bearing).
LUMIHULL_API Pose cam_from_platform(const Mechanism& mechanism, double bearing_rad);

/// Error{bad_input} with `subject` where a value is not finite or outside its range, a name is used twice, a
/// departure point lies outside the room by more than 1 mm, or a tension or length range is empty.
LUMIHULL_API void check(const Mechanism& mechanism, const std::string& subject = "mechanism");

/// mechanism.json ("format": "lumihull-mechanism"). Errors: not_found, io, bad_input naming file, pointer, expectation.
LUMIHULL_API Mechanism read_mechanism(const std::filesystem::path& file);
LUMIHULL_API void write_mechanism(const Mechanism& mechanism, const std::filesystem::path& file);

/// The paper's architecture: six cables, three attachment points, a room of 10 x 12 x 6 m (sections 2.1 to 2.3), the
/// object's centre 1 m above the floor's; all views of a hemisphere of 1.5 m at the paper's tilt are controlled.
LUMIHULL_API Mechanism paper_mechanism();

}  // namespace lumihull::capture
