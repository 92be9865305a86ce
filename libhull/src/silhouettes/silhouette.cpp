// The field of one mask: contour, distances around it, tiles, pyramid. About one pass over the mask's bytes; everything
// else is proportional to the contour's length.

#include <lumihull/base/error.h>
#include <lumihull/hull/silhouette.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>

#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "distance_band.h"
#include "silhouette_data.h"
#include "silhouette_frame.h"

namespace lumihull::hull {
namespace {

/// One bit a pixel: object (value >= 128, i.e. above the 127.5 level).
struct BitMask {
  explicit BitMask(const Image& mask)
      : words((mask.width() + 63) / 64), bits(std::size_t(words) * std::size_t(mask.height())) {
    const int width = mask.width();
    for (int y = 0; y < mask.height(); ++y) {
      const std::uint8_t* row = mask.row<std::uint8_t>(y);
      std::uint64_t* out = &bits[std::size_t(y) * words];
      int x = 0;
#ifdef __AVX2__
      for (; x + 64 <= width; x += 64) {
        const auto load = [&](int at) {
          return std::uint32_t(_mm256_movemask_epi8(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + at))));
        };
        out[x / 64] = load(x) | std::uint64_t(load(x + 32)) << 32;
      }
#endif
      for (; x < width; ++x) out[x / 64] |= std::uint64_t(row[x] >> 7) << (x % 64);
    }
  }
  const std::uint64_t* row(int y) const { return &bits[std::size_t(y) * words]; }
  bool at(int x, int y) const { return row(y)[x / 64] >> (x % 64) & 1; }

  /// What all pixels are whose centres lie in a rectangle or next to it; nullopt where they differ.
  std::optional<bool> uniform(const Eigen::AlignedBox2d& px, int width, int height) const {
    const auto within = [](double v, int size) { return int(std::clamp(std::floor(v), 0.0, size - 1.0)); };
    const int x0 = within(px.min().x() - 0.5, width), x1 = within(px.max().x() + 0.5, width);
    const int y0 = within(px.min().y() - 0.5, height), y1 = within(px.max().y() + 0.5, height);
    const bool first = at(x0, y0);
    const std::uint64_t wanted = first ? ~std::uint64_t(0) : 0;
    for (int w = x0 / 64; w <= x1 / 64; ++w) {
      std::uint64_t cared = ~std::uint64_t(0);
      if (w == x0 / 64) cared <<= x0 % 64;
      if (w == x1 / 64) cared &= ~std::uint64_t(0) >> (63 - x1 % 64);
      std::uint64_t different = 0;
      for (int y = y0; y <= y1; ++y) different |= row(y)[w] ^ wanted;
      if (different & cared) return std::nullopt;
    }
    return first;
  }

  int words;
  std::vector<std::uint64_t> bits;
};

/// Marching squares between the centres of pixels.
class ContourTracer {
 public:
  ContourTracer(const Image& mask, const BitMask& bits, const std::function<void(double, double, double, double)>& emit)
      : mask_(mask), bits_(bits), emit_(emit) {}

  void trace() {
    for (int y = 0; y + 1 < mask_.height(); ++y) {
      const std::uint64_t* a = bits_.row(y);
      const std::uint64_t* b = bits_.row(y + 1);
      for (int w = 0; w < bits_.words; ++w) {
        const bool last = w + 1 == bits_.words;
        // Bit x of `right`: pixel x + 1.
        const std::uint64_t a_right = a[w] >> 1 | (last ? 0 : a[w + 1] << 63);
        const std::uint64_t b_right = b[w] >> 1 | (last ? 0 : b[w + 1] << 63);
        std::uint64_t crossed = (a[w] ^ b[w]) | (a[w] ^ a_right) | (b[w] ^ b_right);
        if (last) {
          const int squares = mask_.width() - 1 - w * 64;
          crossed &= squares <= 0 ? 0 : squares >= 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << squares) - 1;
        }
        for (; crossed != 0; crossed &= crossed - 1) square(w * 64 + std::countr_zero(crossed), y);
      }
    }
  }

 private:
  void square(int x, int y) {
    const std::uint8_t* top = mask_.row<std::uint8_t>(y) + x;
    const std::uint8_t* bottom = mask_.row<std::uint8_t>(y + 1) + x;
    const double v[4] = {top[0] - 127.5, top[1] - 127.5, bottom[1] - 127.5, bottom[0] - 127.5};  // clockwise
    // Crossings of the sides top, right, bottom, left.
    double px[4][2];
    int n = 0;
    const double cx[4] = {0, 1, 1, 0}, cy[4] = {0, 0, 1, 1};
    for (int e = 0; e < 4; ++e) {
      const int f = (e + 1) % 4;
      if ((v[e] > 0) == (v[f] > 0)) continue;
      const double t = v[e] / (v[e] - v[f]);
      px[n][0] = x + 0.5 + cx[e] + t * (cx[f] - cx[e]);
      px[n][1] = y + 0.5 + cy[e] + t * (cy[f] - cy[e]);
      ++n;
    }
    const auto segment = [&](int i, int j) { emit_(px[i][0], px[i][1], px[j][0], px[j][1]); };
    if (n == 2) segment(0, 1);
    if (n == 4) {
      // Corners 0 and 2 are joined where the bilinear surface's saddle has their sign, whichever that is.
      if (v[0] * v[2] > v[1] * v[3])
        segment(0, 1), segment(2, 3);  // corners 1 and 3 are cut off
      else
        segment(3, 0), segment(1, 2);  // corners 0 and 2 are cut off
    }
  }

  const Image& mask_;
  const BitMask& bits_;
  const std::function<void(double, double, double, double)>& emit_;
};

