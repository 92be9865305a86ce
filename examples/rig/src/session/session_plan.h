#pragma once

#include <lumihull/capture/optics.h>
#include <lumihull/rig/simulate.h>

namespace lumihull::rig {

/// The object of the options, and its size in words of the planner.
Object session_object(const SimulateOptions& options);
capture::ObjectSize size_of(const hull::Mesh& mesh);

/// Where views lie: centre and radius such that eye = center + radius (sin phi cos theta, sin phi sin theta, cos phi),
/// by least squares over the stops that are photographed.
struct ViewSphere {
  Eigen::Vector3d center{0, 0, 0};
  double radius_m = 0;
};
ViewSphere sphere_of(const capture::Plan& plan);

struct MadePlan {
  capture::Plan plan;
  std::vector<std::string> notes;
};
/// Views of a hemisphere about (0, 0, center_height_m), floor at z = 0.
MadePlan make_plan(const SimulateOptions& options, const capture::ObjectSize& object, double center_height_m, Job& job);

}  // namespace lumihull::rig
