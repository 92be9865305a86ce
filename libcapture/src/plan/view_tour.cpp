// Plans for a camera that no mechanism carries.
#include <lumihull/base/error.h>
#include <lumihull/capture/planner.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace lumihull::capture {

PlannedTour view_tour(const std::string& robot, const HemisphereOptions& views, Orientation orientation,
                      const std::vector<std::string>& cameras, double travel_s) {
  if (robot != "turntable" && robot != "hand")
    throw Error(ErrorCode::invalid_argument, "expected \"turntable\" or \"hand\", not \"" + robot + "\"", "robot");
  if (!(std::isfinite(travel_s) && travel_s >= 0))
    throw Error(ErrorCode::invalid_argument, "expected a number of at least 0", "travel_s");
  PlannedTour tour;
  tour.plan.robot = robot;
  tour.plan.cameras = cameras;
  tour.plan.stops = hemisphere_views(views, orientation);
  for (std::size_t i = 1; i < tour.plan.stops.size(); ++i) {
    PlannedStop &stop = tour.plan.stops[i], &last = tour.plan.stops[i - 1];
    stop.travel_s = travel_s;
    tour.travel_s += travel_s;
    tour.travel_m += (stop.world_from_platform.translation - last.world_from_platform.translation).norm();
    if (robot == "turntable" && stop.phi_rad != last.phi_rad) {
      char text[120];
      std::snprintf(text, sizeof text, "Move the camera to %.1f degrees from straight above.",
                    stop.phi_rad * 180 / std::numbers::pi);
      stop.pause = text;
    }
  }
  check(tour.plan);
  return tour;
}

KeepOut standing_object(const ObjectSize& object, const Eigen::Vector3d& center, double floor_m) {
  check(object);
  if (!center.allFinite() || !std::isfinite(floor_m))
    throw Error(ErrorCode::invalid_argument, "expected finite numbers", center.allFinite() ? "floor_m" : "center");
  const double height = object.height_m > 0 ? object.height_m : object.diameter_m;
  KeepOut out;
  out.radius_m = 0.5 * object.diameter_m;
  out.base = {center.x(), center.y(), std::min(floor_m, center.z() - 0.5 * height)};
  // A sphere ends in the cap; a cylinder's flat top lies below one.
  out.height_m = center.z() + (object.height_m > 0 ? 0.5 * height : 0) - out.base.z();
  return out;
}

}  // namespace lumihull::capture
