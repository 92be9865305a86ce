#include "rings.h"

#include <lumihull/base/error.h>
#include <lumihull/slf/light_field.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace lumihull::slf {
namespace {

constexpr float kLeastShare = 0.05f;  // that a texel has in rings which are read, or are to be continued, there

/// A triangle that reads a texel which shows another one.
struct Reader {
  std::uint32_t texel;
  float distance2;  // from the triangle to the texel's centre
  std::uint32_t triangle;
};

std::vector<Reader> readers_of(const Atlas& atlas) {
  constexpr std::uint32_t kNone = ~std::uint32_t(0);
  std::vector<std::uint32_t> at(std::size_t(atlas.width) * std::size_t(atlas.height), kNone);
  for (std::uint32_t i = 0; i < atlas.texels.size(); ++i)
    at[std::size_t(atlas.texels[i].y) * std::size_t(atlas.width) + atlas.texels[i].x] = i;
  std::vector<Reader> readers;
  for (std::uint32_t t = 0; t < atlas.uv.size(); ++t) {
    const auto& p = atlas.uv[t];
    if (p[0] == p[1] && p[1] == p[2]) continue;  // without area
    const Eigen::Vector2f low = p[0].cwiseMin(p[1]).cwiseMin(p[2]), high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    const auto from = [](float x) { return std::max(0, int(std::ceil(x - kTexelReach - 0.5f))); };
    const auto to = [](float x, int size) { return std::min(size - 1, int(std::floor(x + kTexelReach - 0.5f))); };
    for (int y = from(low.y()); y <= to(high.y(), atlas.height); ++y)
      for (int x = from(low.x()); x <= to(high.x(), atlas.width); ++x) {
        const std::uint32_t texel = at[std::size_t(y) * std::size_t(atlas.width) + std::size_t(x)];
        if (texel == kNone || atlas.texels[texel].triangle == t) continue;
        const float d2 = nearest_in_triangle(p, {float(x) + 0.5f, float(y) + 0.5f}).distance2;
        if (d2 <= kTexelReach * kTexelReach) readers.push_back({texel, d2, t});
      }
  }
  std::sort(readers.begin(), readers.end(), [](const Reader& a, const Reader& b) {
    return std::tie(a.texel, a.distance2, a.triangle) < std::tie(b.texel, b.distance2, b.triangle);
  });
  return readers;
}

}  // namespace

std::vector<std::uint8_t> slots_of(const hull::Mesh& mesh) {
  const std::size_t vertices = mesh.vertices.size();
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      if (a != b) edges.emplace_back(a, b), edges.emplace_back(b, a);
    }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::vector<std::size_t> first(vertices + 1, 0);
  for (const auto& e : edges) ++first[e.first + 1];
  for (std::size_t v = 0; v < vertices; ++v) first[v + 1] += first[v];

  std::vector<std::uint32_t> order(vertices);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return first[a + 1] - first[a] > first[b + 1] - first[b]; });
  constexpr std::uint8_t kNotYet = 255;
  std::vector<std::uint8_t> slot(vertices, kNotYet);
  for (const std::uint32_t v : order) {
    std::uint32_t used = 0;
    for (std::size_t i = first[v]; i < first[v + 1]; ++i)
      if (const std::uint8_t s = slot[edges[i].second]; s != kNotYet) used |= std::uint32_t(1) << s;
    const int free = std::countr_one(used);
    if (free >= kMaxSlots)
      throw Error(ErrorCode::unsupported,
                  "vertex " + std::to_string(v) + " of the mesh has neighbours in all " + std::to_string(kMaxSlots) +
                      " pictures that surface maps are spread over: use the method \"joint\" or another mesh");
    slot[v] = std::uint8_t(free);
  }
  return slot;
}

Rings make_rings(const hull::Mesh& mesh, const Atlas& atlas, std::vector<std::uint8_t> slot) {
  struct Part {
    std::uint32_t vertex, texel;
    float share;
    int corner;  // of the texel's own triangle, or -1
  };
  Rings rings;
  rings.slot = std::move(slot);
  const std::vector<Reader> readers = readers_of(atlas);
  std::vector<Part> parts;
  parts.reserve(atlas.texels.size() * 3 + readers.size());
  auto reader = readers.begin();
  for (std::uint32_t i = 0; i < atlas.texels.size(); ++i) {
    const Texel& texel = atlas.texels[i];
    const auto& t = mesh.triangles[texel.triangle];
    const std::array<float, 3> own{1 - texel.b1 - texel.b2, texel.b1, texel.b2};
    std::uint32_t taken = 0;  // slots, as bits
    for (int j = 0; j < 3; ++j) {
      parts.push_back({t[j], i, std::clamp(own[std::size_t(j)], kLeastShare, 1.0f), j});
      taken |= std::uint32_t(1) << rings.slot[t[j]];
    }
    // Where several triangles read the texel, the nearest ones' corners come first.
    for (; reader != readers.end() && reader->texel == i; ++reader)
      for (const std::uint32_t v : mesh.triangles[reader->triangle]) {
        const std::uint32_t bit = std::uint32_t(1) << rings.slot[v];
        if (taken & bit) continue;
        parts.push_back({v, i, kLeastShare, -1});
        taken |= bit;
      }
  }

  rings.first.assign(mesh.vertices.size() + 1, 0);
  for (const Part& p : parts) ++rings.first[p.vertex + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) rings.first[v + 1] += rings.first[v];
  rings.texels.resize(parts.size());
  rings.of_texel.resize(atlas.texels.size());
  std::vector<std::uint32_t> next(rings.first.begin(), rings.first.end() - 1);
  for (const Part& p : parts) {
    const std::uint32_t at = next[p.vertex]++;
    rings.texels[at] = {p.texel, p.share};
    if (p.corner >= 0) rings.of_texel[p.texel][p.corner] = at;
  }
  return rings;
}

}  // namespace lumihull::slf
