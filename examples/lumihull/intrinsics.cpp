// lumihull intrinsics PHOTO… --targets …: calibrates a camera and its lens.

#include <lumihull/base/error.h>
#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/board_views.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/point_grids.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "program.h"

namespace lumihull::program {

namespace {

namespace fs = std::filesystem;
using calib::BoardView;

struct Arguments {
  std::vector<std::string> photos;
  std::string targets, free, fix, start, output = "camera.json", opencv, colmap, draw, report;
  double outlier_sigma = 4;
  bool no_outliers = false;
};

/// What one photograph shows.
struct PhotoViews {
  int width = 0, height = 0;
  std::vector<BoardView> views;
};

/// Indices of intrinsics by their names, separated by commas.
std::vector<std::size_t> intrinsics_of(const std::string& text) {
  std::vector<std::size_t> chosen;
  const auto& names = calib::intrinsic_names();
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string name = text.substr(at, end - at);
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      throw Error(ErrorCode::invalid_argument, "\"" + name + "\" is none of f, s, skew, u0, v0, k1, k2, k3, p1, p2");
    chosen.push_back(std::size_t(found - names.begin()));
    at = end + 1;
  }
  return chosen;
}

calib::LensCalibrationOptions options_of(const Arguments& a) {
  calib::LensCalibrationOptions options;
  if (!a.free.empty()) {
    options.free.fill(false);
    for (const std::size_t i : intrinsics_of(a.free)) options.free[i] = true;
  }
  if (!a.fix.empty())
    for (const std::size_t i : intrinsics_of(a.fix)) options.free[i] = false;
  if (!a.start.empty()) options.start = calib::load_intrinsics(a.start).camera;
  options.outlier_sigma = a.outlier_sigma;
  options.robust = !a.no_outliers;
  return options;
}

PhotoViews views_of(const std::string& file, const calib::TargetSet& set, const calib::TargetDetector* detector,
                    Job& job) {
  const Image photo = read_image(file);
  PhotoViews shown{photo.width(), photo.height(), {}};
  const std::string name = fs::path(file).filename().string();
  if (detector) shown.views = calib::board_views(set, detector->detect(photo, job), name);
  for (const calib::PointGrid& grid : set.grids)
    if (const auto found = calib::find_point_grid(photo, grid, job))
      shown.views.push_back(calib::grid_view(grid, *found, name));
  return shown;
}

std::vector<PhotoViews> find_targets(Program& program, const Arguments& a) {
  const calib::TargetSet set = calib::TargetSet::from_text(a.targets);
  std::unique_ptr<const calib::TargetDetector> detector;
  if (!set.designs.empty()) detector = std::make_unique<const calib::TargetDetector>(set);
  std::vector<PhotoViews> all(a.photos.size());
  Job& job = program.job();
  job.begin("finding targets", a.photos.size());
  parallel_for(
      job, a.photos.size(),
      [&](std::size_t i) {
        Job one({}, 1);
        all[i] = views_of(a.photos[i], set, detector.get(), one);
      },
      true);
  job.end();
  for (std::size_t i = 1; i < all.size(); ++i)
    if (all[i].width != all[0].width || all[i].height != all[0].height)
      throw Error(ErrorCode::bad_input,
                  "is " + std::to_string(all[i].width) + " x " + std::to_string(all[i].height) + " px, the first one " +
                      std::to_string(all[0].width) + " x " + std::to_string(all[0].height) +
                      ": all photographs must be of one camera, and not turned or cropped",
                  a.photos[i]);
  return all;
}

/// The photographs with the points that were found and their residuals.
void draw_views(const Arguments& a, const std::vector<std::string>& drawings, const calib::LensCalibration& found,
                const std::vector<BoardView>& views, const std::vector<std::size_t>& photo_of_view, Program& program) {
  constexpr double kMagnify = 100;
  for (std::size_t photo = 0; photo < a.photos.size(); ++photo) {
    program.job().check();
    std::vector<int> shown;
    for (std::size_t v = 0; v < views.size(); ++v)
      if (photo_of_view[v] == photo) shown.push_back(int(v));
    write_png(drawings[photo], calib::draw_residuals(read_image(a.photos[photo]), found, views, shown, kMagnify));
  }
  program.say("drawings  " + a.draw + ": residuals 100 times as large");
}

std::string formatted(const char* format, double x, double y = 0) {
  char text[160];
  std::snprintf(text, sizeof text, format, x, y);
  return text;
}

void say_result(Program& program, const calib::LensCalibration& found) {
  const Camera& c = found.camera;
  const double values[] = {c.f, c.s, c.skew, c.u0, c.v0, c.k1, c.k2, c.k3, c.p1, c.p2};
  for (int i = 0; i < calib::kIntrinsics; ++i) {
    const double sigma = std::sqrt(std::max(0.0, found.covariance(i, i)));
    std::string name = calib::intrinsic_names()[std::size_t(i)];
    name.resize(10, ' ');
    const bool pixels = i == 0 || i == 2 || i == 3 || i == 4;
    if (sigma > 0)
      program.say(name + formatted(pixels ? "%.3f ± %.2g px" : "%.6f ± %.2g", values[i], sigma));
    else if (values[i] != (i == 1 ? 1 : 0))
      program.say(name + formatted(pixels ? "%.3f px (fixed)" : "%.6f (fixed)", values[i]));
  }
  const std::size_t outliers = std::size_t(
      std::count_if(found.residuals.begin(), found.residuals.end(), [](const auto& r) { return r.outlier; }));
  program.say("points    " + std::to_string(found.residuals.size() - outliers) + ", and " + std::to_string(outliers) +
              " outliers");
  program.say(
      formatted("residuals %.4f px RMS, %.2f times what the points' covariances say", found.rms_px, found.sigma0));
  if (found.cross_validation_px >= 0)
    program.say(formatted("halves    differ by at most %.4f px, %.2f times what is expected", found.cross_validation_px,
                          found.cross_validation_sigma));
  // Hundreds of views may have been left out; what is said of the whole comes last.
  constexpr std::size_t kSaid = 12;
  const std::size_t n = found.problems.size(), skipped = n > kSaid ? n - kSaid : 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (skipped > 0 && i == kSaid / 2) program.say("note      … " + std::to_string(skipped) + " more");
    if (i < kSaid / 2 || i >= kSaid / 2 + skipped) program.say("note      " + found.problems[i]);
  }
}

