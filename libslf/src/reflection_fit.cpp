#include "reflection_fit.h"

#include <lumihull/base/image.h>
#include <lumihull/base/parallel.h>

#include <array>
#include <cmath>
#include <functional>

namespace lumihull::slf {
namespace {

using Eigen::Vector3f;
using Light = std::vector<Vector3f>;

constexpr std::size_t kBlocksAtOnce = 512;
constexpr int kRounds = 4, kSteps = 12;  // of the white samples' values; of conjugate gradients in each
constexpr float kSmoothness = 0.02f, kTowardsZero = 0.002f;  // in shares of a node's mean weight
constexpr std::size_t kSamples = 600'000;  // about so many are enough: all places share what is looked for
constexpr std::uint8_t kWhite = 253;
constexpr float kVisible = 0.02f;

/// Where a look is reflected to, and how flat it is.
struct MirrorPlace {
  SphereGrid::Place at;
  float grazing = 0;
};

/// A texel as one photograph shows it.
struct Look {
  MirrorPlace place;
  float weight = 0;
  Vector3f color;  // linear
  std::array<bool, 3> white{};
  Vector3f mirrored_light;  // what the reflection so far says
};

class Fit {
 public:
  Fit(const hull::Mesh& mesh, const Atlas& atlas, std::span<const PhotoSamples> photos, const Light& normals)
      : mesh_(mesh), atlas_(atlas), photos_(photos), normals_(normals) {
    for (std::size_t i = 0; i < 256; ++i) light_of_[i] = linear_from_srgb(unit_of_srgb8(std::uint8_t(i)));
    for (std::uint32_t i = 0; i < grid_.size(); ++i) alias_.push_back(grid_.alias(i));
  }

  const SphereGrid& grid() const { return grid_; }

  /// From now on one texel of so many is looked at.
  void thin(std::uint32_t stride) { stride_ = stride; }

  Vector3f at(const Light& light, const MirrorPlace& p) const {
    Vector3f sum = Vector3f::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t node = alias_[p.at.node[k]];
      sum += p.at.weight[k] * (light[node] + p.grazing * light[grid_.size() + node]);
    }
    return sum;
  }
  void spread(Light& light, const MirrorPlace& p, const Vector3f& value) const {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t node = alias_[p.at.node[k]];
      light[node] += p.at.weight[k] * value;
      light[grid_.size() + node] += p.at.weight[k] * p.grazing * value;
    }
  }

  MirrorPlace place(const Texel& texel, const Vector3f& eye) const {
    const auto& t = mesh_.triangles[texel.triangle];
    const float b0 = 1 - texel.b1 - texel.b2;
    const auto between = [&](const Light& of) -> Vector3f {
      return b0 * of[t[0]] + texel.b1 * of[t[1]] + texel.b2 * of[t[2]];
    };
    const Vector3f to_eye = (eye - between(mesh_.vertices)).stableNormalized(),
                   normal = between(normals_).stableNormalized();
    return {grid_.at(mirrored(to_eye, normal)), grazing(to_eye.dot(normal))};
  }

  /// Calls visit(chunk, looks) for every texel; chunks are parts of the work whose number is fixed.
  std::size_t chunks() const { return (atlas_.blocks.size() - 1 + kBlocksAtOnce - 1) / kBlocksAtOnce; }
  void for_each_texel(Job& job, const Light& light,
                      const std::function<void(std::size_t, std::vector<Look>&)>& visit) const {
    parallel_for(job, chunks(), [&](std::size_t chunk) {
      std::vector<Look> looks;
      const std::size_t last = std::min(atlas_.blocks.size() - 1, (chunk + 1) * kBlocksAtOnce);
      for (std::size_t b = chunk * kBlocksAtOnce; b < last; ++b)
        for (std::uint32_t texel = first_texel(b); texel < atlas_.blocks[b + 1]; texel += stride_) {
          looks.clear();
          for (const PhotoSamples& photo : photos_) {
            if (photo.first[b] == kUnseen) continue;
            const SurfaceSample8& s = photo.samples[photo.first[b] + texel - atlas_.blocks[b]];
            if (s.root_weight == 0) continue;
            Look look;
            look.place = place(atlas_.texels[texel], photo.center);
            look.weight = s.weight();
            look.color = {light_of_[s.r], light_of_[s.g], light_of_[s.b]};
            look.white = {s.r >= kWhite, s.g >= kWhite, s.b >= kWhite};
            look.mirrored_light = at(light, look.place);
            looks.push_back(look);
          }
          if (looks.size() > 1) visit(chunk, looks);
        }
    });
  }