/// Whether the bilinear surface through the pixels' centres is above the level at a point of the picture.
bool inside(const Image& mask, const Eigen::Vector2d& px) {
  const double x = std::clamp(px.x() - 0.5, 0.0, mask.width() - 1.0);
  const double y = std::clamp(px.y() - 0.5, 0.0, mask.height() - 1.0);
  const int ix = std::min(int(x), std::max(mask.width() - 2, 0)), iy = std::min(int(y), std::max(mask.height() - 2, 0));
  const int dx = mask.width() > 1, dy = mask.height() > 1;
  const double fx = x - ix, fy = y - iy;
  const std::uint8_t* a = mask.row<std::uint8_t>(iy) + ix;
  const std::uint8_t* b = mask.row<std::uint8_t>(iy + dy) + ix;
  const double top = a[0] + fx * (a[dx] - a[0]), bottom = b[0] + fx * (b[dx] - b[0]);
  return top + fy * (bottom - top) > 127.5;
}

/// Fills the tile's cell states from its samples; returns their union.
std::uint8_t classify(Tile& tile) {
  // Bit x of each row: what sample x is.
  unsigned in[kTileSamples] = {}, out[kTileSamples] = {}, unseen[kTileSamples] = {};
  for (int y = 0; y < kTileSamples; ++y)
    for (int x = 0; x < kTileSamples; ++x) {
      const std::int16_t s = tile.samples[std::size_t(y) * kTileSamples + x];
      in[y] |= unsigned(s == -kDeep) << x;
      out[y] |= unsigned(s == kDeep) << x;
      unseen[y] |= unsigned(s == kUnseen) << x;
    }
  tile.deep_inside = tile.deep_outside = tile.not_seen = 0;
  for (int y = 0; y < kTile; ++y) {
    const auto all_four = [&](const unsigned* rows) { return std::uint64_t(rows[y] & rows[y + 1]); };
    const std::uint64_t a = all_four(in), b = all_four(out), c = unseen[y] | unseen[y + 1];
    tile.deep_inside |= (a & a >> 1 & 0xFF) << (8 * y);
    tile.deep_outside |= (b & b >> 1 & 0xFF) << (8 * y);
    tile.not_seen |= ((c | c >> 1) & 0xFF) << (8 * y);
  }
  const std::uint64_t band = ~(tile.deep_inside | tile.deep_outside | tile.not_seen);
  return std::uint8_t((tile.deep_inside ? kDeepInside : 0) | (tile.deep_outside ? kDeepOutside : 0) |
                      (tile.not_seen ? kNotSeen : 0) | (band ? kBand : 0));
}

void build_pyramid(Silhouette::Data& data, std::vector<std::uint8_t> states) {
  int width = data.tiles_x, height = data.tiles_y;
  data.pyramid.push_back(std::move(states));
  while (width > 1 || height > 1) {
    const int w = (width + 1) / 2, h = (height + 1) / 2;
    const std::vector<std::uint8_t>& fine = data.pyramid.back();
    std::vector<std::uint8_t> coarse(std::size_t(w) * h);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) coarse[std::size_t(y / 2) * w + x / 2] |= fine[std::size_t(y) * width + x];
    data.pyramid.push_back(std::move(coarse));
    width = w, height = h;
  }
}

