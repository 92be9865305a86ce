#include <lumihull/calib/resect.h>
#include <pybind11/stl.h>

#include <vector>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;

namespace {

using calib::PointMatch;
using calib::Resection;

std::vector<PointMatch> matches_from(const Array<double>& pixels, const Array<double>& world,
                                     const std::optional<Array<double>>& covariances,
                                     const std::optional<Array<double>>& radii,
                                     const std::optional<Array<double>>& normals) {
  const std::size_t n = rows(pixels, 2, "pixels");
  const auto count = py::ssize_t(n);
  if (rows(world, 3, "world") != n) invalid("expected as many world points as pixels", "world");
  if (covariances && (covariances->ndim() != 3 || covariances->shape(0) != count || covariances->shape(1) != 2 ||
                      covariances->shape(2) != 2))
    invalid("expected an array of shape (n, 2, 2)", "covariances");
  if (radii && (radii->ndim() != 1 || radii->shape(0) != count)) invalid("expected an array of shape (n,)", "radii");
  if (radii && !normals) invalid("expected the normals of the circles' planes, too", "normals");
  if (normals && rows(*normals, 3, "normals") != n) invalid("expected as many normals as pixels", "normals");
  std::vector<PointMatch> matches(n);
  for (std::size_t i = 0; i < n; ++i) {
    PointMatch& m = matches[i];
    m.pixel = Eigen::Map<const Eigen::Vector2d>(pixels.data() + 2 * i);
    m.world = Eigen::Map<const Eigen::Vector3d>(world.data() + 3 * i);
    if (covariances) m.covariance = Eigen::Map<const Eigen::Matrix2d>(covariances->data() + 4 * i);
    if (radii) m.radius = radii->data()[i], m.normal = Eigen::Map<const Eigen::Vector3d>(normals->data() + 3 * i);
  }
  return matches;
}

}  // namespace

void bind_resect(py::module_& module) {
  py::class_<Resection>(module, "Resection", "The pose of one photograph, and how well it is known.")
      .def_readonly("pose", &Resection::cam_from_world, "cam_from_world")
      .def_property_readonly(
          "covariance",
          [](const Resection& r) {
            Array<double> out({py::ssize_t(6), py::ssize_t(6)});
            Eigen::Map<Eigen::Matrix<double, 6, 6>>(out.mutable_data()) = r.covariance;  // symmetric
            return out;
          },
          "(6, 6), of (rotation vector, translation) of a small motion applied after the pose, in the camera's frame.")
      .def_property_readonly(
          "outliers",
          [](const Resection& r) {
            Array<std::int64_t> out{py::ssize_t(r.outliers.size())};
            std::copy(r.outliers.begin(), r.outliers.end(), out.mutable_data());
            return out;
          },
          "Indices of the matches that don't count, ascending.")
      .def_readonly("rms_px", &Resection::rms_px)
      .def_readonly("sigma0", &Resection::sigma0, "About 1 where the covariances are right.")
      .def_readonly("iterations", &Resection::iterations)
      .def_readonly("alternative", &Resection::alternative,
                    "Another tilt of a plane that fits nearly as well, or None.")
      .def_readonly("alternative_chi2_ratio", &Resection::alternative_chi2_ratio);

  module.def(
      "resect",
      [](const Camera& camera, const Array<double>& pixels, const Array<double>& world,
         const std::optional<Array<double>>& covariances, const std::optional<Array<double>>& radii,
         const std::optional<Array<double>>& normals, bool robust, double outlier_sigma, int max_iterations,
         std::uint64_t seed) {
        const auto matches = matches_from(pixels, world, covariances, radii, normals);
        py::gil_scoped_release without_gil;
        return calib::resect(
            camera, matches,
            {.robust = robust, .outlier_sigma = outlier_sigma, .max_iterations = max_iterations, .seed = seed});
      },
      "camera"_a, "pixels"_a, "world"_a, "covariances"_a = py::none(), py::kw_only(), "radii"_a = py::none(),
      "normals"_a = py::none(), "robust"_a = true, "outlier_sigma"_a = 4.0, "max_iterations"_a = 20, "seed"_a = 1,
      "The pose of one photograph from points of known position: pixels (n, 2), world (n, 3), covariances (n, 2, 2) in "
      "px². radii (n,) > 0: circles, whose pixels are their ellipses' centres, with the normals (n, 3) of their "
      "planes.");
}

}  // namespace lumihull::python
