#pragma once

#include <lumihull/rig/scene.h>

#include <cstdint>

namespace lumihull::rig {

/// A room for a session: the paper's enclosure (section 5.3), a pedestal, lamps.
struct StudioOptions {
  double radius_m = 3;         ///< axis to panel
  double height_m = 3.3;       ///< of the panels
  double center_height_m = 1;  ///< of the object's middle above the floor; more where the object is taller than that
  Eigen::Vector3f paint = kGreenPaint;
  std::uint64_t seed = 1;
};

/// The object on a pedestal in the middle of such a room: the centre of its bounding box on the axis. Lamps as in
/// `make_scene`, in proportion to the room; they do not move with the camera.
Scene make_studio(Object object, const StudioOptions& options);

}  // namespace lumihull::rig
