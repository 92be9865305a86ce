// The zero level set of a sampled field. Every block owns the grid edges that begin at its nodes, and the cells whose
// first node is one of its; a vertex is found from any cell by its edge's owner and its rank among the owner's crossed
// edges, so that nothing is hashed or welded.

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/hull/carve.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "field_data.h"
#include "marching_cubes_table.h"

namespace lumihull::hull {
namespace {

constexpr int kNodes = kBlock + 1;  // along a side of the nodes that a block's cells touch
// Vertices stay away from the grid's nodes by this share of a voxel: no triangle collapses.
constexpr float kNearestNode = 0.01f;

/// A block with crossed edges or cells that the surface passes.
struct Active {
  std::size_t at;                        // directory index
  std::array<std::uint64_t, 3> crossed;  // owned edges along x, y, z; bit x + 4 y + 16 z of the lower node
  std::uint64_t cells;                   // those with triangles
  std::uint32_t first_vertex, first_triangle;
  std::uint32_t vertices, triangles;
};

/// A block's nodes and the next ones of its neighbours.
class Window {
 public:
  Window(const Field::Data& data, int bx, int by, int bz) : data_(data) {
    for (int i = 0; i < 8; ++i) {
      const int x = bx + (i & 1), y = by + (i >> 1 & 1), z = bz + (i >> 2);
      const bool in = x < data.blocks[0] && y < data.blocks[1] && z < data.blocks[2];
      entries_[std::size_t(i)] = in ? data.directory[data.index(x, y, z)] : kOutsideBlock;
    }
  }

  bool uniform() const {
    for (const std::int32_t e : entries_)
      if (e >= 0 || e != entries_[0]) return false;
    return true;
  }

  /// Of node (x, y, z), 0 … 4 each.
  bool inside(int x, int y, int z) const {
    const std::int32_t e = entries_[std::size_t(x / kBlock + 2 * (y / kBlock) + 4 * (z / kBlock))];
    if (e < 0) return e == kInsideBlock;
    return data_.leaves[std::size_t(e)].inside >> local(x, y, z) & 1;
  }
  float phi(int x, int y, int z) const {
    const std::int32_t e = entries_[std::size_t(x / kBlock + 2 * (y / kBlock) + 4 * (z / kBlock))];
    if (e < 0) return e == kInsideBlock ? -INFINITY : INFINITY;
    return data_.leaves[std::size_t(e)].phi[local(x, y, z)];
  }
  static std::size_t local(int x, int y, int z) {
    return std::size_t(x % kBlock + kBlock * (y % kBlock) + kBlock * kBlock * (z % kBlock));
  }

 private:
  const Field::Data& data_;
  std::array<std::int32_t, 8> entries_;
};

/// Signs of a window's nodes, and its cells' cases.
struct Signs {
  explicit Signs(const Window& w) {
    for (int z = 0; z < kNodes; ++z)
      for (int y = 0; y < kNodes; ++y)
        for (int x = 0; x < kNodes; ++x) in[z][y][x] = w.inside(x, y, z);
  }
  int cube(int x, int y, int z) const {
    int bits = 0;
    for (int c = 0; c < 8; ++c) bits |= int(in[z + (c >> 2)][y + (c >> 1 & 1)][x + (c & 1)]) << c;
    return bits;
  }
  bool in[kNodes][kNodes][kNodes];
};

class Surface {
 public:
  Surface(const Field::Data& data, Job& job) : data_(data), job_(job) {}

  Mesh extract() {
    find_active();
    count();
    Mesh mesh;
    mesh.vertices.resize(vertices_);
    mesh.triangles.resize(triangles_);
    parallel_chunks(job_, active_.size(), 256, [&](std::size_t first, std::size_t last) {
      for (std::size_t a = first; a < last; ++a) emit(active_[a], mesh);
    });
    return mesh;
  }

 private:
  void find_active() {
    std::vector<std::vector<Active>> layers(std::size_t(data_.blocks[2]));
    parallel_for(job_, layers.size(), [&](std::size_t layer) {
      for (int y = 0; y < data_.blocks[1]; ++y)
        for (int x = 0; x < data_.blocks[0]; ++x) {
          const Window window(data_, x, y, int(layer));
          if (window.uniform()) continue;
          Active a = examine(window);
          a.at = data_.index(x, y, int(layer));
          if (a.vertices > 0 || a.cells != 0) layers[layer].push_back(a);
        }
    });
    std::size_t n = 0;
    for (const auto& l : layers) n += l.size();
    active_.reserve(n);
    for (auto& l : layers) {
      active_.insert(active_.end(), l.begin(), l.end());
      l = {};
    }
  }

  static Active examine(const Window& window) {
    Active a{};
    const Signs signs(window);
    for (int z = 0; z < kBlock; ++z)
      for (int y = 0; y < kBlock; ++y)
        for (int x = 0; x < kBlock; ++x) {
          const std::uint64_t bit = std::uint64_t(1) << Window::local(x, y, z);
          const bool in = signs.in[z][y][x];
          if (in != signs.in[z][y][x + 1]) a.crossed[0] |= bit;
          if (in != signs.in[z][y + 1][x]) a.crossed[1] |= bit;
          if (in != signs.in[z + 1][y][x]) a.crossed[2] |= bit;
          if (const unsigned n = cube_table().cases[std::size_t(signs.cube(x, y, z))].triangles) {
            a.cells |= bit;
            a.triangles += n;
          }
        }
    for (const std::uint64_t mask : a.crossed) a.vertices += unsigned(std::popcount(mask));
    return a;
  }

