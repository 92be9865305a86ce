// Least squares of a blurred ellipse to a set of pixels.
#include "contour_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::calib {
namespace {

constexpr int kSize = ContourModel::kSize;
// The light's relative change over a pixel, a priori: 10 % over a thousand pixels, with the tails of a Cauchy
// distribution, so that where the picture shows more it is believed.
constexpr double kLightChange = 1e-4;
constexpr double kRatioSd = 0.03;    // of a ring's ratio, a priori: ink spreads
constexpr double kLeastRaise = 1.2;  // of the noise: less may be chance
constexpr float kOnSlope = 0.25f;    // of the steepest slope
constexpr double kLongest =
    6;  // sum of an answer's semi-axes, over the longer one of the ellipse that pixels were gathered about
constexpr int kFlush = 32;  // blocks that are summed in float
// Times s, what CurvedEdge is used for: the pixels see not much beyond the centres of curvature.
constexpr double kMostCurvature = 0.32, kMostInnerCurvature = 0.45;
constexpr double kFastestRate = 0.02;    // of convergence that is believed: what is ill determined comes late
constexpr double kMildCurvature = 0.25;  // times s: a rough fit needs no correction
constexpr double kFlat = 4.5;            // s from the contour: no edge is seen, with some to spare
// What a corrected share may be off by, in px of the contour: the correction changes by about κ³ s³ of the model's
// movement.
constexpr double kCorrected = 5e-5;
constexpr double kFeetMoved = 0.01;  // px that a contour moves before its nearest points are looked for again

}  // namespace

