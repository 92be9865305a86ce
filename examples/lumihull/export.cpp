// lumihull export FORMAT CAPTURE -o FILE: cameras and models for other programs.

#include <lumihull/base/error.h>
#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/target_tracks.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/results.h>

#include <iostream>

#include "program.h"

namespace lumihull::program {

namespace {

struct Arguments {
  std::string folder, output;
  double max_refit_error = 0.5;
};

void refuse_existing(const std::string& file) {
  if (std::filesystem::exists(file)) throw Error(ErrorCode::invalid_argument, "the file exists; name a new one", file);
}

void say_exported(Program& program, const Arguments& a, const ExportReport& report) {
  program.say(a.output + ": " + std::to_string(report.photos) + " photographs, largest lens error " +
              std::to_string(report.largest_refit_error_px) + " px");
  for (const std::string& note : report.notes) program.say("note: " + note);
  if (program.json)
    std::cout << "{\"output\": " << json_text(a.output) << ", \"photos\": " << report.photos
              << ", \"largest_refit_error_px\": " << report.largest_refit_error_px << "}\n";
}

void say_written(Program& program, const std::string& file, std::size_t count, const std::string& what) {
  program.say(file + ": " + std::to_string(count) + " " + what);
  if (program.json) std::cout << "{\"output\": " << json_text(file) << ", \"" << what << "\": " << count << "}\n";
}

}  // namespace

void add_export(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.app.add_subcommand("export", "cameras and models for other programs");
  verb->require_subcommand(1);

  const auto format = [&](const std::string& name, const std::string& help, std::function<void()> body) {
    CLI::App* sub = program.verb(name, help, std::move(body), verb);
    sub->add_option("capture", a->folder, "folder of the capture")->required();
    sub->add_option("-o,--output", a->output, "what to write")->required();
    return sub;
  };
  const auto options = [a] { return ExportOptions{.max_refit_error_px = a->max_refit_error}; };

  for (CLI::App* sub : {format("colmap", "a COLMAP text model: a folder; with targets as its points where there are",
                               [&program, a, options] {
                                 const Capture capture = Capture::open(a->folder);
                                 say_exported(program, *a,
                                              export_colmap(capture, a->output, options(),
                                                            calib::target_tracks(capture)));
                               }),
                        format("nerf", "NeRF's transforms.json", [&program, a, options] {
                          refuse_existing(a->output);
                          say_exported(program, *a, export_nerf(Capture::open(a->folder), a->output, options()));
                        })})
    sub->add_option("--max-refit-error", a->max_refit_error, "largest error of a lens in the other model, px [0.5]");

  for (const std::string name : {"ply", "obj"})
    format(name, name == "ply" ? "the hull as a PLY mesh" : "the hull as an OBJ mesh", [&program, a, name] {
      refuse_existing(a->output);
      const std::filesystem::path file(a->output);
      if (file.extension() != "." + name)
        throw Error(ErrorCode::invalid_argument, "expected a file name that ends in ." + name, a->output);
      const hull::Mesh mesh = slf::read_hull(Capture::open(a->folder));
      hull::write_mesh(file, mesh);
      say_written(program, a->output, mesh.triangles.size(), "triangles");
    });
  format("glb", "the textured model as binary glTF", [&program, a] {
    refuse_existing(a->output);
    const std::string model = read_file(slf::result_of(Capture::open(a->folder).folder() / "textured.glb", "texture"));
    write_file(a->output, model);
    say_written(program, a->output, model.size(), "bytes");
  });
}

}  // namespace lumihull::program
