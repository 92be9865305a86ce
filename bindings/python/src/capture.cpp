#include <lumihull/base/capture.h>
#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <lumihull/calib/target_tracks.h>
#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/results.h>
#include <lumihull/slf/truth.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;
using Paths = std::vector<std::filesystem::path>;

namespace {

/// Python's negative indices count from the end; beyond is IndexError.
std::size_t index(const Capture& capture, py::ssize_t i) {
  const auto n = py::ssize_t(capture.shots.size());
  if (i < 0) i += n;
  if (i < 0 || i >= n) throw py::index_error("the capture has " + std::to_string(n) + " shots");
  return std::size_t(i);
}

py::object json_loads(const std::string& text) { return py::module_::import("json").attr("loads")(text); }

void bind_shots(py::class_<Capture>& c) {
  c.def("__len__", guarded([](const Capture& self) { return self.shots.size(); }))
      .def_property_readonly("names", guarded([](const Capture& self) {
                               std::vector<std::string> names;
                               for (const Shot& shot : self.shots) names.push_back(shot.name);
                               return names;
                             }))
      .def("file",
           guarded([](const Capture& self, py::ssize_t i) { return self.photo_path(self.shots[index(self, i)]); }),
           "shot"_a, "The photograph's path.")
      .def("held_out", guarded([](const Capture& self, py::ssize_t i) { return self.held_out(index(self, i)); }),
           "shot"_a)
      .def("camera_index",
           guarded([](const Capture& self, py::ssize_t i) { return self.shots[index(self, i)].camera; }), "shot"_a)
      .def("pose",
           guarded([](const Capture& self, py::ssize_t i) { return self.shots[index(self, i)].cam_from_world; }),
           "shot"_a, "cam_from_world, or None.")
      .def("set_pose", guarded([](Capture& self, py::ssize_t i, const std::optional<Pose>& pose) {
             Shot& shot = self.shots[index(self, i)];
             shot.cam_from_world = pose;
             shot.pose_quality.reset();
           }),
           "shot"_a, "cam_from_world"_a)
      .def("pose_covariance", guarded([](const Capture& self, py::ssize_t i) -> std::optional<Array<double>> {
             const Shot& shot = self.shots[index(self, i)];
             if (!shot.pose_quality) return std::nullopt;
             Array<double> out({py::ssize_t(6), py::ssize_t(6)});
             Eigen::Map<Eigen::Matrix<double, 6, 6>>(out.mutable_data()) = shot.pose_quality->covariance;
             return out;
           }),
           "shot"_a,
           "(6, 6): of (rotation vector, translation) of a small motion applied after cam_from_world, rad and metres; "
           "None where the stage \"calibrate\" did not find the pose.")
      .def("view", guarded([](const Capture& self, py::ssize_t i) { return self.view(index(self, i)); }), "shot"_a)
      .def("read_photo", guarded([](const Capture& self, py::ssize_t i) {
             const std::size_t shot = index(self, i);
             py::gil_scoped_release without_gil;
             return self.read_photo(shot);
           }),
           "shot"_a)
      .def("read_mask", guarded([](const Capture& self, py::ssize_t i) {
             const std::size_t shot = index(self, i);
             py::gil_scoped_release without_gil;
             return self.read_mask(shot);
           }),
           "shot"_a)
      .def("write_mask", guarded([](Capture& self, py::ssize_t i, const Image& mask) {
             const std::size_t shot = index(self, i);
             py::gil_scoped_release without_gil;
             self.write_mask(shot, mask, MaskSource::imported);
           }),
           "shot"_a, "mask"_a, "Stores a silhouette that keying then leaves alone.")
      .def("add_shot", guarded([](Capture& self, const std::string& name, const std::string& file, std::size_t camera) {
             return self.add_shot(name, file, camera);
           }),
           "name"_a, "file"_a, "camera"_a, "Adds a photograph without a pose; returns its index.");
}

void bind_cameras(py::class_<Capture>& c) {
  c.def_property_readonly("cameras", guarded([](const Capture& self) { return self.cameras; }), "Copies.")
      .def("camera_covariance", guarded([](const Capture& self, std::size_t i) -> std::optional<Array<double>> {
             if (i >= self.cameras.size()) throw py::index_error("no such camera");
             const auto at = self.camera_covariances.find(int(i));
             if (at == self.camera_covariances.end()) return std::nullopt;
             Array<double> out({py::ssize_t(10), py::ssize_t(10)});
             Eigen::Map<Eigen::Matrix<double, 10, 10>>(out.mutable_data()) = at->second;
             return out;
           }),
           "index"_a, "(10, 10): f, s, skew, u0, v0, k1, k2, k3, p1, p2; None where it was not refined.")
      .def("add_camera", guarded([](Capture& self, const Camera& camera) {
             self.cameras.push_back(camera);
             return self.cameras.size() - 1;
           }),
           "camera"_a, "Returns its index.")
      .def("set_camera", guarded([](Capture& self, std::size_t i, const Camera& camera) {
             if (i >= self.cameras.size()) throw py::index_error("no such camera");
             self.cameras[i] = camera;
             self.camera_covariances.erase(int(i));
           }),
           "index"_a, "camera"_a);
}

void bind_stages(py::module_& module, py::class_<Capture>& c) {
  py::class_<slf::StageResult>(module, "StageResult", "What a stage did.")
      .def_readonly("stage", &slf::StageResult::stage)
      .def_readonly("skipped", &slf::StageResult::skipped)
      .def_readonly("lines", &slf::StageResult::said, "What was done, and warnings that name the photograph.")
      .def_property_readonly("seconds", [](const slf::StageResult& r) { return r.record.seconds; })
      .def_property_readonly("peak_bytes", [](const slf::StageResult& r) { return r.record.peak_bytes; });

  module.def("stage_names", [] {
    std::vector<std::string> names;
    for (const std::string_view name : slf::stage_names()) names.emplace_back(name);
    return names;
  });
  module.def(
      "stage_options",
      [](const std::string& stage) {
        py::dict options;
        for (const slf::OptionSpec& spec : slf::stage_options(stage))
          options[py::str(spec.name)] = py::make_tuple(spec.fallback, spec.help);
        return options;
      },
      "stage"_a, "Name -> (default, help).");

  c.def("set_option",
        guarded([](Capture& self, const std::string& stage, const std::string& name, const OptionValue& value) {
          slf::set_option(self, stage, name, value);
        }),
        "stage"_a, "name"_a, "value"_a, "Stores an option of a stage.")
      .def("option", guarded([](const Capture& self, const std::string& stage, const std::string& name) {
             return slf::effective_option(self, stage, name);
           }),
           "stage"_a, "name"_a, "The stored value, else the default.")
      .def("run", guarded([](Capture& self, bool force, const py::object& progress, unsigned threads) {
             return work(progress, threads, [&](Job& job) { return slf::run(self, job, force); });
           }),
           py::kw_only(), "force"_a = false, "progress"_a = py::none(), "threads"_a = 0,
           "All the stages that are needed. Another thread must not use the capture meanwhile.")
      .def("run_stage",
           guarded(
               [](Capture& self, const std::string& stage, bool force, const py::object& progress, unsigned threads) {
                 return work(progress, threads, [&](Job& job) { return slf::run_stage(self, stage, job, force); });
               }),
           "stage"_a, py::kw_only(), "force"_a = false, "progress"_a = py::none(), "threads"_a = 0)
      .def("describe", guarded([](const Capture& self) { return json_loads(slf::describe_json(self)); }))
      .def("read_hull", guarded([](const Capture& self) {
             py::gil_scoped_release without_gil;
             return slf::read_hull(self);
           }),
           "The hull's mesh.")
      .def("evaluation", guarded([](const Capture& self) { return json_loads(slf::read_evaluation(self)); }),
           "What the stage \"evaluate\" found.")
      .def("compare_with_truth",
           guarded([](const Capture& self, const std::filesystem::path& truth,
                      const std::optional<std::filesystem::path>& page, const py::object& progress, unsigned threads) {
             const std::string json = work(progress, threads, [&](Job& job) {
               const slf::TruthComparison comparison = slf::compare_with_truth(self, truth, {}, job);
               if (page) write_file(*page, slf::truth_html(self, comparison, job));
               return comparison.to_json();
             });
             return json_loads(json);
           }),
           "truth"_a, py::kw_only(), "page"_a = py::none(), "progress"_a = py::none(), "threads"_a = 0,
           "Poses, lenses, targets, masks, surface and new views beside a folder of truth as the virtual rig writes it; "
           "what either side lacks is in \"left_out\". page: an HTML file to write.");
}

template <class Options>
Options import_options(const std::filesystem::path& output, bool reference) {
  Options options;
  options.output = output;
  options.reference = reference;
  return options;
}

RefitImportOptions refit_options(const std::filesystem::path& output, bool reference, double max_refit_error_px) {
  auto options = import_options<RefitImportOptions>(output, reference);
  options.max_refit_error_px = max_refit_error_px;
  return options;
}

void bind_exchange(py::module_& module) {
  using Path = std::filesystem::path;
  module.def(
      "import_projections",
      [](const Path& listing, const Path& output, bool reference, double first_pixel_center,
         const py::object& progress) {
        auto options = import_options<ProjectionImportOptions>(output, reference);
        options.first_pixel_center = first_pixel_center;
        return work(progress, 0, [&](Job& job) { return import_projections(listing, options, job); });
      },
      "listing"_a, "output"_a, py::kw_only(), "reference"_a = false, "first_pixel_center"_a = 0.5,
      "progress"_a = py::none(), "Projection matrices, \"NAME p11 … p34\" a line.");
  module.def(
      "import_middlebury",
      [](const Path& file, const Path& output, bool reference, const py::object& progress) {
        const auto options = import_options<ImportOptions>(output, reference);
        return work(progress, 0, [&](Job& job) { return import_middlebury(file, options, job); });
      },
      "file"_a, "output"_a, py::kw_only(), "reference"_a = false, "progress"_a = py::none(), "*_par.txt");
  module.def(
      "import_nerf",
      [](const Paths& files, const Path& output, bool reference, double max_refit_error_px,
         const py::object& progress) {
        const auto options = refit_options(output, reference, max_refit_error_px);
        return work(progress, 0, [&](Job& job) { return import_nerf(files, options, job); });
      },
      "files"_a, "output"_a, py::kw_only(), "reference"_a = false, "max_refit_error_px"_a = 0.5,
      "progress"_a = py::none(), "transforms*.json; an alpha channel becomes the mask.");
  module.def(
      "import_colmap",
      [](const Path& model, const Path& photos, const Path& output, bool reference, double max_refit_error_px,
         const py::object& progress) {
        const auto options = refit_options(output, reference, max_refit_error_px);
        return work(progress, 0, [&](Job& job) { return import_colmap(model, photos, options, job); });
      },
      "model"_a, "photos"_a, "output"_a, py::kw_only(), "reference"_a = false, "max_refit_error_px"_a = 0.5,
      "progress"_a = py::none(), "A COLMAP model's folder, text or binary.");
  module.def(
      "import_photos",
      [](const Paths& files, const Path& output, bool reference, const py::object& progress) {
        const auto options = import_options<ImportOptions>(output, reference);
        return work(progress, 0, [&](Job& job) { return import_photos(files, options, job); });
      },
      "files"_a, "output"_a, py::kw_only(), "reference"_a = false, "progress"_a = py::none(),
      "Photographs without poses.");
  module.def("import_masks", guarded([](Capture& capture, const Path& folder) {
               return work(py::none(), 0, [&](Job& job) { return import_masks(capture, folder, job); });
             }),
             "capture"_a, "folder"_a, "Adds masks named like their photographs; returns how many.");
  module.def("import_enclosure", guarded([](Capture& capture, const Paths& files, bool reference) {
               return work(py::none(), 0, [&](Job& job) { return import_enclosure(capture, files, reference, job); });
             }),
             "capture"_a, "files"_a, py::kw_only(), "reference"_a = false,
             "Adds photographs of the empty enclosure; returns how many.");
  module.def("export_colmap", guarded([](const Capture& capture, const Path& folder, double max_refit_error_px) {
               return export_colmap(capture, folder, {.max_refit_error_px = max_refit_error_px},
                                    calib::target_tracks(capture))
                   .largest_refit_error_px;
             }),
             "capture"_a, "folder"_a, py::kw_only(), "max_refit_error_px"_a = 0.5,
             "A COLMAP text model, with the targets as its points where there are; returns the largest error of a lens in px.");
  module.def("export_nerf", guarded([](const Capture& capture, const Path& file, double max_refit_error_px) {
               return export_nerf(capture, file, {.max_refit_error_px = max_refit_error_px}).largest_refit_error_px;
             }),
             "capture"_a, "file"_a, py::kw_only(), "max_refit_error_px"_a = 0.5,
             "NeRF's transforms.json; returns the largest error of a lens in px.");
}

}  // namespace

