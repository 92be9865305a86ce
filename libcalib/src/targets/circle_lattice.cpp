// Ellipses into lattices, by what an ellipse says of the affine map at its place.
#include "circle_lattice.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>

namespace lumihull::calib {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int kMostNeighbours = 12;
constexpr int kLargestLattice = 200;  // places along a side
constexpr double kFilled = 0.75;      // of a lattice's box

struct Neighbour {
  int blob;
  Vector2d normal;  // where it is in the metric of the ellipse: radii
};

// The symmetric square root of an ellipse's inverse shape: maps it to the unit circle.
Matrix2d whitening(const Matrix2d& shape) {
  // For 2 x 2: √A = (A + √det A · I) / √(tr A + 2 √det A).
  const double s = std::sqrt(std::max(shape.determinant(), 1e-12));
  const Matrix2d root = (shape + s * Matrix2d::Identity()) / std::sqrt(shape.trace() + 2 * s);
  return root.inverse();
}

// Blobs by size and place.
class Index {
 public:
  explicit Index(std::span<const Blob> blobs) : blobs_(blobs) {
    for (int i = 0; i < int(blobs.size()); ++i) {
      const Blob& b = blobs[std::size_t(i)];
      entries_.push_back({key(octave(b.a), cell(b.center.x(), octave(b.a)), cell(b.center.y(), octave(b.a))), i});
    }
    std::sort(entries_.begin(), entries_.end());
  }

  // Calls body(i) for blobs of an octave below to an octave above the semi-axis `a` within `reach` of a place.
  template <class Body>
  void near(const Vector2d& place, double a, double reach, const Body& body) const {
    for (int o = octave(a) - 1; o <= octave(a) + 1; ++o) {
      const int x0 = cell(place.x() - reach, o), x1 = cell(place.x() + reach, o);
      const int y0 = cell(place.y() - reach, o), y1 = cell(place.y() + reach, o);
      for (int y = y0; y <= y1; ++y) {
        auto it = std::lower_bound(entries_.begin(), entries_.end(), Entry{key(o, x0, y), -1});
        const std::uint64_t last = key(o, x1, y);
        for (; it != entries_.end() && it->key <= last; ++it) body(it->blob);
      }
    }
  }

 private:
  struct Entry {
    std::uint64_t key;
    int blob;
    bool operator<(const Entry& o) const { return key != o.key ? key < o.key : blob < o.blob; }
  };
  static int octave(double a) { return std::clamp(int(std::floor(std::log2(std::max(a, 1e-3)))) + 8, 1, 62); }
  // Cells are eight times the octave's smallest semi-axis.
  static int cell(double v, int octave) { return std::clamp(int(std::floor(std::ldexp(v, 5 - octave))), 0, 0xffffff); }
  static std::uint64_t key(int octave, int x, int y) {
    return std::uint64_t(octave) << 48 | std::uint64_t(y) << 24 | std::uint64_t(x);
  }
  std::span<const Blob> blobs_;
  std::vector<Entry> entries_;
};

class Grower {
 public:
  Grower(std::span<const Blob> blobs, double pitch) : blobs_(blobs), pitch_(pitch), index_(blobs) {
    whitening_.reserve(blobs.size());
    for (const Blob& b : blobs) whitening_.push_back(whitening(b.shape));
    used_.assign(blobs.size(), false);
  }

  std::vector<CircleLattice> run(int least) {
    std::vector<CircleLattice> found;
    // Spots look larger than they are where circles are small, and a diagonal may pass for a step: a lattice of every
    // other place. Those that fill their box come first; what is left may have holes.
    for (const double filled : {kFilled, 0.0})
      for (int i = 0; i < int(blobs_.size()); ++i)
        if (!used_[std::size_t(i)]) from(i, least, filled, found);
    return found;
  }

 private:
  // The lattice about a spot of which at least such a part is there.
  void from(int i, int least, double filled, std::vector<CircleLattice>& found) {
    const std::vector<Neighbour> around = neighbours(i);
    int tries = 0;
    for (const Neighbour& u : around)
      for (const Neighbour& v : around) {
        if (tries >= 6) return;
        const double cross = u.normal.x() * v.normal.y() - u.normal.y() * v.normal.x();
        const double product = u.normal.norm() * v.normal.norm();
        if (cross < 0.8 * product) continue;  // 37° off a right angle at most
        const Vector2d corner = center(u.blob) + center(v.blob) - center(i);
        const int w = nearest(corner, i, 0.3 * pitch_);
        if (w < 0 || w == u.blob || w == v.blob) continue;
        ++tries;
        std::vector<int> members;
        CircleLattice lattice = grow(i, u.blob, v.blob, w, members);
        if (std::min(lattice.columns, lattice.rows) < least ||
            double(members.size()) < filled * double(lattice.blob.size()))
          continue;
        for (const int b : members) used_[std::size_t(b)] = true;
        found.push_back(std::move(lattice));
        return;
      }
  }

  const Vector2d& center(int i) const { return blobs_[std::size_t(i)].center; }

  // Whether two spots can be pictures of equal circles that stand side by side.
  bool alike(int i, int k) const {
    const Blob &p = blobs_[std::size_t(i)], &q = blobs_[std::size_t(k)];
    const double area = q.a * q.b / (p.a * p.b);
    if (area < 0.45 || area > 2.2) return false;
    const Matrix2d m = whitening_[std::size_t(i)] * q.shape * whitening_[std::size_t(i)];
    const double half = 0.5 * m.trace(), root = std::sqrt(std::max(0.0, half * half - m.determinant()));
    if (half + root > 3.0 || half - root < 0.33) return false;
    const float step_p = p.light - p.dark, step_q = q.light - q.dark;
    return step_p < 3 * step_q && step_q < 3 * step_p && q.dark < p.light && p.dark < q.light;
  }

