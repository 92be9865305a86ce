// Lens calibration and point grids, on NumPy's arrays.
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/calib/point_grids.h>
#include <lumihull/calib/target_set.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <limits>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;
using calib::kIntrinsics;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Arrays = std::vector<Array<double>>;

/// A calibration together with how many points each view had.
struct Lens {
  calib::LensCalibration value;
  std::vector<std::size_t> counts;
};

std::array<bool, kIntrinsics> free_of(const std::vector<std::string>& names) {
  std::array<bool, kIntrinsics> free{};
  const auto& known = calib::intrinsic_names();
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) invalid("expected names of f, s, skew, u0, v0, k1, k2, k3, p1, p2", "free");
    free[std::size_t(at - known.begin())] = true;
  }
  return free;
}

std::vector<calib::BoardView> views_from(const Arrays& pixels, const Arrays& points,
                                         const std::optional<Arrays>& covariances, const std::optional<Arrays>& radii) {
  if (points.size() != pixels.size()) invalid("expected as many arrays as pixels", "points");
  if (covariances && covariances->size() != pixels.size()) invalid("expected as many arrays as pixels", "covariances");
  if (radii && radii->size() != pixels.size()) invalid("expected as many arrays as pixels", "radii");
  std::vector<calib::BoardView> views(pixels.size());
  for (std::size_t v = 0; v < pixels.size(); ++v) {
    const std::size_t n = rows(pixels[v], 2, "pixels");
    if (rows(points[v], 3, "points") != n) invalid("expected as many rows as pixels", "points");
    if (covariances) {
      const Array<double>& c = (*covariances)[v];
      if (c.ndim() != 3 || std::size_t(c.shape(0)) != n || c.shape(1) != 2 || c.shape(2) != 2)
        invalid("expected arrays of shape (n, 2, 2)", "covariances");
    }
    if (radii && ((*radii)[v].ndim() != 1 || std::size_t((*radii)[v].shape(0)) != n))
      invalid("expected arrays of shape (n,)", "radii");
    views[v].name = std::to_string(v);
    views[v].matches.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      calib::BoardMatch& m = views[v].matches[i];
      m.pixel = Eigen::Map<const Eigen::Vector2d>(pixels[v].data() + 2 * i);
      m.board = Eigen::Map<const Eigen::Vector3d>(points[v].data() + 3 * i);
      if (covariances) m.covariance = Eigen::Map<const Eigen::Matrix2d>((*covariances)[v].data() + 4 * i);
      if (radii) m.radius = (*radii)[v].data()[i];
    }
  }
  return views;
}

Array<double> covariance_of(const Lens& lens) {
  Array<double> out({py::ssize_t(kIntrinsics), py::ssize_t(kIntrinsics)});
  Eigen::Map<Eigen::Matrix<double, kIntrinsics, kIntrinsics>>(out.mutable_data()) = lens.value.covariance;
  return out;
}

py::list residuals_of(const Lens& lens) {
  std::vector<Array<double>> arrays;
  for (const std::size_t n : lens.counts) {
    arrays.emplace_back(std::vector<py::ssize_t>{py::ssize_t(n), 2});
    std::fill_n(arrays.back().mutable_data(), 2 * n, kNaN);
  }
  for (const auto& r : lens.value.residuals)
    Eigen::Map<Eigen::Vector2d>(arrays[std::size_t(r.view)].mutable_data() + 2 * r.match) = r.error;
  py::list out;
  for (auto& array : arrays) out.append(std::move(array));
  return out;
}

py::list outliers_of(const Lens& lens) {
  std::vector<py::array_t<bool>> arrays;
  for (const std::size_t n : lens.counts) {
    arrays.emplace_back(py::ssize_t(n));
    std::fill_n(arrays.back().mutable_data(), n, true);
  }
  for (const auto& r : lens.value.residuals) arrays[std::size_t(r.view)].mutable_data()[r.match] = r.outlier;
  py::list out;
  for (auto& array : arrays) out.append(std::move(array));
  return out;
}

