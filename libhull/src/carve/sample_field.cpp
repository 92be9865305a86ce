// The octree that samples φ: blocks are discarded, accepted or split, each with the views that can still matter in it.
//
// A view is done with in a block where its field is beyond the band all over the block's projection: inside it can't
// be the maximum next to the surface, outside it carves the whole block. Otherwise it stays in the block's list. What
// is left at 4 x 4 x 4 samples is evaluated in single precision; where that can't tell the sign (|φ| below the rounding
// error) it is evaluated again in double precision. So every sign is that of HullFunction.

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "block_kernel.h"
#include "field_data.h"

namespace lumihull::hull {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kPartly = 0x80000000u;    // in a list: the view doesn't see all of the block
constexpr std::uint32_t kOnlySees = 0x40000000u;  // while classifying: it matters only for the count of seeing views
constexpr std::uint32_t kIndex = 0x3FFFFFFFu;

/// A cube of nodes and what its parents know of it.
struct Block {
  int x = 0, y = 0, z = 0, size = 0;  // first node, nodes along the side
  int deep_outside = 0;               // views that carve all of it
  int seen = 0;                       // views that see all of it, among those that are done with
  bool cuts = false;                  // the rule's cuts may matter
};

enum class Verdict { outside, inside, split };

using List = std::vector<std::uint32_t>;

class Sampler {
 public:
  Sampler(const HullFunction::Impl& function, const Grid& grid) : function_(function), grid_(grid) {
    views_.reserve(function.views.size());
    for (const ProjectedView& v : function.views) views_.emplace_back(v, grid.voxel);
  }

  const Grid& grid() const { return grid_; }
  std::size_t views() const { return views_.size(); }
  bool has_cuts() const { return !function_.rule.cut_planes.empty() || !function_.rule.cut_boxes.empty(); }

  /// Judges a block; `block` takes what is now known of it, `out` the views that still matter.
  Verdict classify(Block& block, std::span<const std::uint32_t> list, List& out) const {
    out.clear();
    // The samples in it, without the layer around the grid.
    const int first[3] = {std::max(block.x, 1), std::max(block.y, 1), std::max(block.z, 1)};
    const int last[3] = {std::min(block.x + block.size - 1, grid_.size[0]),
                         std::min(block.y + block.size - 1, grid_.size[1]),
                         std::min(block.z + block.size - 1, grid_.size[2])};
    Eigen::Vector3d half;
    for (int axis = 0; axis < 3; ++axis) {
      if (first[axis] > last[axis]) return Verdict::outside;
      half[axis] = 0.5 * grid_.voxel * (last[axis] - first[axis]);
    }
    const Eigen::Vector3d center = node(first[0], first[1], first[2]) + half;
    if (block.cuts && cut_away(center, half, block.cuts)) return Verdict::outside;

    int whole = 0;
    bool idle = false;
    for (const std::uint32_t entry : list) {
      const std::uint8_t bits = bound(*views_[entry & kIndex].view, center, half);
      if (bits == kNotSeen) continue;
      if (bits == kDeepInside) {
        ++block.seen;
      } else if (bits == kDeepOutside) {
        ++block.seen;
        if (++block.deep_outside >= function_.rule.tolerance) return Verdict::outside;
      } else if (bits == (kDeepInside | kNotSeen)) {
        out.push_back((entry & kIndex) | kPartly | kOnlySees);
        idle = true;
      } else {
        const bool partly = bits == 0 || (bits & kNotSeen) != 0;
        out.push_back((entry & kIndex) | (partly ? kPartly : 0));
        whole += !partly;
      }
    }
    if (block.seen + int(out.size()) < function_.min_views) return Verdict::outside;
    if (idle) {
      const bool enough = block.seen + whole >= function_.min_views;
      std::size_t kept = 0;
      for (const std::uint32_t entry : out)
        if (!(enough && (entry & kOnlySees))) out[kept++] = entry & ~kOnlySees;
      out.resize(kept);
    }
    return out.empty() && !block.cuts ? Verdict::inside : Verdict::split;
  }

