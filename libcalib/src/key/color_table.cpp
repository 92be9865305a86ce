// The decision of k nearest neighbours for every colour of the RGB cube.
//
// With m = floor(k / 2) + 1 a colour x is object where at least m of its k nearest samples are foreground. Let F(x) be
// the distance to the m-th nearest foreground sample and B(x) that to the (k - m + 1)-th nearest background sample.
// The m-th foreground sample is among the first k of all exactly if at most k - m background samples stand before it,
// and at equal distance the background stands before the foreground; so
//
//     x is object  <=>  F(x) < B(x).
//
// F and B change by at most |x - y| between x and y. A cube of colours with centre c and half-diagonal r therefore has
// one answer where |F(c) - B(c)| exceeds 2r; and in any case only samples within min(F(c), B(c)) + 2r of c can take
// part in a comparison inside the cube: those beyond are farther from every x than the smaller of F(x), B(x). Cubes are
// halved, each handing its samples on, down to 4 x 4 x 4 colours, where F and B are computed for every colour.
#include "color_table.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace lumihull::calib {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLeaf = 4;
constexpr int kLeafColors = kLeaf * kLeaf * kLeaf;

/// Samples of one kind. Coordinates are doubled, so that centres of cubes are integers too; squared distances stay
/// below 2^24, where float is exact. Counts are capped at the number that can matter.
struct Samples {
  std::vector<float> x, y, z;
  std::vector<std::int32_t> count;

  std::size_t size() const { return x.size(); }
  void resize(std::size_t n) { x.resize(n), y.resize(n), z.resize(n), count.resize(n); }
};

struct Cube {
  int x, y, z, side;
  float center(int low) const { return float(2 * low + side - 1); }
  /// From the centre to the farthest colour, doubled coordinates.
  float half_diagonal() const { return std::sqrt(3.0f) * float(side - 1); }
};

/// Squared distance to the n-th nearest sample (counts included), or infinity; all of them go to `distance`.
float nth_distance(const Samples& samples, const Cube& cube, int n, std::vector<float>& distance,
                   std::vector<float>& best) {
  const float cx = cube.center(cube.x), cy = cube.center(cube.y), cz = cube.center(cube.z);
  const std::size_t size = samples.size();
  if (distance.size() < size) distance.resize(size);
  best.assign(std::size_t(n), kInfinity);
  float worst = kInfinity;
  float* const d = distance.data();
  const float *x = samples.x.data(), *y = samples.y.data(), *z = samples.z.data();
  constexpr std::size_t kPiece = 8;
  for (std::size_t first = 0; first < size; first += kPiece) {
    const std::size_t last = std::min(first + kPiece, size);
    float least = kInfinity;
    if (last - first == kPiece) {
      for (std::size_t i = 0; i < kPiece; ++i) {
        const float dx = x[first + i] - cx, dy = y[first + i] - cy, dz = z[first + i] - cz;
        d[first + i] = dx * dx + dy * dy + dz * dz;
      }
      for (std::size_t i = 0; i < kPiece; ++i) least = std::min(least, d[first + i]);
    } else {
      for (std::size_t i = first; i < last; ++i) {
        const float dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz;
        d[i] = dx * dx + dy * dy + dz * dz;
        least = std::min(least, d[i]);
      }
    }
    if (!(least < worst)) continue;
    for (std::size_t i = first; i < last; ++i)
      for (int c = samples.count[i]; c > 0 && d[i] < worst; --c) {
        int slot = n - 1;
        for (; slot > 0 && best[std::size_t(slot - 1)] > d[i]; --slot)
          best[std::size_t(slot)] = best[std::size_t(slot - 1)];
        best[std::size_t(slot)] = d[i];
        worst = best.back();
      }
  }
  return worst;
}

void keep_within(const Samples& from, const std::vector<float>& distance, float squared_radius, Samples& to) {
  to.resize(from.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    to.x[n] = from.x[i], to.y[n] = from.y[i], to.z[n] = from.z[i], to.count[n] = from.count[i];
    n += distance[i] <= squared_radius;
  }
  to.resize(n);
}

