// Dark ellipses in a grey pyramid: local threshold, connected runs, moments.
#include "circle_blobs.h"

#include <lumihull/base/parallel.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace lumihull::calib {

namespace {

constexpr int kTile = 8;
constexpr int kLargestBlob = 40;      // longest side of a spot's box, px of its level
constexpr int kStrip = 256;           // rows that a thread takes at a time
constexpr double kSmallestMinor = 5;  // px of the level: above level 0, where smaller spots are for the level below

// Extremes of tiles, and from them the threshold of each tile: 0 where there is nothing to see.
struct Tiles {
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> low, high;            // of the tile itself
  std::vector<std::uint8_t> near_low, near_high;  // of 3 x 3 tiles
  std::vector<std::uint8_t> threshold, halfway, quarter;

  explicit Tiles(const GreyLevel& level)
      : columns((level.width + kTile - 1) / kTile), rows((level.height + kTile - 1) / kTile) {
    for (auto* v : {&low, &high, &near_low, &near_high, &threshold, &halfway, &quarter})
      v->resize(std::size_t(columns) * std::size_t(rows));
  }
  std::size_t at(int column, int row) const { return std::size_t(row) * std::size_t(columns) + std::size_t(column); }
};

void extremes(const GreyLevel& level, Tiles& tiles, int row) {
  const int y0 = row * kTile, y1 = std::min(y0 + kTile, level.height), width = level.width;
  std::vector<std::uint8_t> low(std::size_t(tiles.columns) * kTile, 255), high(low.size(), 0);
  std::uint8_t *lo = low.data(), *hi = high.data();
  for (int y = y0; y < y1; ++y) {
    const std::uint8_t* in = level.row(y);
    for (int x = 0; x < width; ++x) {
      lo[x] = std::min(lo[x], in[x]);
      hi[x] = std::max(hi[x], in[x]);
    }
  }
  for (int c = 0; c < tiles.columns; ++c) {
    std::uint8_t a = 255, b = 0;
    for (int x = 0; x < kTile; ++x) {
      a = std::min(a, lo[c * kTile + x]);
      b = std::max(b, hi[c * kTile + x]);
    }
    tiles.low[tiles.at(c, row)] = a;
    tiles.high[tiles.at(c, row)] = b;
  }
}

// Whether there is ink within three tiles. A ring whose wall is too thin to hold any is no larger than 9 px or so, and
// the L, which does, is seldom more than a pitch away.
bool ink_near(const Tiles& ink, int column, int row) {
  constexpr int kReach = 3;
  for (int r = std::max(0, row - kReach); r <= std::min(ink.rows - 1, row + kReach); ++r)
    for (int c = std::max(0, column - kReach); c <= std::min(ink.columns - 1, column + kReach); ++c)
      if (ink.low[ink.at(c, r)] < 128) return true;
  return false;
}

// The threshold lies three quarters of the way up to the paper: there a small ring, blurred to half of its depth, is
// still a spot. In sRGB's values that is about halfway in light. It stays clear of the paper's own noise. Where
// something brighter than the paper is near, that may be above the paper: hence a second one, halfway. ink: its tiles,
// or null.
void choose_thresholds(Tiles& tiles, int row, const std::array<float, 8>& noise, int min_contrast, const Tiles* ink) {
  for (int c = 0; c < tiles.columns; ++c) {
    std::uint8_t lo = 255, hi = 0;
    for (int r = std::max(0, row - 1); r <= std::min(tiles.rows - 1, row + 1); ++r)
      for (int k = std::max(0, c - 1); k <= std::min(tiles.columns - 1, c + 1); ++k) {
        lo = std::min(lo, tiles.low[tiles.at(k, r)]);
        hi = std::max(hi, tiles.high[tiles.at(k, r)]);
      }
    const std::size_t i = tiles.at(c, row);
    tiles.near_low[i] = lo;
    tiles.near_high[i] = hi;
    tiles.threshold[i] = tiles.halfway[i] = tiles.quarter[i] = 0;
    if (ink && !ink_near(*ink, c, row)) continue;
    // Extremes of 576 values of noise lie about 6.2 standard deviations apart.
    const float sigma = noise[std::size_t((lo + hi) / 2 >> 5)], contrast = float(hi - lo);
    if (contrast < float(min_contrast) || contrast < 8 * sigma) continue;
    const float at =
        std::max(0.5f * contrast, std::min(0.75f * contrast, contrast - 6.5f * noise[std::size_t(hi >> 5)]));
    tiles.threshold[i] = std::uint8_t(float(lo) + at + 0.5f);
    tiles.halfway[i] = std::uint8_t((lo + hi + 1) / 2);
    tiles.quarter[i] = std::uint8_t((3 * lo + hi + 2) / 4);
  }
}

struct Run {
  int y, x0, x1;  // [x0, x1)
};

// Connected runs (4-neighbours) of dark pixels; the parent of a run has a lower index.
class Runs {
 public:
  std::vector<Run> runs;
  std::vector<int> parent;

