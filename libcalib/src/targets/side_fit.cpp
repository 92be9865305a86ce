#include "side_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "edge_profile.h"

namespace lumihull::calib {
namespace {

constexpr int kParameters = 8;  // c0, c1, c2; dark and its slope, light and its slope; blur
using Vector = Eigen::Matrix<double, kParameters, 1>;
using Matrix = Eigen::Matrix<double, kParameters, kParameters>;

constexpr double kLeastBlur = 0.15, kMostBlur = 30;
constexpr double kFar = 4;  // standard deviations from where on a blurred edge is not felt
constexpr double kPixelVariance = 1.0 / 12;  // of a pixel's box along a line
constexpr double kRest = 1e-4;  // px: a step below which the iteration ends (it converges faster than linearly)
constexpr double kOutlier = 4;  // a part's chi² a pixel over the side's median, from where on it is left out

double normal_cdf(double z) { return 0.5 * std::erfc(-z * 0.70710678118654752440); }

/// One pixel of the band.
struct Sample {
  double u, d, value;
  double window;  ///< the corners' part: share of the dark that the neighbouring sides leave
  double behind;  ///< share of light that leaks in from the cells behind the border
  int part;
  double weight = 1;  ///< 1 / variance; 0: clipped, which says nothing but how much it is at least
};

double bilinear(const Image& values, double x, double y) {
  x -= 0.5, y -= 0.5;
  const int x0 = std::clamp(int(std::floor(x)), 0, std::max(0, values.width() - 2)),
            y0 = std::clamp(int(std::floor(y)), 0, std::max(0, values.height() - 2));
  const int x1 = std::min(x0 + 1, values.width() - 1), y1 = std::min(y0 + 1, values.height() - 1);
  const double tx = std::clamp(x - x0, 0.0, 1.0), ty = std::clamp(y - y0, 0.0, 1.0);
  const float *a = values.row<float>(y0), *b = values.row<float>(y1);
  return (1 - ty) * ((1 - tx) * a[x0] + tx * a[x1]) + ty * ((1 - tx) * b[x0] + tx * b[x1]);
}

/// Share of light at (u, d) that comes from the cells behind the border: rectangles, blurred along both directions.
double leak(const CellsBehind& behind, double half_length, double u, double d, double sigma) {
  const double s = std::sqrt(sigma * sigma + kPixelVariance);
  double sum = 0;
  for (std::size_t row = 0; row < 2; ++row) {
    const auto &upper = behind.corners[row], &lower = behind.corners[row + 1];
    if (behind.light[row] == 0 || d - std::max(upper.front().y(), upper.back().y()) > kFar * s) continue;
    for (int i = 0; i < behind.columns; ++i) {
      if (!(behind.light[row] >> i & 1)) continue;
      const std::size_t k = std::size_t(i);
      const double from = half_length * (upper[k].x() - u), to = half_length * (upper[k + 1].x() - u);
      if (from > kFar * s || to < -kFar * s) continue;
      const double top = 0.5 * (upper[k].y() + upper[k + 1].y()) - d, bottom = 0.5 * (lower[k].y() + lower[k + 1].y()) - d;
      sum += (normal_cdf(to / s) - normal_cdf(from / s)) * (normal_cdf(top / s) - normal_cdf(bottom / s));
    }
  }
  return std::clamp(sum, 0.0, 1.0);
}

/// The band's pixels. What a corner and the cells behind take off is computed for `blur`.
std::vector<Sample> samples_of(const LightPlane& plane, const SideCurve& side, const SideBand& band,
                               const CellsBehind& behind, double blur, int& parts) {
  const double half = 0.5 * side.length;
  const double wanted = 3 * blur + 1.5;
  const double inner = std::min(wanted, std::max(0.75 * band.module_px, 0.75));
  const double outer = std::min(wanted, std::max(band.margin_px - 2.5 * blur, std::min(band.margin_px, 1.5)));
  const double trim = std::min(std::max(2.5 * blur + 0.5, 0.04 * side.length), 0.3 * side.length);
  const Eigen::Vector2d normal = side.normal();
  const double part_px = std::max(3.0, side.length / 24);
  parts = std::max(1, int(std::ceil((side.length - 2 * trim) / part_px)));
  const double spread = std::sqrt(blur * blur + kPixelVariance);

  // Rows or columns, whichever the side crosses more steeply.
  const int major = std::abs(side.along.x()) >= std::abs(side.along.y()) ? 0 : 1, minor = 1 - major;
  const int sizes[2] = {plane.values.width(), plane.values.height()};
  const double reach = std::max(inner, outer) + std::abs(side.c[0]) + std::abs(side.c[1]) + std::abs(side.c[2]);
  const double middle = side.middle[major], extent = half * std::abs(side.along[major]) + reach;
  const int first = std::max(0, int(std::floor(middle - extent))),
            last = std::min(sizes[major] - 1, int(std::ceil(middle + extent)));
  std::vector<Sample> samples;
  for (int i = first; i <= last; i += band.stride) {
    const double on = side.middle[minor] + (i + 0.5 - middle) * side.along[minor] / side.along[major];
    const double wide = reach / std::abs(normal[minor]) + 1;
    const int from = std::max(0, int(std::floor(on - wide))),
              to = std::min(sizes[minor] - 1, int(std::ceil(on + wide)));
    for (int j = from; j <= to; ++j) {
      Eigen::Vector2d p;
      p[major] = i + 0.5, p[minor] = j + 0.5;
      const Eigen::Vector2d off = p - side.middle;
      const double s = off.dot(side.along), u = s / half, d = off.dot(normal), x = d - side.offset(u);
      if (std::abs(s) > half - trim || x < -inner || x > outer) continue;
      const double value = double(plane.values.row<float>(major == 0 ? j : i)[major == 0 ? i : j]);
      if (!std::isfinite(value)) continue;
      const double window = half - std::abs(s) > kFar * spread ? 1 : normal_cdf((half + s) / spread) * normal_cdf((half - s) / spread);
      samples.push_back({u, d, value, window, behind.known() ? leak(behind, half, u, d, blur) : 0,
                         std::min(parts - 1, int((s + half - trim) / part_px))});
    }
  }
  return samples;
}

/// Value and derivatives of one pixel by the side's parameters.
struct Model {
  double value;
  std::array<double, kParameters> gradient;
};

class SideModel {
 public:
  SideModel(const SideCurve& side, const Vector& p, double light_slope)
      : p_(p), profile_(side.normal(), p[7]), slope_(light_slope) {}

