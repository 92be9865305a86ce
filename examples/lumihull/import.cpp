// lumihull import FORMAT FILES -o CAPTURE: makes a capture of what other programs left; adds masks to one.

#include <lumihull/base/import.h>

#include <iostream>

#include "program.h"

namespace lumihull::program {

namespace {

struct Arguments {
  std::vector<std::string> files;
  std::string output, images, into;
  bool reference = false;
  double first_pixel_center = 0.5, max_refit_error = 0.5;

  template <class Options>
  Options options() const {
    Options o;
    o.output = output;
    o.reference = reference;
    return o;
  }
  RefitImportOptions refit_options() const {
    auto o = options<RefitImportOptions>();
    o.max_refit_error_px = max_refit_error;
    return o;
  }
  std::vector<std::filesystem::path> paths() const { return {files.begin(), files.end()}; }
};

void say_imported(Program& program, const Capture& capture) {
  std::size_t positioned = 0;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) positioned += capture.positioned(i);
  program.say(capture.folder().string() + ": " + std::to_string(capture.shots.size()) + " photographs, " +
              std::to_string(positioned) + " with a pose, " + std::to_string(capture.cameras.size()) +
              (capture.cameras.size() == 1 ? " camera" : " cameras") + ", unit " +
              (capture.unit == Unit::metres ? "metres" : "unknown"));
  for (const std::string& note : capture.notes) program.say("note: " + note);
  if (program.json) std::cout << slf::describe_json(capture) << "\n";
}

}  // namespace

void add_import(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.app.add_subcommand("import", "make a capture of photographs and cameras from elsewhere");
  verb->require_subcommand(1);

  // files: how many may be named; -1: any number.
  const auto format = [&](const std::string& name, const std::string& help, const std::string& what, int files,
                          std::function<Capture()> body) {
    CLI::App* sub = program.verb(
        name, help, [&program, body = std::move(body)] { say_imported(program, body()); }, verb);
    sub->add_option(files == 1 ? "file" : "files", a->files, what)->required()->expected(files);
    sub->add_option("-o,--output", a->output, "the new capture's folder")->required();
    sub->add_flag("--reference", a->reference, "refer to the photographs where they are instead of copying them");
    return sub;
  };

  format("projections", "a listing of projection matrices: NAME p11 … p34 a line", "the listing", 1,
         [&program, a] {
           auto options = a->options<ProjectionImportOptions>();
           options.first_pixel_center = a->first_pixel_center;
           return import_projections(a->files.at(0), options, program.job());
         })
      ->add_option("--first-pixel-center", a->first_pixel_center,
                   "the coordinate that the matrices give to the first pixel's centre: 0.5, 0 or 1 [0.5]")
      ->check(CLI::Range(-1.0, 1.0));
  format("middlebury", "a Middlebury multi-view file: *_par.txt", "the file", 1,
         [&program, a] { return import_middlebury(a->files.at(0), a->options<ImportOptions>(), program.job()); });
  format("nerf", "NeRF's transforms*.json; an alpha channel becomes the mask", "one or more files", -1, [&program, a] {
    return import_nerf(a->paths(), a->refit_options(), program.job());
  })->add_option("--max-refit-error", a->max_refit_error, "largest error of a refitted lens, px [0.5]");
  CLI::App* colmap = format("colmap", "a COLMAP model, text or binary", "the model's folder", 1, [&program, a] {
    return import_colmap(a->files.at(0), a->images, a->refit_options(), program.job());
  });
  colmap->add_option("--images", a->images, "the folder that the model's image names are relative to")->required();
  colmap->add_option("--max-refit-error", a->max_refit_error, "largest error of a refitted lens, px [0.5]");
  format("photos", "photographs without cameras", "the photographs", -1,
         [&program, a] { return import_photos(a->paths(), a->options<ImportOptions>(), program.job()); });

  CLI::App* masks = program.verb(
      "masks", "a folder of masks, named like their photographs, into a capture",
      [&program, a] {
        Capture capture = Capture::open(a->into);
        const int n = import_masks(capture, a->files.at(0), program.job());
        program.say(a->into + ": " + std::to_string(n) + " masks");
        if (program.json) std::cout << slf::describe_json(capture) << "\n";
      },
      verb);
  masks->add_option("folder", a->files, "the folder of masks")->required()->expected(1);
  masks->add_option("--into", a->into, "the capture's folder")->required();

  CLI::App* enclosure = program.verb(
      "enclosure", "photographs of the empty enclosure, into a capture",
      [&program, a] {
        Capture capture = Capture::open(a->into);
        const int n = import_enclosure(capture, a->paths(), a->reference, program.job());
        program.say(a->into + ": " + std::to_string(n) + " photographs of the empty enclosure");
        if (program.json) std::cout << slf::describe_json(capture) << "\n";
      },
      verb);
  enclosure->add_option("files", a->files, "the photographs")->required();
  enclosure->add_option("--into", a->into, "the capture's folder")->required();
  enclosure->add_flag("--reference", a->reference, "refer to the photographs where they are instead of copying them");
}

}  // namespace lumihull::program
