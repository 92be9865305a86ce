#include "surface_fill.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "color.h"

namespace lumihull::slf {
namespace {

constexpr int kSmoothing = 40;     // sweeps over the vertices without colour
constexpr float kTrusted = 1e-4f;  // a sum of weights far below that of one ordinary view gives way to its surroundings

void add(BlendColor& sum, const BlendColor& c, float w) {
  sum.r += w * c.r, sum.g += w * c.g, sum.b += w * c.b, sum.weight += w;
}

BlendColor mean(const BlendColor& sum) { return {sum.r / sum.weight, sum.g / sum.weight, sum.b / sum.weight, 1}; }

struct Adjacency {
  std::vector<std::uint32_t> first, neighbour;  // neighbours of v: neighbour[first[v]] … neighbour[first[v + 1] - 1]
};

Adjacency adjacency_of(const hull::Mesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(mesh.triangles.size() * 6);
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) edges.push_back({t[i], t[(i + 1) % 3]}), edges.push_back({t[(i + 1) % 3], t[i]});
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  Adjacency adjacency;
  adjacency.first.assign(mesh.vertices.size() + 1, 0);
  for (const auto& e : edges) ++adjacency.first[e.first + 1], adjacency.neighbour.push_back(e.second);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) adjacency.first[v + 1] += adjacency.first[v];
  return adjacency;
}

/// Spreads the colours of vertices with weight > 0 to all the others.
void spread(const hull::Mesh& mesh, std::vector<BlendColor>& vertices) {
  const Adjacency adjacency = adjacency_of(mesh);
  std::vector<std::uint32_t> unknown;  // in the order in which the colour reaches them
  std::vector<std::uint32_t> front;
  BlendColor all;
  for (std::uint32_t v = 0; v < vertices.size(); ++v)
    if (vertices[v].weight > 0) front.push_back(v), add(all, vertices[v], 1);
  const BlendColor fallback = all.weight > 0 ? mean(all) : BlendColor{0.2f, 0.2f, 0.2f, 1};
  const auto mean_around = [&](std::uint32_t v, BlendColor& out) {
    BlendColor sum;
    for (std::uint32_t k = adjacency.first[v]; k < adjacency.first[v + 1]; ++k) {
      const BlendColor& c = vertices[adjacency.neighbour[k]];
      if (c.weight > 0) add(sum, c, 1);
    }
    if (sum.weight > 0) out = mean(sum);
  };
  while (!front.empty()) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t v : front)
      for (std::uint32_t k = adjacency.first[v]; k < adjacency.first[v + 1]; ++k)
        if (!(vertices[adjacency.neighbour[k]].weight > 0)) next.push_back(adjacency.neighbour[k]);
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    std::vector<BlendColor> colors(next.size());
    for (std::size_t i = 0; i < next.size(); ++i) mean_around(next[i], colors[i]);
    for (std::size_t i = 0; i < next.size(); ++i) vertices[next[i]] = colors[i];
    unknown.insert(unknown.end(), next.begin(), next.end());
    front = std::move(next);
  }
  for (int sweep = 0; sweep < kSmoothing; ++sweep)
    for (const std::uint32_t v : unknown) mean_around(v, vertices[v]);
  for (BlendColor& c : vertices)
    if (!(c.weight > 0)) c = fallback;
}

}  // namespace

std::size_t fill_surface(const hull::Mesh& mesh, const Atlas& atlas, std::vector<BlendColor>& texels) {
  std::vector<BlendColor> vertices(mesh.vertices.size());
  const auto shares = [&](const Texel& t) { return std::array<float, 3>{1 - t.b1 - t.b2, t.b1, t.b2}; };
  for (std::size_t i = 0; i < texels.size(); ++i) {
    if (!(texels[i].weight > kTrusted)) continue;
    const BlendColor c = mean(texels[i]);
    const auto b = shares(atlas.texels[i]);
    for (int k = 0; k < 3; ++k) add(vertices[mesh.triangles[atlas.texels[i].triangle][k]], c, b[k]);
  }
  for (BlendColor& c : vertices)
    if (c.weight > 0) c = mean(c);
  spread(mesh, vertices);

  std::size_t filled = 0;
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const auto b = shares(atlas.texels[i]);
    BlendColor around;
    for (int k = 0; k < 3; ++k) add(around, vertices[mesh.triangles[atlas.texels[i].triangle][k]], b[k]);
    filled += !(texels[i].weight > kTrusted);
    add(texels[i], mean(around), texels[i].weight > kTrusted ? 0.01f * kTrusted : kTrusted);
    texels[i] = mean(texels[i]);
  }
  return filled;
}

Image texture_picture(const Atlas& atlas, const std::vector<BlendColor>& texels) {
  struct Level {
    int width, height;
    std::vector<BlendColor> cells;
  };
  std::vector<Level> levels;
  levels.push_back({atlas.width, atlas.height, {}});
  levels[0].cells.resize(std::size_t(atlas.width) * atlas.height);
  for (std::size_t i = 0; i < texels.size(); ++i)
    levels[0].cells[std::size_t(atlas.texels[i].y) * atlas.width + atlas.texels[i].x] = texels[i];
  while (levels.back().width > 1 || levels.back().height > 1) {
    const Level& fine = levels.back();
    Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
    coarse.cells.resize(std::size_t(coarse.width) * coarse.height);
    for (int y = 0; y < fine.height; ++y)
      for (int x = 0; x < fine.width; ++x) {
        const BlendColor& c = fine.cells[std::size_t(y) * fine.width + x];
        if (c.weight > 0) add(coarse.cells[std::size_t(y / 2) * coarse.width + x / 2], c, 1);
      }
    for (BlendColor& c : coarse.cells)
      if (c.weight > 0) c = mean(c);
    levels.push_back(std::move(coarse));
  }
  for (std::size_t l = levels.size() - 1; l-- > 0;) {
    Level& fine = levels[l];
    const Level& coarse = levels[l + 1];
    for (int y = 0; y < fine.height; ++y)
      for (int x = 0; x < fine.width; ++x) {
        BlendColor& c = fine.cells[std::size_t(y) * fine.width + x];
        if (!(c.weight > 0)) c = coarse.cells[std::size_t(y / 2) * coarse.width + x / 2];
      }
  }
  Image picture(atlas.width, atlas.height, 3);
  for (int y = 0; y < atlas.height; ++y) {
    std::uint8_t* out = picture.row<std::uint8_t>(y);
    for (int x = 0; x < atlas.width; ++x) {
      const BlendColor& c = levels[0].cells[std::size_t(y) * atlas.width + x];
      out[3 * x] = srgb8_of_unit(c.r), out[3 * x + 1] = srgb8_of_unit(c.g), out[3 * x + 2] = srgb8_of_unit(c.b);
    }
  }
  return picture;
}

}  // namespace lumihull::slf