void ContourFit::gather(const Ellipse& ellipse, const ContourModel& model, const BandWidth& band, int sectors,
                        double inner_ratio, const Eigen::Vector2d& inner_offset, bool rough) {
  blocks_.clear();
  // As many as there will be, nearly: they are large.
  const double wide = band.inward + band.outward, about = 2 * std::numbers::pi * ellipse.a * wide;
  blocks_.reserve(std::size_t(std::min(1e5, about / kLanes)) + 8);
  rough_ = rough, correct_next_ = weigh_next_ = false;
  sectors_.assign(std::size_t(sectors), {});
  longest_ = ellipse.a;
  gathered_ = 0;
  inner_ratio_ = inner_ratio;
  inner_offset_ = inner_offset;
  const double s = model.p[ContourModel::blur], ratio = inner_ratio > 0 ? model.p[ContourModel::ratio] : 1;
  const double outer_curvature = s * ellipse.a / (ellipse.b * ellipse.b);
  curvature_ = outer_curvature / ratio;
  quick_ = sum_ == ContourSum::quick && outer_curvature < kMostCurvature && curvature_ < kMostInnerCurvature;
  corrected_at_.p.setConstant(1e9);
  const float flat = quick_ ? float(kFlat * s) : 1e9f, flat_outside = flat, flat_inside = inner_ratio > 0 ? 1e9f : flat;

  constexpr std::size_t outside_flat = BlurredEllipse::kSides, inside_flat = outside_flat + 1;
  std::array<std::size_t, inside_flat + 1> open;  // edges by side, then levels: the block that is being filled
  constexpr std::size_t none = ~std::size_t(0);
  open.fill(none);
  const UnitFrame frame(ellipse);
  const Lanes per_radian = all(float(sectors / (2 * std::numbers::pi)));
  const auto lanes_of = [](double v) { return all(float(v)); };
  const Lanes v11 = lanes_of(frame.inverse(0, 0)), v12 = lanes_of(frame.inverse(0, 1)),
              v22 = lanes_of(frame.inverse(1, 1)), middle_x = lanes_of(ellipse.center.x() - origin_.x()),
              middle_y = lanes_of(ellipse.center.y() - origin_.y());
  const auto close = [&](std::size_t index) {
    Block& block = blocks_[index];
    BlurredEllipse::Pixels& p = block.pixels;
    const Lanes x = p.x - middle_x, y = p.y - middle_y;
    const Lanes turn = (angle_of(v12 * x + v22 * y, v11 * x + v12 * y) + all(float(std::numbers::pi))) * per_radian;
    for (int i = 0; i < block.count; ++i)
      block.sector[std::size_t(i)] = std::uint8_t(std::clamp(int(turn[i]), 0, sectors - 1));
    for (int i = block.count; i < kLanes; ++i) p.x[i] = p.x[0], p.y[i] = p.y[0];
    p.low_x = p.high_x = p.x[0];
    p.low_y = p.high_y = p.y[0];
    for (int i = 1; i < kLanes; ++i) {
      p.low_x = std::min(p.low_x, p.x[i]), p.high_x = std::max(p.high_x, p.x[i]);
      p.low_y = std::min(p.low_y, p.y[i]), p.high_y = std::max(p.high_y, p.y[i]);
    }
  };
  const PixelBox box{0, 0, plane_.values.width(), plane_.values.height()};
  for_each_in_band(ellipse, frame, band, box, [&](const BandPixels& p) {
    const float* values = plane_.values.row<float>(p.y) + p.x;
    for (int i = 0; i < kLanes; ++i) {
      if (!p.inside[i] || !std::isfinite(values[i])) continue;
      const float gx = p.gx[i], gy = p.gy[i], distance = p.distance[i];
      std::size_t kind = distance > flat_outside ? outside_flat : inside_flat;
      if (distance >= -flat_inside && distance <= flat_outside)
        kind = std::abs(gx) >= std::abs(gy) ? (gx > 0 ? BlurredEllipse::right : BlurredEllipse::left)
                                            : (gy > 0 ? BlurredEllipse::bottom : BlurredEllipse::top);
      if (open[kind] == none) {
        open[kind] = blocks_.size();
        Block& fresh = blocks_.emplace_back();
        fresh.part = kind < outside_flat ? Part::edge : kind == outside_flat ? Part::outside : Part::inside;
        fresh.pixels.side = kind < outside_flat ? BlurredEllipse::Side(kind) : BlurredEllipse::right;
      }
      Block& block = blocks_[open[kind]];
      const int lane = block.count++;
      block.pixels.x[lane] = float(p.x + i + 0.5 - origin_.x());
      block.pixels.y[lane] = float(p.y + 0.5 - origin_.y());
      block.value[lane] = values[i];
      ++gathered_;
      if (block.count < kLanes) continue;
      close(open[kind]);
      open[kind] = none;
    }
  });
  for (const std::size_t index : open)
    if (index != none) close(index);
  if (!quick_) return;
  set(model);
  feet_at_ = model;
  for (Block& block : blocks_) {
    block.correction = all(0);
    if (block.part != Part::edge) continue;
    outer_.find(block.pixels, block.foot);
    if (inner_ratio_ > 0) inner_.find(block.pixels, block.inner_foot);
  }
}

void ContourFit::set(const ContourModel& model) {
  const double s = model.p[ContourModel::blur], ratio = model.p[ContourModel::ratio];
  if (!quick_) {
    exact_.set(model.center(), model.root(), s, inner_ratio_ > 0 ? ratio : 0, inner_offset_);
    return;
  }
  outer_.set(model.center(), model.root(), s, 1, false);
  if (inner_ratio_ > 0) inner_.set(model.center() + inner_offset_, model.root(), s, ratio, true);
}

bool ContourFit::corrected(const ContourModel& model) const {
  const double moved = (model.p - corrected_at_.p).head<ContourModel::blur + 1>().norm();
  if (rough_ && curvature_ < kMildCurvature) return true;
  return !quick_ || moved * curvature_ * curvature_ * curvature_ < kCorrected;
}

