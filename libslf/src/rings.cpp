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

/// Who has which share of one texel: a vertex a slot at most.
struct Shares {
  std::array<std::uint32_t, std::size_t(kMaxSlots)> vertex;
  std::array<float, std::size_t(kMaxSlots)> share;
  std::uint32_t taken = 0;                             // slots, as bits
  std::vector<std::array<std::uint8_t, 3>> triangles;  // slots of the corners of those that read the texel

  void clear() {
    taken = 0;
    triangles.clear();
  }
  bool has(std::uint8_t slot) const { return taken >> slot & 1; }
  void set(std::uint8_t slot, std::uint32_t v, float s) {
    taken |= std::uint32_t(1) << slot;
    vertex[slot] = v, share[slot] = s;
  }
};

/// Corners of a triangle whose slots are free get, in equal parts, what its slots lack to a sum of 1.
void complete(const std::array<std::uint32_t, 3>& corners, const std::array<std::uint8_t, 3>& slots, Shares& shares) {
  float lacking = 1;
  int free = 0;
  for (const std::uint8_t s : slots) {
    if (shares.has(s))
      lacking -= shares.share[s];
    else
      ++free;
  }
  for (int j = 0; j < 3; ++j)
    if (!shares.has(slots[j])) shares.set(slots[j], corners[j], std::max(0.0f, lacking / float(free)));
  shares.triangles.push_back(slots);
}

/// Moves shares by as little as it takes that the slots of every triangle sum to 1: next to a vertex its neighbours'
/// shares can't all be what they are in the texel's own triangle. Cyclic projections (Kaczmarz 1937) onto the sums,
/// none below 0; thirds fulfil all of them, so there is an answer.
void balance(Shares& shares) {
  constexpr int kRounds = 200;
  constexpr float kGoodEnough = 2e-4f;
  float worst = 1;
  for (int round = 0; round < kRounds && worst > kGoodEnough; ++round) {
    worst = 0;
    for (const auto& [a, b, c] : shares.triangles) {
      const float lacking = 1 - (shares.share[a] + shares.share[b] + shares.share[c]);
      worst = std::max(worst, std::abs(lacking));
      for (const std::uint8_t s : {a, b, c}) shares.share[s] = std::max(0.0f, shares.share[s] + lacking / 3);
    }
  }
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
  Shares shares;
  auto reader = readers.begin();
  for (std::uint32_t i = 0; i < atlas.texels.size(); ++i) {
    const Texel& texel = atlas.texels[i];
    const auto& t = mesh.triangles[texel.triangle];
    const std::array<float, 3> own{1 - texel.b1 - texel.b2, texel.b1, texel.b2};
    const auto slots_of_corners = [&](const std::array<std::uint32_t, 3>& corners) {
      return std::array{rings.slot[corners[0]], rings.slot[corners[1]], rings.slot[corners[2]]};
    };
    shares.clear();
    for (int j = 0; j < 3; ++j) shares.set(rings.slot[t[j]], t[j], own[j]);
    shares.triangles.push_back(slots_of_corners(t));
    for (; reader != readers.end() && reader->texel == i; ++reader) {
      const auto& corners = mesh.triangles[reader->triangle];
      complete(corners, slots_of_corners(corners), shares);
    }
    if (shares.triangles.size() > 1) balance(shares);
    for (std::uint32_t left = shares.taken; left; left &= left - 1) {
      const auto s = std::size_t(std::countr_zero(left));
      if (!(shares.share[s] > 0)) continue;
      const auto corner = std::find(t.begin(), t.end(), shares.vertex[s]);
      parts.push_back(
          {shares.vertex[s], i, std::min(shares.share[s], 1.0f), corner == t.end() ? -1 : int(corner - t.begin())});
    }
  }

  rings.first.assign(mesh.vertices.size() + 1, 0);
  for (const Part& p : parts) ++rings.first[p.vertex + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) rings.first[v + 1] += rings.first[v];
  rings.texels.resize(parts.size());
  rings.of_texel.assign(atlas.texels.size(), {kNoShare, kNoShare, kNoShare});
  std::vector<std::uint32_t> next(rings.first.begin(), rings.first.end() - 1);
  for (const Part& p : parts) {
    const std::uint32_t at = next[p.vertex]++;
    rings.texels[at] = {p.texel, p.share};
    if (p.corner >= 0) rings.of_texel[p.texel][p.corner] = at;
  }
  return rings;
}

}  // namespace lumihull::slf
