#include <lumihull/capture/optics.h>
#include <lumihull/capture/plan_report.h>
#include <lumihull/capture/planner.h>

#include <algorithm>

#include "arguments.h"
#include "context.h"
#include "handles.h"
#include "mechanism_structs.h"

using namespace lumihull;
using namespace lumihull::capi;
using capture::PlannedStop;

namespace {

capture::Optics optics_from(const lh_optics* user) {
  const lh_optics o = read_struct(user, "optics");
  capture::Optics optics;
  optics.focal_length_mm = or_default(o.focal_length_mm, optics.focal_length_mm);
  optics.sensor_width_mm = or_default(o.sensor_width_mm, optics.sensor_width_mm);
  optics.sensor_height_mm = or_default(o.sensor_height_mm, optics.sensor_height_mm);
  optics.width_px = or_default(int(o.width_px), optics.width_px);
  optics.height_px = or_default(int(o.height_px), optics.height_px);
  optics.f_number = or_default(o.f_number, optics.f_number);
  optics.circle_of_confusion_mm = or_default(o.circle_of_confusion_mm, optics.circle_of_confusion_mm);
  capture::check(optics);
  return optics;
}

capture::ObjectSize object_from(const lh_object_size* user) {
  const lh_object_size o = read_struct(&given(user, "object"), "object");
  const capture::ObjectSize object{o.diameter_m, o.height_m};
  capture::check(object);
  return object;
}

Eigen::Vector3d point_from(const double* xyz, const char* name) {
  const Eigen::Vector3d point = Eigen::Map<const Eigen::Vector3d>(&given(xyz, name));
  if (!point.allFinite()) invalid("expected finite numbers", name);
  return point;
}

std::vector<std::string> words(std::string_view text) {
  std::vector<std::string> all;
  for (size_t at = 0; at <= text.size();) {
    const size_t end = std::min(text.find(',', at), text.size());
    all.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return all;
}

/// Zero is the default, a negative number is zero.
template <class T>
T or_none(T value, T fallback) {
  return value < 0 ? T(0) : or_default(value, fallback);
}

capture::Bearing bearing_from(int32_t bearing) {
  if (bearing == LH_BEARING_GRAVITY) return capture::Bearing::gravity;
  if (bearing == LH_BEARING_FIXED) return capture::Bearing::fixed;
  if (bearing == LH_BEARING_MOTOR) return capture::Bearing::motor;
  invalid("expected LH_BEARING_…, found " + std::to_string(bearing), "bearing");
}

capture::HemisphereOptions views_from(const lh_plan_options& o) {
  capture::HemisphereOptions views;
  views.center = point_from(o.center, "center");
  views.radius_m = or_default(o.radius_m, views.radius_m);
  views.azimuths = or_default(int(o.azimuths), views.azimuths);
  views.rows = or_default(int(o.rows), views.rows);
  views.spacing_rad = o.spacing_rad;
  views.thin = o.thin;
  views.phi_from_rad = o.phi_from_rad;
  views.phi_to_rad = or_default(o.phi_to_rad, views.phi_to_rad);
  if (o.own_tilt) views.tilt_factor = o.tilt_factor, views.tilt_offset_rad = o.tilt_offset_rad;
  views.bearing = bearing_from(o.bearing);
  views.bearing_tolerance_rad = o.bearing_tolerance_rad;
  views.settle_s = or_none(o.settle_s, views.settle_s);
  views.exposure_s = or_default(o.exposure_s, views.exposure_s);
  return views;
}

capture::PlannerOptions planner_from(const lh_plan_options& o) {
  capture::PlannerOptions options;
  options.limits.clearance_m = or_default(o.clearance_m, options.limits.clearance_m);
  options.limits.cable_clearance_m = or_default(o.cable_clearance_m, options.limits.cable_clearance_m);
  options.object = keep_out_from(o.object, "object");
  if (o.cameras) options.cameras = words(o.cameras);
  options.turn_s = or_default(o.turn_s, options.turn_s);
  options.pictures_per_battery = or_none(int(o.pictures_per_battery), options.pictures_per_battery);
  options.kicks = or_none(int(o.kicks), options.kicks);
  options.seed = or_default(o.seed, options.seed);
  return options;
}

capture::PlannedTour tour_from(const lh_plan_options& o, const capture::PlannerOptions& options, Job& job) {
  const capture::HemisphereOptions views = views_from(o);
  if (o.mechanism) {
    if (o.robot && std::string_view(o.robot) != "cables")
      invalid("expected \"cables\" or NULL with a mechanism, found \"" + std::string(o.robot) + "\"", "robot");
    const auto make = o.raster ? capture::raster_tour : capture::plan_tour;
    return make(o.mechanism->value, views, options, job);
  }
  const std::string robot = o.robot ? o.robot : "hand";
  const double travel = or_default(o.travel_s, robot == "turntable" ? 3.0 : 10.0);
  const auto orientation = o.landscape ? capture::Orientation::landscape : capture::Orientation::portrait;
  return capture::view_tour(robot, views, orientation, options.cameras, travel);
}

const PlannedStop& stop_of(const lh_plan* plan, size_t stop) {
  const auto& stops = given(plan, "plan").value.plan.stops;
  return stops[index(stop, stops.size(), "stop")];
}

}  // namespace

std::optional<capture::KeepOut> lumihull::capi::keep_out_from(const lh_keep_out* user, const char* name) {
  if (!user) return std::nullopt;
  const lh_keep_out o = read_struct(user, name);
  return capture::KeepOut{point_from(o.base, name), o.radius_m, o.height_m};
}

lh_stop lumihull::capi::stop_to(const PlannedStop& s) {
  lh_stop out{};
  out.struct_size = sizeof out;
  out.theta_rad = s.theta_rad, out.phi_rad = s.phi_rad, out.roll_rad = s.roll_rad;
  pose_to(s.world_from_platform, out.world_from_platform);
  pose_to(s.cam_from_world, out.cam_from_world);
  out.travel_s = s.travel_s, out.settle_s = s.settle_s, out.exposure_s = s.exposure_s;
  out.cables = s.lengths_m.size();
  out.photograph = s.photograph;
  return out;
}

lh_status lh_optics_camera(lh_context* ctx, const lh_optics* optics, double focus_m, lh_camera* camera) {
  return guarded(
      ctx, [&] { write_struct(camera, camera_to(capture::ideal_camera(optics_from(optics), focus_m)), "camera"); });
}

lh_status lh_optics_fill_radius(lh_context* ctx, const lh_optics* optics, const lh_object_size* object,
                                int32_t landscape, double margin, double pointing_error_rad, double* radius_m) {
  return guarded(ctx, [&] {
    given(radius_m, "radius_m");
    const auto orientation = landscape ? capture::Orientation::landscape : capture::Orientation::portrait;
    *radius_m = capture::fill_radius(optics_from(optics), object_from(object), orientation, margin, pointing_error_rad);
  });
}

lh_status lh_object_keep_out(lh_context* ctx, const lh_object_size* object, const double center[3], double floor_m,
                             lh_keep_out* out) {
  return guarded(ctx, [&] {
    const capture::KeepOut k = capture::standing_object(object_from(object), point_from(center, "center"), floor_m);
    lh_keep_out value{};
    Eigen::Map<Eigen::Vector3d>(value.base, 3) = k.base;
    value.radius_m = k.radius_m;
    value.height_m = k.height_m;
    write_struct(out, value, "out");
  });
}

lh_status lh_plan_hemisphere(lh_context* ctx, const lh_plan_options* user, lh_plan** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const lh_plan_options o = read_struct(user, "options");
    const capture::PlannerOptions options = planner_from(o);
    give(out, tour_from(o, options, job), options.limits);
  });
}