  void add_row(int y, const std::uint64_t* bits, int words) {
    const std::size_t before = row_begin_, above_end = runs.size();
    row_begin_ = runs.size();
    std::size_t above = before;
    int start = -1;
    const auto close = [&](int end) {
      const int index = int(runs.size());
      runs.push_back({y, start, end});
      parent.push_back(index);
      while (above < above_end && runs[above].x1 <= start) ++above;
      for (std::size_t k = above; k < above_end && runs[k].x0 < end; ++k) join(int(k), index);
      start = -1;
    };
    for (int w = 0; w < words; ++w) {
      std::uint64_t word = bits[w];
      int position = 0;
      if (start >= 0) {
        const int ones = std::countr_one(word);
        if (ones == 64) continue;
        close(64 * w + ones);
        position = ones;
      }
      while (position < 64) {
        const std::uint64_t rest = word >> position;
        if (rest == 0) break;
        position += std::countr_zero(rest);
        start = 64 * w + position;
        const int ones = std::countr_one(word >> position);
        if (position + ones >= 64) break;
        position += ones;
        close(64 * w + position);
      }
    }
    if (start >= 0) close(64 * words);
  }

  int root(int i) {
    while (parent[std::size_t(i)] != i) {
      parent[std::size_t(i)] = parent[std::size_t(parent[std::size_t(i)])];
      i = parent[std::size_t(i)];
    }
    return i;
  }