  Model at(const Sample& s) const {
    const double bend = s.u * s.u - 1.0 / 3;  // SideCurve::basis
    const EdgeProfile::Value f = profile_.at(s.d - (p_[0] + p_[1] * s.u + p_[2] * bend));
    const double share = 1 - (1 - f.share) * s.window + s.behind;
    const double shade = 1 + slope_ * s.d;
    const double dark = (p_[3] + p_[4] * s.u) * shade, step = (p_[5] + p_[6] * s.u) * shade - dark;
    const double by_place = -step * s.window * f.by_x, by_light = share * shade, by_dark = shade - by_light;
    return {dark + step * share,
            {by_place, by_place * s.u, by_place * bend, by_dark, by_dark * s.u, by_light, by_light * s.u,
             step * s.window * f.by_sigma}};
  }

 private:
  const Vector& p_;
  EdgeProfile profile_;
  double slope_;
};

struct Normal {
  Matrix a = Matrix::Zero();
  Vector b = Vector::Zero();
  double chi2 = 0;
  int count = 0;
};

/// Normal equations of the band's pixels, and the priors': curvature, slopes of the levels (to 30 % a side, so that sides
/// of few pixels stay determined), what the other sides say.
Normal normal_equations(const SideCurve& side, const SideBand& band, const std::vector<Sample>& samples, const std::vector<char>& used, const Vector& p) {
  Normal n;
  const SideModel model(side, p, band.light_slope);
  alignas(32) double a[kParameters][kParameters] = {}, b[kParameters] = {};
  for (const Sample& s : samples) {
    if (!used[std::size_t(s.part)] || s.weight == 0) continue;
    const Model m = model.at(s);
    const double weight = s.weight, r = s.value - m.value;
    for (std::size_t i = 0; i < kParameters; ++i) {
      const double g = weight * m.gradient[i];
      for (std::size_t j = 0; j < kParameters; ++j) a[i][j] += g * m.gradient[j];
      b[i] += g * r;
    }
    n.chi2 += weight * r * r;
    ++n.count;
  }
  n.a = Eigen::Map<Matrix>(&a[0][0]);
  n.b = Eigen::Map<Vector>(b);
  const auto prior = [&](int k, double sd, double mean = 0) {
    const double weight = 1 / (sd * sd), off = p[k] - mean;
    n.a(k, k) += weight;
    n.b[k] -= weight * off;
    n.chi2 += weight * off * off;
  };
  prior(2, std::max(1e-4, band.curvature_sd * side.length * side.length / 8));
  const double contrast = std::max(1e-6, std::abs(p[5] - p[3]));
  prior(4, 0.3 * contrast);
  prior(6, 0.3 * contrast);
  if (band.expected) {
    prior(3, band.expected->level_sd, band.expected->dark);
    prior(5, band.expected->level_sd, band.expected->light);
    prior(7, band.expected->blur_sd, band.expected->blur_px);
  }
  return n;
}

/// Levels for a given curve and blur: linear, so that the iteration starts with what fits.
bool start_levels(const SideCurve& side, const SideBand& band, const std::vector<Sample>& samples, Vector& p) {
  Eigen::Matrix2d a = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b(0, 0);
  const SideModel model(side, p, band.light_slope);
  for (const Sample& s : samples) {
    const Model m = model.at(s);
    const Eigen::Vector2d g(m.gradient[3], m.gradient[5]);
    a += g * g.transpose();
    b += g * s.value;
  }
  if (!(a.determinant() > 1e-9 * a.trace() * a.trace())) return false;
  const Eigen::Vector2d levels = a.ldlt().solve(b);
  p[3] = levels[0], p[5] = levels[1], p[4] = p[6] = 0;
  return levels[1] > levels[0];
}

/// Each pixel's variance: its noise, and what the model leaves besides: lenses, sharpening and paper are not as it says.
void weigh(const LightPlane& plane, const SideCurve& side, const SideBand& band, const std::vector<char>& used,
           const Vector& p, std::vector<Sample>& samples) {
  const SideModel model(side, p, band.light_slope);
  const double limit = double(plane.saturation), limit_sd = std::sqrt(plane.noise.variance(limit));
  std::vector<double> variances;
  double excess = 0;
  int count = 0;
  for (Sample& s : samples) {
    const double v = model.at(s).value, r = s.value - v, noise = plane.noise.variance(v);
    // By the model, too: to leave out only those that noise has lifted would pull the level down.
    const bool clipped = s.value >= limit || (v > limit - 2 * limit_sd && s.value > limit - 5 * limit_sd);
    s.weight = clipped ? 0 : 1;
    variances.push_back(noise);
    if (used[std::size_t(s.part)] && !clipped) excess += r * r - noise, ++count;
  }
  excess = count > 0 ? std::max(0.0, excess / count) : 0;
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].weight /= variances[i] + excess;
}

/// Levenberg-Marquardt; false where it does not come to rest near its start.
bool iterate(const SideCurve& side, const SideBand& band, const std::vector<Sample>& samples,
             const std::vector<char>& used, Vector& p, Normal& n) {
  n = normal_equations(side, band, samples, used, p);
  double damping = 1e-6;
  for (int i = 0; i < 20; ++i) {
    Matrix a = n.a;
    a.diagonal() *= 1 + damping;
    const Vector step = a.ldlt().solve(n.b);
    if (!step.allFinite()) return false;
    Vector next = p + step;
    next[7] = std::clamp(next[7], kLeastBlur, kMostBlur);
    // So small a step needs no look at where it leads.
    const bool small = (next - p).head<3>().cwiseAbs().maxCoeff() < kRest && std::abs(next[7] - p[7]) < 10 * kRest;
    if (small && damping < 1e-3) {
      p = next;
      return true;
    }
    const Normal m = normal_equations(side, band, samples, used, next);
    if (m.chi2 <= n.chi2) {
      p = next, n = m;
      damping = std::max(1e-9, 0.1 * damping);
    } else {
      damping = std::max(1e-4, damping * 10);
      if (damping > 1e4) return true;
    }
  }
  return true;
}

/// Leaves out parts of the side that do not look like the rest of it. Returns how many went.
int drop_disturbed(const SideCurve& side, const SideBand& band, const std::vector<Sample>& samples,
                   std::vector<char>& used, const Vector& p) {
  std::vector<double> chi2(used.size(), 0);
  std::vector<int> count(used.size(), 0);
  const SideModel model(side, p, band.light_slope);
  for (const Sample& s : samples) {
    if (s.weight == 0) continue;
    const double r = s.value - model.at(s).value;
    chi2[std::size_t(s.part)] += r * r * s.weight;
    ++count[std::size_t(s.part)];
  }
  std::vector<double> all;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (count[i] > 0) all.push_back(chi2[i] / count[i]);
  if (all.size() < 4) return 0;
  std::nth_element(all.begin(), all.begin() + std::ptrdiff_t(all.size() / 2), all.end());
  const double usual = std::max(1.0, all[all.size() / 2]);
  int gone = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    // Few pixels scatter more: five standard deviations of a mean of squares, besides.
    const bool stays = count[i] > 0 && chi2[i] / count[i] < usual * (kOutlier + 5 * std::sqrt(2.0 / count[i]) - 1);
    gone += used[i] && !stays;
    used[i] = used[i] && stays;
  }
  return gone;
}

}  // namespace

