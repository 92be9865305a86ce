// What a surface light field costs and what it is worth: PSNR over a capture's held-out photographs against terms, size
// of the file, texels' size and the maps' JPEG quality; joint factorisation, PCA and NMF on the same mesh, from the
// same photographs. The peers of the same run: the lumigraph, which keeps the photographs, and the mean texture. The
// capture needs masks and hull.ply; nothing in it is changed. Every figure is the file's, its JPEG losses included.
//
//     bench_light_field CAPTURE [OUT_FOLDER] [--methods joint,pca,nmf] [--terms 1,2,3,4,6] [--texels 1,0.7,0.5,0.35]
//                       [--qualities 50,65,75,85,92] [--texel 0.5] [--triangles 20000] [--refit]
//
// Joint and PCA are fitted once with the most terms, of which the first ones are shown (--refit: anew for every number
// of them, as NMF always is). Texel size and quality vary for the joint one with the most terms.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/hull/simplify.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/results.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "svg_plot.h"

using namespace lumihull;
namespace fs = std::filesystem;

namespace {

double seconds(const std::function<void()>& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Settings {
  fs::path capture, out = ".";
  std::vector<std::string> methods{"joint", "pca", "nmf"};
  std::vector<int> terms{1, 2, 3, 4, 6}, qualities{50, 65, slf::LightFieldFileOptions().map_quality, 85, 92};
  std::vector<double> texels{1, 0.7, 0.5, 0.35};
  double texel = slf::LightFieldOptions().texel_px;
  std::size_t triangles = 20000;
  bool refit = false;
};

/// One line of the table. Peers have no terms, texels, quality, or maps.
struct Row {
  std::string method;
  int terms = -1;
  double texel_px = 0;
  int quality = -1, width = 0, height = 0;
  double bytes = 0, psnr = 0, inside = 0, fit_s = 0;
};

void print(const Row& r) {
  std::printf("%-12s ", r.method.c_str());
  if (r.terms < 0)
    std::printf("%5s %6s %7s %11s", "", "", "", "");
  else
    std::printf("%5d %6.2f %7d %5d x %4d", r.terms, r.texel_px, r.quality, r.width, r.height);
  std::printf(" %8.2f %7.2f %7.2f %7.1f\n", r.bytes / 1e6, r.psnr, r.inside, r.fit_s);
  std::fflush(stdout);
}

/// The held-out photographs, as the evaluation prepares them.
class Judge {
 public:
  explicit Judge(const Capture& capture) : background_(capture.background_rgb.value_or(std::array<std::uint8_t, 3>{})) {
    const slf::PhotoSet photos = slf::photos_of(capture, slf::held_out_shots(capture));
    if (photos.size() == 0)
      throw Error(ErrorCode::degenerate, "no positioned photograph is held out", capture.folder().string());
    const auto folder = std::get<std::string>(slf::effective_option(capture, "evaluate", "reference_masks"));
    for (std::size_t i = 0; i < photos.size(); ++i) {
      slf::Photo photo = photos.read(i);
      if (!folder.empty())
        photo.alpha = converted(read_image(fs::path(folder) / (photos.names[i] + ".png")), PixelType::u8, 1);
      views_.push_back(photos.views[i]);
      references_.push_back(slf::composited(photo.rgb, photo.alpha, background_));
      masks_.push_back(std::move(photo.alpha));
    }
  }

  std::size_t size() const { return views_.size(); }

  /// Means of PSNR, whole and inside.
  void judge(Row& row, const std::function<slf::Rendering(const View&)>& render) const {
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const Image picture = slf::composited(render(views_[i]).rgba, background_);
      row.psnr += slf::psnr(picture, references_[i]) / double(views_.size());
      row.inside += slf::psnr(picture, references_[i], &masks_[i]) / double(views_.size());
    }
  }

 private:
  std::array<std::uint8_t, 3> background_;
  std::vector<View> views_;
  std::vector<Image> references_, masks_;
};

class Bench {
 public:
  explicit Bench(const Settings& settings)
      : settings_(settings),
        capture_(Capture::open(settings.capture)),
        photos_(slf::photos_of(capture_, slf::training_shots(capture_))),
        judge_(capture_),
        job_([](const Progress& p) {
          if (p.total) std::fprintf(stderr, "\r  %-24s %3.0f %%\r", p.stage.c_str(), 100.0 * p.done / p.total);
        }),
        file_(settings.out / "bench_light_field.glb") {
    mesh_ = slf::read_hull(capture_);
    if (mesh_.triangles.size() > settings.triangles) mesh_ = hull::simplify(mesh_, {settings.triangles, 0}, job_).mesh;
    std::printf("%zu triangles, %zu photographs used, %zu held out, %u threads\n", mesh_.triangles.size(),
                photos_.size(), judge_.size(), job_.threads());
    std::printf("%-12s %5s %6s %7s %12s %8s %7s %7s %7s\n", "method", "terms", "texel", "quality", "maps", "MB", "PSNR",
                "inside", "fit, s");
  }

