#include <lumihull/base/camera.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/calib/key_image.h>
#include <lumihull/hull/carve.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/hull/region.h>
#include <lumihull/hull/simplify.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cstring>
#include <limits>
#include <memory>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;
using calib::ColorKey;
using calib::Rgb;
using hull::Mesh;
using hull::RayScene;

namespace {

constexpr std::size_t kRaysAtOnce = 4096;

std::span<const Rgb> colors(const Array<std::uint8_t>& rgb, const char* name) {
  return {reinterpret_cast<const Rgb*>(rgb.data()), rows(rgb, 3, name)};
}

calib::EdgeMode edge_mode(const std::string& edges) {
  if (edges == "soft") return calib::EdgeMode::soft;
  if (edges == "hard") return calib::EdgeMode::hard;
  if (edges == "matte") return calib::EdgeMode::matte;
  invalid("expected \"soft\", \"hard\" or \"matte\", found \"" + edges + "\"", "edges");
}

/// Rows of three values as a read-only array that keeps `owner` alive.
template <class T, class Row>
py::array view_of(const std::vector<Row>& values, py::handle owner) {
  static_assert(sizeof(Row) == 3 * sizeof(T));
  py::array view(py::dtype::of<T>(), {py::ssize_t(values.size()), py::ssize_t(3)}, values.data(), owner);
  py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

Mesh mesh_from(const Array<float>& vertices, const Array<std::uint32_t>& triangles) {
  Mesh mesh;
  mesh.vertices.resize(rows(vertices, 3, "vertices"));
  mesh.triangles.resize(rows(triangles, 3, "triangles"));
  if (!mesh.vertices.empty())
    std::memcpy(static_cast<void*>(mesh.vertices.data()), vertices.data(), std::size_t(vertices.nbytes()));
  if (!mesh.triangles.empty()) std::memcpy(mesh.triangles.data(), triangles.data(), std::size_t(triangles.nbytes()));
  hull::validate(mesh, "mesh");
  return mesh;
}

void bind_color_key(py::module_& module) {
  py::class_<ColorKey>(module, "ColorKey", "Decides by colour what is object: exact k nearest neighbours in RGB.")
      .def_static(
          "train",
          [](const Array<std::uint8_t>& background, const std::optional<Array<std::uint8_t>>& foreground, int k,
             double foreground_share, std::uint64_t seed, const py::object& progress, unsigned threads) {
            const auto back = colors(background, "background");
            if (!foreground)
              return work(progress, threads, [&](Job& job) {
                return ColorKey::train(back, {.k = k, .foreground_share = foreground_share, .seed = seed}, job);
              });
            const auto front = colors(*foreground, "foreground");
            return work(progress, threads, [&](Job& job) {
              return ColorKey::train(calib::count_colors(back), calib::count_colors(front), k, job);
            });
          },
          "background"_a, "foreground"_a = py::none(), py::kw_only(), "k"_a = 7, "foreground_share"_a = 0.2,
          "seed"_a = 1, "progress"_a = py::none(), "threads"_a = 0,
          "From colours (n, 3) of the enclosure; foreground: (m, 3), or None: uniform in the RGB cube.")
      .def_static(
          "load",
          [](const std::filesystem::path& file) {
            return work(py::none(), 0, [&](Job& job) { return ColorKey::load(file, job); });
          },
          "file"_a)
      .def("save", &ColorKey::save, "file"_a)
      .def_property_readonly("k", &ColorKey::k)
      .def_property_readonly("background_median", &ColorKey::background_median)
      .def(
          "decide",
          [](const ColorKey& key, const Array<std::uint8_t>& rgb) {
            if (rgb.ndim() < 1 || rgb.shape(rgb.ndim() - 1) != 3) invalid("expected an array of shape (..., 3)", "rgb");
            py::array_t<bool> out(std::vector<py::ssize_t>(rgb.shape(), rgb.shape() + rgb.ndim() - 1));
            const auto n = std::size_t(out.size());
            bool* to = out.mutable_data();
            const Rgb* from = reinterpret_cast<const Rgb*>(rgb.data());
            py::gil_scoped_release without_gil;
            for (std::size_t i = 0; i < n; ++i) to[i] = key.is_object(from[i]);
            return out;
          },
          "rgb"_a, "Whether colours (..., 3) are object: bool (...).")
      .def(
          "probability",
          [](const ColorKey& key, const Array<std::uint8_t>& rgb) {
            const auto c = colors(rgb, "rgb");
            Array<double> out(py::ssize_t(c.size()));
            double* to = out.mutable_data();
            py::gil_scoped_release without_gil;
            for (std::size_t i = 0; i < c.size(); ++i) to[i] = key.probability(c[i]);
            return out;
          },
          "rgb"_a, "P(object | colour) of colours (n, 3).")
      .def(
          "silhouette",
          [](const ColorKey& key, const Image& photo, const std::string& edges, int smallest_object_px,
             int largest_hole_px) {
            const calib::KeyImageOptions options{edge_mode(edges), smallest_object_px, largest_hole_px};
            py::gil_scoped_release without_gil;
            return calib::key_image(key, photo, options);
          },
          "photo"_a, py::kw_only(), "edges"_a = "soft", "smallest_object_px"_a = 0, "largest_hole_px"_a = 0,
          "The silhouette of a photograph: 255 = object.");
}

void bind_mesh(py::module_& module) {
  py::class_<Mesh>(module, "Mesh", "Triangles over shared vertices, counter-clockwise seen from outside; immutable.")
      .def(py::init(&mesh_from), "vertices"_a, "triangles"_a, "Copies (n, 3) float32 and (m, 3) uint32.")
      .def_property_readonly(
          "vertices", [](py::object self) { return view_of<float>(self.cast<const Mesh&>().vertices, self); },
          "(n, 3) float32; a read-only view.")
      .def_property_readonly(
          "triangles", [](py::object self) { return view_of<std::uint32_t>(self.cast<const Mesh&>().triangles, self); },
          "(m, 3) uint32; a read-only view.")
      .def_property_readonly("normals",
                             [](const Mesh& mesh) {
                               const auto normals = hull::vertex_normals(mesh);
                               Array<float> out({py::ssize_t(normals.size()), py::ssize_t(3)});
                               if (!normals.empty())
                                 std::memcpy(out.mutable_data(), normals.data(), std::size_t(out.nbytes()));
                               return out;
                             })
      .def_property_readonly("volume", &hull::enclosed_volume)
      .def(
          "check",
          [](const Mesh& mesh, bool self_intersections) {
            py::gil_scoped_release without_gil;
            return hull::check_mesh(mesh, self_intersections);
          },
          py::kw_only(), "self_intersections"_a = true)
      .def(
          "simplify",
          [](const Mesh& mesh, std::size_t max_triangles, double max_error, const py::object& progress,
             unsigned threads) {
            return work(progress, threads, [&](Job& job) {
              return hull::simplify(mesh, {max_triangles, max_error}, job).mesh;
            });
          },
          py::kw_only(), "max_triangles"_a = 0, "max_error"_a = 0.0, "progress"_a = py::none(), "threads"_a = 0,
          "A mesh of fewer triangles; one of the two bounds must be set.");

  using hull::MeshCheck;
  py::class_<MeshCheck>(module, "MeshCheck", "What a mesh is, as a surface.")
      .def_readonly("closed", &MeshCheck::closed)
      .def_readonly("manifold", &MeshCheck::manifold)
      .def_readonly("oriented", &MeshCheck::oriented)
      .def_readonly("degenerate_triangles", &MeshCheck::degenerate_triangles)
      .def_readonly("unused_vertices", &MeshCheck::unused_vertices)
      .def_readonly("parts", &MeshCheck::parts)
      .def_readonly("euler", &MeshCheck::euler)
      .def_readonly("self_intersections", &MeshCheck::self_intersections, "None: not counted.")
      .def_property_readonly("good", &MeshCheck::good);
  module.def("read_mesh", &hull::read_mesh, "file"_a, py::call_guard<py::gil_scoped_release>(), "PLY or OBJ.");
  module.def("write_mesh", &hull::write_mesh, "file"_a, "mesh"_a, py::call_guard<py::gil_scoped_release>(),
             "PLY or OBJ, by the file's name; atomically.");
}

/// Ray i with what can't be cast (not finite, no direction) made one that hits nothing: t_far = 0.
hull::Ray ray_at(const float* origins, const float* directions, std::size_t i) {
  const Eigen::Vector3f o = Eigen::Map<const Eigen::Vector3f>(origins + 3 * i);
  const Eigen::Vector3f d = Eigen::Map<const Eigen::Vector3f>(directions + 3 * i);
  if (!o.allFinite() || !d.allFinite() || d.isZero(0)) return {Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitX(), 0, 0};
  return {o, d};
}

py::tuple cast_rays(const RayScene& scene, const Array<float>& origins, const Array<float>& directions) {
  const std::size_t n = rows(origins, 3, "origins");
  if (rows(directions, 3, "directions") != n) invalid("expected as many as origins", "directions");
  py::array_t<std::uint32_t> triangle{py::ssize_t(n)};
  py::array_t<float> distance{py::ssize_t(n)};
  py::array_t<float> barycentric({py::ssize_t(n), py::ssize_t(2)});
  std::uint32_t* t = triangle.mutable_data();
  float *d = distance.mutable_data(), *b = barycentric.mutable_data();
  const float *o = origins.data(), *v = directions.data();
  {
    py::gil_scoped_release without_gil;
    Job job;
    parallel_chunks(job, n, kRaysAtOnce, [&](std::size_t first, std::size_t last) {
      std::vector<hull::Ray> rays;
      for (std::size_t i = first; i < last; ++i) rays.push_back(ray_at(o, v, i));
      std::vector<hull::Hit> hits(rays.size());
      scene.hit(rays, hits);
      for (std::size_t i = first; i < last; ++i) {
        hull::Hit hit = hits[i - first];
        if (!hit || rays[i - first].t_far == 0) hit = {hull::kNoHit, std::numeric_limits<float>::infinity(), 0, 0};
        t[i] = hit.triangle, d[i] = hit.t, b[2 * i] = hit.b1, b[2 * i + 1] = hit.b2;
      }
    });
  }
  return py::make_tuple(triangle, distance, barycentric);
}

void bind_ray_scene(py::module_& module) {
  py::class_<RayScene>(module, "RayScene", "A mesh made ready for ray casting.")
      .def(py::init<const Mesh&>(), "mesh"_a, py::call_guard<py::gil_scoped_release>())
      .def("hit", &cast_rays, "origins"_a, "directions"_a,
           "First hits of rays (n, 3), (n, 3): triangle (n) uint32, NO_HIT where none; distance (n), infinite where "
           "none; "
           "barycentric (n, 2).");
  module.attr("NO_HIT") = hull::kNoHit;
}

Mesh carve(const std::vector<View>& views, const std::vector<Image>& masks, int resolution,
           const std::optional<std::array<double, 6>>& region, int tolerance, int min_views, double min_component,
           const std::vector<std::array<double, 4>>& cut_planes, const std::vector<std::array<double, 6>>& cut_boxes,
           const py::object& progress, unsigned threads) {
  if (views.size() != masks.size())
    invalid("expected as many masks as views, found " + std::to_string(masks.size()), "masks");
  const auto box = [](const std::array<double, 6>& b) { return hull::Box{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}}; };
  hull::CarveOptions options;
  options.resolution = resolution;
  if (region) options.region = box(*region);
  options.rule.tolerance = tolerance;
  options.rule.min_views = min_views;
  for (const auto& p : cut_planes) options.rule.cut_planes.push_back({{p[0], p[1], p[2]}, p[3]});
  for (const auto& b : cut_boxes) options.rule.cut_boxes.push_back(box(b));
  options.min_component = min_component;
  for (std::size_t i = 0; i < views.size(); ++i) options.names.push_back("view " + std::to_string(i));
  return work(progress, threads, [&](Job& job) {
    const auto silhouettes = hull::make_silhouettes(
        views, [&](std::size_t i) { return masks[i]; }, options.region, resolution, options.rule, options.names, job);
    return hull::carve(views, silhouettes, options, job).mesh;
  });
}

}  // namespace

void bind_model(py::module_& module) {
  bind_color_key(module);
  bind_mesh(module);
  bind_ray_scene(module);
  module.def("carve", &carve, "views"_a, "masks"_a, py::kw_only(), "resolution"_a = 256, "region"_a = py::none(),
             "tolerance"_a = 1, "min_views"_a = 1, "min_component"_a = 0.01,
             "cut_planes"_a = std::vector<std::array<double, 4>>(),
             "cut_boxes"_a = std::vector<std::array<double, 6>>(), "progress"_a = py::none(), "threads"_a = 0,
             "The visual hull of silhouettes (8 bits, 255 = object), one a view.");
}

}  // namespace lumihull::python
