// The robot's mechanism and its calibration, on NumPy's arrays.
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/design.h>
#include <lumihull/capture/forward.h>
#include <lumihull/capture/mechanism_calibration.h>
#include <lumihull/capture/sensitivity.h>
#include <lumihull/capture/statics.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;
using namespace lumihull::capture;

namespace {

template <class Values>
Array<double> vector_of(const Values& values) {
  Array<double> out(py::ssize_t(values.size()));
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

Eigen::Vector3d point_from(const Array<double>& array, const char* name) {
  if (array.ndim() != 1 || array.shape(0) != 3) invalid("expected three numbers", name);
  return Eigen::Map<const Eigen::Vector3d>(array.data());
}

/// (n,) of one value a cable.
std::span<const double> values(const Array<double>& array, const char* name) {
  if (array.ndim() != 1) invalid("expected an array of shape (cables,)", name);
  return {array.data(), std::size_t(array.shape(0))};
}

/// (cables, 3) of a point of each cable.
Array<double> points_of(const Mechanism& m, Eigen::Vector3d Cable::*point) {
  Array<double> out({py::ssize_t(m.cables.size()), py::ssize_t(3)});
  for (std::size_t i = 0; i < m.cables.size(); ++i)
    Eigen::Map<Eigen::Vector3d>(out.mutable_data() + 3 * i) = m.cables[i].*point;
  return out;
}

void set_points(Mechanism& m, Eigen::Vector3d Cable::*point, const std::optional<Array<double>>& array,
                const char* name) {
  if (!array) return;
  if (rows(*array, 3, name) != m.cables.size()) invalid("expected an array of shape (cables, 3)", name);
  for (std::size_t i = 0; i < m.cables.size(); ++i)
    m.cables[i].*point = Eigen::Map<const Eigen::Vector3d>(array->data() + 3 * i);
}

/// One number of each cable: an array, or one number for all.
Array<double> numbers_of(const Mechanism& m, double Cable::*number) {
  Array<double> out(py::ssize_t(m.cables.size()));
  for (std::size_t i = 0; i < m.cables.size(); ++i) out.mutable_data()[i] = m.cables[i].*number;
  return out;
}

void set_numbers(Mechanism& m, double Cable::*number, const std::optional<Array<double>>& array, const char* name) {
  if (!array) return;
  const bool one = array->ndim() == 0;
  if (!one && (array->ndim() != 1 || std::size_t(array->shape(0)) != m.cables.size()))
    invalid("expected a number, or an array of shape (cables,)", name);
  for (std::size_t i = 0; i < m.cables.size(); ++i) m.cables[i].*number = array->data()[one ? 0 : i];
}

const char* word(Balance balance) {
  switch (balance) {
    case Balance::controlled:
      return "controlled";
    case Balance::loose:
      return "loose";
    case Balance::singular:
      return "singular";
    case Balance::unbalanced:
      return "unbalanced";
  }
  return "unbalanced";
}

void bind_results(py::module_& module) {
  py::class_<Tensions>(module, "Tensions", "What the cables bear; see Mechanism.tensions.")
      .def_property_readonly("state", [](const Tensions& t) { return word(t.balance); })
      .def_property_readonly(
          "tensions", [](const Tensions& t) { return vector_of(t.tension_N); }, "(cables,), N, >= 0.")
      .def_readonly("residual_N", &Tensions::residual_N)
      .def_readonly("smallest_singular", &Tensions::smallest_singular);
  py::class_<Sensitivity>(module, "Sensitivity", "The platform's largest motion from errors of lengths: m/m and rad/m.")
      .def_readonly("translation_each", &Sensitivity::translation_each)
      .def_readonly("rotation_each", &Sensitivity::rotation_each)
      .def_readonly("translation_joint", &Sensitivity::translation_joint)
      .def_readonly("rotation_joint", &Sensitivity::rotation_joint);
  py::class_<Hanging>(module, "Hanging", "Where the platform hangs; see Mechanism.hang.")
      .def_readonly("pose", &Hanging::world_from_platform, "world_from_platform.")
      .def_property_readonly(
          "tensions", [](const Hanging& h) { return vector_of(h.tension_N); }, "(cables,), N; 0 where one is slack.")
      .def_readonly("taut", &Hanging::taut)
      .def_readonly("iterations", &Hanging::iterations);
  py::class_<Clearance>(module, "Clearance", "Least distances of surfaces, m; negative: they intersect.")
      .def_readonly("cable_cable", &Clearance::cable_cable)
      .def_readonly("cable_platform", &Clearance::cable_platform)
      .def_readonly("cable_camera", &Clearance::cable_camera)
      .def_readonly("cable_object", &Clearance::cable_object)
      .def_readonly("platform_object", &Clearance::platform_object)
      .def_readonly("platform_room", &Clearance::platform_room);
  py::class_<Crossing>(module, "Crossing", "Two cables that pass through each other on a straight way.")
      .def_readonly("first", &Crossing::first)
      .def_readonly("second", &Crossing::second)
      .def_readonly("at", &Crossing::at, "0 to 1 of the way.");
  py::class_<KeepOut>(module, "KeepOut", "What must not be touched: an upright cylinder with a half-sphere's cap.")
      .def(py::init([](const Array<double>& base, double radius_m, double height_m) {
             return KeepOut{point_from(base, "base"), radius_m, height_m};
           }),
           "base"_a, "radius_m"_a, "height_m"_a)
      .def_property_readonly(
          "base", [](const KeepOut& k) { return vector_of(k.base); }, "(3,): centre of its lower end, world.")
      .def_readonly("radius_m", &KeepOut::radius_m)
      .def_readonly("height_m", &KeepOut::height_m, "Of the cylinder, without the cap.");
}

Mechanism replaced(const Mechanism& mechanism, const std::optional<Array<double>>& departures,
                   const std::optional<Array<double>>& attachments, const std::optional<Array<double>>& min_tensions,
                   const std::optional<Array<double>>& max_tensions, const std::optional<Array<double>>& stiffnesses,
                   std::optional<double> mass_kg, const std::optional<Array<double>>& center_of_mass) {
  Mechanism m = mechanism;
  set_points(m, &Cable::departure, departures, "departures");
  set_points(m, &Cable::attachment, attachments, "attachments");
  set_numbers(m, &Cable::min_tension_N, min_tensions, "min_tensions");
  set_numbers(m, &Cable::max_tension_N, max_tensions, "max_tensions");
  set_numbers(m, &Cable::stiffness_N, stiffnesses, "stiffnesses");
  if (mass_kg) m.mass_kg = *mass_kg;
  if (center_of_mass) m.center_of_mass = point_from(*center_of_mass, "center_of_mass");
  check(m);
  return m;
}

void bind_files_and_parts(py::class_<Mechanism>& type) {
  type.def_static(
          "load",
          [](const std::filesystem::path& file) {
            py::gil_scoped_release without_gil;
            return read_mechanism(file);
          },
          "file"_a, "From a mechanism.json.")
      .def_static("paper", &paper_mechanism, "Six cables in a room of 10 x 12 x 6 m, the object 1 m above the floor.")
      .def_static("large", &large_mechanism, "Six cables in a room of 16 x 18 x 10 m: for views from 2.7 m.")
      .def(
          "save",
          [](const Mechanism& m, const std::filesystem::path& file) {
            py::gil_scoped_release without_gil;
            write_mechanism(m, file);
          },
          "file"_a)
      .def("replace", &replaced, py::kw_only(), "departures"_a = py::none(), "attachments"_a = py::none(),
           "min_tensions"_a = py::none(), "max_tensions"_a = py::none(), "stiffnesses"_a = py::none(),
           "mass_kg"_a = py::none(), "center_of_mass"_a = py::none(),
           "A copy with other values: points (cables, 3); of the cables a number each, or one for all.")
      .def(
          "__len__", [](const Mechanism& m) { return m.cables.size(); }, "Number of cables.")
      .def_readonly("name", &Mechanism::name)
      .def_property_readonly(
          "cables",
          [](const Mechanism& m) {
            std::vector<std::string> names;
            for (const Cable& cable : m.cables) names.push_back(cable.name);
            return names;
          },
          "Their names.")
      .def_property_readonly(
          "departures", [](const Mechanism& m) { return points_of(m, &Cable::departure); },
          "(cables, 3): where cables leave the walls, world, m.")
      .def_property_readonly(
          "attachments", [](const Mechanism& m) { return points_of(m, &Cable::attachment); },
          "(cables, 3): on the platform, in its frame, m.")
      .def_property_readonly(
          "min_tensions", [](const Mechanism& m) { return numbers_of(m, &Cable::min_tension_N); }, "(cables,), N.")
      .def_property_readonly(
          "max_tensions", [](const Mechanism& m) { return numbers_of(m, &Cable::max_tension_N); }, "(cables,), N.")
      .def_property_readonly(
          "stiffnesses", [](const Mechanism& m) { return numbers_of(m, &Cable::stiffness_N); },
          "(cables,): Young's modulus x cross-section, N; 0: does not stretch.")
      .def_readonly("mass_kg", &Mechanism::mass_kg)
      .def_property_readonly(
          "center_of_mass", [](const Mechanism& m) { return vector_of(m.center_of_mass); },
          "(3,): in the platform's frame, m.")
      .def_readonly("gravity_m_s2", &Mechanism::gravity_m_s2)
      .def_property_readonly(
          "room", [](const Mechanism& m) { return py::make_tuple(vector_of(m.room.min()), vector_of(m.room.max())); },
          "Two corners, (3,) each: world, m.");
}

void bind_mechanism_type(py::module_& module) {
  py::class_<Mechanism> type(module, "Mechanism",
                             "A platform that hangs on 3 to 12 cables and carries the camera. World: z up, metres. A "
                             "pose is world_from_platform.");
  bind_files_and_parts(type);
  type.def(
          "camera",
          [](const Mechanism& m, double bearing_rad) {
            if (!std::isfinite(bearing_rad)) invalid("expected a finite number", "bearing_rad");
            return cam_from_platform(m, bearing_rad);
          },
          "bearing_rad"_a = 0.0, "cam_from_platform while the camera's bearing is turned by an angle.")
      .def(
          "lengths", [](const Mechanism& m, const Pose& pose) { return vector_of(cable_lengths(m, pose)); }, "pose"_a,
          "(cables,): straight lengths, m.")
      .def(
          "wrench_matrix",
          [](const Mechanism& m, const Pose& pose) {
            const WrenchMatrix w = wrench_matrix(m, pose);
            Array<double> out({py::ssize_t(6), py::ssize_t(w.cols())});
            Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>>(out.mutable_data(), 6, w.cols()) = w;
            return out;
          },
          "pose"_a, "(6, cables): forces and torques about the platform's origin, world axes, of 1 N in each cable.")
      .def(
          "tensions", [](const Mechanism& m, const Pose& pose) { return tensions(m, pose); }, "pose"_a,
          "What holds the platform there under gravity.")
      .def(
          "sensitivity", [](const Mechanism& m, const Pose& pose) { return sensitivity(m, pose); }, "pose"_a)
      .def(
          "unstrained_lengths",
          [](const Mechanism& m, const Pose& pose) { return vector_of(unstrained_lengths(m, pose)); }, "pose"_a,
          "(cables,): what to wind out so that the platform hangs there, m.")
      .def(
          "hang",
          [](const Mechanism& m, const Array<double>& lengths, const Pose& start, bool elastic) {
            const auto l = values(lengths, "lengths");
            py::gil_scoped_release without_gil;
            return elastic ? hang_elastic(m, l, start) : hang_rigid(m, l, start);
          },
          "lengths"_a, "start"_a, py::kw_only(), "elastic"_a = false,
          "Where the platform hangs with lengths (cables,), m, near `start`. elastic: lengths are unstretched; each "
          "cable needs a stiffness.")
      .def(
          "clearance",
          [](const Mechanism& m, const Pose& pose, const KeepOut* object) { return clearance(m, pose, object); },
          "pose"_a, "object"_a = py::none())
      .def(
          "crossing", [](const Mechanism& m, const Pose& from, const Pose& to) { return first_crossing(m, from, to); },
          "start"_a, "end"_a, "The first one on the straight way, or None.");
}

std::vector<MechanismObservation> observations_from(const Mechanism& guess, const std::vector<Pose>& poses,
                                                    const Array<double>& commanded,
                                                    const std::optional<std::vector<int>>& groups,
                                                    const std::optional<std::vector<double>>& bearings,
                                                    const std::optional<Array<double>>& covariances) {
  const std::size_t n = poses.size(), cables = guess.cables.size();
  if (rows(commanded, py::ssize_t(cables), "commanded") != n) invalid("expected as many rows as poses", "commanded");
  if (groups && groups->size() != n) invalid("expected as many as poses", "groups");
  if (bearings && bearings->size() != n) invalid("expected as many as poses", "bearings");
  if (covariances && (covariances->ndim() != 3 || std::size_t(covariances->shape(0)) != n ||
                      covariances->shape(1) != 6 || covariances->shape(2) != 6))
    invalid("expected an array of shape (n, 6, 6)", "covariances");
  std::vector<MechanismObservation> observations(n);
  for (std::size_t k = 0; k < n; ++k) {
    MechanismObservation& o = observations[k];
    o.name = std::to_string(k);
    o.cam_from_world = poses[k];
    o.commanded_m.assign(commanded.data() + cables * k, commanded.data() + cables * (k + 1));
    if (groups) o.bearing_group = (*groups)[k];
    if (bearings) o.bearing_rad = (*bearings)[k];
    if (covariances) o.covariance = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(covariances->data() + 36 * k);
  }
  return observations;
}

void bind_calibration(py::module_& module) {
  using Result = MechanismCalibration;
  py::class_<Result>(module, "MechanismCalibration", "See calibrate_mechanism.")
      .def_property_readonly("mechanism", [](const Result& r) { return r.mechanism; })
      .def_property_readonly(
          "offsets", [](const Result& r) { return vector_of(r.offsets_m); },
          "(cables,), m: straight length = gain x commanded + offset.")
      .def_property_readonly(
          "gains", [](const Result& r) { return vector_of(r.gains); }, "(cables,).")
      .def_property_readonly(
          "bearings",
          [](const Result& r) {
            py::dict out;
            for (std::size_t i = 0; i < r.bearing_groups.size(); ++i)
              out[py::int_(r.bearing_groups[i])] = r.bearings_rad[i];
            return out;
          },
          "The bearing's angle of each group, rad.")
      .def_readonly("length_rms_m", &Result::length_rms_m)
      .def_readonly("sigma0", &Result::sigma0)
      .def_property_readonly(
          "rejected",
          [](const Result& r) {
            Array<std::int64_t> out(py::ssize_t(r.rejected.size()));
            std::copy(r.rejected.begin(), r.rejected.end(), out.mutable_data());
            return out;
          },
          "Indices of observations whose pose contradicts the others.")
      .def_readonly("parameters", &Result::parameters, "Names of the covariance's rows.")
      .def_property_readonly(
          "covariance",
          [](const Result& r) {
            Array<double> out({py::ssize_t(r.covariance.rows()), py::ssize_t(r.covariance.cols())});
            Eigen::Map<Eigen::MatrixXd>(out.mutable_data(), r.covariance.rows(), r.covariance.cols()) =
                r.covariance.transpose();
            return out;
          },
          "(parameters, parameters), m² and rad².")
      .def_readonly("unobservable", &Result::unobservable, "What these observations do not tell, in words.")
      .def(
          "commanded", [](const Result& r, const Pose& pose) { return vector_of(commanded_lengths(r, pose)); },
          "pose"_a, "(cables,): what to command so that the platform stands there, m.");
  module.def(
      "calibrate_mechanism",
      [](const Mechanism& guess, const std::vector<Pose>& poses, const Array<double>& commanded,
         const std::optional<std::vector<int>>& groups, const std::optional<std::vector<double>>& bearings,
         const std::optional<Array<double>>& covariances, bool gains, bool shared_attachments, double length_sigma_m) {
        const auto observations = observations_from(guess, poses, commanded, groups, bearings, covariances);
        MechanismCalibrationOptions options;
        options.gains = gains;
        options.shared_attachments = shared_attachments;
        options.length_sigma_m = length_sigma_m;
        return work(py::none(), 0, [&](Job&) { return calibrate_mechanism(guess, observations, options); });
      },
      "guess"_a, "poses"_a, "commanded"_a, py::kw_only(), "groups"_a = py::none(), "bearings"_a = py::none(),
      "covariances"_a = py::none(), "gains"_a = false, "shared_attachments"_a = true, "length_sigma_m"_a = 0.05e-3,
      "A mechanism from measured cam_from_world of n photographs and commanded lengths (n, cables), m. groups: the "
      "bearing stayed locked for all of a group; bearings: its nominal angle, rad; covariances (n, 6, 6): of (rotation "
      "vector, translation) applied after each pose.");
}

}  // namespace

void bind_mechanism(py::module_& module) {
  bind_results(module);
  bind_mechanism_type(module);
  bind_calibration(module);
}

}  // namespace lumihull::python