  void run() {
    peers();
    const int most = *std::max_element(settings_.terms.begin(), settings_.terms.end());
    for (const std::string& method : settings_.methods) {
      const bool nmf = method == "nmf";
      if (nmf && most == 0) continue;
      const Fit fit = fitted(method, most, settings_.texel);
      Row best;
      for (const int k : settings_.terms) {
        if (nmf && k == 0) continue;
        if (k != most && (nmf || settings_.refit))
          show(fitted(method, k, settings_.texel), k, kDefaultQuality, method);
        else
          show(fit, k, kDefaultQuality, method);
        if (k == most) best = series_[method].back();
      }
      if (method != "joint") continue;
      for (const int quality : settings_.qualities)
        if (quality == kDefaultQuality)
          series_["quality"].push_back(best);
        else
          show(fit, most, quality, "quality");
      for (const double texel : settings_.texels)
        if (texel == settings_.texel)
          series_["texel"].push_back(best);
        else
          show(fitted(method, most, texel), most, kDefaultQuality, "texel");
    }
    fs::remove(file_);
    write_csv();
    write_plots(most);
  }

 private:
  static constexpr int kDefaultQuality = slf::LightFieldFileOptions().map_quality;

  struct Fit {
    slf::LightField field;
    std::string method;
    double texel_px, seconds;
  };

  void peers() {
    const slf::RenderOptions render = slf::EvaluateOptions().render;
    Row texture{.method = "mean_texture"}, lumigraph{.method = "lumigraph"};
    texture.fit_s =
        seconds([&] { texture.bytes = double(slf::write_glb(file_, slf::mean_texture(mesh_, photos_, {}, job_))); });
    const slf::TexturedMesh textured = slf::read_glb(file_);
    const hull::RayScene scene(mesh_), textured_scene(textured.mesh);
    judge_.judge(texture,
                 [&](const View& v) { return slf::render_texture(textured, textured_scene, v, render, job_); });
    slf::Lumigraph blend(mesh_, scene, photos_);
    for (const std::size_t i : slf::training_shots(capture_))
      lumigraph.bytes += double(fs::file_size(capture_.photo_path(capture_.shots[i])));
    judge_.judge(lumigraph, [&](const View& v) { return blend.render(v, render, job_); });
    for (const Row& row : {texture, lumigraph}) print(row), levels_.push_back(row);
  }

  Fit fitted(const std::string& method, int terms, double texel_px) {
    slf::LightFieldOptions options;
    options.method = method == "pca"   ? slf::Factorization::pca
                     : method == "nmf" ? slf::Factorization::nmf
                                       : slf::Factorization::joint;
    options.terms = terms;
    options.texel_px = texel_px;
    options.max_side = 8192;  // so that the texels have the size that was asked for
    Fit fit{{}, method, texel_px, 0};
    fit.seconds = seconds([&] { fit.field = slf::fit_light_field(mesh_, photos_, options, job_); });
    return fit;
  }

  /// Judges the file of a fit's first terms; the result belongs to a series: a method, "quality" or "texel".
  void show(const Fit& fit, int terms, int quality, const std::string& series) {
    slf::LightField field = fit.field;
    field.terms.resize(std::min(field.terms.size(), std::size_t(terms)));
    if (field.terms.empty()) field.slot.clear();
    slf::LightFieldFileOptions options;
    options.map_quality = quality;
    Row row{.method = fit.method, .terms = terms, .texel_px = fit.texel_px, .quality = quality};
    row.width = field.base.texture.width(), row.height = field.base.texture.height();
    row.bytes = double(slf::write_light_field(file_, field, options));
    row.fit_s = fit.seconds;
    const slf::LightFieldRenderer renderer(slf::read_light_field(file_));
    judge_.judge(row, [&](const View& v) { return renderer.render(v, slf::EvaluateOptions().render, job_); });
    print(row);
    series_[series].push_back(row);
  }

  void write_csv() const {
    std::string text = "series,method,terms,texel_px,map_quality,width,height,bytes,psnr_db,psnr_inside_db,fit_s\n";
    char line[200];
    for (const Row& r : levels_) {
      std::snprintf(line, sizeof line, "peer,%s,,,,,,%.0f,%.3f,%.3f,%.2f\n", r.method.c_str(), r.bytes, r.psnr,
                    r.inside, r.fit_s);
      text += line;
    }
    for (const auto& [series, rows] : series_)
      for (const Row& r : rows) {
        std::snprintf(line, sizeof line, "%s,%s,%d,%g,%d,%d,%d,%.0f,%.3f,%.3f,%.2f\n", series.c_str(), r.method.c_str(),
                      r.terms, r.texel_px, r.quality, r.width, r.height, r.bytes, r.psnr, r.inside, r.fit_s);
        text += line;
      }
    write("light_field.csv", text);
  }

