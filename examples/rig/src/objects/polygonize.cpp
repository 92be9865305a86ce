#include "polygonize.h"

#include <array>
#include <cassert>
#include <cmath>
#include <unordered_map>

namespace lumihull::rig {

namespace {

using Eigen::Vector3f;
using Function = std::function<float(const Vector3f&)>;

/// The zero of f between a (f(a) < 0) and b by the Illinois variant of the false position.
Vector3f zero_between(const Function& f, Vector3f a, Vector3f b, float fa, float fb) {
  const Vector3f from = a, to = b;
  for (int i = 0; i < 6; ++i) {
    const Vector3f m = a + (b - a) * (fa / (fa - fb));
    const float fm = f(m);
    if (fm < 0) {
      a = m, fa = fm, fb *= 0.5f;
    } else {
      b = m, fb = fm, fa *= 0.5f;
    }
  }
  // Kept off the grid's points, where triangles would collapse.
  const float t = ((a + b) * 0.5f - from).norm() / (to - from).norm();
  return from + (to - from) * std::fmin(0.98f, std::fmax(0.02f, t));
}

}  // namespace

Polygons polygonize(const Function& f, const Vector3f& low, const Vector3f& high, float cell) {
  const Eigen::Vector3i n = ((high - low) / cell).array().ceil().cast<int>() + 1;
  const auto index = [&](int x, int y, int z) { return (std::uint64_t(z) * n.y() + y) * n.x() + x; };
  const auto point = [&](std::uint64_t i) {
    return Vector3f(low + cell * Vector3f(float(i % n.x()), float(i / n.x() % n.y()), float(i / n.x() / n.y())));
  };
  const std::size_t count = std::size_t(n.x()) * n.y() * n.z();
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = f(point(i));

  Polygons result;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_of_edge;
  const auto vertex = [&](std::uint64_t inside, std::uint64_t outside) {
    const std::uint64_t key = inside * count + outside;
    const auto [it, added] = vertex_of_edge.try_emplace(key, std::uint32_t(result.mesh.vertices.size()));
    if (added) {
      const Vector3f p = zero_between(f, point(inside), point(outside), values[inside], values[outside]);
      const float h = 0.25f * cell;
      const Vector3f gradient(f(p + Vector3f(h, 0, 0)) - f(p - Vector3f(h, 0, 0)),
                              f(p + Vector3f(0, h, 0)) - f(p - Vector3f(0, h, 0)),
                              f(p + Vector3f(0, 0, h)) - f(p - Vector3f(0, 0, h)));
      result.mesh.vertices.push_back(p);
      result.normals.push_back(gradient.normalized());
    }
    return it->second;
  };

  // Kuhn: the six paths from corner 000 to corner 111 along the axes; odd permutations are mirrored.
  constexpr int kPaths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (int z = 0; z + 1 < n.z(); ++z)
    for (int y = 0; y + 1 < n.y(); ++y)
      for (int x = 0; x + 1 < n.x(); ++x) {
        int inside_corners = 0;
        for (int c = 0; c < 8; ++c) inside_corners += values[index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))] < 0;
        if (inside_corners == 0 || inside_corners == 8) continue;
        for (int path = 0; path < 6; ++path) {
          std::array<std::uint64_t, 4> corner;
          Eigen::Vector3i at(x, y, z);
          corner[0] = index(at.x(), at.y(), at.z());
          for (int k = 0; k < 3; ++k) {
            ++at[kPaths[path][k]];
            corner[std::size_t(k) + 1] = index(at.x(), at.y(), at.z());
          }
          if (path >= 3) std::swap(corner[2], corner[3]);  // now all six have one orientation
          std::array<int, 4> in{}, out{};
          int ins = 0, outs = 0;
          for (int k = 0; k < 4; ++k) (values[corner[std::size_t(k)]] < 0 ? in[ins++] : out[outs++]) = k;
          const auto cut = [&](int i, int o) { return vertex(corner[std::size_t(i)], corner[std::size_t(o)]); };
          // Parity of the permutation (first, then the rest) decides which way round the polygon goes.
          const auto even = [](int a, int b, int c, int d) {
            int inversions = (a > b) + (a > c) + (a > d) + (b > c) + (b > d) + (c > d);
            return inversions % 2 == 0;
          };
          const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, bool keep) {
            result.mesh.triangles.push_back(keep ? std::array{a, b, c} : std::array{a, c, b});
          };
          if (ins == 1) {
            add(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2]), even(in[0], out[0], out[1], out[2]));
          } else if (ins == 3) {
            add(cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0]), !even(out[0], in[0], in[1], in[2]));
          } else if (ins == 2) {
            const bool keep = even(in[0], in[1], out[0], out[1]);
            const auto a = cut(in[0], out[0]), b = cut(in[0], out[1]), c = cut(in[1], out[1]), d = cut(in[1], out[0]);
            add(a, b, c, keep);
            add(a, c, d, keep);
          }
        }
      }
  return result;
}

}  // namespace lumihull::rig
