// What share of a blurred pixel an ellipse, or a ring, covers.
#include "blurred_ellipse.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::calib {
namespace {

constexpr double kSpacing = 1.3;  // of nodes, in units of s: the sum is right to 1e-5
constexpr float kReach = 4.6f;    // of the Gaussian, in units of s: 2e-6 are beyond

}  // namespace

void BlurredEllipse::set(const Eigen::Vector2d& center, const Eigen::Matrix2d& root, double s, double inner_ratio,
                         const Eigen::Vector2d& inner_offset) {
  nodes_.clear();
  groups_.clear();
  s_ = s;
  ring_ = inner_ratio > 0;
  add_contour(center, root, 1, 1);
  if (ring_) add_contour(center + inner_offset, root, inner_ratio, -1);
}

void BlurredEllipse::add_contour(const Eigen::Vector2d& center, const Eigen::Matrix2d& root, double ratio,
                                 double sign) {
  const double longest =
      ratio * (0.5 * root.trace() + std::hypot(0.5 * (root(0, 0) - root(1, 1)), root(0, 1)));  // the longer semi-axis
  const int wanted = std::max(16, int(std::ceil(2 * std::numbers::pi * longest / (kSpacing * s_))));
  const int count = (wanted + kGroup - 1) / kGroup * kGroup;
  const double step = 2 * std::numbers::pi / count, det = ratio * ratio * root.determinant();
  const Eigen::Matrix2d normals = (det / ratio * root.inverse().transpose()) * step;  // n ds = det M^-T u dt
  const double c1 = std::cos(step), s1 = std::sin(step);
  double c = 1, sn = 0;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d u(c, sn), arm = root * u, q = center + ratio * arm, n = sign * (normals * u);
    nodes_.push_back({float(q.x() / s_),
                      float(q.y() / s_),
                      float(n.x() / s_),
                      float(n.y() / s_),
                      {float(ratio * n.x() * c), float(ratio * (n.x() * sn + n.y() * c)), float(ratio * n.y() * sn)},
                      sign < 0 ? float(n.dot(arm)) : 0.0f});
    const double next = c * c1 - sn * s1;
    sn = sn * c1 + c * s1;
    c = next;
  }
  for (auto node = nodes_.end() - count; node != nodes_.end(); node += kGroup) {
    Group g{node->x, node->x, node->y, node->y};
    for (auto n = node + 1; n != node + kGroup; ++n) {
      g.low_x = std::min(g.low_x, n->x), g.high_x = std::max(g.high_x, n->x);
      g.low_y = std::min(g.low_y, n->y), g.high_y = std::max(g.high_y, n->y);
    }
    groups_.push_back(g);
  }
}

void BlurredEllipse::evaluate(const Pixels& pixels, Share& share) const { sum<true>(pixels, share); }

Lanes BlurredEllipse::covered(const Pixels& pixels) const {
  Share share;
  sum<false>(pixels, share);
  return share.w;
}

template <bool derivatives>
void BlurredEllipse::sum(const Pixels& p, Share& share) const {
  const float scale = float(1 / s_);
  const Lanes px = p.x * all(scale), py = p.y * all(scale);
  // What a group must reach to have a part: across u within the Gaussian, along u not behind the pixels.
  Group window{scale * p.low_x - kReach, scale * p.high_x + kReach, scale * p.low_y - kReach,
               scale * p.high_y + kReach};
  constexpr float kFar = 1e30f;
  if (p.side == right) window.high_x = kFar;
  if (p.side == left) window.low_x = -kFar;
  if (p.side == bottom) window.high_y = kFar;
  if (p.side == top) window.low_y = -kFar;
  const bool along_x = p.side == right || p.side == left;
  const float direction = p.side == right || p.side == bottom ? 1.0f : -1.0f;

  Lanes w = all(0), cx = w, cy = w, r0 = w, r1 = w, r2 = w, by_s = w, fourth = w, ratio = w;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Group& box = groups_[g];
    if (box.low_x > window.high_x || box.high_x < window.low_x || box.low_y > window.high_y ||
        box.high_y < window.low_y)
      continue;
    const float nearest = p.side == right    ? box.low_x - scale * p.high_x
                          : p.side == left   ? scale * p.low_x - box.high_x
                          : p.side == bottom ? box.low_y - scale * p.high_y
                                             : scale * p.low_y - box.high_y;
    if (nearest > kReach) {  // all of it beyond the pixels: Φ = 1, G = 0
      for (const Node* n = &nodes_[kGroup * g]; n != &nodes_[kGroup * g] + kGroup; ++n) {
        const Lanes t = along_x ? all(n->y) - py : all(n->x) - px;
        w += exp_of_negative(all(-0.5f) * t * t) * all(direction * (along_x ? n->nx : n->ny));
      }
      continue;
    }
    for (const Node* n = &nodes_[kGroup * g]; n != &nodes_[kGroup * g] + kGroup; ++n) {
      const Lanes x = all(n->x) - px, y = all(n->y) - py, xx = x * x, yy = y * y;
      const Lanes ex = exp_of_negative(all(-0.5f) * xx), ey = exp_of_negative(all(-0.5f) * yy), e = ex * ey;
      if (along_x)
        w += ey * normal_cdf(all(direction) * x, ex) * all(direction * n->nx);
      else
        w += ex * normal_cdf(all(direction) * y, ey) * all(direction * n->ny);
      const Lanes nxx = all(n->nx) * x, nyy = all(n->ny) * y;
      fourth += e * (nxx * (xx - all(3)) + nyy * (yy - all(3)));
      if constexpr (!derivatives) continue;
      cx += e * all(n->nx);
      cy += e * all(n->ny);
      r0 += e * all(n->root[0]);
      r1 += e * all(n->root[1]);
      r2 += e * all(n->root[2]);
      by_s += e * (nxx + nyy);
      if (ring_) ratio += e * all(n->ratio);
    }
  }
  const double flux = 1 / std::sqrt(2 * std::numbers::pi), density = 1 / (2 * std::numbers::pi);
  const double s2 = s_ * s_;
  share.w = all(float(flux)) * w + all(float(density / (2880 * s2 * s2))) * fourth;
  if constexpr (!derivatives) return;
  const Lanes by_n = all(float(density / s_)), by_weight = all(float(density / s2));
  share.by_center[0] = by_n * cx;
  share.by_center[1] = by_n * cy;
  share.by_root[0] = by_weight * r0;
  share.by_root[1] = by_weight * r1;
  share.by_root[2] = by_weight * r2;
  share.by_s = -by_n * by_s;
  share.by_ratio = by_weight * ratio;
}

}  // namespace lumihull::calib