template <class Body>
void ContourFit::for_each_residual(const ContourModel& model, Body&& body) {
  set(model);
  const bool correcting = quick_ && correct_next_;
  correct_next_ = false;
  if (correcting) {
    exact_.set(model.center(), model.root(), model.p[ContourModel::blur],
               inner_ratio_ > 0 ? model.p[ContourModel::ratio] : 0, inner_offset_);
    corrected_at_ = model;
  }
  const bool follow = quick_ && (model.p - feet_at_.p).head<ContourModel::root22 + 1>().norm() > kFeetMoved;
  if (follow) feet_at_ = model;
  BlurredEllipse::Share share;
  const Lanes gx = all(float(model.p[ContourModel::light_x] / unit_)),
              gy = all(float(model.p[ContourModel::light_y] / unit_));
  // The light falls on the print before it is blurred: ∫ f(q) (1 + g·q) G(q - p) dq = (1 + g·p) w + s² g·∇w.
  const Lanes spread = all(float(model.p[ContourModel::blur] * model.p[ContourModel::blur]));
  const Lanes outside = all(float(model.p[ContourModel::outside])), step = all(float(model.p[ContourModel::step]));
  for (Block& block : blocks_) {
    const Lanes light = all(1) + gx * block.pixels.x + gy * block.pixels.y;
    if (block.part != Part::edge) {
      share = BlurredEllipse::Share{};
      share.w = all(block.part == Part::inside ? 1.0f : 0.0f);
      const Lanes plain = outside + step * share.w;
      block.expected = plain * light;
      block.slope = all(0);
      body(block, share, light, plain, block.value - block.expected);
      continue;
    }
    if (quick_) {
      share = BlurredEllipse::Share{};
      if (follow) outer_.follow(block.pixels, block.foot);
      outer_.add(block.pixels, block.foot, share);
      if (inner_ratio_ > 0) {
        if (follow) inner_.follow(block.pixels, block.inner_foot);
        inner_.add(block.pixels, block.inner_foot, share);
      }
      if (correcting) block.correction = exact_.covered(block.pixels) - share.w;
      share.w += block.correction;
    } else {
      exact_.evaluate(block.pixels, share);
    }
    const Lanes plain = outside + step * share.w;
    block.expected = plain * light - step * spread * (gx * share.by_center[0] + gy * share.by_center[1]);
    const Lanes slope2 = share.by_center[0] * share.by_center[0] + share.by_center[1] * share.by_center[1];
    block.slope = step * slope2 * inverse_root(slope2 + all(1e-30f));
    body(block, share, light, plain, block.value - block.expected);
  }
}

void ContourFit::expect(const ContourModel& model) {
  correct_next_ = !rough_ && !corrected(model);
  for_each_residual(model, [](const Block&, const BlurredEllipse::Share&, const Lanes&, const Lanes&, const Lanes&) {});
}

void ContourFit::weigh(Block& block) {
  const PlaneNoise& noise = plane_.noise;
  const float scale = float(noise_scale_ * noise_scale_), limit = plane_.saturation;
  const Lanes v = block.expected, jitter = all(float(jitter_px_)) * block.slope;
  const Lanes plain = all(scale) * (all(float(noise.read)) + all(float(noise.gain)) * chosen(v > all(0), v, all(0)));
  const Lanes variance = chosen(plain > all(1e-14f), plain, all(1e-14f)) + jitter * jitter;
  const Lanes inverse = inverse_root(variance);
  // By the model, not only by the value: to leave out those that noise has lifted would pull the level down. What
  // is far below the limit is not clipped, whatever the model says: else it could explain all by light beyond it.
  const float near_limit = limit - 5 * std::sqrt(float(noise.variance(double(limit))));
  const IntLanes clipped =
      (block.value >= all(limit)) | ((v > all(limit) - all(2) * variance * inverse) & (block.value > all(near_limit)));
  block.variance = variance;
  block.weight = inverse * inverse;
  bool all_count = block.count == kLanes && all_used_;
  for (int i = 0; i < kLanes; ++i) all_count &= clipped[i] == 0;
  if (all_count) {
    pixels_ += kLanes;
    return;
  }
  for (int i = 0; i < kLanes; ++i) {
    const bool there = i < block.count, counts = there && !clipped[i] && sectors_[block.sector[std::size_t(i)]].used;
    if (!counts) block.weight[i] = 0;
    pixels_ += counts;
    clipped_ += there && clipped[i];
  }
}