  /// White samples take what the model says where that is more.
  static void raise_white(std::vector<Look>& looks) {
    for (int c = 0; c < 3; ++c) {
      float own = 0, weight = 0;
      for (const Look& l : looks)
        if (!l.white[std::size_t(c)]) own += l.weight * (l.color[c] - l.mirrored_light[c]), weight += l.weight;
      if (!(weight > 0)) continue;
      own /= weight;
      for (Look& l : looks)
        if (l.white[std::size_t(c)]) l.color[c] = std::max(l.color[c], own + l.mirrored_light[c]);
    }
  }

  static Vector3f mean(const std::vector<Look>& looks, const std::function<Vector3f(const Look&)>& of) {
    Vector3f sum = Vector3f::Zero();
    float weight = 0;
    for (const Look& l : looks) sum += l.weight * of(l), weight += l.weight;
    return sum / weight;
  }

 private:
  std::uint32_t first_texel(std::size_t block) const {
    return (atlas_.blocks[block] + stride_ - 1) / stride_ * stride_;
  }

  const hull::Mesh& mesh_;
  const Atlas& atlas_;
  std::span<const PhotoSamples> photos_;
  const Light& normals_;
  SphereGrid grid_{kReflectionSide};
  std::uint32_t stride_ = 1;
  std::vector<std::uint32_t> alias_;
  std::array<float, 256> light_of_;
};

/// Sum of the chunks' grids, in their order.
Light sum_of(const std::vector<Light>& chunks, std::size_t size) {
  Light sum(size, Vector3f::Zero());
  for (const Light& chunk : chunks)
    for (std::size_t i = 0; i < size; ++i) sum[i] += chunk[i];
  return sum;
}

/// The regularisation's part of the normal equations: differences of neighbouring nodes, and the values themselves.
void add_smoothness(const SphereGrid& grid, const Light& x, float weight, Light& out) {
  const auto side = std::uint32_t(grid.side());
  const auto nodes = std::uint32_t(grid.size());
  const auto couple = [&](std::uint32_t first, std::uint32_t a, std::uint32_t b) {
    a = first + grid.alias(a), b = first + grid.alias(b);
    const Vector3f d = kSmoothness * weight * (x[a] - x[b]);
    out[a] += d, out[b] -= d;
  };
  for (std::uint32_t part = 0; part < 2; ++part)
    for (std::uint32_t i = 0; i < nodes; ++i) {
      const std::uint32_t first = part * nodes;
      if (i % side + 1 < side) couple(first, i, i + 1);
      if (i / side + 1 < side) couple(first, i, i + side);
      if (grid.alias(i) == i) out[first + i] += kTowardsZero * weight * x[first + i];
    }
}

Eigen::Array3d dot(const Light& a, const Light& b) {
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i].cast<double>().array() * b[i].cast<double>().array());
  return sum;
}

}  // namespace