  void write_plots(int most) const {
    char text[60];
    const auto formatted = [&](const char* format, double value) {
      std::snprintf(text, sizeof text, format, value);
      return std::string(text);
    };
    bench::Plot by_terms{"Held-out photographs, by terms",
                         "terms beyond the mean colour (NMF: in all)",
                         "PSNR inside the silhouettes, dB",
                         {},
                         {}};
    bench::Plot by_bytes{
        "Held-out photographs, by size of the file", "size of the file, MB", "PSNR inside the silhouettes, dB", {}, {}};
    for (const Row& r : levels_) {
      by_terms.levels.push_back({r.method == "lumigraph" ? "lumigraph" : "mean texture", r.inside});
      const std::string size = formatted(" (%.1f MB)", r.bytes / 1e6);
      by_bytes.levels.push_back({by_terms.levels.back().label + size, r.inside});
    }
    const std::map<std::string, std::string> names{{"joint", "joint"}, {"pca", "PCA"}, {"nmf", "NMF"}};
    for (const std::string& method : settings_.methods) {
      if (series_.count(method) == 0) continue;
      bench::Curve terms{names.at(method), {}}, bytes{names.at(method) + ", by terms", {}};
      for (const Row& r : series_.at(method)) {
        terms.points.push_back({double(r.terms), r.inside, ""});
        bytes.points.push_back({r.bytes / 1e6, r.inside, std::to_string(r.terms)});
      }
      by_terms.curves.push_back(terms), by_bytes.curves.push_back(bytes);
    }
    for (const char* series : {"texel", "quality"}) {
      const auto rows = series_.find(series);
      if (rows == series_.end() || rows->second.size() < 2) continue;
      const bool texel = std::string(series) == "texel";
      bench::Curve curve{formatted("joint, %.0f terms, by ", most) + (texel ? "texel" : "quality"), {}};
      for (const Row& r : rows->second)
        curve.points.push_back(
            {r.bytes / 1e6, r.inside, texel ? formatted("%g px", r.texel_px) : formatted("%g", r.quality)});
      std::stable_sort(curve.points.begin(), curve.points.end(), [](auto& a, auto& b) { return a.x < b.x; });
      by_bytes.curves.push_back(curve);
    }
    write("light_field_terms.svg", bench::svg(by_terms));
    write("light_field_bytes.svg", bench::svg(by_bytes));
  }

  void write(const char* name, const std::string& text) const {
    write_file(settings_.out / name, text);
    std::printf("%s\n", (settings_.out / name).c_str());
  }

  Settings settings_;
  Capture capture_;
  slf::PhotoSet photos_;
  Judge judge_;
  Job job_;
  fs::path file_;  // the one that is judged, written again and again
  hull::Mesh mesh_;
  std::vector<Row> levels_;
  std::map<std::string, std::vector<Row>> series_;
};

}  // namespace

int main(int argc, char** argv) {
  Settings s;
  CLI::App app("PSNR of a capture's surface light field against terms, texel size, quality and bytes");
  app.add_option("capture", s.capture, "folder of a capture with masks, hull.ply and held-out photographs")->required();
  app.add_option("out", s.out, "folder for light_field.csv, light_field_terms.svg, light_field_bytes.svg")
      ->capture_default_str();
  app.add_option("--methods", s.methods, "some of joint, pca, nmf")
      ->delimiter(',')
      ->check(CLI::IsMember({"joint", "pca", "nmf"}))
      ->capture_default_str();
  app.add_option("--terms", s.terms, "numbers of terms")
      ->delimiter(',')
      ->check(CLI::Range(0, slf::kMaxTerms))
      ->capture_default_str();
  app.add_option("--texel", s.texel, "size of a texel where it does not vary, px")->check(CLI::Range(0.1, 10.0));
  app.add_option("--texels", s.texels, "sizes of a texel, px")->delimiter(',')->check(CLI::Range(0.1, 10.0));
  app.add_option("--qualities", s.qualities, "of the maps' JPEGs; 0: PNG")->delimiter(',')->check(CLI::Range(0, 100));
  app.add_option("--triangles", s.triangles, "of the mesh, at most")->check(CLI::Range(4, 10000000));
  app.add_flag("--refit", s.refit, "fit joint and PCA anew for each number of terms");
  CLI11_PARSE(app, argc, argv);
  try {
    fs::create_directories(s.out);
    Bench(s).run();
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "%s\n", e.what()), 1;
  }
}
