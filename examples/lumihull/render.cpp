// lumihull render CAPTURE|MODEL.glb: new views.

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
  std::string source, output, cameras, method, background = "transparent";
  slf::TurntableOptions turntable;
  int rays = 2;
  bool held_out = false, adaptive = false, overwrite = false;
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

/// A model's file, not a capture's folder.
bool is_model(const std::filesystem::path& source) {
  std::error_code ignored;
  return !std::filesystem::is_directory(source, ignored) &&
         (source.extension() == ".glb" || std::filesystem::exists(source, ignored));
}

std::vector<slf::PathView> path_of(const Arguments& a, const slf::CaptureRenderer& renderer) {
  if (!a.cameras.empty()) return slf::read_camera_path(a.cameras);
  return renderer.turntable(a.turntable);
}

/// Writes the pictures along a path.
void draw(Program& program, const Arguments& a, slf::CaptureRenderer& renderer, const std::vector<slf::PathView>& path,
          const std::filesystem::path& output) {
  const auto background = parse_background(a.background);
  std::filesystem::create_directories(output);
  if (!a.overwrite)
    for (const slf::PathView& p : path)
      if (std::filesystem::exists(output / (p.name + ".png")))
        throw Error(ErrorCode::invalid_argument, "the file exists; name another folder, or --overwrite",
                    (output / (p.name + ".png")).string());

  const slf::RenderOptions options{.rays = a.rays, .adaptive = a.adaptive};
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

/// Renders a model's file alone, which has no photographs.
void render_model(Program& program, const Arguments& a) {
  const auto refuse = [](const char* flag, const char* what) { throw Error(ErrorCode::invalid_argument, what, flag); };
  if (a.held_out) refuse("--held-out", "a model's file has no photographs; name the capture's folder");
  if (!a.method.empty()) refuse("--method", "a model's file is shown as what it is; name the capture's folder");
  if (a.output.empty()) refuse("--output", "expected a folder for the pictures of a model's file");
  slf::CaptureRenderer renderer{std::filesystem::path(a.source)};
  draw(program, a, renderer, path_of(a, renderer), a.output);
}

void render_capture(Program& program, const Arguments& a) {
  const Capture capture = Capture::open(a.source);
  std::error_code ignored;
  const bool has_light_field = std::filesystem::exists(capture.folder() / "light_field.glb", ignored);
  slf::CaptureRenderer renderer(capture, !a.method.empty() ? a.method : has_light_field ? "light_field" : "lumigraph");
  const auto path = a.held_out ? slf::views_of_shots(capture, slf::held_out_shots(capture)) : path_of(a, renderer);
  if (path.empty()) throw Error(ErrorCode::not_found, "no photograph is held out", capture.folder().string());
  draw(program, a, renderer, path, a.output.empty() ? capture.folder() / "render" : std::filesystem::path(a.output));
}

}  // namespace

void add_render(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb("render", "new views: PNG pictures along a path", [&program, a] {
    is_model(a->source) ? render_model(program, *a) : render_capture(program, *a);
  });
  verb->add_option("source", a->source, "folder of the capture, or a model's file (.glb) alone")
      ->required()
      ->type_name("CAPTURE|MODEL.glb");
  verb->add_option("-o,--output", a->output, "folder for the pictures; needed with MODEL.glb [CAPTURE/render]");
  verb->add_option(
          "--method", a->method,
          "light_field (the factored model), lumigraph (blends photographs), mean_texture or shaded (bare hull) "
          "[light_field where light_field.glb exists, else lumigraph]")
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
  verb->add_flag("--adaptive", a->adaptive, "n x n rays only at outlines: faster");
  verb->add_option("--background", a->background, "transparent, or r,g,b [transparent]");
  verb->add_flag("--overwrite", a->overwrite, "replace pictures of the same names");
}

}  // namespace lumihull::program