ReflectionFit fit_reflection(const hull::Mesh& mesh, const Atlas& atlas, std::span<const PhotoSamples> photos,
                             Job& job) {
  ReflectionFit out;
  out.normals = hull::vertex_normals(mesh);
  for (auto& n : out.normals)
    if (n.isZero()) n = Vector3f::UnitZ();  // no triangle with an area uses it
  Fit fit(mesh, atlas, photos, out.normals);
  std::size_t samples = 0;
  for (const PhotoSamples& p : photos) samples += p.samples.size();
  fit.thin(std::uint32_t(std::max<std::size_t>(1, samples / kSamples)));
  const std::size_t nodes = fit.grid().size(), size = 2 * nodes;
  Light x(size, Vector3f::Zero());
  float node_weight = 0;
  const auto multiplied = [&](const Light& v) {
    std::vector<Light> parts(fit.chunks(), Light(size, Vector3f::Zero()));
    fit.for_each_texel(job, v, [&](std::size_t chunk, std::vector<Look>& looks) {
      const Vector3f mean = Fit::mean(looks, [](const Look& l) { return l.mirrored_light; });
      for (const Look& l : looks) fit.spread(parts[chunk], l.place, l.weight * (l.mirrored_light - mean));
    });
    Light product = sum_of(parts, size);
    add_smoothness(fit.grid(), v, node_weight, product);
    return product;
  };
  job.begin("reflections", std::uint64_t(kRounds));
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Light> parts(fit.chunks(), Light(size, Vector3f::Zero()));
    std::vector<double> weights(fit.chunks(), 0);
    fit.for_each_texel(job, x, [&](std::size_t chunk, std::vector<Look>& looks) {
      Fit::raise_white(looks);
      // The residual with the reflection so far is the gradient.
      const Vector3f mean = Fit::mean(looks, [](const Look& l) -> Vector3f { return l.color - l.mirrored_light; });
      for (const Look& l : looks) {
        fit.spread(parts[chunk], l.place, l.weight * (l.color - l.mirrored_light - mean));
        weights[chunk] += double(l.weight);
      }
    });
    Light residual = sum_of(parts, size);
    double weight = 0;
    for (const double w : weights) weight += w;
    node_weight = float(weight / double(nodes));
    {
      Light pull(size, Vector3f::Zero());
      add_smoothness(fit.grid(), x, node_weight, pull);
      for (std::size_t i = 0; i < size; ++i) residual[i] -= pull[i];
    }
    Light direction = residual;
    Eigen::Array3d squares = dot(residual, residual);
    for (int step = 0; step < kSteps; ++step) {
      const Light product = multiplied(direction);
      const Eigen::Array3d curvature = dot(direction, product);
      const Eigen::Array3f alpha = (curvature > 0).select(squares / curvature, 0).cast<float>();
      for (std::size_t i = 0; i < size; ++i) {
        x[i].array() += alpha * direction[i].array();
        residual[i].array() -= alpha * product[i].array();
      }
      const Eigen::Array3d now = dot(residual, residual);
      const Eigen::Array3f beta = (squares > 0).select(now / squares, 0).cast<float>();
      squares = now;
      for (std::size_t i = 0; i < size; ++i) direction[i] = residual[i] + Vector3f(beta * direction[i].array());
    }
    job.advance();
  }
  job.end();
  std::vector<std::array<double, 3>> sums(fit.chunks(), {0, 0, 0});
  fit.for_each_texel(job, x, [&](std::size_t chunk, std::vector<Look>& looks) {
    const Vector3f alone = Fit::mean(looks, [](const Look& l) { return l.color; });
    for (const Look& l : looks) {
      sums[chunk][0] += double(l.weight * (l.color - alone).squaredNorm());
      sums[chunk][2] += double(l.weight);
    }
    Fit::raise_white(looks);
    const Vector3f own = Fit::mean(looks, [](const Look& l) -> Vector3f { return l.color - l.mirrored_light; });
    for (const Look& l : looks) sums[chunk][1] += double(l.weight * (l.color - l.mirrored_light - own).squaredNorm());
  });
  double before = 0, after = 0, weight = 0;
  for (const auto& s : sums) before += s[0], after += s[1], weight += s[2];
  out.left = before > 0 ? after / before : 1;
  out.explained_rms = weight > 0 ? std::sqrt(std::max(0.0, before - after) / (3 * weight)) : 0;
  out.light.resize(size);
  for (std::uint32_t i = 0; i < nodes; ++i) {
    out.light[i] = x[fit.grid().alias(i)];
    out.light[nodes + i] = x[nodes + fit.grid().alias(i)];
  }
  return out;
}

void take_off(const ReflectionFit& reflection, const hull::Mesh& mesh, const Atlas& atlas,
              std::span<PhotoSamples> photos, Job& job) {
  const Fit fit(mesh, atlas, photos, reflection.normals);
  parallel_for(job, photos.size(), [&](std::size_t p) {
    PhotoSamples& photo = photos[p];
    for (std::size_t b = 0; b + 1 < atlas.blocks.size(); ++b) {
      if (photo.first[b] == kUnseen) continue;
      for (std::uint32_t texel = atlas.blocks[b]; texel < atlas.blocks[b + 1]; ++texel) {
        SurfaceSample8& s = photo.samples[photo.first[b] + texel - atlas.blocks[b]];
        if (s.root_weight == 0) continue;
        const Vector3f off = fit.at(reflection.light, fit.place(atlas.texels[texel], photo.center));
        const auto without = [&](std::uint8_t byte, float light) {
          return srgb8_of_unit(srgb_from_linear(std::clamp(linear_from_srgb(unit_of_srgb8(byte)) - light, 0.0f, 1.0f)));
        };
        // How much a white one has of its own is not known: others say it, where there are any.
        if (std::max({s.r, s.g, s.b}) >= kWhite && off.maxCoeff() > kVisible)
          s.root_weight = std::uint8_t(std::max(1, s.root_weight / 16));
        s.r = without(s.r, off.x()), s.g = without(s.g, off.y()), s.b = without(s.b, off.z());
      }
    }
  });
}

}  // namespace lumihull::slf
