#include <lumihull/base/camera.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <Eigen/LU>
#include <cstring>
#include <limits>
#include <memory>
#include <new>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Matrix23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

py::dtype dtype_of(PixelType type) {
  if (type == PixelType::u8) return py::dtype::of<std::uint8_t>();
  if (type == PixelType::u16) return py::dtype::of<std::uint16_t>();
  return py::dtype::of<float>();
}

std::vector<py::ssize_t> shape_of(const Image& image) {
  std::vector<py::ssize_t> shape{image.height(), image.width()};
  if (image.channels() > 1) shape.push_back(image.channels());
  return shape;
}

Eigen::Vector3d vector3(const Array<double>& array, const char* name) {
  if (array.ndim() != 1 || array.shape(0) != 3) invalid("expected three numbers", name);
  return Eigen::Map<const Eigen::Vector3d>(array.data());
}

Array<double> matrix_of(const Pose& pose) {
  Array<double> out({py::ssize_t(3), py::ssize_t(4)});
  Eigen::Map<Matrix34>(out.mutable_data(), 3, 4) = pose.matrix();
  return out;
}

py::array vector_of(const Eigen::Vector3d& v) { return Array<double>(3, v.data()); }

void bind_image(py::module_& module) {
  py::class_<Image>(module, "Image", py::buffer_protocol(),
                    "A picture in memory; numpy.asarray(image) is a view of its pixels, not a copy.")
      .def(py::init(&image_from), "array"_a)
      .def_property_readonly("width", &Image::width)
      .def_property_readonly("height", &Image::height)
      .def_property_readonly("channels", &Image::channels)
      .def_property_readonly(
          "array", [](py::object self) { return pixels(self.cast<const Image&>(), self, true); },
          "(height, width, channels), or (height, width) for one channel; a view.")
      .def_buffer([](Image& image) {
        const auto item = py::ssize_t(size_of(image.type()));
        const auto shape = shape_of(image);
        return py::buffer_info(image.data(), item,
                               image.type() == PixelType::u8    ? "B"
                               : image.type() == PixelType::u16 ? "H"
                                                                : "f",
                               py::ssize_t(shape.size()), shape, py::detail::c_strides(shape, item));
      });
  py::implicitly_convertible<py::array, Image>();

  module.def(
      "read_image",
      [](const std::filesystem::path& file, int channels, bool apply_orientation) {
        py::gil_scoped_release without_gil;
        return read_image(file, {.apply_orientation = apply_orientation, .channels = channels});
      },
      "file"_a, "channels"_a = 0, "apply_orientation"_a = false,
      "Reads a photograph. channels: 0 = as stored; 1, 3 or 4: convert.");
  module.def(
      "write_png",
      [](const std::filesystem::path& file, const Image& image) {
        py::gil_scoped_release without_gil;
        write_png(file, image);
      },
      "file"_a, "image"_a, "Writes 8- or 16-bit pictures of 1, 3 or 4 channels, atomically.");
  module.def(
      "write_jpeg",
      [](const std::filesystem::path& file, const Image& image, int quality) {
        py::gil_scoped_release without_gil;
        write_jpeg(file, image, quality);
      },
      "file"_a, "image"_a, "quality"_a = 92, "Writes 8-bit pictures of 1 or 3 channels.");
}