  std::vector<Neighbour> neighbours(int i) const {
    const Blob& b = blobs_[std::size_t(i)];
    const double far = 1.3 * pitch_, near = 0.7 * pitch_;
    std::vector<Neighbour> found;
    index_.near(b.center, b.a, far * b.a, [&](int k) {
      if (k == i || used_[std::size_t(k)]) return;
      const Vector2d n = whitening_[std::size_t(i)] * (center(k) - b.center);
      const double d2 = n.squaredNorm();
      if (d2 > far * far || d2 < near * near || !alike(i, k)) return;
      found.push_back({k, n});
    });
    std::sort(found.begin(), found.end(), [](const Neighbour& p, const Neighbour& q) {
      const double a = p.normal.squaredNorm(), c = q.normal.squaredNorm();
      return a != c ? a < c : p.blob < q.blob;
    });
    if (found.size() > kMostNeighbours) found.resize(kMostNeighbours);
    return found;
  }

  // The spot like `like` nearest to a place, at most `reach` of its radii away; -1: none.
  int nearest(const Vector2d& place, int like, double reach) const {
    const Blob& b = blobs_[std::size_t(like)];
    const Matrix2d& w = whitening_[std::size_t(like)];
    double best = reach * reach;
    int found = -1;
    index_.near(place, b.a, reach * b.a, [&](int k) {
      if (used_[std::size_t(k)]) return;
      const double d2 = (w * (center(k) - place)).squaredNorm();
      if ((d2 < best || (d2 == best && k < found)) && alike(like, k)) {
        best = d2;
        found = k;
      }
    });
    return found;
  }

  CircleLattice grow(int origin, int right, int down, int corner, std::vector<int>& members) const {
    using Place = std::pair<int, int>;
    std::map<Place, int> at;
    std::map<int, Place> place_of;
    std::queue<Place> open;
    const auto put = [&](Place p, int blob) {
      at[p] = blob;
      place_of[blob] = p;
      open.push(p);
    };
    put({0, 0}, origin), put({1, 0}, right), put({0, 1}, down), put({1, 1}, corner);
    const auto find = [&](int x, int y) {
      const auto it = at.find({x, y});
      return it == at.end() ? -1 : it->second;
    };
    bool everywhere = false;  // the last resort: steps from farther away
    for (;;) {
      if (open.empty()) {
        if (everywhere || at.size() < 6) break;
        everywhere = true;
        for (const auto& [p, blob] : at) open.push(p);
      }
      const auto [x, y] = open.front();
      open.pop();
      const int self = find(x, y);
      for (const auto& [dx, dy] : std::array<Place, 4>{Place{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
        const int nx = x + dx, ny = y + dy;
        if (at.count({nx, ny}) || std::abs(nx) > kLargestLattice || std::abs(ny) > kLargestLattice) continue;
        // Straight on; or as the row beside does it. The mean of what there is.
        Vector2d sum(0, 0);
        int ways = 0;
        const int back = find(x - dx, y - dy);
        if (back >= 0) {
          const int further = find(x - 2 * dx, y - 2 * dy);
          Vector2d step = center(self) - center(back);
          // Steps grow or shrink by a constant ratio in perspective; half of the way is on the safe side of noise.
          if (further >= 0) step += 0.5 * (step - (center(back) - center(further)));
          sum += center(self) + step;
          ++ways;
        }
        for (const int side : {-1, 1}) {
          const int p = find(x + side * dy, y + side * dx), q = find(nx + side * dy, ny + side * dx);
          if (p >= 0 && q >= 0) {
            sum += center(self) + center(q) - center(p);
            ++ways;
          }
        }
        if (ways == 0 && everywhere) {
          for (int r = 2; r <= 3 && ways == 0; ++r)
            for (int oy = -r; oy <= r; ++oy)
              for (int ox = -r; ox <= r; ++ox) {
                if (std::max(std::abs(ox), std::abs(oy)) != r) continue;
                const int p = find(x + ox, y + oy), q = find(nx + ox, ny + oy);
                if (p < 0 || q < 0) continue;
                sum += center(self) + center(q) - center(p);
                ++ways;
              }
        }
        if (ways == 0) continue;
        const int next = nearest(sum / ways, self, 0.25 * pitch_);
        if (next < 0 || place_of.count(next)) continue;
        put({nx, ny}, next);
      }
    }
    int x0 = 0, x1 = 0, y0 = 0, y1 = 0;
    for (const auto& [p, blob] : at) {
      x0 = std::min(x0, p.first), x1 = std::max(x1, p.first);
      y0 = std::min(y0, p.second), y1 = std::max(y1, p.second);
    }
    CircleLattice lattice;
    lattice.columns = x1 - x0 + 1, lattice.rows = y1 - y0 + 1;
    lattice.blob.assign(std::size_t(lattice.columns) * std::size_t(lattice.rows), -1);
    for (const auto& [p, blob] : at) {
      lattice.blob[std::size_t((p.second - y0) * lattice.columns + p.first - x0)] = blob;
      members.push_back(blob);
    }
    return lattice;
  }

  std::span<const Blob> blobs_;
  double pitch_;
  Index index_;
  std::vector<Matrix2d> whitening_;
  std::vector<bool> used_;
};

}  // namespace

std::vector<CircleLattice> find_lattices(std::span<const Blob> blobs, double pitch_in_radii, int least) {
  if (blobs.size() < 4) return {};
  return Grower(blobs, pitch_in_radii).run(least);
}

}  // namespace lumihull::calib
