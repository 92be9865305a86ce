#include "mask_edges.h"

#include <algorithm>
#include <cmath>

namespace lumihull::slf::truth {
namespace {

constexpr float kLevel = 127.5f;

float distance_to(const Eigen::Vector2f& p, const MaskEdges::Segment& s) {
  const Eigen::Vector2f along = s.b - s.a;
  const float square = along.squaredNorm();
  const float t = square > 0 ? std::clamp((p - s.a).dot(along) / square, 0.0f, 1.0f) : 0.0f;
  return (s.a + t * along - p).norm();
}

}  // namespace

MaskEdges::MaskEdges(const Image& mask) : columns_(mask.width() - 1), rows_(mask.height() - 1) {
  starts_.reserve(std::size_t(std::max(0, columns_)) * std::size_t(std::max(0, rows_)) + 1);
  for (int y = 0; y < rows_; ++y) {
    const std::uint8_t *up = mask.row<std::uint8_t>(y), *down = mask.row<std::uint8_t>(y + 1);
    for (int x = 0; x < columns_; ++x) {
      starts_.push_back(std::uint32_t(segments_.size()));
      // Corners in turn; crossings of the square's four sides.
      const float v[4] = {float(up[x]), float(up[x + 1]), float(down[x + 1]), float(down[x])};
      const int inside = (v[0] > kLevel) + (v[1] > kLevel) + (v[2] > kLevel) + (v[3] > kLevel);
      if (inside == 0 || inside == 4) continue;
      static const Eigen::Vector2f corner[4] = {{0.5f, 0.5f}, {1.5f, 0.5f}, {1.5f, 1.5f}, {0.5f, 1.5f}};
      Eigen::Vector2f crossing[4];
      int n = 0, first = 0;
      for (int k = 0; k < 4; ++k) {
        const int next = (k + 1) % 4;
        if ((v[k] > kLevel) == (v[next] > kLevel)) continue;
        const float t = (kLevel - v[k]) / (v[next] - v[k]);
        if (n == 0) first = k;
        crossing[n++] = Eigen::Vector2f(float(x), float(y)) + (1 - t) * corner[k] + t * corner[next];
      }
      if (n == 2) {
        segments_.push_back({crossing[0], crossing[1]});
      } else {
        // A saddle: the middle's value says which corners belong together. `first` is 0: all sides are crossed.
        const bool middle = v[0] + v[1] + v[2] + v[3] > 4 * kLevel;
        const bool cut_first = (v[first] > kLevel) != middle;  // the first corner stands alone
        segments_.push_back({crossing[0], crossing[cut_first ? 3 : 1]});
        segments_.push_back({crossing[2], crossing[cut_first ? 1 : 3]});
      }
    }
  }
  starts_.push_back(std::uint32_t(segments_.size()));
}

double MaskEdges::length() const {
  double sum = 0;
  for (const Segment& s : segments_) sum += s.length();
  return sum;
}

float MaskEdges::distance(const Eigen::Vector2f& p, float reach) const {
  if (segments_.empty()) return reach;
  float best = reach;
  const int cx = int(std::floor(p.x() - 0.5f)), cy = int(std::floor(p.y() - 0.5f));
  const auto look = [&](int x, int y) {
    if (x < 0 || x >= columns_) return;
    const std::size_t i = std::size_t(y) * std::size_t(columns_) + std::size_t(x);
    for (std::uint32_t k = starts_[i]; k < starts_[i + 1]; ++k) best = std::min(best, distance_to(p, segments_[k]));
  };
  // Rings of squares around the one that holds p; those of ring r are at least r - 1 away.
  for (int r = 0; float(r) - 1 < best; ++r)
    for (int y = std::max(0, cy - r); y <= std::min(rows_ - 1, cy + r); ++y) {
      if (y == cy - r || y == cy + r) {
        for (int x = cx - r; x <= cx + r; ++x) look(x, y);
      } else {
        look(cx - r, y);
        look(cx + r, y);
      }
    }
  return best;
}

void DistanceHistogram::add(float distance, float weight) {
  const auto step = std::uint64_t(std::lround(std::min(distance, kReach) * kSteps));
  const auto w = std::uint64_t(std::lround(256 * weight));
  bins_[std::size_t(step)] += w;
  total_ += w;
  sum_ += w * step;
  squares_ += w * step * step;
  ++count_;
  max_ = std::max(max_, std::min(distance, kReach));
}

void DistanceHistogram::add(const DistanceHistogram& other) {
  for (std::size_t i = 0; i < bins_.size(); ++i) bins_[i] += other.bins_[i];
  total_ += other.total_, sum_ += other.sum_, squares_ += other.squares_;
  count_ += other.count_;
  max_ = std::max(max_, other.max_);
}

double DistanceHistogram::within(double distance) const {
  if (!total_) return 1;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bins_.size() && double(i) <= distance * kSteps; ++i) sum += bins_[i];
  return double(sum) / double(total_);
}

double DistanceHistogram::mean() const { return total_ ? double(sum_) / double(total_) / kSteps : 0; }

double DistanceHistogram::rms() const { return total_ ? std::sqrt(double(squares_) / double(total_)) / kSteps : 0; }

double DistanceHistogram::quantile(double q) const {
  const double wanted = q * double(total_);
  double sum = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i)
    if ((sum += double(bins_[i])) >= wanted && sum > 0) return double(i) / kSteps;
  return 0;
}

FalseParts false_parts(const Image& mask, const Image& truth) {
  const int w = mask.width(), h = mask.height();
  const auto at = [w](const Image& image, std::size_t i) {
    return image.row<std::uint8_t>(int(i / std::size_t(w)))[i % std::size_t(w)] >= 128;
  };
  FalseParts out;
  std::vector<std::uint8_t> seen(std::size_t(w) * std::size_t(h));
  std::vector<std::size_t> stack;
  for (std::size_t start = 0; start < seen.size(); ++start) {
    if (seen[start]) continue;
    const bool object = at(mask, start);
    std::size_t size = 0, true_object = 0;
    bool border = false;
    seen[start] = 1;
    stack.push_back(start);
    while (!stack.empty()) {
      const std::size_t i = stack.back();
      stack.pop_back();
      ++size;
      true_object += at(truth, i);
      const int x = int(i % std::size_t(w)), y = int(i / std::size_t(w));
      border |= x == 0 || y == 0 || x == w - 1 || y == h - 1;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int nx = x + dx, ny = y + dy;
          if (nx < 0 || ny < 0 || nx >= w || ny >= h || (!object && dx != 0 && dy != 0)) continue;
          const std::size_t k = std::size_t(ny) * std::size_t(w) + std::size_t(nx);
          if (seen[k] || at(mask, k) != object) continue;
          seen[k] = 1;
          stack.push_back(k);
        }
    }
    if (object && 2 * true_object < size) ++out.islands, out.island_px += size;
    if (!object && !border && 2 * true_object >= size) ++out.holes, out.hole_px += size;
  }
  return out;
}

}  // namespace lumihull::slf::truth
