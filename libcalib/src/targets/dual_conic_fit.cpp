// Ouellet & Hébert's ellipse operator, with the pixels' noise propagated through it.
#include <lumihull/base/error.h>
#include <lumihull/calib/ellipse.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "contour_band.h"
#include "ellipse_starts.h"
#include "lanes.h"

namespace lumihull::calib {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Matrix52 = Eigen::Matrix<double, 5, 2>;

constexpr int kMaxRadius = 15;         // of filters, px: 3 sigma
constexpr double kHighestRatio = 1.8;  // of the band: circles' gaps are as wide as they are, and 0.4 of one is ours

/// A Gaussian and its derivative, as taps -radius … radius for a correlation: a ramp of slope 1 has the derivative 1.
struct Filters {
  int radius = 0;
  std::array<double, 2 * kMaxRadius + 1> smooth{}, slope{};

  explicit Filters(double sigma) : radius(std::min(kMaxRadius, int(std::ceil(3 * sigma)))) {
    double sum = 0, moment = 0;
    for (int i = -radius; i <= radius; ++i) {
      smooth[std::size_t(i + radius)] = std::exp(-0.5 * i * i / (sigma * sigma));
      slope[std::size_t(i + radius)] = i * smooth[std::size_t(i + radius)];
      sum += smooth[std::size_t(i + radius)];
      moment += i * slope[std::size_t(i + radius)];
    }
    for (double& v : smooth) v /= sum;
    for (double& v : slope) v /= moment;
  }
  /// Variance of a derivative for pixels of variance 1.
  double variance() const {
    double a = 0, b = 0;
    for (int i = 0; i <= 2 * radius; ++i) {
      a += smooth[std::size_t(i)] * smooth[std::size_t(i)];
      b += slope[std::size_t(i)] * slope[std::size_t(i)];
    }
    return a * b;
  }
};

Eigen::Vector2d gradient(const Image& values, const Filters& f, int x, int y) {
  const int taps = 2 * f.radius + 1;
  double gx = 0, gy = 0;
  for (int j = 0; j < taps; ++j) {
    const float* row = values.row<float>(y + j - f.radius) + x - f.radius;
    double smooth = 0, slope = 0;
    for (int i = 0; i < taps; ++i) {
      smooth += f.smooth[std::size_t(i)] * double(row[i]);
      slope += f.slope[std::size_t(i)] * double(row[i]);
    }
    gx += f.smooth[std::size_t(j)] * slope;
    gy += f.slope[std::size_t(j)] * smooth;
  }
  return {gx, gy};
}

/// Of eight pixels of a row, from x on; all of their neighbourhood is in the picture.
void gradients(const Image& values, const Filters& f, int x, int y, Lanes& gx, Lanes& gy) {
  const int taps = 2 * f.radius + 1;
  gx = gy = all(0);
  for (int j = 0; j < taps; ++j) {
    const float* row = values.row<float>(y + j - f.radius) + x - f.radius;
    Lanes smooth = all(0), slope = all(0);
    for (int i = 0; i < taps; ++i) {
      Lanes v;
      std::memcpy(&v, row + i, sizeof v);
      smooth += all(float(f.smooth[std::size_t(i)])) * v;
      slope += all(float(f.slope[std::size_t(i)])) * v;
    }
    gx += all(float(f.smooth[std::size_t(j)])) * slope;
    gy += all(float(f.slope[std::size_t(j)])) * smooth;
  }
}

/// A pixel of the band: its place about the guess's centre in units of its scale, and its gradient.
struct BandPixel {
  int x = 0, y = 0;
  Eigen::Vector2d place{0, 0}, gradient{0, 0};

  /// K' = [a², ab, b², ac, bc] and c of the line (a, b, c).
  Vector5 monomials(double& c) const {
    const double a = gradient.x(), b = gradient.y();
    c = -gradient.dot(place);
    return {a * a, a * b, b * b, a * c, b * c};
  }
};

/// Σ over pixels j of var_j (dΘ/dI_j)(dΘ/dI_j)ᵀ, where dΘ/dI_j = Σ_i by_gradient_i · D_ij over the band's pixels i and
/// D the filters' taps. Band pixels come row by row, so that 2 radius + 1 rows of sums are enough.
class NoisePropagation {
 public:
  NoisePropagation(const LightPlane& plane, const Filters& filters, int x0, int x1)
      : plane_(plane),
        f_(filters),
        x0_(x0 - filters.radius),
        width_(std::size_t(x1 - x0 + 2 * filters.radius)),
        rows_(std::size_t(2 * filters.radius + 1), std::vector<Vector5>(width_, Vector5::Zero())) {}