void ContourFit::start_weighing() {
  pixels_ = clipped_ = 0;
  all_used_ = std::all_of(sectors_.begin(), sectors_.end(), [](const Sector& s) { return s.used; });
}

void ContourFit::weigh() {
  start_weighing();
  for (Block& block : blocks_) weigh(block);
}

double ContourFit::evaluate(const ContourModel& model, double robust, ContourModel::Matrix& normal,
                            ContourModel::Vector& right) {
  constexpr int kPairs = kSize * (kSize + 1) / 2;
  std::array<Lanes, kPairs + kSize + 1> sums{};
  ContourModel::Matrix h = ContourModel::Matrix::Zero();
  ContourModel::Vector b = ContourModel::Vector::Zero();
  double squares = 0;
  const int size = inner_ratio_ > 0 ? kSize : kSize - 1;
  const auto flush = [&] {
    std::size_t k = 0;
    const auto total = [&](std::size_t i) {
      double sum = 0;
      for (int l = 0; l < kLanes; ++l) sum += double(sums[i][l]);
      sums[i] = all(0);
      return sum;
    };
    for (int i = 0; i < size; ++i)
      for (int j = 0; j <= i; ++j) h(i, j) += total(k++);
    for (int i = 0; i < size; ++i) b[i] += total(std::size_t(kPairs + i));
    squares += total(kPairs + kSize);
  };
  const Lanes per_unit = all(float(1 / unit_)), step = all(float(model.p[ContourModel::step]));
  const Lanes spread = step * all(float(model.p[ContourModel::blur] * model.p[ContourModel::blur]));
  const Lanes limit = all(robust > 0 ? float(1 / (robust * robust)) : 0.0f);
  int since = 0;
  const bool weighing = weigh_next_;
  weigh_next_ = false;
  if (weighing) start_weighing();
  for_each_residual(model, [&](Block& block, const BlurredEllipse::Share& share, const Lanes& light, const Lanes& plain,
                               const Lanes& residual) {
    if (weighing) weigh(block);
    const Lanes scaled = residual * residual * block.weight, damping = all(1) / (all(1) + limit * scaled);
    sums[kPairs + kSize] += scaled * damping;
    const Lanes weight = block.weight * damping * damping, by_share = step * light;
    if (block.part != Part::edge) {  // shows the levels and the light alone
      constexpr int first = ContourModel::outside, last = ContourModel::light_y;
      static_assert(last - first == 3);
      const Lanes seen[4] = {light, light * share.w, plain * block.pixels.x * per_unit,
                             plain * block.pixels.y * per_unit};
      for (int i = first; i <= last; ++i) {
        const Lanes weighted = weight * seen[i - first];
        for (int j = first; j <= i; ++j) sums[std::size_t(i * (i + 1) / 2 + j)] += weighted * seen[j - first];
        sums[std::size_t(kPairs + i)] += weighted * residual;
      }
      if (++since == kFlush) flush(), since = 0;
      return;
    }
    const Lanes slope[kSize] = {by_share * share.by_center[0],
                                by_share * share.by_center[1],
                                by_share * share.by_root[0],
                                by_share * share.by_root[1],
                                by_share * share.by_root[2],
                                by_share * share.by_s,
                                light,
                                light * share.w,
                                (plain * block.pixels.x - spread * share.by_center[0]) * per_unit,
                                (plain * block.pixels.y - spread * share.by_center[1]) * per_unit,
                                by_share * share.by_ratio};
    std::size_t k = 0;
    for (int i = 0; i < size; ++i) {
      const Lanes weighted = weight * slope[i];
      for (int j = 0; j <= i; ++j) sums[k++] += weighted * slope[j];
      sums[std::size_t(kPairs + i)] += weighted * residual;
    }
    if (++since == kFlush) flush(), since = 0;
  });
  flush();
  normal = h.selfadjointView<Eigen::Lower>();
  right = b;
  return squares;
}