  struct Evaluated {
    std::size_t samples = 0, views = 0;
  };

  /// All samples of a leaf.
  Leaf evaluate(const Block& block, std::span<const std::uint32_t> list, Top& top, Evaluated& count) const {
    const int m = function_.rule.tolerance - block.deep_outside;
    top.resize(std::size_t(m));
    for (auto& rank : top) rank.fill(-kInfinity);
    const Eigen::Vector3d origin = node(block.x, block.y, block.z);
    int whole = 0;
    // At the grid's edge the block's outer nodes were not judged: they may be outside the picture.
    const bool edge = touches_layer(block);
    bool partly = edge;
    double error = 0;
    for (const std::uint32_t entry : list) {
      if (edge || (entry & kPartly)) {
        partly = true;
        continue;
      }
      error = std::max(error, merge(views_[entry & kIndex], origin, top));
      ++whole;
    }
    count.samples += 64;
    count.views += 64 * list.size();
    Leaf leaf;
    leaf.inside = 0;
    List indices;
    std::vector<double> scratch;
    for (int s = 0; s < 64; ++s) {
      const int i = block.x + s % 4, j = block.y + s / 4 % 4, k = block.z + s / 16;
      if (i < 1 || j < 1 || k < 1 || i > grid_.size[0] || j > grid_.size[1] || k > grid_.size[2]) {
        leaf.phi[std::size_t(s)] = kInfinity;
        continue;
      }
      float phi = top.back()[std::size_t(s)];
      if (partly || block.cuts || std::abs(phi) <= error) {
        // The exact way.
        if (indices.empty())
          for (const std::uint32_t entry : list) indices.push_back(entry & kIndex);
        scratch.resize(std::size_t(m));
        const double exact = function_.phi(node(i, j, k), indices, block.deep_outside, block.seen, scratch.data());
        phi = float(exact);
        if (exact < 0 && !(phi < 0)) phi = -std::numeric_limits<float>::min();
      } else if (block.seen + whole < function_.min_views) {
        phi = kInfinity;
      }
      leaf.phi[std::size_t(s)] = phi;
      if (phi < 0) leaf.inside |= std::uint64_t(1) << s;
    }
    return leaf;
  }

  Eigen::Vector3d node(int i, int j, int k) const { return grid_.sample(i - 1, j - 1, k - 1); }

  bool touches_layer(const Block& b) const {
    return b.x < 1 || b.y < 1 || b.z < 1 || b.x + b.size - 1 > grid_.size[0] || b.y + b.size - 1 > grid_.size[1] ||
           b.z + b.size - 1 > grid_.size[2];
  }

 private:
  /// Whether the cuts carve the whole box; `matter`: whether they may matter in it.
  bool cut_away(const Eigen::Vector3d& center, const Eigen::Vector3d& half, bool& matter) const {
    matter = false;
    const double margin = 2 * grid_.voxel;  // next to a cut its distance is needed
    const auto judge = [&](double d, double reach) {
      if (d - reach > margin) return true;
      if (d + reach > -margin) matter = true;
      return false;
    };
    for (const CutPlane& plane : function_.rule.cut_planes)
      if (judge(plane.normal.dot(center) - plane.offset, plane.normal.cwiseAbs().dot(half))) return true;
    for (const Box& box : function_.rule.cut_boxes)
      if (judge(cut_by(box, center), half.norm())) return true;
    return false;
  }

  const HullFunction::Impl& function_;
  const Grid grid_;
  std::vector<BlockView> views_;
};

/// One chunk of the octree, sampled depth first.
class Chunk {
 public:
  Chunk(const Sampler& sampler, Field::Data& data, const Job& job) : sampler_(sampler), data_(data), job_(job) {}

