#include <lumihull/slf/capture_renderer.h>
#include <lumihull/slf/metrics.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <memory>
#include <numbers>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;

namespace {

/// A rendering as arrays that own their pixels.
struct RenderedView {
  py::array rgba;
  py::object depth;
};

RenderedView render(slf::CaptureRenderer& self, const View& view, const slf::RenderOptions& options,
                    const py::object& progress, unsigned threads) {
  view.camera.validate();
  slf::Rendering rendering = work(progress, threads, [&](Job& job) { return self.render(view, options, job); });
  RenderedView out{own_pixels(std::move(rendering.rgba)), py::none()};
  if (options.depth) out.depth = own_pixels(std::move(rendering.depth));
  return out;
}

void bind_metrics(py::module_& module) {
  const auto add = [&](const char* name, double (*metric)(const Image&, const Image&, const Image*), const char* help) {
    module.def(
        name,
        [metric](const Image& a, const Image& b, const std::optional<Image>& mask) {
          py::gil_scoped_release without_gil;
          return metric(a, b, mask ? &*mask : nullptr);
        },
        "a"_a, "b"_a, "mask"_a = py::none(), help);
  };
  add("psnr", &slf::psnr, "dB, of two 8-bit RGB pictures; 100 for equal ones. mask: only pixels >= 128 count.");
  add("ssim", &slf::ssim, "Structural similarity (Wang et al. 2004) of two 8-bit RGB pictures, at least 11 x 11.");
  module.def("silhouette_iou", &slf::silhouette_iou, "a"_a, "b"_a, py::call_guard<py::gil_scoped_release>(),
             "Intersection over union of the pixels >= 128.");
}

}  // namespace

void bind_views(py::module_& module) {
  py::class_<RenderedView>(module, "Rendering", "A new view.")
      .def_readonly("rgba", &RenderedView::rgba, "(height, width, 4) uint8, sRGB, straight alpha.")
      .def_readonly("depth", &RenderedView::depth, "(height, width) float32, infinite where nothing is; or None.");
  py::class_<slf::CaptureRenderer>(module, "Renderer",
                                   "Renders new views of a capture that has a hull, or of a model's file.")
      .def(py::init([](const Capture& capture, const std::string& method) {
             const InUse in_use(&capture, false);
             py::gil_scoped_release without_gil;
             return std::make_unique<slf::CaptureRenderer>(capture, method);
           }),
           "capture"_a, "method"_a = "lumigraph",
           "method: \"light_field\", \"lumigraph\", \"mean_texture\" or \"shaded\".")
      .def_static(
          "open",
          [](const std::filesystem::path& file) {
            py::gil_scoped_release without_gil;
            return std::make_unique<slf::CaptureRenderer>(file);
          },
          "file"_a, "A model by its file alone: a light_field.glb, or another .glb of Lumihull's by its texture.")
      .def("render",
           guarded([](slf::CaptureRenderer& self, const View& view, int rays, bool depth, bool adaptive,
                      const py::object& progress, unsigned threads) {
             return render(self, view, {.rays = rays, .depth = depth, .adaptive = adaptive}, progress, threads);
           }),
           "view"_a, py::kw_only(), "rays"_a = 2, "depth"_a = false, "adaptive"_a = false, "progress"_a = py::none(),
           "threads"_a = 0, "Renders with rays x rays rays a pixel; adaptive: only at outlines, which is faster.")
      .def("turntable",
           guarded([](const slf::CaptureRenderer& self, int frames, int width, int height, double elevation) {
             std::vector<View> views;
             for (const slf::PathView& p : self.turntable({.frames = frames,
                                           .elevation_deg = elevation * 180 / std::numbers::pi,
                                           .width = width,
                                           .height = height}))
               views.push_back(p.view);
             return views;
           }),
           "frames"_a, "width"_a, "height"_a, py::kw_only(), "elevation"_a = 0.35,
           "Views of a full turn around the object; elevation in radians above the horizon.");
  bind_metrics(module);
}

}  // namespace lumihull::python