bool ContourFit::solve(ContourModel& model, int max_iterations, double converged, double robust, bool weigh_first) {
  double rate = 1;
  weigh_next_ = weigh_first;
  correct_next_ = !rough_ && !corrected(model);
  for (int i = 0; i < 5; ++i) {
    if (!iterate(model, max_iterations, converged, robust, rate)) return false;
    if (corrected(model)) break;
    correct_next_ = true;
  }
  return true;
}

bool ContourFit::iterate(ContourModel& model, int max_iterations, double converged, double robust, double& rate) {
  using Vector = ContourModel::Vector;
  using Matrix = ContourModel::Matrix;
  const double least_blur = 0.3, most_blur = std::min(std::max(0.85 * unit_, 1.0), std::max(2.6, 0.3 * unit_));
  const double size = model.root().determinant();
  const auto with_prior = [&](const ContourModel& m, double squares, Matrix* h, Vector* b) {
    const Eigen::Vector2d light = m.p.segment<2>(ContourModel::light_x);
    const double expected = kLightChange * kLightChange * unit_ * unit_, spread = expected + light.squaredNorm();
    if (h) {
      h->diagonal().segment<2>(ContourModel::light_x).array() += 1 / spread;
      b->segment<2>(ContourModel::light_x) -= light / spread;
    }
    squares += std::log(spread / expected);
    constexpr int kRatio = ContourModel::ratio;
    const double weight = inner_ratio_ > 0 ? 1 / (kRatioSd * kRatioSd) : 1,
                 off = inner_ratio_ > 0 ? m.p[kRatio] - inner_ratio_ : 0;
    if (h) (*h)(kRatio, kRatio) += weight, (*b)[kRatio] -= weight * off;
    squares += weight * off * off;
    return squares;
  };
  Matrix h;
  Vector b;
  double squares = evaluate(model, robust, h, b), lambda = 1e-3, before = 0;
  double loss = with_prior(model, squares, &h, &b);
  bool current = true;  // what is expected is the model's
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    Matrix damped = h;
    damped.diagonal() *= 1 + lambda;
    const Eigen::LDLT<Matrix> solver(damped);
    const Vector step = solver.solve(b);
    if (solver.info() != Eigen::Success || !step.allFinite()) return false;
    ContourModel next = model;
    next.p += step;
    next.p[ContourModel::blur] = std::clamp(next.p[ContourModel::blur], least_blur, most_blur);
    next.p[ContourModel::ratio] = std::clamp(next.p[ContourModel::ratio], 0.05, 0.95);
    const double next_size = next.root().determinant();
    const double axes = next.root().trace();  // their sum: a sliver of the same area could be of any length
    bool better = next_size > 0.1 * size && next_size < 10 * size && axes > 0 && axes < kLongest * (longest_ + 1) &&
                  next.center().norm() < 2 * unit_ + 10;
    Matrix next_h;
    Vector next_b;
    if (better) {
      current = false;
      const double next_squares = evaluate(next, robust, next_h, next_b);
      const double next_loss = with_prior(next, next_squares, &next_h, &next_b);
      better = next_loss <= loss * (1 + 1e-6);
      if (better) {
        const double moved = step.dot(h * step);
        current = true;
        model = next;
        squares = next_squares;
        loss = next_loss;
        h = next_h;
        b = next_b;
        lambda = std::max(1e-7, lambda * 0.1);
        // What the next step would be, where each is that much shorter than the one before.
        if (before > 0) rate = std::clamp(moved / before, kFastestRate, 1.0);
        before = moved;
        if (moved * rate < converged) break;
        continue;
      }
    }
    if (step.dot(h * step) < converged) break;
    lambda *= 10;
    if (lambda > 1e6) break;
  }
  if (!current)
    for_each_residual(model,
                      [](const Block&, const BlurredEllipse::Share&, const Lanes&, const Lanes&, const Lanes&) {});
  squares_ = squares;
  information_ = h;
  return std::isfinite(squares);
}

