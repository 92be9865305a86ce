// Maximum-likelihood fit of an ellipse with its edge profile: what is fitted, what is left out, what is refused.
#include <lumihull/calib/ellipse.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "contour_band.h"
#include "contour_fit.h"
#include "ellipse_starts.h"

namespace lumihull::calib {
namespace {

constexpr double kHighestRatio = 1.8;  // of the band: gaps between circles are as wide as they are, 0.4 of one is ours
// Of the step: what lenses' edges differ from a Gaussian's by; RMS over the band, and in a part of it beside the rest.
constexpr double kTolerance = 0.02, kSectorTolerance = 0.005;
constexpr double kSectorSigma = 4.5;      // beyond which a part's residuals are no noise
constexpr double kShiftTolerance = 0.01;  // px that a part may be off: below what such contours are good for
constexpr double kRobustSigma = 4;
constexpr double kMostNoise = 0.05;   // of the step: what residuals may pass for noise, whatever the plane says
constexpr double kMostJitter = 0.15;  // px: what edges may differ by from the model's, pixel by pixel

/// Upper limit of χ²_n / n at so many standard deviations (Wilson & Hilferty 1931).
double chi_square_limit(int n, double sigma) {
  const double v = 2.0 / (9.0 * n), root = 1 - v + sigma * std::sqrt(v);
  return root * root * root;
}

double perimeter(const Ellipse& e) {
  const double ratio = (e.a - e.b) / (e.a + e.b), h = ratio * ratio;  // Ramanujan 1914
  return std::numbers::pi * (e.a + e.b) * (1 + 3 * h / (10 + std::sqrt(4 - 3 * h)));
}

/// The edge reaches 3 s; beyond, the light's levels and gradients are measured. The start is made with less.
BandWidth band_of(double s, double b, double inner_ratio, bool wide, bool& ring) {
  const double reach = wide ? 6 * s + 2 : 3 * s + 0.5, wall = (1 - inner_ratio) * b, apart = wall - (3 * s + 0.5);
  ring = inner_ratio > 0 && apart < 3 * s + 0.5;  // else the band ends before the inner contour begins
  return {inner_ratio > 0 && !ring ? std::min(reach, apart) : reach, reach, kHighestRatio};
}

std::optional<Ellipse> ellipse_of(const ContourModel& model, const Eigen::Vector2d& origin) {
  const Eigen::Matrix2d root = model.root();
  return Ellipse::from_shape(origin + model.center(), root * root);
}

/// Share of the contour's length in sectors that are used.
double visible_share(const std::vector<ContourFit::Sector>& sectors, const Ellipse& e) {
  const UnitFrame frame(e);
  double all_length = 0, used = 0;
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    const double angle = (double(i) + 0.5) * 2 * std::numbers::pi / double(sectors.size()) - std::numbers::pi;
    const double length = (frame.root * Eigen::Vector2d(-std::sin(angle), std::cos(angle))).norm();
    all_length += length;
    if (sectors[i].used) used += length;
  }
  return used / all_length;
}

/// Marks sectors whose residuals are more than noise, and more than what all sectors have, and those beside them: what
/// disturbs does not end at a sector's border. True where any mark changed.
bool judge_sectors(std::vector<ContourFit::Sector>& sectors) {
  std::array<double, ContourFit::kMaxSectors> levels{};
  std::size_t n = 0;
  for (const ContourFit::Sector& s : sectors)
    if (s.pixels > 0) levels[n++] = s.squares / s.pixels;
  if (n == 0) return false;
  // A profile that is not Gaussian shows in all of them alike.
  std::nth_element(levels.begin(), levels.begin() + n * 4 / 10, levels.begin() + n);
  const double common = std::max(1.0, levels[n * 4 / 10]);
  std::array<bool, ContourFit::kMaxSectors> bad{};
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    const ContourFit::Sector& s = sectors[i];
    const double shift_limit = kSectorSigma * std::sqrt(common) + kShiftTolerance / s.shift_sd_px;
    if (s.pixels == 0) {  // at a thin ellipse's ends sectors may be narrower than a pixel
      bad[i] = s.clipped > 0;
      continue;
    }
    bad[i] =
        s.squares > common * s.pixels * chi_square_limit(s.pixels, kSectorSigma) || std::abs(s.shift) > shift_limit;
  }
  bool changed = false;
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    const std::size_t before = (i + sectors.size() - 1) % sectors.size(), after = (i + 1) % sectors.size();
    const bool used = !bad[before] && !bad[i] && !bad[after];
    changed |= used != sectors[i].used;
    sectors[i].used = used;
  }
  return changed;
}