void bind_camera(py::module_& module) {
  py::class_<Camera>(module, "Camera", "A camera with Heikkilä's lens model; see lumihull/base/camera.h.")
      .def(py::init([](int width, int height, double f, double s, double skew, std::optional<double> u0,
                       std::optional<double> v0, double k1, double k2, double k3, double p1, double p2) {
             Camera c;
             c.width = width, c.height = height, c.f = f, c.s = s, c.skew = skew;
             c.u0 = u0.value_or(width * 0.5), c.v0 = v0.value_or(height * 0.5);
             c.k1 = k1, c.k2 = k2, c.k3 = k3, c.p1 = p1, c.p2 = p2;
             c.validate();
             return c;
           }),
           "width"_a, "height"_a, "f"_a, py::kw_only(), "s"_a = 1.0, "skew"_a = 0.0, "u0"_a = py::none(),
           "v0"_a = py::none(), "k1"_a = 0.0, "k2"_a = 0.0, "k3"_a = 0.0, "p1"_a = 0.0, "p2"_a = 0.0)
      .def_readonly("width", &Camera::width)
      .def_readonly("height", &Camera::height)
      .def_readonly("f", &Camera::f)
      .def_readonly("s", &Camera::s)
      .def_readonly("skew", &Camera::skew)
      .def_readonly("u0", &Camera::u0)
      .def_readonly("v0", &Camera::v0)
      .def_readonly("k1", &Camera::k1)
      .def_readonly("k2", &Camera::k2)
      .def_readonly("k3", &Camera::k3)
      .def_readonly("p1", &Camera::p1)
      .def_readonly("p2", &Camera::p2)
      .def(
          "project",
          [](const Camera& c, const Array<double>& points) {
            const std::size_t n = rows(points, 3, "points");
            Array<double> out({py::ssize_t(n), py::ssize_t(2)});
            for (std::size_t i = 0; i < n; ++i)
              Eigen::Map<Eigen::Vector2d>(out.mutable_data() + 2 * i) =
                  c.project(Eigen::Map<const Eigen::Vector3d>(points.data() + 3 * i))
                      .value_or(Eigen::Vector2d::Constant(kNaN));
            return out;
          },
          "points"_a,
          "Pixels (n, 2) of points (n, 3) in the camera's frame; NaN behind it or beyond the lens's domain.")
      .def(
          "project_jacobian",
          [](const Camera& c, const Array<double>& points) {
            const std::size_t n = rows(points, 3, "points");
            Array<double> out({py::ssize_t(n), py::ssize_t(2), py::ssize_t(3)});
            for (std::size_t i = 0; i < n; ++i) {
              Matrix23d jacobian;
              if (!c.project(Eigen::Map<const Eigen::Vector3d>(points.data() + 3 * i), &jacobian))
                jacobian.setConstant(kNaN);
              Eigen::Map<Matrix23>(out.mutable_data() + 6 * i) = jacobian;
            }
            return out;
          },
          "points"_a, "d pixel / d point, (n, 2, 3); NaN where `project` is.")
      .def(
          "unproject",
          [](const Camera& c, const Array<double>& px) {
            const std::size_t n = rows(px, 2, "pixels");
            Array<double> out({py::ssize_t(n), py::ssize_t(3)});
            for (std::size_t i = 0; i < n; ++i)
              Eigen::Map<Eigen::Vector3d>(out.mutable_data() + 3 * i) =
                  c.ray(Eigen::Map<const Eigen::Vector2d>(px.data() + 2 * i)).value_or(Eigen::Vector3d::Constant(kNaN));
            return out;
          },
          "pixels"_a, "Directions (n, 3), (x, y, 1) in the camera's frame, that pixels (n, 2) see.");
}