void ContourFit::measure_sectors(double tolerance) {
  for (Sector& s : sectors_) s.pixels = s.clipped = 0, s.squares = s.shift = s.shift_sd_px = 0;
  const float play = float(tolerance * tolerance);
  for (const Block& block : blocks_)
    for (int i = 0; i < block.count; ++i) {
      Sector& s = sectors_[block.sector[std::size_t(i)]];
      if (block.value[i] >= plane_.saturation) {
        ++s.clipped;
        continue;
      }
      const float residual = block.value[i] - block.expected[i];
      ++s.pixels;
      const float weight = 1 / (block.variance[i] + play);
      s.squares += double(residual * residual * weight);
      s.shift += double(residual * block.slope[i] * weight);
      s.shift_sd_px += double(block.slope[i] * block.slope[i] * weight);
    }
  for (Sector& s : sectors_) {
    s.shift_sd_px = 1 / std::sqrt(std::max(1e-30, s.shift_sd_px));
    s.shift *= s.shift_sd_px;
  }
}

void ContourFit::loosen(double most, double most_px) {
  float steepest = 0;
  for (const Block& block : blocks_)
    for (int i = 0; i < block.count; ++i) steepest = std::max(steepest, std::abs(block.slope[i]));
  if (!(steepest > 0)) return;
  const auto gather = [&](bool on_slope, auto value) {
    scratch_.clear();
    for (const Block& block : blocks_)
      for (int i = 0; i < block.count; ++i)
        if ((std::abs(block.slope[i]) >= kOnSlope * steepest) == on_slope && block.value[i] < plane_.saturation)
          scratch_.push_back(value(block, i));
  };
  const auto residual = [](const Block& block, int i) { return std::abs(block.value[i] - block.expected[i]); };
  const auto variance = [&](const Block& block, int i) {
    return float(std::max(1e-14, plane_.noise.variance(double(block.expected[i]))));
  };
  gather(false, [&](const Block& block, int i) { return residual(block, i) / std::sqrt(variance(block, i)); });
  if (const double scale = median_scale(); scale > kLeastRaise) noise_scale_ = std::max(1.0, std::min(scale, most));

  double noise = 0;
  gather(true, [&](const Block& block, int i) {
    noise += double(variance(block, i) / (block.slope[i] * block.slope[i]));
    return residual(block, i) / std::abs(block.slope[i]);
  });
  if (scratch_.empty()) return;
  noise *= noise_scale_ * noise_scale_ / double(scratch_.size());
  const double seen = median_scale();
  if (seen * seen > kLeastRaise * kLeastRaise * noise) jitter_px_ = std::min(std::sqrt(seen * seen - noise), most_px);
}

bool ContourFit::loosen_more(double most, double most_px) {
  const double raise = std::sqrt(squares_ / std::max(1, pixels_ - kSize));
  const double noise = std::max(noise_scale_, std::min(noise_scale_ * raise, most));
  const double jitter = std::max(jitter_px_, std::min(jitter_px_ * raise, most_px));
  if (!(raise > kLeastRaise) || (noise == noise_scale_ && jitter == jitter_px_)) return false;
  noise_scale_ = noise, jitter_px_ = jitter;
  return true;
}

double ContourFit::robust_scale() {
  scratch_.clear();
  for (const Block& block : blocks_)
    for (int i = 0; i < block.count; ++i)
      if (block.value[i] < plane_.saturation)
        scratch_.push_back(std::abs(block.value[i] - block.expected[i]) / std::sqrt(block.variance[i]));
  return median_scale();
}

double ContourFit::median_scale() {
  if (scratch_.empty()) return 0;
  const auto middle = scratch_.begin() + std::ptrdiff_t(scratch_.size() / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.end());
  return double(*middle) / 0.6745;
}

}  // namespace lumihull::calib