enum class Effort : std::uint8_t {
  plain,    ///< nothing is in the way, or little
  careful,  ///< parts of the contour are taken to be disturbed
  noisier,  ///< the same, and edges need not be quite as the model has them
};

/// Fits the pixels of one band. Where parts of the contour are disturbed the rest is fitted alone; false: there is no
/// rest, or no answer.
bool fit_band(ContourFit& pixels, ContourModel& model, double noise, Effort effort, bool last) {
  const double converged = last ? 1e-5 : 1e-2;  // squared length of a step, in standard deviations
  const auto tolerance = [&] { return kSectorTolerance * std::abs(model.p[ContourModel::step]); };
  if (effort == Effort::plain) {
    const ContourModel start = model;
    if (pixels.solve(model, 20, converged, 0, true)) {
      if (!last) return true;  // disturbances show in the second round
      pixels.measure_sectors(tolerance());
      if (!judge_sectors(pixels.sectors())) return true;
    }
    for (ContourFit::Sector& s : pixels.sectors()) s.used = true;
    model = start;
  }
  pixels.expect(model);
  pixels.weigh();
  // A fit that disturbances do not pull shows where they are: large residuals count ever less.
  const double step = std::abs(model.p[ContourModel::step]) / noise;
  for (const double share : {0.3, 0.1, 0.0}) {
    if (share == 0 && effort == Effort::noisier) break;  // that is for noise that is known
    const double scale = std::max({kRobustSigma * std::clamp(pixels.robust_scale(), 1.0, 10.0), share * step});
    if (!pixels.solve(model, 10, 1e-3, scale)) return false;
  }
  const double most_noise = kMostNoise * std::abs(model.p[ContourModel::step]) / noise;
  if (effort == Effort::noisier) {
    pixels.loosen(most_noise, kMostJitter);
    pixels.weigh();
  }
  for (int pass = 0;; ++pass) {
    bool settled = false;
    for (int i = 0; i < 6 && !settled; ++i) {
      pixels.measure_sectors(tolerance());
      settled = !judge_sectors(pixels.sectors()) && i > 0;
      if (settled) break;
      pixels.weigh();
      if (pixels.pixels() < 2 * ContourModel::kSize) return false;
      if (!pixels.solve(model, 10, converged, 0)) return false;
    }
    if (effort != Effort::noisier || pass > 0 || !pixels.loosen_more(most_noise, kMostJitter)) return true;
    pixels.weigh();
  }
}