void find_bounds(Silhouette::Data& data, const std::vector<Segment>& segments, const BitMask& bits, int width,
                 int height, const std::function<Eigen::Vector2d(double, double)>& ideal_from_pixel) {
  SilhouetteBounds& b = data.bounds;
  b.min = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  b.max = -b.min;
  const auto add = [&](const Eigen::Vector2d& p) {
    if (!p.allFinite()) return;
    b.min = b.min.cwiseMin(p);
    b.max = b.max.cwiseMax(p);
  };
  for (const Segment& s : segments) {
    add(data.origin + data.cell * Eigen::Vector2d(s.ax, s.ay));
    add(data.origin + data.cell * Eigen::Vector2d(s.bx, s.by));
  }
  const auto border = [&](int x, int y, double px, double py) {
    if (!bits.at(x, y)) return;
    b.touches_border = true;
    add(ideal_from_pixel(px, py));
  };
  for (int x = 0; x < width; ++x) border(x, 0, x + 0.5, 0), border(x, height - 1, x + 0.5, height);
  for (int y = 0; y < height; ++y) border(0, y, 0, y + 0.5), border(width - 1, y, width, y + 0.5);
  if (!(b.min.x() <= b.max.x() && b.min.y() <= b.max.y())) b = {};
}

}  // namespace

SilhouetteMaker::SilhouetteMaker(const Camera& camera, double cell_px)
    : frame_(std::make_unique<const Frame>(camera, cell_px)) {}
SilhouetteMaker::~SilhouetteMaker() = default;
SilhouetteMaker::SilhouetteMaker(SilhouetteMaker&&) noexcept = default;
SilhouetteMaker& SilhouetteMaker::operator=(SilhouetteMaker&&) noexcept = default;