  void count() {
    of_leaf_.assign(data_.leaves.size(), kNone);
    for (std::size_t a = 0; a < active_.size(); ++a) {
      active_[a].first_vertex = std::uint32_t(vertices_);
      active_[a].first_triangle = std::uint32_t(triangles_);
      vertices_ += active_[a].vertices;
      triangles_ += active_[a].triangles;
      const std::int32_t entry = data_.directory[active_[a].at];
      if (entry >= 0) of_leaf_[std::size_t(entry)] = std::uint32_t(a);
    }
    if (vertices_ >= (std::size_t(1) << 31) || triangles_ >= (std::size_t(1) << 31))
      throw Error(ErrorCode::out_of_memory,
                  "the surface has more than 2^31 vertices or triangles; lower the resolution");
  }

  /// The active block at a directory index; it is there where one of its edges is crossed.
  const Active& active_at(std::size_t at) const {
    const std::int32_t entry = data_.directory[at];
    if (entry >= 0) return active_[of_leaf_[std::size_t(entry)]];
    return *std::lower_bound(active_.begin(), active_.end(), at,
                             [](const Active& a, std::size_t index) { return a.at < index; });
  }

  static std::uint32_t vertex_of(const Active& owner, std::size_t local, std::size_t axis) {
    std::uint32_t id = owner.first_vertex;
    for (std::size_t i = 0; i < axis; ++i) id += std::uint32_t(std::popcount(owner.crossed[i]));
    return id + std::uint32_t(std::popcount(owner.crossed[axis] & ((std::uint64_t(1) << local) - 1)));
  }

  void emit(const Active& active, Mesh& mesh) const {
    const std::size_t row = std::size_t(data_.blocks[0]), slab = row * std::size_t(data_.blocks[1]);
    const int bx = int(active.at % row), by = int(active.at / row % std::size_t(data_.blocks[1]));
    const int bz = int(active.at / slab);
    const Window window(data_, bx, by, bz);
    std::uint32_t vertex = active.first_vertex;
    for (int axis = 0; axis < 3; ++axis)
      for (std::uint64_t left = active.crossed[std::size_t(axis)]; left != 0; left &= left - 1) {
        const int s = std::countr_zero(left), x = s % 4, y = s / 4 % 4, z = s / 16;
        const float a = window.phi(x, y, z), b = window.phi(x + (axis == 0), y + (axis == 1), z + (axis == 2));
        // At the region's faces, and where pictures end, a value is only a sign: half way.
        const float t = std::isfinite(a) && std::isfinite(b) ? a / (a - b) : 0.5f;
        Eigen::Vector3d p = data_.grid.sample(bx * kBlock + x - 1, by * kBlock + y - 1, bz * kBlock + z - 1);
        p[axis] += data_.grid.voxel * double(std::clamp(t, kNearestNode, 1 - kNearestNode));
        mesh.vertices[vertex++] = p.cast<float>();
      }
    if (active.cells == 0) return;
    const Signs signs(window);
    const CubeTable& table = cube_table();
    std::array<const Active*, 8> owners{};
    std::uint32_t triangle = active.first_triangle;
    for (std::uint64_t left = active.cells; left != 0; left &= left - 1) {
      const int s = std::countr_zero(left), x = s % 4, y = s / 4 % 4, z = s / 16;
      const CubeCase& cube = table.cases[std::size_t(signs.cube(x, y, z))];
      for (unsigned t = 0; t < cube.triangles; ++t)
        for (std::size_t corner = 0; corner < 3; ++corner) {
          const CubeEdge e = table.edges[cube.edges[t][corner]];
          const int ex = x + (e.corner & 1), ey = y + (e.corner >> 1 & 1), ez = z + (e.corner >> 2);
          const std::size_t which = std::size_t(ex / kBlock + 2 * (ey / kBlock) + 4 * (ez / kBlock));
          if (!owners[which])
            owners[which] = &active_at(data_.index(bx + ex / kBlock, by + ey / kBlock, bz + ez / kBlock));
          mesh.triangles[triangle + t][corner] = vertex_of(*owners[which], Window::local(ex, ey, ez), e.axis);
        }
      triangle += cube.triangles;
    }
  }

  static constexpr std::uint32_t kNone = ~std::uint32_t(0);
  const Field::Data& data_;
  Job& job_;
  std::vector<Active> active_;          // by directory index
  std::vector<std::uint32_t> of_leaf_;  // active block of a leaf
  std::size_t vertices_ = 0, triangles_ = 0;
};

}  // namespace

Mesh extract_surface(const Field& field, Job& job) { return Surface(field.data(), job).extract(); }

}  // namespace lumihull::hull