void bind_capture(py::module_& module) {
  py::class_<Capture> c(module, "Capture", "The folder that holds an object's photographs and what was made of them.");
  c.def_static("open", &Capture::open, "folder"_a)
      .def_static("create", &Capture::create, "folder"_a, "A new capture in a new or empty folder.")
      .def("save", guarded([](const Capture& self) { self.save(); }))
      .def_property_readonly("folder", guarded([](const Capture& self) { return self.folder(); }))
      .def_property("unit_known", guarded([](const Capture& self) { return self.unit == Unit::metres; }),
                    guarded([](Capture& self, bool known) { self.unit = known ? Unit::metres : Unit::unknown; }),
                    "Whether lengths are metres.")
      .def_property("hold_out", guarded([](const Capture& self) { return self.hold_out(); }),
                    guarded([](Capture& self, int n) { self.set_hold_out(n); }),
                    "Every nth shot (the first, …) is held out; 0: none.")
      .def_property("background_rgb", guarded([](const Capture& self) { return self.background_rgb; }),
                    guarded([](Capture& self, const std::optional<std::array<std::uint8_t, 3>>& rgb) {
                      self.background_rgb = rgb;
                    }))
      .def_property_readonly("notes", guarded([](const Capture& self) { return self.notes; }));
  bind_shots(c);
  bind_cameras(c);
  bind_stages(module, c);
  bind_exchange(module);
}

}  // namespace lumihull::python
