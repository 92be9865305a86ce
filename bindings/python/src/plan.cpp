// Plans of a capture, on NumPy's arrays.
#include <lumihull/capture/optics.h>
#include <lumihull/capture/plan_report.h>
#include <lumihull/capture/planner.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <numbers>
#include <tuple>

#include "bindings.h"
#include "planned.h"

namespace lumihull::python {

using namespace py::literals;
using namespace lumihull::capture;

namespace {

Eigen::Vector3d point_from(const Array<double>& array, const char* name) {
  if (array.ndim() != 1 || array.shape(0) != 3) invalid("expected three numbers", name);
  const Eigen::Vector3d point = Eigen::Map<const Eigen::Vector3d>(array.data());
  if (!point.allFinite()) invalid("expected finite numbers", name);
  return point;
}

Orientation orientation_from(const std::string& text) {
  if (text == "portrait") return Orientation::portrait;
  if (text == "landscape") return Orientation::landscape;
  invalid("expected \"portrait\" or \"landscape\"", "orientation");
}

Bearing bearing_from(const std::string& text) {
  if (text == "gravity") return Bearing::gravity;
  if (text == "fixed") return Bearing::fixed;
  if (text == "motor") return Bearing::motor;
  invalid("expected \"gravity\", \"fixed\" or \"motor\"", "bearing");
}

/// (stops, 3) or another value of each stop.
template <class Value>
Array<double> of_stops(const Planned& p, py::ssize_t columns, const Value& value) {
  const auto& stops = p.tour.plan.stops;
  Array<double> out({py::ssize_t(stops.size()), columns});
  for (std::size_t i = 0; i < stops.size(); ++i) value(stops[i], out.mutable_data() + py::ssize_t(i) * columns);
  return out;
}

const PlannedStop& stop_at(const Planned& p, py::ssize_t i) {
  const auto n = py::ssize_t(p.tour.plan.stops.size());
  if (i < 0) i += n;
  if (i < 0 || i >= n) throw py::index_error("the plan has " + std::to_string(n) + " stops");
  return p.tour.plan.stops[std::size_t(i)];
}

Planned hemisphere(const std::optional<Mechanism>& mechanism, const std::string& robot,
                   const std::vector<std::string>& cameras, const Array<double>& center, double radius_m, int azimuths,
                   int row_count, double spacing_rad, bool thin, const std::pair<double, double>& phi_rad,
                   const std::pair<double, double>& tilt, const std::string& bearing, double bearing_tolerance_rad,
                   const std::string& orientation, double settle_s, double exposure_s, std::optional<double> travel_s,
                   const std::optional<KeepOut>& object, double clearance_m, double cable_clearance_m,
                   int pictures_per_battery, bool raster, int kicks, std::uint64_t seed, const py::object& progress,
                   unsigned threads) {
  HemisphereOptions views;
  views.center = point_from(center, "center");
  views.radius_m = radius_m;
  views.azimuths = azimuths, views.rows = row_count;
  views.spacing_rad = spacing_rad, views.thin = thin;
  std::tie(views.phi_from_rad, views.phi_to_rad) = phi_rad;
  std::tie(views.tilt_factor, views.tilt_offset_rad) = tilt;
  views.bearing = bearing_from(bearing);
  views.bearing_tolerance_rad = bearing_tolerance_rad;
  views.settle_s = settle_s, views.exposure_s = exposure_s;
  const Orientation held = orientation_from(orientation);
  PlannerOptions options;
  options.limits = {clearance_m, cable_clearance_m};
  options.object = object;
  options.cameras = cameras;
  options.pictures_per_battery = pictures_per_battery;
  options.kicks = kicks, options.seed = seed;
  const auto make = [&](Job& job) {
    if (!mechanism) return view_tour(robot, views, held, cameras, travel_s.value_or(robot == "turntable" ? 3 : 10));
    return raster ? raster_tour(*mechanism, views, options, job) : plan_tour(*mechanism, views, options, job);
  };
  return {work(progress, threads, make), options.limits};
}

void bind_optics(py::module_& module) {
  py::class_<Optics>(module, "Optics", "Lens and sensor, as their makers give them.")
      .def(py::init([](double focal_length_mm, const std::pair<double, double>& sensor_mm,
                       const std::pair<int, int>& pixels, double f_number, double circle_of_confusion_mm) {
             Optics o;
             o.focal_length_mm = focal_length_mm;
             std::tie(o.sensor_width_mm, o.sensor_height_mm) = sensor_mm;
             std::tie(o.width_px, o.height_px) = pixels;
             o.f_number = f_number;
             o.circle_of_confusion_mm = circle_of_confusion_mm;
             check(o);
             return o;
           }),
           "focal_length_mm"_a = 18.0, "sensor_mm"_a = std::pair(22.7, 15.1), "pixels"_a = std::pair(3072, 2048),
           "f_number"_a = 16.0, "circle_of_confusion_mm"_a = 0.015)
      .def(
          "camera", [](const Optics& o, double focus_m) { return ideal_camera(o, focus_m); }, "focus_m"_a,
          "The camera without distortion that the lens makes when focused at a distance.")
      .def(
          "fill_radius",
          [](const Optics& o, double diameter_m, double height_m, const std::string& orientation, double margin,
             double pointing_error_rad) {
            return fill_radius(o, {diameter_m, height_m}, orientation_from(orientation), margin, pointing_error_rad);
          },
          "diameter_m"_a, "height_m"_a = 0.0, py::kw_only(), "orientation"_a = "portrait", "margin"_a = 0.05,
          "pointing_error_rad"_a = 0.0,
          "The smallest radius of a hemisphere, m, from all of which the object (an upright cylinder, or a sphere) "
          "fills "
          "the picture but for a margin (share, each side).");
  module.def(
      "standing_object",
      [](double diameter_m, double height_m, const Array<double>& center, double floor_m) {
        return standing_object({diameter_m, height_m}, point_from(center, "center"), floor_m);
      },
      "diameter_m"_a, "height_m"_a, "center"_a, "floor_m"_a,
      "The KeepOut of an object on its pedestal, from the floor to its top; height_m 0: a sphere.");
}

void bind_stop(py::module_& module) {
  py::class_<PlannedStop>(module, "Stop", "A stop of a plan.")
      .def_readonly("name", &PlannedStop::name)
      .def_readonly("theta_rad", &PlannedStop::theta_rad, "Azimuth of the view.")
      .def_readonly("phi_rad", &PlannedStop::phi_rad, "From straight above.")
      .def_readonly("roll_rad", &PlannedStop::roll_rad, "Of the camera's bearing.")
      .def_readonly("pose", &PlannedStop::world_from_platform, "world_from_platform.")
      .def_readonly("cam_from_world", &PlannedStop::cam_from_world, "Commanded.")
      .def_property_readonly(
          "lengths",
          [](const PlannedStop& s) { return Array<double>(py::ssize_t(s.lengths_m.size()), s.lengths_m.data()); },
          "(cables,), m.")
      .def_readonly("travel_s", &PlannedStop::travel_s, "From the stop before.")
      .def_readonly("settle_s", &PlannedStop::settle_s)
      .def_readonly("exposure_s", &PlannedStop::exposure_s)
      .def_readonly("photograph", &PlannedStop::photograph, "False: it is only passed.")
      .def_readonly("pause", &PlannedStop::pause, "What the operator is asked to do before; else ''.");
}

void bind_plan_type(py::module_& module) {
  py::class_<Planned>(module, "Plan", "Where photographs are taken, in which order; see plan_hemisphere.")
      .def_static(
          "load",
          [](const std::filesystem::path& file) {
            py::gil_scoped_release without_gil;
            Planned p;
            p.tour.plan = read_plan(file);
            return p;
          },
          "file"_a, "From a plan.json.")
      .def(
          "save",
          [](const Planned& p, const std::filesystem::path& file) {
            py::gil_scoped_release without_gil;
            write_plan(p.tour.plan, file);
          },
          "file"_a)
      .def(
          "__len__", [](const Planned& p) { return p.tour.plan.stops.size(); }, "Number of stops.")
      .def(
          "__getitem__", [](const Planned& p, py::ssize_t i) { return stop_at(p, i); }, "stop"_a)
      .def_property_readonly("robot", [](const Planned& p) { return p.tour.plan.robot; })
      .def_property_readonly("cameras", [](const Planned& p) { return p.tour.plan.cameras; })
      .def_property_readonly("mechanism", [](const Planned& p) { return p.tour.plan.mechanism; })
      .def_property_readonly("object", [](const Planned& p) { return p.tour.plan.object; })
      .def_property_readonly(
          "duration_s", [](const Planned& p) { return duration_s(p.tour.plan); },
          "Travel, settling and exposures of all stops.")
      .def_property_readonly(
          "names",
          [](const Planned& p) {
            std::vector<std::string> names;
            for (const PlannedStop& stop : p.tour.plan.stops) names.push_back(stop.name);
            return names;
          },
          "Of the stops.")
      .def_property_readonly(
          "positions",
          [](const Planned& p) {
            return of_stops(p, 3, [](const PlannedStop& s, double* out) {
              Eigen::Map<Eigen::Vector3d>(out, 3) = s.world_from_platform.translation;
            });
          },
          "(stops, 3): of the platform, world, m.")
      .def_property_readonly(
          "angles",
          [](const Planned& p) {
            return of_stops(p, 3, [](const PlannedStop& s, double* out) {
              out[0] = s.theta_rad, out[1] = s.phi_rad, out[2] = s.roll_rad;
            });
          },
          "(stops, 3): theta, phi, roll, rad.")
      .def_property_readonly(
          "lengths",
          [](const Planned& p) {
            const auto& mechanism = p.tour.plan.mechanism;
            const auto cables = mechanism ? py::ssize_t(mechanism->cables.size()) : 0;
            return of_stops(p, cables, [](const PlannedStop& s, double* out) {
              std::copy(s.lengths_m.begin(), s.lengths_m.end(), out);
            });
          },
          "(stops, cables), m.")
      .def_property_readonly(
          "left_out", [](const Planned& p) { return p.tour.left_out; },
          "Names of stops that can't be taken; nothing is known of a loaded plan's.")
      .def_property_readonly(
          "problems",
          [](const Planned& p) {
            py::gil_scoped_release without_gil;
            return plan_problems(p.tour.plan, p.limits);
          },
          "Stops and ways that its mechanism can't take, in words.")
      .def(
          "describe",
          [](const Planned& p) { return py::module_::import("json").attr("loads")(describe_json(p.tour, p.limits)); },
          "Figures, what was left out and why, notes, problems.")
      .def(
          "judge",
          [](const Planned& p, const Camera& camera, double diameter_m, double height_m, const Array<double>& center) {
            const Eigen::Vector3d c = point_from(center, "center");
            PlanReport r;
            {
              py::gil_scoped_release without_gil;
              r = report(p.tour.plan, camera, {diameter_m, height_m}, c);
            }
            return py::dict("photographs"_a = r.photographs, "cut_off"_a = r.cut_off,
                            "least_margin_px"_a = r.least_margin_px, "median_fill"_a = r.median_fill,
                            "least_tension_N"_a = r.least_tension_N, "greatest_tension_N"_a = r.greatest_tension_N,
                            "least_clearance_m"_a = r.least_clearance_m);
          },
          "camera"_a, "diameter_m"_a, "height_m"_a = 0.0, "center"_a = std::vector<double>{0, 0, 0},
          "What its photographs will show of an object, and what it asks of the mechanism.");
  module.def("plan_hemisphere", &hemisphere, "mechanism"_a = py::none(), py::kw_only(), "robot"_a = "hand",
             "cameras"_a = std::vector<std::string>{"camera"}, "center"_a = std::vector<double>{0, 0, 0},
             "radius_m"_a = 1.5, "azimuths"_a = 24, "rows"_a = 10, "spacing_rad"_a = 0.0, "thin"_a = false,
             "phi_rad"_a = std::pair(0.0, std::numbers::pi / 2), "tilt"_a = std::pair(2.0 / 3, -std::numbers::pi / 6),
             "bearing"_a = "gravity", "bearing_tolerance_rad"_a = 0.0, "orientation"_a = "portrait", "settle_s"_a = 7.0,
             "exposure_s"_a = 0.5, "travel_s"_a = py::none(), "object"_a = py::none(), "clearance_m"_a = 0.05,
             "cable_clearance_m"_a = 0.005, "pictures_per_battery"_a = 1000, "raster"_a = false, "kicks"_a = 1000,
             "seed"_a = 1, "progress"_a = py::none(), "threads"_a = 0,
             "Views of an object from a hemisphere, in an order that travels little (raster: azimuth by azimuth). The "
             "platform is tilted by factor x phi + offset (tilt). Without a mechanism: views of a \"turntable\" or a "
             "\"hand\", `travel_s` apart. Stops that can't be taken are left out.");
}

}  // namespace

void bind_plan(py::module_& module) {
  bind_optics(module);
  bind_stop(module);
  bind_plan_type(module);
}

}  // namespace lumihull::python