void bind_pose(py::module_& module) {
  py::class_<Pose>(module, "Pose", "A rigid transform; name variables b_from_a.")
      .def(py::init<>())
      .def(py::init(&pose_from), "matrix"_a)
      .def_static(
          "look_at",
          [](const Array<double>& eye, const Array<double>& target, const Array<double>& up) {
            const Eigen::Vector3d e = vector3(eye, "eye"), t = vector3(target, "target"), u = vector3(up, "up");
            if (!e.allFinite() || !t.allFinite() || !((t - e).cross(u).norm() > 1e-9 * (t - e).norm() * u.norm()))
              invalid("expected finite vectors, eye and target apart, up not parallel to the line of sight", "up");
            return look_at(e, t, u);
          },
          "eye"_a, "target"_a, "up"_a, "cam_from_world of a camera at eye that looks at target.")
      .def_property_readonly("matrix", &matrix_of, "(3, 4): [R t].")
      .def_property_readonly("translation", [](const Pose& p) { return vector_of(p.translation); })
      .def_property_readonly(
          "center", [](const Pose& p) { return vector_of(p.center()); },
          "For cam_from_world: the camera's centre in the world.")
      .def("inverse", &Pose::inverse)
      .def(
          "__matmul__", [](const Pose& a, const Pose& b) { return a * b; }, "b_from_a"_a)
      .def(
          "apply",
          [](const Pose& pose, const Array<double>& points) {
            const std::size_t n = rows(points, 3, "points");
            Array<double> out({py::ssize_t(n), py::ssize_t(3)});
            for (std::size_t i = 0; i < n; ++i)
              Eigen::Map<Eigen::Vector3d>(out.mutable_data() + 3 * i) =
                  pose * Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(points.data() + 3 * i));
            return out;
          },
          "points"_a, "Transforms points (n, 3).");

  py::class_<View>(module, "View", "A camera at a place.")
      .def(py::init([](const Camera& camera, const Pose& pose) {
             return View{camera, pose};
           }),
           "camera"_a, "cam_from_world"_a)
      .def_property_readonly("camera", [](const View& v) { return v.camera; })
      .def_property_readonly("cam_from_world", [](const View& v) { return v.cam_from_world; });
}

}  // namespace

py::array pixels(const Image& image, py::handle owner, bool writable) {
  py::array view(dtype_of(image.type()), shape_of(image), image.data(), owner);
  if (!writable) py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

py::array own_pixels(Image&& image) {
  auto owned = std::make_unique<Image>(std::move(image));
  const Image& ref = *owned;
  const py::capsule owner(owned.release(), [](void* p) { delete static_cast<Image*>(p); });
  return pixels(ref, owner, true);
}

Image image_from(const py::array& any) {
  const bool u8 = py::isinstance<py::array_t<std::uint8_t>>(any), u16 = py::isinstance<py::array_t<std::uint16_t>>(any);
  if (!u8 && !u16 && !py::isinstance<py::array_t<float>>(any))
    invalid("expected uint8, uint16 or float32, found " + py::str(any.dtype()).cast<std::string>(), "array");
  const auto array = py::array::ensure(any, py::array::c_style);
  if (!array) throw std::bad_alloc();
  const py::ssize_t channels = any.ndim() == 3 ? any.shape(2) : 1;
  if ((any.ndim() != 2 && any.ndim() != 3) || (channels != 1 && channels != 3 && channels != 4) ||
      any.shape(0) > kMaxImageSide || any.shape(1) > kMaxImageSide)
    invalid("expected the shape (height, width) or (height, width, 1, 3 or 4)", "array");
  Image image = Image::uninitialized(int(any.shape(1)), int(any.shape(0)), int(channels),
                                     u8    ? PixelType::u8
                                     : u16 ? PixelType::u16
                                           : PixelType::f32);
  std::memcpy(image.data(), array.data(), image.bytes());
  return image;
}

Pose pose_from(const Array<double>& matrix) {
  if (matrix.ndim() != 2 || matrix.shape(0) != 3 || matrix.shape(1) != 4)
    invalid("expected an array of shape (3, 4)", "matrix");
  const Eigen::Map<const Matrix34> m(matrix.data(), 3, 4);
  const Eigen::Matrix3d r = m.leftCols<3>();
  if (!m.allFinite() || !((r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= 1e-6) ||
      r.determinant() < 0)
    invalid("expected [R t] with finite numbers and R a rotation to within 1e-6", "matrix");
  return Pose::from_matrix(r, m.col(3));
}

void bind_base(py::module_& module) {
  bind_image(module);
  bind_camera(module);
  bind_pose(module);
}

}  // namespace lumihull::python
