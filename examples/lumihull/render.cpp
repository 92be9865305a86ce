// lumihull render CAPTURE: new views.

#include <lumihull/base/error.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/capture_renderer.h>
#include <lumihull/slf/metrics.h>

#include <filesystem>
#include <iostream>
#include <optional>

#include "program.h"

namespace lumihull::program {

namespace {

struct Arguments {
  std::string folder, output, cameras, method = "light_field", background = "transparent";
  slf::TurntableOptions turntable;
  int rays = 2;
  bool held_out = false, overwrite = false;
};

/// "r,g,b" as a colour; nullopt for "transparent".
std::optional<std::array<std::uint8_t, 3>> parse_background(const std::string& text) {
  if (text == "transparent") return std::nullopt;
  std::array<int, 3> rgb{};
  int used = 0;
  if (std::sscanf(text.c_str(), "%d,%d,%d%n", &rgb[0], &rgb[1], &rgb[2], &used) != 3 ||
      std::size_t(used) != text.size() || *std::min_element(rgb.begin(), rgb.end()) < 0 ||
      *std::max_element(rgb.begin(), rgb.end()) > 255)
    throw Error(ErrorCode::invalid_argument, "expected transparent, or r,g,b from 0 to 255", "--background");
  return std::array{std::uint8_t(rgb[0]), std::uint8_t(rgb[1]), std::uint8_t(rgb[2])};
}

std::vector<slf::PathView> path_of(const Arguments& a, const Capture& capture, const slf::CaptureRenderer& renderer) {
  if (a.held_out) return slf::views_of_shots(capture, slf::held_out_shots(capture));
  if (!a.cameras.empty()) return slf::read_camera_path(a.cameras);
  return renderer.turntable(a.turntable);
}

void render(Program& program, const Arguments& a) {
  const Capture capture = Capture::open(a.folder);
  const auto background = parse_background(a.background);
  const std::filesystem::path output = a.output.empty() ? capture.folder() / "render" : std::filesystem::path(a.output);
  slf::CaptureRenderer renderer(capture, a.method);
  const std::vector<slf::PathView> path = path_of(a, capture, renderer);
  if (path.empty()) throw Error(ErrorCode::not_found, "no photograph is held out", capture.folder().string());
  std::filesystem::create_directories(output);
  if (!a.overwrite)
    for (const slf::PathView& p : path)
      if (std::filesystem::exists(output / (p.name + ".png")))
        throw Error(ErrorCode::invalid_argument, "the file exists; name another folder, or --overwrite",
                    (output / (p.name + ".png")).string());

  const slf::RenderOptions options{.rays = a.rays};
  Job& job = program.job();
  Job frame_job({}, job.threads());  // a frame's own progress would hide that of the sequence
  job.begin("rendering", path.size());
  for (const slf::PathView& p : path) {
    job.check();
    slf::Rendering rendering = renderer.render(p.view, options, frame_job);
    if (background) rendering.rgba = slf::composited(rendering.rgba, *background);
    write_png(output / (p.name + ".png"), rendering.rgba);
    job.advance();
  }
  job.end();
  program.say(output.string() + ": " + std::to_string(path.size()) + " pictures");
  if (program.json)
    std::cout << "{\"output\": " << json_text(output.string()) << ", \"pictures\": " << path.size() << "}\n";
}

}  // namespace

void add_render(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb =
      program.verb("render", "new views: PNG pictures along a path", [&program, a] { render(program, *a); });
  verb->add_option("capture", a->folder, "folder of the capture")->required();
  verb->add_option("-o,--output", a->output, "folder for the pictures [CAPTURE/render]");
  verb->add_option(
          "--method", a->method,
          "light_field (the factored model), lumigraph (blends photographs), mean_texture or shaded (bare hull) "
          "[light_field]")
      ->check(CLI::IsMember({"light_field", "lumigraph", "mean_texture", "shaded"}));
  auto* turntable = verb->add_option("--turntable", a->turntable.frames, "so many frames around the object [60]")
                        ->check(CLI::Range(1, 100000));
  auto* cameras = verb->add_option("--cameras", a->cameras, "cameras from a JSON file")->excludes(turntable);
  verb->add_flag("--held-out", a->held_out, "at the photographs that were held out")
      ->excludes(turntable)
      ->excludes(cameras);
  verb->add_option("--elevation", a->turntable.elevation_deg, "of the turntable's camera, degrees [20]");
  verb->add_option("--distance", a->turntable.distance, "of the turntable's camera, world units; 0: so that it fits");
  verb->add_option("--field-of-view", a->turntable.field_of_view_deg, "vertical, degrees [30]");
  verb->add_option("--width", a->turntable.width, "of the turntable's pictures, px [1280]");
  verb->add_option("--height", a->turntable.height, "px [720]");
  verb->add_option("--rays", a->rays, "n x n rays a pixel [2]")->check(CLI::Range(1, 8));
  verb->add_option("--background", a->background, "transparent, or r,g,b [transparent]");
  verb->add_flag("--overwrite", a->overwrite, "replace pictures of the same names");
}

}  // namespace lumihull::program
