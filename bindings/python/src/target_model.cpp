// What the stage "calibrate" found, on NumPy's arrays.
#include <lumihull/calib/target_model.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <limits>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;
using calib::TargetModel;

namespace {

const calib::CalibratedBody& body(const TargetModel& model, py::ssize_t i) {
  const auto n = py::ssize_t(model.calibration.bodies.size());
  if (i < 0) i += n;
  if (i < 0 || i >= n) throw py::index_error("the model has " + std::to_string(n) + " targets");
  return model.calibration.bodies[std::size_t(i)];
}

}  // namespace

void bind_target_model(py::module_& module) {
  py::class_<TargetModel>(module, "TargetModel",
                          "The targets of a calibrated capture as solved; each a target of its own, or a board.")
      .def_static(
          "of",
          [](const Capture& capture) {
            py::gil_scoped_release without_gil;
            return TargetModel::of(capture);
          },
          "capture"_a, "What the stage \"calibrate\" left: targets.json, cameras, poses.")
      .def_static(
          "load",
          [](const std::filesystem::path& file) {
            py::gil_scoped_release without_gil;
            return TargetModel::load(file);
          },
          "file"_a, "A targets.json alone, without cameras and poses.")
      .def("__len__", [](const TargetModel& m) { return m.calibration.bodies.size(); })
      .def_property_readonly(
          "names",
          [](const TargetModel& m) {
            std::vector<std::string> names;
            for (const calib::CalibratedBody& b : m.calibration.bodies) names.push_back(b.name);
            return names;
          },
          "\"matrix5x5 17\", or a board's name.")
      .def(
          "pose",
          [](const TargetModel& m, py::ssize_t i) -> std::optional<Pose> {
            const calib::CalibratedBody& b = body(m, i);
            return b.placed ? std::optional(b.body.world_from_body) : std::nullopt;
          },
          "target"_a, "world_from_body, or None where it could not be placed.")
      .def(
          "part", [](const TargetModel& m, py::ssize_t i) { return body(m, i).part; }, "target"_a,
          "Which part of the photographs it was solved with, for parts share no target; 0: the placed one; -1: none.")
      .def(
          "pose_in_part", [](const TargetModel& m, py::ssize_t i) { return body(m, i).part_from_body; }, "target"_a,
          "part_from_body, in the frame of its part; None without one.")
      .def_property_readonly(
          "photos",
          [](const TargetModel& m) {
            py::list photos;
            for (std::size_t i = 0; i < m.photos.size(); ++i) {
              const calib::CalibratedPhoto& p = m.calibration.photos.at(i);
              photos.append(py::dict("name"_a = m.photos[i].name, "camera"_a = m.photos[i].camera, "part"_a = p.part,
                                     "cam_from_part"_a = p.cam_from_part, "in_model"_a = p.in_model,
                                     "reason"_a = p.reason));
            }
            return photos;
          },
          "A dictionary a photograph: name, camera, part (-1: no pose), cam_from_part, in_model, reason.")
      .def(
          "features",
          [](const TargetModel& m, py::ssize_t i) {
            const calib::CalibratedBody& b = body(m, i);
            Array<std::int32_t> out({py::ssize_t(b.features.size()), py::ssize_t(3)});
            for (std::size_t k = 0; k < b.features.size(); ++k) {
              std::int32_t* row = out.mutable_data() + 3 * k;
              row[0] = b.features[k].design, row[1] = b.features[k].id, row[2] = b.features[k].feature;
            }
            return out;
          },
          "target"_a, "(n, 3): design, id and feature of its points.")
      .def(
          "points",
          [](const TargetModel& m, py::ssize_t i) {
            const calib::CalibratedBody& b = body(m, i);
            Array<double> out({py::ssize_t(b.points.size()), py::ssize_t(3)});
            for (std::size_t k = 0; k < b.points.size(); ++k)
              Eigen::Map<Eigen::Vector3d>(out.mutable_data() + 3 * k) = b.points[k];
            return out;
          },
          "target"_a, "(n, 3): its points in the world, metres; n = 0 where it could not be placed.")
      .def(
          "covariances",
          [](const TargetModel& m, py::ssize_t i) {
            const calib::CalibratedBody& b = body(m, i);
            Array<double> out({py::ssize_t(b.point_covariances.size()), py::ssize_t(3), py::ssize_t(3)});
            for (std::size_t k = 0; k < b.point_covariances.size(); ++k)
              Eigen::Map<Eigen::Matrix3d>(out.mutable_data() + 9 * k) = b.point_covariances[k];
            return out;
          },
          "target"_a, "(n, 3, 3): of the points, m².")
      .def(
          "describe",
          [](const TargetModel& m) {
            return py::module_::import("json").attr("loads")(calib::calibration_json(m));
          },
          "All figures, what was removed and why, intrinsics with standard deviations, the verdict.");
}

}  // namespace lumihull::python