class Builder {
 public:
  Builder(int need_foreground, int need_background, std::uint64_t* table)
      : need_foreground_(need_foreground), need_background_(need_background), table_(table) {
    nearest_foreground_.resize(std::size_t(need_foreground) * kLeafColors);
    nearest_background_.resize(std::size_t(need_background) * kLeafColors);
  }

  /// Decides a cube whose samples are among the given ones; `depth` counts halvings and names the scratch space.
  void descend(const Cube& cube, const Samples& foreground, const Samples& background, int depth) {
    Samples &near_foreground = foreground_[std::size_t(depth)], &near_background = background_[std::size_t(depth)];
    if (!narrow(cube, foreground, background, near_foreground, near_background)) return;
    if (cube.side == kLeaf) return leaf(cube, near_foreground, near_background);
    const int half = cube.side / 2;
    for (int i = 0; i < 8; ++i)
      descend({cube.x + (i >> 2 & 1) * half, cube.y + (i >> 1 & 1) * half, cube.z + (i & 1) * half, half},
              near_foreground, near_background, depth + 1);
  }

  /// false: the cube has one answer, and it was filled. true: the samples that matter inside are in the last two.
  bool narrow(const Cube& cube, const Samples& foreground, const Samples& background, Samples& near_foreground,
              Samples& near_background) {
    const float to_foreground = std::sqrt(nth_distance(foreground, cube, need_foreground_, to_foreground_, best_));
    const float to_background = std::sqrt(nth_distance(background, cube, need_background_, to_background_, best_));
    const float r = cube.half_diagonal();
    constexpr float kRounding = 0.01f;
    if (to_foreground + 2 * r + kRounding < to_background) return fill(cube, true), false;
    if (to_background + 2 * r + kRounding < to_foreground) return fill(cube, false), false;
    const float radius = std::min(to_foreground, to_background) + 2 * r + kRounding;
    keep_within(foreground, to_foreground_, radius * radius, near_foreground);
    keep_within(background, to_background_, radius * radius, near_background);
    return true;
  }

 private:
  void fill(const Cube& cube, bool object) {
    if (!object) return;  // the table starts as background
    if (cube.side >= 8) {
      for (int x = cube.x; x < cube.x + cube.side; x += 8)
        for (int y = cube.y; y < cube.y + cube.side; y += 8)
          for (int z = cube.z; z < cube.z + cube.side; z += 8)
            std::fill_n(table_ + (ColorKey::address({std::uint8_t(x), std::uint8_t(y), std::uint8_t(z)}) >> 6), 8,
                        ~std::uint64_t(0));
    } else {
      for (int x = 0; x < kLeaf; ++x)
        for (int y = 0; y < kLeaf; ++y) set_row(cube, x, y, 0xF);
    }
  }

  /// Four colours along blue.
  void set_row(const Cube& cube, int x, int y, std::uint64_t bits) {
    const std::uint32_t a =
        ColorKey::address({std::uint8_t(cube.x + x), std::uint8_t(cube.y + y), std::uint8_t(cube.z)});
    table_[a >> 6] |= bits << (a & 63);
  }

  /// The need-th smallest squared distance for each of the leaf's colours, in rows of `kLeafColors`, ascending.
  static void nearest(const Cube& cube, const Samples& samples, int need, float* best) {
    std::fill_n(best, std::size_t(need) * kLeafColors, kInfinity);
    alignas(32) float d[kLeafColors];
    for (std::size_t i = 0; i < samples.size(); ++i) {
      float along_z[kLeaf];
      for (int z = 0; z < kLeaf; ++z) {
        const float dz = samples.z[i] - float(2 * (cube.z + z));
        along_z[z] = dz * dz;
      }
      for (int x = 0; x < kLeaf; ++x) {
        const float dx = samples.x[i] - float(2 * (cube.x + x));
        for (int y = 0; y < kLeaf; ++y) {
          const float dy = samples.y[i] - float(2 * (cube.y + y));
          const float dxy = dx * dx + dy * dy;
          for (int z = 0; z < kLeaf; ++z) d[(x * kLeaf + y) * kLeaf + z] = dxy + along_z[z];
        }
      }
      insert(d, best, need);
      for (int again = samples.count[i]; again > 1; --again) insert(d, best, need);
    }
  }

