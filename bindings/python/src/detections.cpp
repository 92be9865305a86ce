#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/ink_key.h>
#include <pybind11/stl.h>

#include <memory>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;
using calib::Detection;
using calib::Detections;
using calib::RefusedTarget;
using calib::TargetDetector;
using calib::TargetSet;

namespace {

const char* word(RefusedTarget::Reason reason) {
  switch (reason) {
    case RefusedTarget::Reason::no_code:
      return "no_code";
    case RefusedTarget::Reason::homography:
      return "homography";
    case RefusedTarget::Reason::duplicate:
      return "duplicate";
    case RefusedTarget::Reason::too_few_features:
      return "too_few_features";
    case RefusedTarget::Reason::unknown_id:
      return "unknown_id";
    case RefusedTarget::Reason::overexposed:
      return "overexposed";
  }
  return "";
}

/// One array of what every feature has: (n, …).
template <class T, class Fill>
Array<T> of_features(const Detection& d, std::vector<py::ssize_t> shape, Fill fill) {
  shape.insert(shape.begin(), py::ssize_t(d.features.size()));
  Array<T> out(shape);
  const std::size_t step = d.features.empty() ? 0 : std::size_t(out.size()) / d.features.size();
  for (std::size_t i = 0; i < d.features.size(); ++i) fill(d.features[i], out.mutable_data() + i * step);
  return out;
}

template <int Rows, int Columns>
auto row_major(double* to) {
  constexpr int kOrder = Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor;
  return Eigen::Map<Eigen::Matrix<double, Rows, Columns, kOrder>>(to, Rows, Columns);
}

}  // namespace

void bind_detections(py::module_& module) {
  py::class_<Detection>(module, "Detection", "A target that was found and read; its measured points, n of them.")
      .def_readonly("design", &Detection::design, "Which of the set's designs.")
      .def_readonly("id", &Detection::id, "-1: a field of points without ids.")
      .def_readonly("corrected", &Detection::corrected, "Cells that were read wrongly and corrected.")
      .def_readonly("erased", &Detection::erased, "Cells that could not be read.")
      .def_readonly("rms_px", &Detection::rms_px, "sqrt(sum of dx² + dy² / n) about pixel_from_target.")
      .def_property_readonly(
          "indices",
          [](const Detection& d) {
            return of_features<std::int32_t>(d, {}, [](const auto& f, std::int32_t* to) { *to = f.index; });
          },
          "(n,) which point of the target: circles row-major, corners clockwise from the top left.")
      .def_property_readonly(
          "pixels",
          [](const Detection& d) {
            return of_features<double>(d, {2}, [](const auto& f, double* to) { row_major<2, 1>(to) = f.pixel; });
          },
          "(n, 2) px. Circles: their ellipses' centres, which is not where circles' centres are seen.")
      .def_property_readonly(
          "covariances",
          [](const Detection& d) {
            return of_features<double>(d, {2, 2},
                                       [](const auto& f, double* to) { row_major<2, 2>(to) = f.covariance; });
          },
          "(n, 2, 2) px².")
      .def_property_readonly(
          "dual_conics",
          [](const Detection& d) {
            return of_features<double>(d, {3, 3},
                                       [](const auto& f, double* to) { row_major<3, 3>(to) = f.dual_conic; });
          },
          "(n, 3, 3) of the ellipses; zero for corners.")
      .def_property_readonly(
          "pixel_from_target",
          [](const Detection& d) {
            Array<double> out({py::ssize_t(3), py::ssize_t(3)});
            row_major<3, 3>(out.mutable_data()) = d.pixel_from_target;
            return out;
          },
          "(3, 3) homography from the target's plane, metres.");

  py::class_<RefusedTarget>(module, "RefusedTarget", "What looked like a target and was refused.")
      .def_property_readonly("reason", [](const RefusedTarget& r) { return word(r.reason); })
      .def_property_readonly("pixel", [](const RefusedTarget& r) { return Array<double>(2, r.pixel.data()); })
      .def_readonly("size_px", &RefusedTarget::size_px)
      .def_readonly("id", &RefusedTarget::id, "-1: none was read.");

  py::class_<Detections>(module, "Detections", "What was found in one photograph.")
      .def_readonly("targets", &Detections::targets)
      .def_readonly("refused", &Detections::refused);

  py::class_<TargetDetector>(module, "TargetDetector", "Finds, reads and measures the targets of a set.")
      .def(py::init([](const TargetSet& set, std::optional<calib::ColorKey> ink_key, double min_circle_px,
                       double correct, bool refine) {
             calib::DetectOptions options;
             options.ink_key = std::move(ink_key);
             options.min_circle_px = min_circle_px;
             options.correct = correct;
             options.refine = refine;
             options.validate();
             return TargetDetector(set, std::move(options));
           }),
           "targets"_a, py::kw_only(), "ink_key"_a = py::none(), "min_circle_px"_a = 4.5, "correct"_a = 1.0,
           "refine"_a = true,
           "ink_key: a ColorKey of the ink against enclosure and paper; None: adaptive contrast.\n"
           "min_circle_px: smallest minor axis that is looked for, at least 3.\n"
           "correct: how much of a code's power to correct wrong cells is used, 0 to 1.\n"
           "refine: circles to the bound that noise sets; else by the dual-conic operator alone.")
      .def(
          "detect",
          [](const TargetDetector& detector, const Image& photo, unsigned threads, const py::object& progress) {
            return work(progress, threads, [&](Job& job) { return detector.detect(photo, job); });
          },
          "photo"_a, py::kw_only(), "threads"_a = 0, "progress"_a = py::none(), "Detections in an sRGB picture.")
      .def(
          "draw",
          [](const TargetDetector& detector, const Image& photo, const Detections& found, double magnify) {
            py::gil_scoped_release without_gil;
            return calib::draw_detections(photo, detector.set(), found, magnify);
          },
          "photo"_a, "found"_a, "magnify"_a = 100.0, "The photograph with what was found drawn in.");

  using calib::InkSamples;
  py::class_<InkSamples>(
      module, "InkSamples",
      "Samples of targets' ink and of what is around it, from photographs in which targets were found.")
      .def(py::init<>())
      .def(
          "add",
          [](InkSamples& samples, const Image& photo, const TargetSet& targets, const Detections& found) {
            py::gil_scoped_release without_gil;
            samples.add(photo, targets, found);
          },
          "photo"_a, "targets"_a, "found"_a)
      .def_property_readonly("ink_pixels", &InkSamples::ink_pixels)
      .def(
          "train",
          [](const InkSamples& samples, int k, unsigned threads) {
            return work(py::none(), threads, [&](Job& job) { return samples.train(k, job); });
          },
          "k"_a = 7, py::kw_only(), "threads"_a = 0, "A ColorKey whose foreground is the ink, for TargetDetector.");
}

}  // namespace lumihull::python