/// From a start to an answer.
EllipseFit fit_from(const LightPlane& plane, const EllipseFit& start, const EllipseOptions& options, Effort effort) {
  EllipseFit fit = start;
  fit.state = EllipseState::no_fit;
  const PixelBox picture{0, 0, plane.values.width(), plane.values.height()};
  const Eigen::Vector2d origin = start.ellipse.center;
  ContourFit pixels(plane, origin, std::sqrt(start.ellipse.a * start.ellipse.b), ContourSum::quick);
  ContourModel model;
  const UnitFrame frame(start.ellipse);
  const double blur = std::clamp(start.blur_px, 0.5, 0.5 * start.ellipse.b + 0.5);
  model.p << 0, 0, frame.root(0, 0), frame.root(0, 1), frame.root(1, 1), std::sqrt(blur * blur + 1.0 / 12), fit.outside,
      fit.inside - fit.outside, 0, 0, options.inner_ratio;
  const double start_noise = std::sqrt(std::max(1e-14, plane.noise.variance(0.5 * (fit.inside + fit.outside))));

  const int sectors = std::clamp(int(perimeter(start.ellipse) / 1.6), 12, ContourFit::kMaxSectors);
  Ellipse ellipse = start.ellipse;
  bool ring = false;
  for (int round = 0; round < 2; ++round) {
    const BandWidth band = band_of(model.p[ContourModel::blur], ellipse.b, options.inner_ratio, round > 0, ring);
    pixels.gather(ellipse, model, band, sectors, ring ? options.inner_ratio : 0, options.inner_offset, round == 0);
    if (pixels.gathered() < 2 * ContourModel::kSize) return fit;
    if (!fit_band(pixels, model, start_noise, effort, round > 0)) {
      fit.visible = visible_share(pixels.sectors(), ellipse);
      if (fit.visible < options.min_visible) fit.state = EllipseState::occluded;
      return fit;
    }
    const std::optional<Ellipse> now = ellipse_of(model, origin);
    if (!now || !(now->b >= 0.5)) return fit;
    ellipse = *now;
    if (!contains(picture, ellipse, 0)) {
      fit.state = EllipseState::at_border;
      return fit;
    }
  }

  fit.ellipse = ellipse;
  fit.outside = model.p[ContourModel::outside];
  fit.inside = fit.outside + model.p[ContourModel::step];
  fit.blur_px = std::sqrt(std::max(0.0, model.p[ContourModel::blur] * model.p[ContourModel::blur] - 1.0 / 12));
  fit.visible = visible_share(pixels.sectors(), ellipse);
  const int freedom = pixels.pixels() - (ring ? ContourModel::kSize : ContourModel::kSize - 1);
  if (freedom <= 0) return fit;
  const double variance_ratio = pixels.squares() / freedom;
  fit.residual = std::sqrt(variance_ratio);

  // d Q / d root, Q = root².
  Eigen::Matrix<double, 5, ContourModel::kSize> j = Eigen::Matrix<double, 5, ContourModel::kSize>::Zero();
  const double m11 = model.p[ContourModel::root11], m12 = model.p[ContourModel::root12],
               m22 = model.p[ContourModel::root22];
  j.topLeftCorner<2, 2>().setIdentity();
  j.block<3, 3>(2, ContourModel::root11) << 2 * m11, 2 * m12, 0, m12, m11 + m22, m12, 0, 2 * m12, 2 * m22;
  const ContourModel::Matrix inverse = pixels.information().inverse();
  fit.covariance = j * inverse * j.transpose() * std::max(1.0, variance_ratio / 1.3);
  if (!fit.covariance.allFinite() || !(fit.covariance(0, 0) > 0) || !(fit.covariance(1, 1) > 0)) return fit;

  const double noise = std::sqrt(std::max(1e-14, plane.noise.variance(0.5 * (fit.inside + fit.outside))));
  const double step = std::abs(model.p[ContourModel::step]), most = kTolerance * step / noise;
  // Where noise is what the residuals are there is no more to be forgiven.
  const double tolerated = pixels.loosened() ? std::min(most, 1.0) : most;
  if (pixels.clipped() > options.max_saturated * pixels.gathered())
    fit.state = EllipseState::saturated;
  else if (step < options.min_contrast_noise * noise)
    fit.state = EllipseState::no_contrast;
  else if (fit.visible < options.min_visible)
    fit.state = EllipseState::occluded;
  else if (fit.visible < 0.95 ? variance_ratio > 1.4 + 0.25 * tolerated * tolerated  // what is left must be right
                              : variance_ratio > 2 + tolerated * tolerated)
    fit.state = EllipseState::no_fit;
  else
    fit.state = EllipseState::good;
  return fit;
}