  static void insert(const float* distance, float* best, int need) {
    alignas(32) float carried[kLeafColors];
    std::memcpy(carried, distance, sizeof carried);
    for (int n = 0; n < need; ++n, best += kLeafColors) {
      for (int i = 0; i < kLeafColors; ++i) {
        const float here = best[i], other = carried[i];
        best[i] = here < other ? here : other;
        carried[i] = here < other ? other : here;
      }
    }
  }

  void leaf(const Cube& cube, const Samples& foreground, const Samples& background) {
    nearest(cube, foreground, need_foreground_, nearest_foreground_.data());
    nearest(cube, background, need_background_, nearest_background_.data());
    const float* f = nearest_foreground_.data() + std::size_t(need_foreground_ - 1) * kLeafColors;
    const float* b = nearest_background_.data() + std::size_t(need_background_ - 1) * kLeafColors;
    for (int row = 0; row < kLeaf * kLeaf; ++row) {
      std::uint64_t bits = 0;
      for (int z = 0; z < kLeaf; ++z) bits |= std::uint64_t(f[row * kLeaf + z] < b[row * kLeaf + z]) << z;
      set_row(cube, row / kLeaf, row % kLeaf, bits);
    }
  }

  int need_foreground_, need_background_;
  std::uint64_t* table_;
  std::vector<float> best_, to_foreground_, to_background_;  // scratch of `narrow`
  std::vector<float> nearest_foreground_, nearest_background_;
  std::array<Samples, 8> foreground_, background_;
};

Samples doubled(std::span<const ColorCount> colors, int need) {
  Samples samples;
  samples.resize(colors.size());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    samples.x[i] = 2.0f * colors[i].color[0];
    samples.y[i] = 2.0f * colors[i].color[1];
    samples.z[i] = 2.0f * colors[i].color[2];
    samples.count[i] = std::int32_t(std::min<std::uint32_t>(colors[i].count, std::uint32_t(need)));
  }
  return samples;
}

}  // namespace

std::vector<std::uint64_t> build_color_table(std::span<const ColorCount> background,
                                             std::span<const ColorCount> foreground, int k, Job& job) {
  std::vector<std::uint64_t> table((std::size_t(1) << 24) / 64, 0);
  const int need_foreground = k / 2 + 1, need_background = k - need_foreground + 1;
  const Samples all_foreground = doubled(foreground, need_foreground);
  const Samples all_background = doubled(background, need_background);

  // 512 cubes of 32³ colours, each from the samples of its cube of 128³: enough pieces to share, and none looks at all
  // the samples.
  constexpr int kOuter = 128, kInner = 32;
  struct Outer {
    bool open = false;
    Samples foreground, background;
  };
  std::array<Outer, 8> outer;
  parallel_for(job, outer.size(), [&](std::size_t i) {
    Builder builder(need_foreground, need_background, table.data());
    const Cube cube{int(i >> 2 & 1) * kOuter, int(i >> 1 & 1) * kOuter, int(i & 1) * kOuter, kOuter};
    outer[i].open = builder.narrow(cube, all_foreground, all_background, outer[i].foreground, outer[i].background);
  });
  parallel_for(job, 512, [&](std::size_t i) {
    const int x = int(i >> 6 & 7), y = int(i >> 3 & 7), z = int(i & 7);
    const Outer& from = outer[std::size_t((x >> 2) * 4 + (y >> 2) * 2 + (z >> 2))];
    if (!from.open) return;
    Builder builder(need_foreground, need_background, table.data());
    builder.descend({x * kInner, y * kInner, z * kInner, kInner}, from.foreground, from.background, 0);
  });
  return table;
}

}  // namespace lumihull::calib
