// The enclosure's colours from photographs that show the object, without cameras.
//
// Assumptions: the enclosure surrounds the object in most photographs, changes its colour gradually except at edges of
// its own, and its colours are seen at the border of many photographs or are reached from such colours without a step.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/background.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace lumihull::calib {
namespace {

constexpr std::size_t kCells = std::size_t(1) << 15;  // cells of 8 x 8 x 8 colours
constexpr int kStep = 5;                              // largest step between neighbouring smoothed pixels, 8-bit values

std::uint16_t cell(const std::uint8_t* p) { return std::uint16_t((p[0] >> 3) << 10 | (p[1] >> 3) << 5 | p[2] >> 3); }

struct Photo {
  Image sharp, smooth;
  Frame frame;
  std::vector<std::uint8_t> flooded;  ///< 1: reached from the border
};

Image smoothed(const Image& in) {
  Image out(in.width(), in.height(), 3);
  for (int y = 0; y < in.height(); ++y)
    for (int x = 0; x < in.width(); ++x) {
      int sum[3] = {}, n = 0;
      for (int v = std::max(0, y - 1); v <= std::min(in.height() - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(in.width() - 1, x + 1); ++u, ++n)
          for (int c = 0; c < 3; ++c) sum[c] += in.row<std::uint8_t>(v)[3 * u + c];
      for (int c = 0; c < 3; ++c) out.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t((sum[c] + n / 2) / n);
    }
  return out;
}

bool in_ring(const Frame& f, int x, int y) {
  const int ring = std::max(2, std::min(f.x1 - f.x0, f.y1 - f.y0) / 64);
  return x < f.x0 + ring || x >= f.x1 - ring || y < f.y0 + ring || y >= f.y1 - ring;
}

/// Everything that is reached from the ring at the border through accepted colours and small steps.
void flood(Photo& photo, const std::vector<std::uint8_t>& accepted) {
  const int width = photo.sharp.width();
  const Frame& f = photo.frame;
  photo.flooded.assign(std::size_t(width) * std::size_t(photo.sharp.height()), 0);
  std::vector<std::pair<int, int>> open;
  const auto reach = [&](int x, int y) {
    photo.flooded[std::size_t(y) * std::size_t(width) + std::size_t(x)] = 1;
    open.emplace_back(x, y);
  };
  for (int y = f.y0; y < f.y1; ++y)
    for (int x = f.x0; x < f.x1; ++x)
      if (in_ring(f, x, y) && accepted[cell(photo.smooth.row<std::uint8_t>(y) + 3 * x)]) reach(x, y);
  while (!open.empty()) {
    const auto [x, y] = open.back();
    open.pop_back();
    const std::uint8_t* here = photo.smooth.row<std::uint8_t>(y) + 3 * x;
    constexpr int kSides[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    for (const auto& side : kSides) {
      const int u = x + side[0], v = y + side[1];
      if (u < f.x0 || u >= f.x1 || v < f.y0 || v >= f.y1) continue;
      if (photo.flooded[std::size_t(v) * std::size_t(width) + std::size_t(u)]) continue;
      const std::uint8_t* there = photo.smooth.row<std::uint8_t>(v) + 3 * u;
      int step = 0;
      for (int c = 0; c < 3; ++c) step = std::max(step, std::abs(int(here[c]) - int(there[c])));
      if (step <= kStep || accepted[cell(there)]) reach(u, v);
    }
  }
}

}  // namespace

std::vector<ColorCount> background_of_photos(std::size_t photos, const std::function<Image(std::size_t)>& read,
                                             Job& job) {
  if (photos == 0) throw Error(ErrorCode::invalid_argument, "expected photographs", "background");
  // Evenly spread photographs are enough; memory stays bounded.
  const std::size_t used = std::min<std::size_t>(photos, 64);
  std::vector<Photo> set(used);
  parallel_for(job, used, [&](std::size_t i) {
    set[i].sharp = read(i * photos / used);
    set[i].smooth = smoothed(set[i].sharp);
    set[i].frame = find_frame(set[i].sharp);
  });

  // Colours that stand at the border of at least a quarter of the photographs.
  std::vector<std::uint32_t> photos_with(kCells, 0);
  for (const Photo& p : set) {
    std::vector<std::uint32_t> seen(kCells, 0);
    std::uint32_t ring = 0;
    for (int y = p.frame.y0; y < p.frame.y1; ++y)
      for (int x = p.frame.x0; x < p.frame.x1; ++x)
        if (in_ring(p.frame, x, y)) ++seen[cell(p.smooth.row<std::uint8_t>(y) + 3 * x)], ++ring;
    for (std::size_t i = 0; i < kCells; ++i) photos_with[i] += seen[i] > ring / 2000;
  }
  std::vector<std::uint8_t> accepted(kCells, 0);
  for (std::size_t i = 0; i < kCells; ++i) accepted[i] = 4 * photos_with[i] >= used;

  ColorHistogram histogram;
  for (int round = 0; round < 3; ++round) {
    parallel_for(job, used, [&](std::size_t i) { flood(set[i], accepted); });
    // A colour is the enclosure's where nearly all of its pixels are reached from the border, in several photographs.
    std::vector<std::uint64_t> reached(kCells, 0), all(kCells, 0);
    std::vector<std::uint32_t> in_photos(kCells, 0);
    for (const Photo& p : set) {
      std::vector<std::uint8_t> here(kCells, 0);
      for (int y = p.frame.y0; y < p.frame.y1; ++y)
        for (int x = p.frame.x0; x < p.frame.x1; ++x) {
          const std::uint16_t c = cell(p.smooth.row<std::uint8_t>(y) + 3 * x);
          ++all[c];
          if (p.flooded[std::size_t(y) * std::size_t(p.sharp.width()) + std::size_t(x)]) ++reached[c], here[c] = 1;
        }
      for (std::size_t i = 0; i < kCells; ++i) in_photos[i] += here[i];
    }
    for (std::size_t i = 0; i < kCells; ++i)
      accepted[i] = all[i] > 0 && 10 * reached[i] >= 8 * all[i] && 8 * in_photos[i] >= used;
  }
  for (const Photo& p : set)
    for (int y = p.frame.y0; y < p.frame.y1; ++y)
      for (int x = p.frame.x0; x < p.frame.x1; ++x) {
        if (!p.flooded[std::size_t(y) * std::size_t(p.sharp.width()) + std::size_t(x)]) continue;
        if (!accepted[cell(p.smooth.row<std::uint8_t>(y) + 3 * x)]) continue;
        const std::uint8_t* c = p.sharp.row<std::uint8_t>(y) + 3 * x;
        histogram.add({c[0], c[1], c[2]});
      }
  std::vector<ColorCount> counts = histogram.counts();
  if (counts.empty())
    throw Error(ErrorCode::degenerate,
                "no colour stands at the border of a quarter of the photographs: give photographs of the empty "
                "enclosure or regions of background",
                "background");
  return counts;
}

}  // namespace lumihull::calib
