#include "saddle_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace lumihull::calib::lens {
namespace {

using Eigen::Vector2d;
constexpr int kUnknowns = 9;
using Vector9 = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix9 = Eigen::Matrix<double, kUnknowns, kUnknowns>;
enum { kX, kY, kAngle1, kAngle2, kMean, kContrast, kBlur, kLightX, kLightY };

struct Sample {
  double x, y, value, weight;
};

/// The model at a pixel's centre and its derivatives. The blur includes the pixel's own width.
double model(const Vector9& p, double x, double y, Vector9* gradient) {
  const double dx = x - p(kX), dy = y - p(kY);
  const double c1 = std::cos(p(kAngle1)), s1 = std::sin(p(kAngle1)), c2 = std::cos(p(kAngle2)),
               s2 = std::sin(p(kAngle2));
  // Distances from the edges: normals are the directions turned by 90 degrees.
  const double d1 = -s1 * dx + c1 * dy, d2 = -s2 * dx + c2 * dy;
  const double scale = 1 / (std::numbers::sqrt2 * p(kBlur));
  const double e1 = std::erf(d1 * scale), e2 = std::erf(d2 * scale);
  const double light = 1 + p(kLightX) * dx + p(kLightY) * dy, pattern = p(kMean) + p(kContrast) * e1 * e2;
  if (gradient) {
    constexpr double kSlope = 2 / 1.7724538509055160273;  // d erf(t) / dt at 0
    const double g1 = kSlope * std::exp(-d1 * d1 * scale * scale) * scale * e2,
                 g2 = kSlope * std::exp(-d2 * d2 * scale * scale) * scale * e1;
    const double a = light * p(kContrast);
    Vector9& g = *gradient;
    g(kX) = a * (g1 * s1 + g2 * s2) - p(kLightX) * pattern;
    g(kY) = -a * (g1 * c1 + g2 * c2) - p(kLightY) * pattern;
    g(kAngle1) = a * g1 * (-c1 * dx - s1 * dy);
    g(kAngle2) = a * g2 * (-c2 * dx - s2 * dy);
    g(kMean) = light;
    g(kContrast) = light * e1 * e2;
    g(kBlur) = -a * (g1 * d1 + g2 * d2) / p(kBlur);
    g(kLightX) = dx * pattern;
    g(kLightY) = dy * pattern;
  }
  return light * pattern;
}

double cost_of(const std::vector<Sample>& samples, const Vector9& p) {
  double sum = 0;
  for (const Sample& s : samples) {
    const double r = s.value - model(p, s.x, s.y, nullptr);
    sum += s.weight * r * r;
  }
  return sum;
}

/// JᵀWJ and JᵀWr.
void normal_equations(const std::vector<Sample>& samples, const Vector9& p, Matrix9& normal, Vector9& right) {
  normal.setZero();
  right.setZero();
  Vector9 g;
  for (const Sample& s : samples) {
    const double r = s.value - model(p, s.x, s.y, &g);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(g, s.weight);
    right += s.weight * r * g;
  }
  normal = normal.selfadjointView<Eigen::Lower>();
}

bool sensible(const Vector9& p, const Vector2d& start, double radius) {
  return p.allFinite() && (p.head<2>() - start).norm() <= 0.5 * radius && p(kBlur) > 0.1 && p(kBlur) < radius &&
         std::abs(std::sin(p(kAngle1) - p(kAngle2))) > 0.15;
}

}  // namespace

std::optional<Saddle> fit_saddle(const LightPlane& plane, const Vector2d& start, const Vector2d& along1,
                                 const Vector2d& along2, double radius) {
  if (!start.allFinite() || !(radius >= 2)) return std::nullopt;
  const int x0 = int(std::floor(start.x() - radius)), x1 = int(std::ceil(start.x() + radius)),
            y0 = int(std::floor(start.y() - radius)), y1 = int(std::ceil(start.y() + radius));
  if (x0 < 0 || y0 < 0 || x1 > plane.values.width() || y1 > plane.values.height()) return std::nullopt;
  std::vector<Sample> samples;
  double low = 1e30, high = -1e30, mean = 0;
  for (int y = y0; y < y1; ++y) {
    const float* row = plane.values.row<float>(y);
    for (int x = x0; x < x1; ++x) {
      const Vector2d d(x + 0.5 - start.x(), y + 0.5 - start.y());
      if (d.squaredNorm() > radius * radius) continue;
      samples.push_back({x + 0.5, y + 0.5, row[x], 1 / plane.noise.variance(row[x])});
      low = std::min(low, double(row[x]));
      high = std::max(high, double(row[x]));
      mean += row[x];
    }
  }
  if (samples.size() < 2 * kUnknowns || !(high > low)) return std::nullopt;
  mean /= double(samples.size());

  Vector9 p;
  p << start, std::atan2(along1.y(), along1.x()), std::atan2(along2.y(), along2.x()), mean, 0.4 * (high - low), 1, 0, 0;
  {  // the sign of the contrast, by the pixels themselves
    Vector9 other = p;
    other(kContrast) = -p(kContrast);
    if (cost_of(samples, other) < cost_of(samples, p)) p = other;
  }
  double cost = cost_of(samples, p), damping = 1e-3;
  Matrix9 normal;
  Vector9 right;
  for (int iteration = 0; iteration < 40; ++iteration) {
    normal_equations(samples, p, normal, right);
    bool better = false;
    double change = 0;
    for (int attempt = 0; attempt < 8 && !better; ++attempt) {
      Matrix9 damped = normal;
      damped.diagonal() *= 1 + damping;
      const Vector9 step = damped.ldlt().solve(right);
      const Vector9 next = p + step;
      if (sensible(next, start, radius)) {
        if (const double next_cost = cost_of(samples, next); next_cost <= cost) {
          p = next;
          cost = next_cost;
          change = step.head<2>().norm();
          damping = std::max(1e-9, 0.1 * damping);
          better = true;
          continue;
        }
      }
      damping *= 10;
    }
    if (!better || change < 1e-7) break;
  }
  if (!sensible(p, start, radius)) return std::nullopt;
  const double noise = std::sqrt(plane.noise.variance(p(kMean)));
  if (!(std::abs(p(kContrast)) > 3 * noise) || !(std::abs(p(kContrast)) < 4 * (high - low))) return std::nullopt;
  normal_equations(samples, p, normal, right);
  const Eigen::LDLT<Matrix9> ldlt(normal);
  if (!(ldlt.vectorD().minCoeff() > 0)) return std::nullopt;
  Saddle saddle;
  saddle.pixel = p.head<2>();
  const double excess = cost / double(samples.size() - kUnknowns);
  saddle.covariance = ldlt.solve(Matrix9::Identity()).topLeftCorner<2, 2>() * std::max(1.0, excess);
  saddle.covariance(0, 1) = saddle.covariance(1, 0);
  saddle.residual = std::sqrt(excess);
  saddle.blur_px = p(kBlur);
  saddle.contrast = p(kContrast);
  if (!saddle.covariance.allFinite() || !(saddle.covariance.determinant() > 0)) return std::nullopt;
  return saddle;
}

}  // namespace lumihull::calib::lens