void bind_calibration(py::module_& module) {
  py::class_<Lens>(module, "LensCalibration", "A calibrated camera with its covariance; see calibrate_lens.")
      .def_property_readonly("camera", [](const Lens& lens) { return lens.value.camera; })
      .def_property_readonly("covariance", &covariance_of, "(10, 10): f, s, skew, u0, v0, k1, k2, k3, p1, p2.")
      .def_property_readonly(
          "standard_deviations",
          [](const Lens& lens) {
            py::dict out;
            for (int i = 0; i < kIntrinsics; ++i)
              if (lens.value.covariance(i, i) > 0)
                out[py::str(calib::intrinsic_names()[std::size_t(i)])] = std::sqrt(lens.value.covariance(i, i));
            return out;
          },
          "Of the parameters that were estimated, by name.")
      .def_property_readonly(
          "poses", [](const Lens& lens) { return lens.value.cam_from_board; },
          "cam_from_board of each view; None where it could not be used.")
      .def_property_readonly("residuals", &residuals_of, "A view: (n, 2), measured less predicted, px.")
      .def_property_readonly("outliers", &outliers_of, "A view: (n,), True for points that do not count.")
      .def_property_readonly("problems", [](const Lens& lens) { return lens.value.problems; })
      .def_property_readonly("rms_px", [](const Lens& lens) { return lens.value.rms_px; })
      .def_property_readonly("sigma0", [](const Lens& lens) { return lens.value.sigma0; })
      .def_property_readonly("cross_validation_px", [](const Lens& lens) { return lens.value.cross_validation_px; })
      .def_property_readonly("cross_validation_sigma",
                             [](const Lens& lens) { return lens.value.cross_validation_sigma; })
      .def(
          "projection_uncertainty",
          [](const Lens& lens, int columns, int rows) {
            const std::vector<double> sigma = calib::projection_uncertainty(lens.value, columns, rows);
            Array<double> out({py::ssize_t(rows), py::ssize_t(columns)});
            std::copy(sigma.begin(), sigma.end(), out.mutable_data());
            return out;
          },
          "columns"_a = 32, "rows"_a = 24,
          "(rows, columns): standard deviation of a distant point's pixel over the picture, the best rotation taken "
          "off.")
      .def(
          "save", [](const Lens& lens, const std::filesystem::path& file) { calib::save_intrinsics(file, lens.value); },
          "file"_a)
      .def_static(
          "load",
          [](const std::filesystem::path& file) {
            return Lens{calib::load_intrinsics(file), {}};
          },
          "file"_a, "Camera and covariance from a file that `save` wrote.");
  module.def(
      "calibrate_lens",
      [](const Arrays& pixels, const Arrays& points, int width, int height, const std::optional<Arrays>& covariances,
         const std::optional<Arrays>& radii, const std::optional<std::vector<std::string>>& free,
         const std::optional<Camera>& start, bool robust, double outlier_sigma, const py::object& progress,
         unsigned threads) {
        const auto views = views_from(pixels, points, covariances, radii);
        calib::LensCalibrationOptions options;
        if (free) options.free = free_of(*free);
        options.start = start;
        options.robust = robust;
        options.outlier_sigma = outlier_sigma;
        Lens lens{work(progress, threads,
                       [&](Job& job) { return calib::calibrate_lens(views, width, height, options, job); }),
                  {}};
        for (const auto& view : views) lens.counts.push_back(view.matches.size());
        return lens;
      },
      "pixels"_a, "points"_a, "width"_a, "height"_a, py::kw_only(), "covariances"_a = py::none(),
      "radii"_a = py::none(), "free"_a = py::none(), "start"_a = py::none(), "robust"_a = true, "outlier_sigma"_a = 4.0,
      "progress"_a = py::none(), "threads"_a = 0,
      "A camera and its lens from views of a body: for each view pixels (n, 2) and places on the body (n, 3). "
      "covariances: "
      "(n, 2, 2) a view, px²; radii: (n,), > 0 for circles in z = 0, whose ellipses' centres the pixels are. free: "
      "names "
      "of what is estimated, by default f, u0, v0, k1, k2, p1, p2.");
  module.def(
      "find_point_grid",
      [](const Image& photo, const std::string& grid, const py::object& progress, unsigned threads) -> py::object {
        const calib::TargetSet set = calib::TargetSet::from_word(grid);
        if (set.grids.size() != 1 || !set.designs.empty())
          invalid("expected one grid, as \"chessboard:9x6:25mm\"", "grid");
        const auto found =
            work(progress, threads, [&](Job& job) { return calib::find_point_grid(photo, set.grids[0], job); });
        if (!found) return py::none();
        const auto n = py::ssize_t(found->features.size());
        Array<double> pixels({n, py::ssize_t(2)}), points({n, py::ssize_t(3)}),
            covariances({n, py::ssize_t(2), py::ssize_t(2)});
        for (py::ssize_t i = 0; i < n; ++i) {
          const calib::Feature& f = found->features[std::size_t(i)];
          Eigen::Map<Eigen::Vector2d>(pixels.mutable_data() + 2 * i) = f.pixel;
          Eigen::Map<Eigen::Matrix2d>(covariances.mutable_data() + 4 * i) = f.covariance;
          const Eigen::Vector2d place = set.grids[0].point(f.index);
          Eigen::Map<Eigen::Vector3d>(points.mutable_data() + 3 * i) = Eigen::Vector3d(place.x(), place.y(), 0);
        }
        return py::make_tuple(pixels, points, covariances);
      },
      "photo"_a, "grid"_a, py::kw_only(), "progress"_a = py::none(), "threads"_a = 0,
      "Finds and measures a field of points, as \"chessboard:9x6:25mm\" or \"circles:11x8:15mm\": pixels (n, 2), "
      "places on the "
      "board (n, 3), covariances (n, 2, 2); None where there is none.");
}

}  // namespace

void bind_lens(py::module_& module) { bind_calibration(module); }

}  // namespace lumihull::python
