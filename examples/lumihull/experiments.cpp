// lumihull repeatability CAPTURE: how well the robot came back to places that it was sent to several times.
// lumihull stability FRAME…: how long a ball in a film moves after the robot's command has ended.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/ellipse.h>
#include <lumihull/capture/experiments.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <optional>

#include "program.h"

namespace lumihull::program {

namespace {

namespace fs = std::filesystem;

std::string formatted(const char* format, double x, double y = 0) {
  char text[200];
  std::snprintf(text, sizeof text, format, x, y);
  return text;
}

// ---- repeatability --------------------------------------------------------------------------------------------------

struct ReturnArguments {
  std::string folder, page, svg;
};

void judge_returns(Program& program, const ReturnArguments& a) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const capture::Repeatability found = capture::repeatability(Capture::open(a.folder));
  for (const capture::RepeatedPlace& p : found.places)
    program.say(p.name + ": " + std::to_string(p.photographs.size()) + " visits, within " +
                formatted("%.2f mm and %.3f° of their mean", 1000 * p.spread.largest_distance_m,
                          kDegrees * p.spread.largest_angle_rad));
  program.say("all: within " +
              formatted("%.2f mm and %.3f°", 1000 * found.largest_distance_m, kDegrees * found.largest_angle_rad) +
              formatted(", RMS %.2f mm and %.3f°", 1000 * found.rms_distance_m, kDegrees * found.rms_angle_rad));
  if (found.measured_m >= 0)
    program.say("poses are known to " +
                formatted("%.3f mm and %.4f° (RMS)", 1000 * found.measured_m, kDegrees * found.measured_rad));
  if (!found.without_pose.empty())
    program.say("note: " + std::to_string(found.without_pose.size()) + " photographs have no pose and are left out");
  std::vector<capture::PoseSpread> spreads;
  for (const capture::RepeatedPlace& p : found.places) spreads.push_back(p.spread);
  const fs::path page = a.page.empty() ? fs::path(a.folder) / "repeatability.html" : fs::path(a.page);
  write_file(page, capture::repeatability_html(found, "Repeatability"));
  if (!a.svg.empty()) write_file(a.svg, capture::repeatability_svg(spreads));
  program.say("page " + page.string());
  if (program.json) std::cout << capture::describe_json(found) << '\n';
}

// ---- stability ------------------------------------------------------------------------------------------------------

struct FilmArguments {
  std::vector<std::string> frames;
  std::string svg, ball;
  double fps = 30, allowed = 0.5, rest = 2;
};

/// The level between the two kinds of pixels that a picture has mostly (Otsu 1979), on 256 levels of sqrt(light).
int between_levels(const std::vector<std::uint8_t>& levels) {
  std::array<double, 256> count{};
  for (const std::uint8_t v : levels) ++count[v];
  double all = 0, sum = 0;
  for (int v = 0; v < 256; ++v) all += count[std::size_t(v)], sum += v * count[std::size_t(v)];
  double below = 0, sum_below = 0, most = -1;
  int best = 127;
  for (int v = 0; v < 255; ++v) {
    below += count[std::size_t(v)], sum_below += v * count[std::size_t(v)];
    if (below == 0 || below == all) continue;
    const double apart = sum_below / below - (sum - sum_below) / (all - below);
    const double between = below * (all - below) * apart * apart;
    if (between > most) most = between, best = v;
  }
  return best;
}

/// Moments of a region of pixels, as they are collected.
struct Region {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  bool at_border = false;