  void add(const BandPixel& p, const Matrix52& by_gradient) {
    const int taps = 2 * f_.radius + 1;
    if (!started_) next_ = p.y - f_.radius, started_ = true;
    while (next_ < p.y - f_.radius) finish_row();
    for (int j = 0; j < taps; ++j) {
      Vector5* row = rows_[std::size_t(p.y + j - f_.radius) % rows_.size()].data() + (p.x - f_.radius - x0_);
      const Vector5 by_slope = by_gradient.col(0) * f_.smooth[std::size_t(j)];
      const Vector5 by_smooth = by_gradient.col(1) * f_.slope[std::size_t(j)];
      for (int i = 0; i < taps; ++i)
        row[i] += by_slope * f_.slope[std::size_t(i)] + by_smooth * f_.smooth[std::size_t(i)];
    }
  }
  Matrix5 covariance() {
    for (std::size_t i = 0; i < rows_.size(); ++i) finish_row();
    return sum_.selfadjointView<Eigen::Lower>();
  }

 private:
  void finish_row() {
    std::vector<Vector5>& row = rows_[std::size_t(next_) % rows_.size()];
    if (next_ < plane_.values.height()) {
      const float* values = plane_.values.row<float>(next_);
      for (std::size_t i = 0; i < width_; ++i) {
        if (row[i][0] == 0 && row[i][1] == 0) continue;
        const double variance = plane_.noise.variance(values[x0_ + int(i)]);
        sum_.selfadjointView<Eigen::Lower>().rankUpdate(row[i], variance);
        row[i].setZero();
      }
    }
    ++next_;
  }

  const LightPlane& plane_;
  const Filters& f_;
  int x0_;
  std::size_t width_;
  std::vector<std::vector<Vector5>> rows_;
  int next_ = 0;
  bool started_ = false;
  Matrix5 sum_ = Matrix5::Zero();
};

/// d (centre, shape) / d Θ, in units of the scale; Θ = (A, B, C, D, E).
Matrix5 answer_by_theta(const Vector5& theta) {
  const double x = 0.5 * theta[3], y = 0.5 * theta[4];
  Matrix5 j = Matrix5::Zero();
  j(0, 3) = j(1, 4) = 0.5;
  j(2, 0) = j(4, 2) = -1;
  j(3, 1) = -0.5;
  j(2, 3) = x;
  j(3, 3) = 0.5 * y;
  j(3, 4) = 0.5 * x;
  j(4, 4) = y;
  return j;
}

}  // namespace