void run(Program& program, const Arguments& a) {
  const calib::LensCalibrationOptions options = options_of(a);
  options.validate();
  std::vector<std::string> drawings;
  if (!a.draw.empty()) drawings = drawing_names(a.draw, a.photos);
  std::vector<PhotoViews> shown = find_targets(program, a);
  std::vector<BoardView> views;
  std::vector<std::size_t> photo_of_view;
  std::size_t with = 0;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (shown[i].views.empty()) program.say("note      " + a.photos[i] + " shows none of the targets");
    with += !shown[i].views.empty();
    for (BoardView& view : shown[i].views) {
      views.push_back(std::move(view));
      photo_of_view.push_back(i);
    }
  }
  program.say("found     targets in " + std::to_string(with) + " of " + std::to_string(shown.size()) + " photographs");
  if (views.empty())
    throw Error(ErrorCode::degenerate,
                "no photograph shows the targets: is --targets what was printed (columns x rows "
                "are those of inner corners), all of it visible and in focus?");
  const calib::LensCalibration found =
      calib::calibrate_lens(views, shown[0].width, shown[0].height, options, program.job());
  say_result(program, found);

  calib::save_intrinsics(a.output, found);
  program.say("camera    " + a.output);
  const auto exported = [&](const std::string& file, const CameraText& camera) {
    write_file(file, camera.text);
    program.say("exported  " + file + formatted(", largest error of the refit %.2g px", camera.largest_error_px));
  };
  if (!a.opencv.empty()) exported(a.opencv, opencv_camera(found.camera));
  if (!a.colmap.empty()) exported(a.colmap, colmap_camera(found.camera));
  if (!a.report.empty()) {
    write_file(a.report, calib::lens_report_html(found, views, "Lens calibration"));
    program.say("report    " + a.report);
  }
  if (!a.draw.empty()) draw_views(a, drawings, found, views, photo_of_view, program);
  if (program.json) std::cout << calib::intrinsics_json(found);
}

}  // namespace

void add_intrinsics(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb("intrinsics", "calibrate a camera and its lens from photographs of targets",
                                [&program, a] { run(program, *a); });
  verb->add_option("photos", a->photos, "photographs by one camera with one zoom and focus")->required();
  verb->add_option("--targets", a->targets,
                   "what is in them: chessboard:9x6:25mm (inner corners, side of a field), circles:11x8:15mm, "
                   "matrix5x5:18mm, … or a file that describes what was printed")
      ->required()
      ->type_name("WORD|FILE");
  verb->add_option("--free", a->free, "parameters that are estimated [f,u0,v0,k1,k2,p1,p2]")->type_name("NAME,…");
  verb->add_option("--fix", a->fix, "parameters that are not, of f, s, skew, u0, v0, k1, k2, k3, p1, p2")
      ->type_name("NAME,…");
  verb->add_option("--start", a->start, "a camera to start from, and for the values of what is fixed")
      ->type_name("FILE");
  verb->add_option("--outlier-sigma", a->outlier_sigma,
                   "points farther off than this many standard deviations are left out [4]");
  verb->add_flag("--keep-all", a->no_outliers, "plain least squares: no point is an outlier");
  verb->add_option("-o,--output", a->output, "the camera with its covariance [camera.json]")->type_name("FILE");
  verb->add_option("--opencv", a->opencv, "the camera for OpenCV, as YAML")->type_name("FILE");
  verb->add_option("--colmap", a->colmap, "the camera for COLMAP, as cameras.txt")->type_name("FILE");
  verb->add_option("--report", a->report, "a page with residuals and uncertainty")->type_name("FILE");
  verb->add_option("--draw", a->draw, "a folder for the photographs with what was found")->type_name("FOLDER");
}

}  // namespace lumihull::program