  void add(int column, int row) {
    const double u = column + .5, v = row + .5;
    ++n, x += u, y += v, xx += u * u, xy += u * v, yy += v * v;
  }
  /// The ellipse of these moments, if the region fills one.
  std::optional<calib::Ellipse> ellipse() const {
    const Eigen::Vector2d c(x / n, y / n);
    Eigen::Matrix2d q;
    q << xx / n - c.x() * c.x(), xy / n - c.x() * c.y(), xy / n - c.x() * c.y(), yy / n - c.y() * c.y();
    const auto out = calib::Ellipse::from_shape(c, 4 * q);
    if (!out || out->b < 0.4 * out->a || std::abs(n / (std::numbers::pi * out->a * out->b) - 1) > 0.05) return {};
    return out;
  }
};

/// The largest region of one kind of pixels, `light` or dark, that looks like a ball.
std::optional<calib::Ellipse> largest_ball(std::vector<std::uint8_t> levels, int width, int height, bool light) {
  constexpr int kLeastPixels = 200;
  const int level = between_levels(levels);
  for (std::uint8_t& v : levels) v = (v > level) == light;
  std::optional<calib::Ellipse> best;
  std::vector<int> open;
  for (int start = 0; start < width * height; ++start) {
    if (!levels[std::size_t(start)]) continue;
    Region region;
    open.assign(1, start);
    levels[std::size_t(start)] = 0;
    while (!open.empty()) {
      const int at = open.back(), column = at % width, row = at / width;
      open.pop_back();
      region.add(column, row);
      region.at_border |= column == 0 || row == 0 || column == width - 1 || row == height - 1;
      const auto look = [&](bool inside, int next) {
        if (!inside || !levels[std::size_t(next)]) return;
        levels[std::size_t(next)] = 0;
        open.push_back(next);
      };
      look(column > 0, at - 1), look(column + 1 < width, at + 1);
      look(row > 0, at - width), look(row + 1 < height, at + width);
    }
    if (region.at_border || region.n < kLeastPixels) continue;
    const auto ellipse = region.ellipse();
    if (ellipse && (!best || ellipse->a * ellipse->b > best->a * best->b)) best = ellipse;
  }
  return best;
}

std::optional<calib::Ellipse> find_ball(const calib::LightPlane& plane) {
  const int width = plane.values.width(), height = plane.values.height();
  std::vector<std::uint8_t> levels;
  levels.reserve(std::size_t(width) * std::size_t(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      levels.push_back(std::uint8_t(255 * std::sqrt(std::clamp(plane.values.row<float>(y)[x], 0.f, 1.f))));
  const auto light = largest_ball(levels, width, height, true);
  return light ? light : largest_ball(std::move(levels), width, height, false);
}

/// "X,Y,D"
calib::Ellipse ball_of(const std::string& text) {
  double x = 0, y = 0, d = 0;
  char more = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &x, &y, &d, &more) != 3 || !std::isfinite(x + y + d) || d < 4)
    throw Error(ErrorCode::invalid_argument, "expected the ball's centre and diameter in pixels as X,Y,D", "--ball");
  return {{x, y}, d / 2, d / 2, 0};
}

void judge_film(Program& program, const FilmArguments& a) {
  Job& job = program.job();
  std::optional<calib::Ellipse> last;
  if (!a.ball.empty()) last = ball_of(a.ball);
  std::vector<double> times;
  std::vector<Eigen::Vector2d> centers;
  std::vector<std::string> lost;
  double sigma2 = 0;
  job.begin("measuring the ball", a.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    job.check();
    const calib::LightPlane plane = calib::light_plane(read_image(a.frames[i]));
    calib::EllipseFit fit;
    if (last) fit = calib::fit_ellipse(plane, *last);
    if (fit.state != calib::EllipseState::good)
      if (const auto found = find_ball(plane)) fit = calib::fit_ellipse(plane, *found);
    if (fit.state == calib::EllipseState::good) {
      last = fit.ellipse;
      times.push_back(double(i) / a.fps);
      centers.push_back(fit.ellipse.center);
      sigma2 += fit.center_covariance().trace();
    } else {
      lost.push_back(a.frames[i]);
    }
    job.advance();
  }
  job.end();
  if (times.size() < 4)
    throw Error(
        ErrorCode::bad_input,
        "no ball was found in " + std::to_string(lost.size()) + " of " + std::to_string(a.frames.size()) +
            " pictures: expected a round object that is wholly in the picture, light before dark or dark before "
            "light; --ball X,Y,D says where it is in the first",
        lost.empty() ? a.frames.front() : lost.front());
  const capture::Stability found = capture::stability(times, centers, a.allowed, a.rest);
  if (!lost.empty())
    program.say("note: the ball was not found in " + std::to_string(lost.size()) + " pictures, the first of them " +
                lost.front());
  program.say("ball of " +
              formatted("%.1f px, measured to %.3f px", 2 * last->a, std::sqrt(sigma2 / double(times.size()))) +
              formatted(" (noise); at rest %.3f px RMS", found.rest_px));
  program.say(found.settle_s ? formatted("within %g px from %.2f s on", a.allowed, *found.settle_s)
                             : formatted("not within %g px at the end", a.allowed));
  if (!a.svg.empty()) {
    write_file(a.svg, capture::stability_svg(found.time_s, found.distance_px, a.allowed));
    program.say("picture " + a.svg);
  }
  if (program.json) std::cout << capture::describe_json(found) << '\n';
}

}  // namespace

void add_experiments(Program& program) {
  const auto r = std::make_shared<ReturnArguments>();
  CLI::App* verb = program.verb("repeatability", "how well the robot came back, of a calibrated capture",
                                [&program, r] { judge_returns(program, *r); });
  verb->add_option("capture", r->folder, "whose plan visits places several times (`lumihull plan --repeatability`)")
      ->required();
  verb->add_option("-o,--output", r->page, "the page [CAPTURE/repeatability.html]")->type_name("FILE");
  verb->add_option("--svg", r->svg, "its picture alone")->type_name("FILE");

  const auto f = std::make_shared<FilmArguments>();
  verb = program.verb("stability", "how long a ball in a film moves after the robot has stopped",
                      [&program, f] { judge_film(program, *f); });
  verb->add_option("frames", f->frames, "pictures of the film in order; the first is of the command's end")->required();
  verb->add_option("--fps", f->fps, "pictures a second [30]")->check(CLI::Range(0.001, 1e6));
  verb->add_option("--allowed", f->allowed, "displacement that counts as still, px [0.5]")->check(CLI::PositiveNumber);
  verb->add_option("--rest", f->rest, "seconds at the film's end that count as rest [2]")->check(CLI::PositiveNumber);
  verb->add_option("--ball", f->ball, "where it is in the first picture: centre and diameter, px; else it is found")
      ->type_name("X,Y,D");
  verb->add_option("--svg", f->svg, "a picture of its displacement over time")->type_name("FILE");
}

}  // namespace lumihull::program