EllipseFit dual_conic_start(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options,
                            bool with_covariance) {
  EllipseFit fit;
  fit.ellipse = guess;
  const int width = plane.values.width(), height = plane.values.height();
  if (!guess.center.allFinite() || !(guess.b >= 1) || !(guess.a >= guess.b) || !(guess.a <= 1e5) ||
      !std::isfinite(guess.angle))
    return fit;
  if (!contains({0, 0, width, height}, guess, 1)) {
    fit.state = EllipseState::at_border;
    return fit;
  }
  const Filters filters(options.gradient_sigma_px);
  const PixelBox box{filters.radius, filters.radius, width - filters.radius, height - filters.radius};
  const UnitFrame frame(guess);
  const double reach = 2 * options.gradient_sigma_px + 1, scale = std::sqrt(guess.a * guess.b);
  const double wall = options.inner_ratio > 0 ? (1 - options.inner_ratio) * guess.b : guess.b;  // to the next contour
  const BandWidth band{std::min(reach, options.inner_ratio > 0 ? 0.6 * wall : wall), reach, kHighestRatio};

  std::vector<BandPixel> pixels;
  if (with_covariance) pixels.reserve(std::size_t(8 * guess.a * (band.inward + band.outward)) + 64);
  // Levels are those of the band's outer parts; of a thin ring these may hold no pixel's centre, then all of a side.
  double inside = 0, outside = 0, any_inside = 0, energy = 0;
  int n_inside = 0, n_outside = 0, n_any_inside = 0, clipped = 0;
  std::size_t count = 0;
  Matrix5 normal = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
  for_each_in_band(guess, frame, band, box, [&](const BandPixels& some) {
    const bool room = some.x + kLanes + filters.radius <= width;
    Lanes gx, gy;
    if (room) gradients(plane.values, filters, some.x, some.y, gx, gy);
    for (int i = 0; i < kLanes; ++i) {
      if (!some.inside[i]) continue;
      const int x = some.x + i, y = some.y;
      const double value = plane.values.row<float>(y)[x], distance = double(some.distance[i]);
      if (value >= double(plane.saturation)) ++clipped;
      if (distance < -0.5 * band.inward) inside += value, ++n_inside;
      if (distance < 0) any_inside += value, ++n_any_inside;
      if (distance > 0.5 * band.outward) outside += value, ++n_outside;
      BandPixel p{x, y, (Eigen::Vector2d(x + 0.5, y + 0.5) - guess.center) / scale,
                  room ? Eigen::Vector2d(double(gx[i]), double(gy[i])) : gradient(plane.values, filters, x, y)};
      if (!p.gradient.allFinite()) continue;
      double c = 0;
      const Vector5 k = p.monomials(c);
      for (int n = 0; n < 5; ++n)
        for (int m = n; m < 5; ++m) normal(m, n) += k[m] * k[n];
      right -= k * (c * c);
      energy += p.gradient.squaredNorm();
      ++count;
      if (with_covariance) pixels.push_back(p);
    }
  });
  if (n_inside == 0) inside = any_inside, n_inside = n_any_inside;
  if (count < 12 || n_inside == 0 || n_outside == 0) return fit;
  fit.inside = inside / n_inside;
  fit.outside = outside / n_outside;
  const double contrast = fit.outside - fit.inside, middle = 0.5 * (fit.outside + fit.inside);
  const double noise = std::sqrt(std::max(1e-300, plane.noise.variance(middle)));
  if (!(std::abs(contrast) >= options.min_contrast_noise * noise)) {
    fit.state = EllipseState::no_contrast;
    return fit;
  }
  if (clipped > options.max_saturated * double(count)) {
    fit.state = EllipseState::saturated;
    return fit;
  }

  const Eigen::LDLT<Matrix5> solver = normal.selfadjointView<Eigen::Lower>().ldlt();
  const Vector5 theta = solver.solve(right);
  if (solver.info() != Eigen::Success || !theta.allFinite()) return fit;
  Eigen::Matrix3d dual;
  dual << theta[0], theta[1] / 2, theta[3] / 2, theta[1] / 2, theta[2], theta[4] / 2, theta[3] / 2, theta[4] / 2, 1;
  std::optional<Ellipse> ellipse = Ellipse::from_dual_conic(dual);
  if (!ellipse) return fit;
  ellipse->center = guess.center + scale * ellipse->center;
  ellipse->a *= scale;
  ellipse->b *= scale;
  // Beyond the band nothing was measured.
  if ((ellipse->center - guess.center).norm() > reach + 0.2 * guess.a || ellipse->a > 1.5 * guess.a + reach ||
      ellipse->b < 0.4 * guess.b)
    return fit;
  fit.ellipse = *ellipse;
  fit.state = EllipseState::good;

  // An edge with a Gaussian profile of sigma s has ∫ slope² = contrast² / (2 sqrt(pi) s) across it; noise adds its own.
  const double ratio = (fit.ellipse.a - fit.ellipse.b) / (fit.ellipse.a + fit.ellipse.b), h = ratio * ratio;
  const double length = std::numbers::pi * (fit.ellipse.a + fit.ellipse.b) * (1 + 3 * h / (10 + std::sqrt(4 - 3 * h)));
  energy -= 2 * noise * noise * filters.variance() * double(count);
  if (energy > 0) {
    const double s = contrast * contrast * length / (2 * std::sqrt(std::numbers::pi) * energy);
    const double sigma = options.gradient_sigma_px;
    fit.blur_px = std::sqrt(std::max(0.0, s * s - sigma * sigma - 1.0 / 12));
  }
  if (!with_covariance) return fit;

  // N Θ = -Σ K' c² differentiated by each gradient g: N dΘ = -Σ (dK' (c² + K'·Θ) + K' (2 c dc + dK'·Θ)).
  int x_low = width, x_high = 0;
  for (const BandPixel& p : pixels) x_low = std::min(x_low, p.x), x_high = std::max(x_high, p.x);
  NoisePropagation propagation(plane, filters, x_low, x_high + 1);
  for (const BandPixel& p : pixels) {
    double c = 0;
    const Vector5 k = p.monomials(c);
    const double residual = c * c + k.dot(theta), a = p.gradient.x(), b = p.gradient.y();
    Matrix52 by_gradient;
    for (int i = 0; i < 2; ++i) {
      const double da = i == 0, db = i == 1, dc = -p.place[i];
      const Vector5 dk(2 * a * da, da * b + a * db, 2 * b * db, da * c + a * dc, db * c + b * dc);
      by_gradient.col(i) = -(dk * residual + k * (2 * c * dc + dk.dot(theta)));
    }
    propagation.add(p, by_gradient);
  }
  const Matrix5 inverse = solver.solve(Matrix5::Identity());
  Matrix5 j = answer_by_theta(theta) * inverse;
  j.topRows<2>() *= scale;
  j.bottomRows<3>() *= scale * scale;
  fit.covariance = j * propagation.covariance() * j.transpose();
  return fit;
}

EllipseFit dual_conic_fit(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options) {
  options.validate();
  // A band that lies to one side of the contour draws the answer to that side: once more, about the answer.
  const EllipseFit first = dual_conic_start(plane, guess, options, false);
  if (first.state != EllipseState::good) return first;
  return dual_conic_start(plane, first.ellipse, options, true);
}

}  // namespace lumihull::calib
