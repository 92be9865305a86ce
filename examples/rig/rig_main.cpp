// lumihull-rig: photographs an object with the virtual rig, with the truth beside.

#include <lumihull/base/error.h>
#include <lumihull/rig/rig_capture.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <map>

namespace rig = lumihull::rig;

namespace {

lumihull::Job* running = nullptr;

void stop(int) {
  if (running) running->cancel();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Photographs an object in a painted enclosure, with known cameras and the truth beside.");
  std::string output;
  rig::RigOptions options;
  unsigned threads = 0;
  bool plain = false, fast = false, fine = false, no_distortion = false, no_noise = false;
  app.add_option("-o,--output", output, "folder to make; must be new or empty")->required();
  app.add_option("--object", options.object,
                 "vase, bust, statue, snowmobile, deer, gate, box, sphere, pebble, or a mesh file (.obj, .ply, .glb)")
      ->capture_default_str();
  app.add_option("--size", options.size_m, "longest side of the object, m")->capture_default_str();
  app.add_option("--photos", options.photos, "photographs of the object")->capture_default_str();
  app.add_option("--empty", options.empty_photos, "photographs of the empty enclosure")->capture_default_str();
  app.add_option("--width", options.width, "of a photograph, px; the height is two thirds")->capture_default_str();
  app.add_option("--path", options.path, "where the camera goes")
      ->transform(CLI::CheckedTransformer(std::map<std::string, rig::Path>{
          {"hemisphere", rig::Path::hemisphere}, {"ring", rig::Path::ring}, {"random", rig::Path::random}}));
  app.add_option("--fill", options.fill, "part of the picture's height that the object takes")->capture_default_str();
  app.add_flag("--matt", options.matt, "the object has no gloss");
  app.add_flag("--uniform", options.uniform, "the object has one paint all over");
  std::vector<int> unlit;
  app.add_option("--unlit", unlit, "the object is R,G,B (0 to 255) in every photograph, whatever the light")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0, 255));
  app.add_flag("--blue", options.blue, "a blue enclosure instead of a green one");
  app.add_flag("--pedestal", options.pedestal, "the object stands on a pedestal");
  app.add_flag("--targets", options.targets,
               "printed targets on walls and floor; photographs and sheets.json for importers, cameras are not told");
  app.add_option("--target-px", options.target_px, "diameter of the targets' circles in the photographs, px")
      ->capture_default_str();
  app.add_option("--blur", options.photo.blur_px, "of the lens, px (sigma)")->capture_default_str();
  app.add_flag("--no-distortion", no_distortion, "an ideal lens");
  app.add_option("--format", options.format, "of the photographs")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, rig::PhotoFormat>{{"jpeg", rig::PhotoFormat::jpeg}, {"png", rig::PhotoFormat::png}}));
  app.add_option("--quality", options.jpeg_quality, "of the JPEGs, 1 to 100")->capture_default_str();
  app.add_option("--f-number", options.photo.f_number, "of the lens' opening; 0: a pinhole, all is sharp")
      ->capture_default_str();
  app.add_option("--focus", options.photo.focus_m, "distance that is sharp, m; 0: the object's middle")
      ->capture_default_str();
  app.add_flag("--bayer", options.photo.bayer, "a sensor with one colour a pixel, demosaiced");
  app.add_option("--exposure", options.photo.exposure, "brightness")->capture_default_str();
  app.add_flag("--no-noise", no_noise, "an ideal sensor");
  app.add_option("--test-views", options.test_views,
                 "pictures along an arc for judging a renderer, into truth/: free of noise, with camera path and masks")
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of paint, noise and trajectory")->capture_default_str();
  app.add_flag("--plain", plain,
               "plain files and P.txt (without targets) instead of a capture folder; implies --no-distortion");
  app.add_flag("--fast", fast, "trace a third of the size and enlarge; noise at full size");
  app.add_flag("--fine", fine, "four times the rays and paths")->excludes("--fast");
  app.add_option("--threads", threads, "0: one for each core")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  options.distortion = !no_distortion && !plain;
  const rig::Quality quality = fast ? rig::Quality::fast : fine ? rig::Quality::fine : rig::Quality::normal;
  const rig::PhotoOptions rays = rig::photo_options(quality);
  options.photo.rays = rays.rays, options.photo.edge_rays = rays.edge_rays, options.photo.reduce = rays.reduce;
  options.light = rig::light_options(quality);
  if (no_noise) options.photo.full_well = 0;
  if (unlit.size() == 3) options.unlit = {std::uint8_t(unlit[0]), std::uint8_t(unlit[1]), std::uint8_t(unlit[2])};

  lumihull::Job job(
      [](const lumihull::Progress& p) {
        const bool done = p.done == p.total;
        std::fprintf(stderr, "\r%-36s %6llu / %llu", p.stage.c_str(), static_cast<unsigned long long>(p.done),
                     static_cast<unsigned long long>(p.total));
        if (p.eta_s >= 0 && !done) std::fprintf(stderr, "   %.0f s to go ", p.eta_s);
        if (done) std::fprintf(stderr, "   %.1f s          \n", p.elapsed_s);
      },
      threads);
  running = &job;
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  int status = 0;
  try {
    if (plain || options.targets)
      rig::make_photographs(output, options, job);
    else
      rig::make_capture(output, options, job);
  } catch (const lumihull::Error& e) {
    std::fprintf(stderr, "\nlumihull-rig: %s\n", e.what());
    status = e.code() == lumihull::ErrorCode::cancelled ? 130 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "\nlumihull-rig: %s\n", e.what());
    status = 1;
  }
  running = nullptr;
  return status;
}