lh_status lh_plan_load(lh_context* ctx, const char* file, lh_plan** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    capture::PlannedTour tour;
    tour.plan = capture::read_plan(path(file, "file"));
    give(out, std::move(tour), capture::PoseLimits{});
  });
}

lh_status lh_plan_save(lh_context* ctx, const lh_plan* plan, const char* file) {
  return guarded(ctx, [&] { capture::write_plan(given(plan, "plan").value.plan, path(file, "file")); });
}

void lh_plan_destroy(lh_plan* plan) { delete plan; }

size_t lh_plan_stop_count(const lh_plan* plan) { return plan ? plan->value.plan.stops.size() : 0; }

double lh_plan_duration(const lh_plan* plan) { return plan ? capture::duration_s(plan->value.plan) : 0; }

lh_status lh_plan_mechanism(lh_context* ctx, const lh_plan* plan, lh_mechanism** out) {
  return guarded(ctx, [&] {
    const auto& mechanism = given(plan, "plan").value.plan.mechanism;
    given(out, "out");
    if (!mechanism) throw Error(ErrorCode::not_found, "the plan has no mechanism", "plan");
    give(out, *mechanism);
  });
}

lh_status lh_plan_stop(lh_context* ctx, const lh_plan* plan, size_t stop, lh_stop* out) {
  return guarded(ctx, [&] { write_struct(out, stop_to(stop_of(plan, stop)), "out"); });
}

lh_status lh_plan_stop_name(lh_context* ctx, const lh_plan* plan, size_t stop, char* buffer, size_t size,
                            size_t* needed) {
  return guarded(ctx, [&] { give_text(stop_of(plan, stop).name, buffer, size, needed); });
}

lh_status lh_plan_stop_pause(lh_context* ctx, const lh_plan* plan, size_t stop, char* buffer, size_t size,
                             size_t* needed) {
  return guarded(ctx, [&] { give_text(stop_of(plan, stop).pause, buffer, size, needed); });
}

lh_status lh_plan_stop_lengths(lh_context* ctx, const lh_plan* plan, size_t stop, double* lengths_m, size_t n) {
  return guarded(ctx, [&] {
    const auto& lengths = stop_of(plan, stop).lengths_m;
    const auto to = room(lengths_m, n, lengths.size(), 1, "lengths_m");
    std::copy(lengths.begin(), lengths.end(), to.begin());
  });
}

lh_status lh_plan_describe(lh_context* ctx, const lh_plan* plan, char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    const lh_plan& p = given(plan, "plan");
    give_text(capture::describe_json(p.value, p.limits), buffer, size, needed);
  });
}

lh_status lh_plan_judge(lh_context* ctx, const lh_plan* plan, const lh_camera* camera, const lh_object_size* object,
                        const double center[3], lh_plan_report* out) {
  return guarded(ctx, [&] {
    const capture::PlanReport r = capture::report(given(plan, "plan").value.plan, camera_from(camera, "camera"),
                                                  object_from(object), point_from(center, "center"));
    lh_plan_report value{};
    value.photographs = r.photographs;
    value.cut_off = r.cut_off.size();
    value.least_margin_px = r.least_margin_px;
    value.median_fill = r.median_fill;
    value.least_tension_N = r.least_tension_N;
    value.greatest_tension_N = r.greatest_tension_N;
    value.least_clearance_m = r.least_clearance_m;
    value.cables_in_picture = r.cables_known ? int64_t(r.cables_in_picture.size()) : -1;
    write_struct(out, value, "out");
  });
}