  void descend(const Block& block, std::span<const std::uint32_t> list, std::size_t depth = 0) {
    if (block.size == kBlock) {
      add(block, sampler_.evaluate(block, list, top_, count));
      return;
    }
    if (lists_.size() <= depth) lists_.resize(depth + 1);
    if (block.size >= 16) job_.check();
    const int half = block.size / 2;
    for (int child = 0; child < 8; ++child) {
      Block b = block;
      b.x += (child & 1) * half, b.y += (child >> 1 & 1) * half, b.z += (child >> 2) * half;
      b.size = half;
      // Taken out while a deeper level may make the vector of lists grow.
      List mine = std::move(lists_[depth]);
      const Verdict verdict = sampler_.classify(b, list, mine);
      if (verdict == Verdict::split)
        descend(b, mine, depth + 1);
      else
        settle(b, verdict == Verdict::inside);
      lists_[depth] = std::move(mine);
    }
  }

  /// Marks a block that is one thing all over.
  void settle(const Block& block, bool inside) {
    if (inside && sampler_.touches_layer(block)) {
      if (block.size > kBlock) {
        const int half = block.size / 2;
        for (int child = 0; child < 8; ++child) {
          Block b = block;
          b.x += (child & 1) * half, b.y += (child >> 1 & 1) * half, b.z += (child >> 2) * half;
          b.size = half;
          settle(b, true);
        }
        return;
      }
      Leaf leaf;
      leaf.inside = 0;
      const std::array<int, 3>& n = data_.grid.size;
      for (int s = 0; s < 64; ++s) {
        const int i = block.x + s % 4, j = block.y + s / 4 % 4, k = block.z + s / 16;
        const bool in = i >= 1 && j >= 1 && k >= 1 && i <= n[0] && j <= n[1] && k <= n[2];
        leaf.phi[std::size_t(s)] = in ? -kInfinity : kInfinity;
        if (in) leaf.inside |= std::uint64_t(1) << s;
      }
      add(block, leaf);
      return;
    }
    const int x0 = block.x / kBlock, y0 = block.y / kBlock, z0 = block.z / kBlock;
    const int n = std::max(block.size / kBlock, 1);
    const int x1 = std::min(x0 + n, data_.blocks[0]), y1 = std::min(y0 + n, data_.blocks[1]);
    const int z1 = std::min(z0 + n, data_.blocks[2]);
    if (!inside || x0 >= x1) return;  // the directory starts as outside
    for (int z = z0; z < z1; ++z)
      for (int y = y0; y < y1; ++y) std::fill_n(&data_.directory[data_.index(x0, y, z)], x1 - x0, kInsideBlock);
    for (int z = z0; z < z1; ++z)
      for (int y = y0; y < y1; ++y) inside_samples += std::size_t(64) * std::size_t(x1 - x0);
  }

  struct Placed {
    std::size_t at;  // directory index
    Leaf leaf;
  };
  std::vector<Placed> leaves;
  Sampler::Evaluated count;
  std::size_t inside_samples = 0;

 private:
  void add(const Block& block, const Leaf& leaf) {
    const int x = block.x / kBlock, y = block.y / kBlock, z = block.z / kBlock;
    if (x >= data_.blocks[0] || y >= data_.blocks[1] || z >= data_.blocks[2]) return;
    inside_samples += std::size_t(std::popcount(leaf.inside));
    leaves.push_back({data_.index(x, y, z), leaf});
  }

  const Sampler& sampler_;
  Field::Data& data_;
  const Job& job_;
  std::vector<List> lists_;
  Top top_;
};

struct Task {
  Block block;
  List list;
};

}  // namespace