 private:
  void join(int a, int b) {
    a = root(a), b = root(b);
    if (a != b) parent[std::size_t(std::max(a, b))] = std::min(a, b);
  }
  std::size_t row_begin_ = 0;
};

struct Component {
  int x0, x1, y0, y1;  // box, [x0, x1) x [y0, y1)
  int pixels;
  int extents;  // where its rows' extents stand
};

// From where to where a spot goes in one of its rows, to a part of a pixel.
struct Extent {
  double x0 = 1e9, x1 = -1e9;
};

// Where the grey value between two pixels' centres is the threshold: the part of the way from the dark one, 0 … 1.
double crossing(int dark, int light, int threshold) {
  return light > dark ? std::clamp((threshold - 0.5 - dark) / double(light - dark), 0.0, 1.0) : 0.5;
}

// An ellipse, or not: by the filled outline's moments, and by how well the outline keeps to it.
bool describe(const Component& c, const Extent* extents, double min_minor, Blob& blob) {
  const int rows = c.y1 - c.y0;
  double n = 0, sx = 0, sy = 0;
  for (int i = 0; i < rows; ++i) {
    const double length = extents[i].x1 - extents[i].x0;
    if (length <= 0) return false;
    n += length;
    sx += length * 0.5 * (extents[i].x0 + extents[i].x1);
    sy += length * (c.y0 + i + 0.5);
  }
  if (c.pixels < 0.3 * n) return false;
  const Eigen::Vector2d center(sx / n, sy / n);
  double xx = 0, xy = 0, yy = 0;
  for (int i = 0; i < rows; ++i) {
    const double length = extents[i].x1 - extents[i].x0;
    const double x = 0.5 * (extents[i].x0 + extents[i].x1) - center.x(), y = c.y0 + i + 0.5 - center.y();
    xx += length * (x * x + length * length / 12);
    xy += length * x * y;
    yy += length * y * y;
  }
  // A filled ellipse's second moments are a quarter of its shape matrix.
  blob.shape << 4 * xx / n, 4 * xy / n, 4 * xy / n, 4 * yy / n;
  const double half_trace = 0.5 * blob.shape.trace();
  const double root = std::sqrt(std::max(0.0, half_trace * half_trace - blob.shape.determinant()));
  const double a2 = half_trace + root, b2 = half_trace - root;
  if (!(b2 > 0)) return false;
  blob.a = std::sqrt(a2), blob.b = std::sqrt(b2);
  if (2 * blob.b < min_minor || blob.a > 5 * blob.b) return false;
  const double area = M_PI * blob.a * blob.b;
  if (std::abs(n - area) > (0.06 + 0.3 / blob.b) * area) return false;
  const Eigen::Matrix2d inverse = blob.shape.inverse();
  double sum = 0;
  for (int i = 0; i < rows; ++i)
    for (const double x : {extents[i].x0, extents[i].x1}) {
      const Eigen::Vector2d d = Eigen::Vector2d(x, c.y0 + i + 0.5) - center;
      const double r = std::sqrt(d.dot(inverse * d)) - 1;
      sum += r * r;
    }
  const double off = std::sqrt(sum / (2 * rows));
  if (off > 0.04 + 0.35 / blob.b) return false;
  blob.center = center;
  return true;
}

// Spots whose first row is in [first, last).
std::vector<Blob> blobs_of_strip(const GreyLevel& level, const Tiles& tiles,
                                 const std::vector<std::uint8_t>& thresholds, int level_index, int first, int last,
                                 double min_minor) {
  const int from = std::max(0, first - 1), to = std::min(level.height, last + kLargestBlob + 2);
  const int padded = tiles.columns * kTile, words = (padded + 63) / 64;
  std::vector<std::uint8_t> threshold(std::size_t(words) * 64, 0), dark(std::size_t(words) * 64, 0);
  std::vector<std::uint64_t> bits(std::size_t(words), 0);
  Runs runs;
  int tile_row = -1;
  bool any = false;
  for (int y = from; y < to; ++y) {
    if (y / kTile != tile_row) {
      tile_row = y / kTile;
      any = false;
      for (int c = 0; c < tiles.columns; ++c) {
        const std::uint8_t t = thresholds[tiles.at(c, tile_row)];
        any |= t != 0;
        std::memset(threshold.data() + std::size_t(c) * kTile, t, kTile);
      }
    }
    if (any) {
      const std::uint8_t *in = level.row(y), *t = threshold.data();
      std::uint8_t* out = dark.data();
      const int width = level.width;
      for (int x = 0; x < width; ++x) out[x] = in[x] < t[x];
      for (int w = 0; w < words; ++w) {
        std::uint64_t word = 0;
        for (int k = 0; k < 8; ++k) {
          std::uint64_t bytes;
          std::memcpy(&bytes, out + 64 * w + 8 * k, 8);
          word |= (bytes * 0x0102040810204080u >> 56) << (8 * k);
        }
        bits[std::size_t(w)] = word;
      }
    } else {
      std::fill(bits.begin(), bits.end(), 0);
    }
    runs.add_row(y, bits.data(), words);
  }

  std::vector<int> component_of(runs.runs.size());
  std::vector<Component> components;
  for (std::size_t i = 0; i < runs.runs.size(); ++i) {
    const Run& run = runs.runs[i];
    const int root = runs.root(int(i));
    if (root == int(i)) {
      component_of[i] = int(components.size());
      components.push_back({run.x0, run.x1, run.y, run.y + 1, run.x1 - run.x0, 0});
    } else {
      component_of[i] = component_of[std::size_t(root)];
      Component& c = components[std::size_t(component_of[i])];
      c.x0 = std::min(c.x0, run.x0), c.x1 = std::max(c.x1, run.x1), c.y1 = run.y + 1;
      c.pixels += run.x1 - run.x0;
    }
  }
  int extents_needed = 0;
  const int least = std::max(2, int(min_minor) - 1);
  for (Component& c : components) {
    const int w = c.x1 - c.x0, h = c.y1 - c.y0;
    const bool fits = c.y0 >= first && c.y0 < last && w >= least && h >= least && w <= kLargestBlob &&
                      h <= kLargestBlob && c.x0 > 0 && c.y0 > 0 && c.x1 < level.width && c.y1 < level.height &&
                      c.pixels * 5 >= w * h;
    c.extents = fits ? extents_needed : -1;
    if (fits) extents_needed += h;
  }
  std::vector<Extent> extents(static_cast<std::size_t>(extents_needed));
  for (std::size_t i = 0; i < runs.runs.size(); ++i) {
    const Component& c = components[std::size_t(component_of[i])];
    if (c.extents < 0) continue;
    const Run& run = runs.runs[i];
    const std::uint8_t* in = level.row(run.y);
    const std::uint8_t* t = thresholds.data() + tiles.at(0, run.y / kTile);
    Extent& e = extents[std::size_t(c.extents + run.y - c.y0)];
    e.x0 = std::min(e.x0, run.x0 + 0.5 - crossing(in[run.x0], in[run.x0 - 1], t[run.x0 / kTile]));
    e.x1 = std::max(e.x1, run.x1 - 0.5 + crossing(in[run.x1 - 1], in[run.x1], t[(run.x1 - 1) / kTile]));
  }

  std::vector<Blob> found;
  const double scale = std::ldexp(1.0, level_index);
  for (const Component& c : components) {
    if (c.extents < 0) continue;
    Blob blob;
    if (!describe(c, extents.data() + c.extents, min_minor, blob)) continue;
    const std::size_t tile = tiles.at(int(blob.center.x()) / kTile, int(blob.center.y()) / kTile);
    blob.dark = tiles.near_low[tile], blob.light = tiles.near_high[tile];
    blob.center *= scale;
    blob.shape *= scale * scale;
    blob.a *= scale, blob.b *= scale;
    blob.level = level_index;
    found.push_back(blob);
  }
  return found;
}

// Keeps one of those that are the same spot seen in several levels: the finest.
std::vector<Blob> without_repeats(std::vector<Blob> blobs, int width, int height) {
  constexpr int kCell = 16;
  const int columns = width / kCell + 1, rows = height / kCell + 1;
  std::vector<int> head(std::size_t(columns) * std::size_t(rows), -1), next;
  std::vector<Blob> kept;
  kept.reserve(blobs.size());
  for (const Blob& blob : blobs) {
    const int cx = int(blob.center.x()) / kCell, cy = int(blob.center.y()) / kCell;
    bool repeated = false;
    for (int y = std::max(0, cy - 1); y <= std::min(rows - 1, cy + 1) && !repeated; ++y)
      for (int x = std::max(0, cx - 1); x <= std::min(columns - 1, cx + 1) && !repeated; ++x)
        for (int i = head[std::size_t(y) * std::size_t(columns) + std::size_t(x)]; i >= 0; i = next[std::size_t(i)]) {
          const Blob& other = kept[std::size_t(i)];
          const double ratio = blob.a * blob.b / (other.a * other.b);
          if ((blob.center - other.center).norm() < 0.3 * std::min(blob.b, other.b) + 0.5 && ratio < 3 && ratio > 0.3) {
            repeated = true;
            break;
          }
        }
    if (repeated) continue;
    int& first = head[std::size_t(cy) * std::size_t(columns) + std::size_t(cx)];
    next.push_back(first);
    first = int(kept.size());
    kept.push_back(blob);
  }
  return kept;
}

}  // namespace