SideCurve SideCurve::between(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  SideCurve s;
  s.middle = 0.5 * (from + to);
  s.length = (to - from).norm();
  if (s.length > 0) s.along = (to - from) / s.length;
  return s;
}

Eigen::Vector2d SideCurve::tangent(double u) const {
  const double slope = (c[1] + 2 * u * c[2]) / (0.5 * length);
  return (along + slope * normal()).normalized();
}

std::optional<SideCurve> find_side(const LightPlane& plane, const SideCurve& chord, double reach_px,
                                   double curvature_sd) {
  constexpr double kStep = 0.5;  // along a profile
  const int profiles = std::clamp(int(chord.length), 8, 64), steps = 2 * int(std::ceil(reach_px / kStep)) + 1;
  std::vector<Eigen::Vector2d> edges;  // (u, d)
  std::vector<double> values(std::size_t(steps) + 4);
  for (int i = 0; i < profiles; ++i) {
    const double u = -0.85 + 1.7 * (i + 0.5) / profiles;
    const Eigen::Vector2d middle = chord.point(u);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const Eigen::Vector2d p = middle + chord.normal() * ((double(k) - double(values.size() - 1) / 2) * kStep);
      values[k] = bilinear(plane.values, p.x(), p.y());
    }
    double best = 0;
    std::size_t at = 0;
    const auto slope = [&](std::size_t k) { return values[k + 2] + values[k + 1] - values[k - 1] - values[k - 2]; };
    for (std::size_t k = 2; k + 2 < values.size(); ++k)
      if (slope(k) > best) best = slope(k), at = k;
    if (at == 0) continue;
    double shift = 0;
    if (at > 2 && at + 3 < values.size()) {
      const double a = slope(at - 1), b = slope(at + 1), bend = a - 2 * best + b;
      if (bend < 0) shift = std::clamp(0.5 * (a - b) / bend, -0.5, 0.5);
    }
    edges.push_back({u, chord.offset(u) + (double(at) + shift - double(values.size() - 1) / 2) * kStep});
  }
  if (edges.size() < 6) return std::nullopt;

  // Starts at the median, then weights of Cauchy's distribution, one px wide and narrowing.
  std::vector<double> offsets;
  for (const auto& e : edges) offsets.push_back(e.y());
  std::nth_element(offsets.begin(), offsets.begin() + std::ptrdiff_t(offsets.size() / 2), offsets.end());
  SideCurve side = chord;
  side.c = {offsets[offsets.size() / 2], 0, 0};
  const double sag = std::max(1e-3, curvature_sd * chord.length * chord.length / 8);
  double agree = 0;
  for (int round = 0; round < 8; ++round) {
    const double width = round < 4 ? 1 : 0.4;
    Eigen::Matrix3d a = Eigen::Vector3d(1e-9, 0.01, 0.04 / (sag * sag)).asDiagonal();
    Eigen::Vector3d b(0, 0, 0);
    agree = 0;
    for (const auto& e : edges) {
      const Eigen::Vector3d basis = SideCurve::basis(e.x());
      const double r = e.y() - side.c.dot(basis), weight = 1 / (1 + r * r / (width * width));
      a += weight * basis * basis.transpose();
      b += weight * e.y() * basis;
      agree += std::abs(r) < 1;
    }
    side.c = a.ldlt().solve(b);
  }
  if (!side.c.allFinite() || agree < 0.6 * profiles) return std::nullopt;
  return side;
}