Silhouette SilhouetteMaker::make(const Image& mask, double band_px) const {
  const Frame& frame = *frame_;
  if (mask.type() != PixelType::u8 || mask.channels() != 1)
    throw Error(ErrorCode::bad_input, "a mask must have one channel of 8 bits");
  if (mask.width() != frame.camera.width || mask.height() != frame.camera.height)
    throw Error(ErrorCode::bad_input, "the mask has " + std::to_string(mask.width()) + " x " +
                                          std::to_string(mask.height()) + " pixels, its camera " +
                                          std::to_string(frame.camera.width) + " x " +
                                          std::to_string(frame.camera.height));
  if (!(band_px > 0 && band_px <= 1e5))
    throw Error(ErrorCode::invalid_argument, "band_px must be positive and at most 100000");

  auto data = std::make_shared<Silhouette::Data>();
  data->cell = frame.cell;
  data->origin = frame.origin;
  data->tiles_x = frame.tiles_x;
  data->tiles_y = frame.tiles_y;
  data->seen_x0 = frame.seen_x0, data->seen_y0 = frame.seen_y0;
  data->seen_x1 = frame.seen_x1, data->seen_y1 = frame.seen_y1;
  const double cell_px = frame.cell / frame.px_ideal;
  const float band = float(std::max(band_px / cell_px, 2.0));  // cells
  data->quantum = double(band) * frame.cell / kDeep;

  const BitMask bits(mask);
  std::vector<Segment> segments;
  bool cut_off = false;
  const auto in_domain = [&](const Eigen::Vector2d& px) {
    return !frame.lens || frame.camera.distorted_from_pixel(px).squaredNorm() < frame.domain2;
  };
  const std::function<void(double, double, double, double)> emit = [&](double ax, double ay, double bx, double by) {
    if (!in_domain({ax, ay}) || !in_domain({bx, by})) {
      cut_off = true;
      return;
    }
    const Eigen::Vector2d a = frame.field_from_pixel({ax, ay}), b = frame.field_from_pixel({bx, by});
    segments.push_back({float(a.x()), float(a.y()), float(b.x()), float(b.y())});
  };
  ContourTracer(mask, bits, emit).trace();
  data->empty = std::all_of(bits.bits.begin(), bits.bits.end(), [](std::uint64_t w) { return w == 0; });
  data->full = !data->empty && segments.empty() && bits.at(0, 0);
  find_bounds(*data, segments, bits, mask.width(), mask.height(), [&](double x, double y) -> Eigen::Vector2d {
    if (!in_domain({x, y})) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    return frame.origin + frame.cell * frame.field_from_pixel({x, y});
  });

  const int samples_x = data->cells_x() + 1, samples_y = data->cells_y() + 1;
  // Tiles with a sample in the band.
  std::vector<std::uint8_t> near(std::size_t(data->tiles_x) * data->tiles_y);
  for (const Segment& s : segments) {
    // A sample on a tile's far edge belongs to the tile before it, too: hence the cell more.
    const int tx0 = std::max(int(std::floor((std::min(s.ax, s.bx) - band - 1) / kTile)), 0);
    const int tx1 = std::min(int(std::floor((std::max(s.ax, s.bx) + band + 1) / kTile)), data->tiles_x - 1);
    const int ty0 = std::max(int(std::floor((std::min(s.ay, s.by) - band - 1) / kTile)), 0);
    const int ty1 = std::min(int(std::floor((std::max(s.ay, s.by) + band + 1) / kTile)), data->tiles_y - 1);
    for (int ty = ty0; ty <= ty1; ++ty)
      for (int tx = tx0; tx <= tx1; ++tx) near[std::size_t(ty) * data->tiles_x + tx] = 1;
  }
  const DistanceBand distances(segments, band, samples_x, samples_y);

  for (const std::int16_t constant : {std::int16_t(-kDeep), kDeep, kUnseen}) {
    Tile tile{};
    tile.samples.fill(constant);
    classify(tile);
    data->tiles.push_back(tile);
  }
  const auto make_tile = [&](int tx, int ty) {
    const std::size_t t = std::size_t(ty) * data->tiles_x + tx;
    const bool all_seen = frame.seen[t] == Frame::Seen::all;
    const std::optional<bool> side =
        all_seen ? bits.uniform(frame.pixels_of_tile(tx, ty), mask.width(), mask.height()) : std::nullopt;
    Tile tile{};
    for (int y = 0; y < kTileSamples; ++y)
      for (int x = 0; x < kTileSamples; ++x) {
        const int i = tx * kTile + x, j = ty * kTile + y;
        std::int16_t& sample = tile.samples[std::size_t(y) * kTileSamples + x];
        int magnitude = kDeep;
        if (near[t])
          if (const float d2 = distances.at(i, j); d2 < band * band)
            magnitude = std::min(int(std::sqrt(d2) * (kDeep / band) + 0.5f), kDeep - 1);
        if (side) {
          sample = std::int16_t(*side ? -magnitude : magnitude);
          continue;
        }
        const Eigen::Vector2d px = frame.pixel_of_sample(i, j);
        sample = !all_seen && !frame.sees(px) ? kUnseen : std::int16_t(inside(mask, px) ? -magnitude : magnitude);
      }
    return tile;
  };
  data->directory.resize(near.size());
  std::vector<std::uint8_t> states(near.size());
  for (int ty = 0; ty < data->tiles_y; ++ty) {
    // Tiles side by side without contour are on one side of it; where the lens has cut the contour off, who knows.
    std::int32_t beside = kUnseenTile;
    for (int tx = 0; tx < data->tiles_x; ++tx) {
      const std::size_t t = std::size_t(ty) * data->tiles_x + tx;
      if (frame.seen[t] == Frame::Seen::none) {
        data->directory[t] = beside = kUnseenTile;
        states[t] = kNotSeen;
        continue;
      }
      if (!near[t] && frame.seen[t] == Frame::Seen::all) {
        if (beside == kUnseenTile || cut_off)
          beside = inside(mask, frame.pixel_of_sample(tx * kTile + kTile / 2, ty * kTile + kTile / 2)) ? kInsideTile
                                                                                                       : kOutsideTile;
        data->directory[t] = beside;
        states[t] = beside == kInsideTile ? kDeepInside : kDeepOutside;
        continue;
      }
      beside = kUnseenTile;
      Tile tile = make_tile(tx, ty);
      states[t] = classify(tile);
      if (states[t] == kDeepInside || states[t] == kDeepOutside || states[t] == kNotSeen) {
        data->directory[t] = states[t] == kDeepInside    ? kInsideTile
                             : states[t] == kDeepOutside ? kOutsideTile
                                                         : kUnseenTile;
      } else {
        data->directory[t] = std::int32_t(data->tiles.size());
        data->tiles.push_back(tile);
      }
    }
  }
  data->tiles.shrink_to_fit();
  build_pyramid(*data, std::move(states));
  return Silhouette(std::move(data));
}

Silhouette Silhouette::from_mask(const Image& mask, const Camera& camera, const SilhouetteOptions& options) {
  return SilhouetteMaker(camera, options.cell_px).make(mask, options.band_px);
}

std::optional<double> Silhouette::distance(const Eigen::Vector2d& ideal) const {
  const Eigen::Vector2d at = (ideal - data_->origin) / data_->cell;
  const double d = data_->sample(at.x(), at.y());
  if (std::isnan(d)) return std::nullopt;
  return d * data_->quantum;
}

double Silhouette::band() const { return data_->quantum * kDeep; }
bool Silhouette::is_empty() const { return data_->empty; }
bool Silhouette::is_full() const { return data_->full; }
const SilhouetteBounds& Silhouette::bounds() const { return data_->bounds; }

std::size_t Silhouette::bytes() const {
  std::size_t sum = data_->tiles.size() * sizeof(Tile) + data_->directory.size() * sizeof(std::int32_t);
  for (const auto& level : data_->pyramid) sum += level.size();
  return sum;
}

}  // namespace lumihull::hull