namespace {

struct Part {
  int level, first, last;
};

// Tiles of all levels, their extremes filled in.
std::vector<Tiles> tiles_of(const GreyPyramid& pyramid, std::vector<Part>& tile_rows, Job& job) {
  constexpr int kTileRows = 16;
  std::vector<Tiles> tiles;
  tile_rows.clear();
  for (int l = 0; l < int(pyramid.size()); ++l) {
    tiles.emplace_back(pyramid[std::size_t(l)]);
    for (int r = 0; r < tiles.back().rows; r += kTileRows)
      tile_rows.push_back({l, r, std::min(r + kTileRows, tiles.back().rows)});
  }
  parallel_for(job, tile_rows.size(), [&](std::size_t i) {
    const Part& p = tile_rows[i];
    for (int r = p.first; r < p.last; ++r) extremes(pyramid[std::size_t(p.level)], tiles[std::size_t(p.level)], r);
  });
  return tiles;
}

}  // namespace

std::vector<Blob> find_blobs(const GreyPyramid& grey, const GreyPyramid* ink, const BlobOptions& options, Job& job) {
  if (grey.empty()) return {};
  std::vector<Part> tile_rows, strips;
  std::vector<Tiles> grey_tiles = tiles_of(grey, tile_rows, job), ink_tiles;
  if (ink) ink_tiles = tiles_of(*ink, tile_rows, job);
  std::vector<std::array<float, 8>> noise;
  for (const GreyLevel& level : grey) noise.push_back(grey_noise(level));
  parallel_for(job, tile_rows.size(), [&](std::size_t i) {
    const Part& p = tile_rows[i];
    const std::size_t l = std::size_t(p.level);
    for (int r = p.first; r < p.last; ++r) {
      choose_thresholds(grey_tiles[l], r, noise[l], options.min_contrast, ink ? &ink_tiles[l] : nullptr);
      if (ink) choose_thresholds(ink_tiles[l], r, {}, options.min_contrast, nullptr);
    }
  });
  for (int l = 0; l < int(grey.size()); ++l)
    for (int y = 0; y < grey[std::size_t(l)].height; y += kStrip)
      strips.push_back({l, y, std::min(y + kStrip, grey[std::size_t(l)].height)});
  // Two thresholds on grey, one on ink; and the third one on grey.
  const std::size_t ink_kind = 2, quarter_kind = ink ? 3 : 2, kinds = quarter_kind + (options.both_kinds ? 1 : 0);
  std::vector<std::vector<Blob>> found(kinds * strips.size());
  parallel_for(job, found.size(), [&](std::size_t i) {
    const Part& p = strips[i % strips.size()];
    const std::size_t l = std::size_t(p.level);
    const double least = p.level == 0 ? 0.75 * options.min_circle_px
                                      : std::max(kSmallestMinor, 0.75 * std::ldexp(options.min_circle_px, -p.level));
    const std::size_t kind = i / strips.size();
    const bool on_ink = ink && kind == ink_kind;
    const Tiles& tiles = on_ink ? ink_tiles[l] : grey_tiles[l];
    const auto& thresholds = kind == 1 ? tiles.halfway : kind == quarter_kind ? tiles.quarter : tiles.threshold;
    found[i] = blobs_of_strip(on_ink ? (*ink)[l] : grey[l], tiles, thresholds, p.level, p.first, p.last, least);
  });
  std::vector<Blob> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return without_repeats(std::move(all), grey[0].width, grey[0].height);
}

}  // namespace lumihull::calib