std::optional<SideFit> fit_side(const LightPlane& plane, const SideCurve& start, const SideBand& band,
                                const CellsBehind& behind) {
  SideFit fit;
  SideCurve side = start;
  Vector p = Vector::Zero();
  p.head<3>() = side.c;
  p[7] = std::clamp(band.expected ? band.expected->blur_px : 1, kLeastBlur, kMostBlur);
  std::vector<Sample> samples;
  std::vector<char> used;
  Normal n;
  // The band's width and what leaks into it depend on the blur: three rounds.
  for (int round = 0; round < 3; ++round) {
    int parts = 1;
    const double blur = p[7];
    side.c = p.head<3>();
    samples = samples_of(plane, side, band, behind, blur, parts);
    if (samples.size() < 3 * kParameters) return std::nullopt;
    used.assign(std::size_t(parts), 1);
    if (round == 0 && !start_levels(side, band, samples, p)) return std::nullopt;
    weigh(plane, side, band, used, p, samples);
    if (!iterate(side, band, samples, used, p, n)) return std::nullopt;
    if ((p.head<3>() - start.c).cwiseAbs().maxCoeff() > 2) return std::nullopt;
    if ((round > 0 || band.expected) && std::abs(p[7] - blur) < 0.02 * p[7] + 0.005) break;
  }
  weigh(plane, side, band, used, p, samples);
  while (drop_disturbed(side, band, samples, used, p) > 0) {
    if (std::count(used.begin(), used.end(), 1) < 0.5 * double(used.size())) return std::nullopt;
    if (!iterate(side, band, samples, used, p, n)) return std::nullopt;
    weigh(plane, side, band, used, p, samples);
  }
  if (!iterate(side, band, samples, used, p, n)) return std::nullopt;
  if (n.count < 2 * kParameters || !(p[5] > p[3])) return std::nullopt;
  if ((p.head<3>() - start.c).cwiseAbs().maxCoeff() > 2) return std::nullopt;

  const double freedom = std::max(1, n.count - kParameters);
  fit.residual = std::sqrt(n.chi2 / freedom);
  const Matrix covariance = n.a.ldlt().solve(Matrix::Identity()) * std::max(1.0, n.chi2 / freedom);
  if (!covariance.allFinite()) return std::nullopt;
  side.c = p.head<3>();
  side.covariance = covariance.topLeftCorner<3, 3>();
  fit.curve = side;
  fit.dark_variance = covariance(3, 3), fit.light_variance = covariance(5, 5), fit.blur_variance = covariance(7, 7);
  fit.dark = p[3], fit.light = p[5], fit.blur_px = p[7];
  fit.light_slope = p[6] / (0.5 * side.length) / p[5];
  fit.visible = double(std::count(used.begin(), used.end(), 1)) / double(used.size());
  return fit;
}

}  // namespace lumihull::calib