/// What a guess within a few px can be of.
bool near_guess(const Ellipse& e, const Ellipse& guess) {
  const double play = 2 + 0.15 * guess.a;
  return (e.center - guess.center).norm() <= play && std::abs(e.a - guess.a) <= play &&
         std::abs(e.b - guess.b) <= 2 + 0.15 * guess.b;
}

/// Levels on both sides of a contour, for a start: means over eight directions.
void look_at_levels(const LightPlane& plane, const Ellipse& e, double s, double inner_ratio, double& inside,
                    double& outside) {
  // Of a ring the middle of its wall; both at least where little of the other level is seen.
  const double inward = inner_ratio > 0 ? 0.5 * (1 - inner_ratio) : std::min(0.8, 2 * s / e.b), outward = 2 * s / e.b;
  Ellipse in = e, out = e;
  in.a *= 1 - inward, in.b *= 1 - inward;
  out.a *= 1 + std::min(outward, kHighestRatio - 1), out.b *= 1 + std::min(outward, kHighestRatio - 1);
  const auto mean = [&](const Ellipse& ring) {
    double sum = 0;
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector2d p = ring.point(std::numbers::pi * k / 4);
      const int x = std::clamp(int(p.x()), 0, plane.values.width() - 1),
                y = std::clamp(int(p.y()), 0, plane.values.height() - 1);
      sum += double(plane.values.row<float>(y)[x]);
    }
    return sum / 8;
  };
  inside = mean(in), outside = mean(out);
}

}  // namespace

EllipseFit fit_ellipse(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options) {
  options.validate();
  return fit_ellipse(plane, guess, options, 0);
}

EllipseFit fit_ellipse(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options, double blur_px) {
  EllipseFit start, fit;
  const auto plain_fit = [&] {
    fit = fit_from(plane, start, options, Effort::plain);
    if (fit.state == EllipseState::good && !near_guess(fit.ellipse, guess)) fit.state = EllipseState::no_fit;
  };
  const auto settled = [&] {
    return (fit.state == EllipseState::good && fit.visible > 0.9) || fit.state == EllipseState::saturated ||
           fit.state == EllipseState::at_border;
  };
  // Where the blur is known the guess itself may do for a start.
  const PixelBox picture{0, 0, plane.values.width(), plane.values.height()};
  if (blur_px > 0 && guess.b >= 1 && contains(picture, guess, 1)) {
    start.ellipse = guess;
    start.blur_px = blur_px;
    look_at_levels(plane, guess, std::sqrt(blur_px * blur_px + 1.0 / 12), options.inner_ratio, start.inside,
                   start.outside);
    if (start.inside != start.outside) {
      plain_fit();
      if (fit.state == EllipseState::good && fit.visible > 0.9) return fit;
    }
  }
  start = dual_conic_start(plane, guess, options, false);
  const bool started = start.state == EllipseState::good;
  if (!started && start.state != EllipseState::no_fit) return start;
  if (start.inside == start.outside) return start;  // nothing was looked at
  fit = start;
  if (started) {
    plain_fit();
    if (settled()) return fit;
  }
  // The dual conic is drawn off by whatever edge is near; the guess may not be.
  start.ellipse = guess;
  start.blur_px = std::min(start.blur_px, 1.0);
  EllipseFit again = fit_from(plane, start, options, Effort::careful);
  if (again.state == EllipseState::good && !near_guess(again.ellipse, guess)) again.state = EllipseState::no_fit;
  const bool better =
      again.state == EllipseState::good && (fit.state != EllipseState::good || again.visible > fit.visible);
  if (better || !started) fit = again;
  if (fit.state == EllipseState::good || fit.state == EllipseState::no_contrast) return fit;
  const EllipseFit noisier = fit_from(plane, start, options, Effort::noisier);
  return noisier.state == EllipseState::good && near_guess(noisier.ellipse, guess) ? noisier : fit;
}

}  // namespace lumihull::calib