Field sample_field(const HullFunction& function, const Grid& grid, Job& job) {
  auto data = std::make_unique<Field::Data>();
  data->grid = grid;
  std::size_t entries = 1;
  int root = kBlock;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int nodes = grid.size[axis] + 2;
    data->blocks[axis] = (nodes + kBlock - 1) / kBlock;
    entries *= std::size_t(data->blocks[axis]);
    while (root < nodes) root *= 2;
  }
  data->directory.assign(entries, kOutsideBlock);
  const Sampler sampler(function.impl(), grid);

  // Level by level down to blocks that are worth a task each.
  std::vector<Task> tasks(1);
  tasks[0].block.size = root;
  tasks[0].block.cuts = sampler.has_cuts();
  for (std::uint32_t i = 0; i < sampler.views(); ++i) tasks[0].list.push_back(i);
  Chunk uniform(sampler, *data, job);
  while (!tasks.empty() && tasks[0].block.size > 32) {
    std::vector<std::array<std::optional<Task>, 8>> children(tasks.size());
    std::vector<std::vector<Block>> inside(tasks.size());
    parallel_for(job, tasks.size(), [&](std::size_t t) {
      const int half = tasks[t].block.size / 2;
      for (int child = 0; child < 8; ++child) {
        Task c;
        c.block = tasks[t].block;
        c.block.x += (child & 1) * half, c.block.y += (child >> 1 & 1) * half, c.block.z += (child >> 2) * half;
        c.block.size = half;
        const Verdict verdict = sampler.classify(c.block, tasks[t].list, c.list);
        if (verdict == Verdict::inside) inside[t].push_back(c.block);
        if (verdict == Verdict::split) children[t][std::size_t(child)] = std::move(c);
      }
      tasks[t].list = {};
    });
    for (const auto& blocks : inside)
      for (const Block& b : blocks) uniform.settle(b, true);
    std::vector<Task> next;
    for (auto& eight : children)
      for (auto& child : eight)
        if (child) next.push_back(std::move(*child));
    tasks = std::move(next);
  }

  std::vector<std::vector<Chunk::Placed>> leaves(tasks.size() + 1);
  std::vector<Sampler::Evaluated> counts(tasks.size());
  std::vector<std::size_t> inside(tasks.size());
  job.begin("carving", tasks.size());
  parallel_chunks(
      job, tasks.size(), 1,
      [&](std::size_t t, std::size_t) {
        Chunk chunk(sampler, *data, job);
        chunk.descend(tasks[t].block, tasks[t].list);
        chunk.leaves.shrink_to_fit();
        leaves[t] = std::move(chunk.leaves);
        counts[t] = chunk.count;
        inside[t] = chunk.inside_samples;
        tasks[t].list = {};
      },
      true);
  job.end();
  leaves.back() = std::move(uniform.leaves);
  data->samples_inside = uniform.inside_samples;
  std::size_t total = 0;
  for (const auto& l : leaves) total += l.size();
  data->leaves.reserve(total);
  for (auto& l : leaves) {
    for (const Chunk::Placed& p : l) {
      data->directory[p.at] = std::int32_t(data->leaves.size());
      data->leaves.push_back(p.leaf);
    }
    l = {};
  }
  for (std::size_t t = 0; t < tasks.size(); ++t) {
    data->samples_inside += inside[t];
    data->samples_evaluated += counts[t].samples;
    data->views_evaluated += counts[t].views;
  }
  return Field(std::move(data));
}

Field::Field(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Field::~Field() = default;
Field::Field(Field&&) noexcept = default;
Field& Field::operator=(Field&&) noexcept = default;

const Grid& Field::grid() const { return data_->grid; }

float Field::at(int i, int j, int k) const {
  const int x = i + 1, y = j + 1, z = k + 1;
  const std::int32_t entry = data_->directory[data_->index(x / kBlock, y / kBlock, z / kBlock)];
  if (entry == kOutsideBlock) return kInfinity;
  if (entry == kInsideBlock) return -kInfinity;
  return data_->leaves[std::size_t(entry)].phi[std::size_t(x % kBlock + kBlock * (y % kBlock) + 16 * (z % kBlock))];
}

bool Field::inside(int i, int j, int k) const { return at(i, j, k) < 0; }
std::size_t Field::samples_inside() const { return data_->samples_inside; }
std::size_t Field::samples_evaluated() const { return data_->samples_evaluated; }
std::size_t Field::views_evaluated() const { return data_->views_evaluated; }

std::size_t Field::bytes() const {
  return data_->directory.size() * sizeof(std::int32_t) + data_->leaves.size() * sizeof(Leaf);
}

}  // namespace lumihull::hull
