#include "reflection_fit.h"

#include <lumihull/base/image.h>
#include <lumihull/base/parallel.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace lumihull::slf {
namespace {

using Eigen::Vector3f;
using Light = std::vector<Vector3f>;

constexpr std::size_t kChunks = 64;
constexpr int kRounds = 4, kSteps = 12;                      // of E and s by turns; of conjugate gradients on E in each
constexpr int kTrialRounds = 2, kTrialSteps = 8;             // where a comparison is all that is wanted
constexpr float kSmoothness = 0.02f, kTowardsZero = 0.002f;  // in shares of a node's mean weight
constexpr float kStrengthTowardsOne = 0.1f;                  // in shares of a vertex's mean weight
// About so many samples are enough: all places share what is looked for.
constexpr std::size_t kSamples = 600'000, kTrialSamples = 150'000;
constexpr std::uint8_t kWhite = 253;
constexpr float kVisible = 0.02f;
constexpr std::uint8_t kFolds = 4, kNoFold = kFolds;  // photographs p, p + 4, … are left out together
// The object's radius over that of the sphere where what it mirrors is: first these, then twice half a step beside the
// best.
constexpr float kNearnessStep = 0.15f;
constexpr int kNearnesses = 5;

/// A texel as one photograph shows it.
struct Look {
  MirrorPlace place;
  float weight = 0;
  Vector3f color;  // linear
  std::array<bool, 3> white{};
  std::uint8_t fold = 0;
  Vector3f mirrored_light;  // what the reflection so far says, for a strength of 1
};

/// A texel and its looks.
struct Spot {
  std::uint32_t triangle;
  float b1, b2;
  std::size_t first, last;
};

struct Model {
  Light light;
  std::vector<float> strength;
};

class Fit {
 public:
  /// Looks at about `most` samples. The mesh and its normals must outlive the object.
  Fit(const hull::Mesh& mesh, const std::vector<Vector3f>& normals, const Atlas& atlas,
      std::span<const PhotoSamples> photos, std::size_t most)
      : mesh_(mesh), normals_(normals) {
    for (std::uint32_t i = 0; i < grid_.size(); ++i) alias_.push_back(grid_.alias(i));
    std::array<float, 256> light_of;
    for (std::size_t i = 0; i < 256; ++i) light_of[i] = linear_from_srgb(unit_of_srgb8(std::uint8_t(i)));
    std::size_t samples = 0;
    for (const PhotoSamples& p : photos) samples += p.samples.size();
    const auto stride = std::uint32_t(std::max<std::size_t>(1, samples / most));
    for (std::size_t b = 0; b + 1 < atlas.blocks.size(); ++b)
      for (std::uint32_t texel = (atlas.blocks[b] + stride - 1) / stride * stride; texel < atlas.blocks[b + 1];
           texel += stride) {
        const Texel& t = atlas.texels[texel];
        Spot spot{t.triangle, t.b1, t.b2, looks_.size(), 0};
        for (std::size_t p = 0; p < photos.size(); ++p) {
          if (photos[p].first[b] == kUnseen) continue;
          const SurfaceSample8& s = photos[p].samples[photos[p].first[b] + texel - atlas.blocks[b]];
          if (s.root_weight == 0) continue;
          Look look;
          look.weight = s.weight();
          look.color = {light_of[s.r], light_of[s.g], light_of[s.b]};
          look.white = {s.r >= kWhite, s.g >= kWhite, s.b >= kWhite};
          look.fold = std::uint8_t(p % kFolds);
          looks_.push_back(look);
          eyes_.push_back(photos[p].center);
        }
        spot.last = looks_.size();
        if (spot.last - spot.first > 1)
          spots_.push_back(spot);
        else
          looks_.resize(spot.first), eyes_.resize(spot.first);
      }
  }

  const SphereGrid& grid() const { return grid_; }
  std::size_t spots() const { return spots_.size(); }
  const Spot& spot(std::size_t i) const { return spots_[i]; }

  const hull::Mesh& mesh() const { return mesh_; }

  void place(const Surroundings& around, Job& job) {
    parallel_for(job, kChunks, [&](std::size_t chunk) {
      const auto [first, last] = part(chunk);
      for (std::size_t i = first; i < last; ++i)
        for (std::size_t k = spots_[i].first; k < spots_[i].last; ++k)
          looks_[k].place =
              mirror_place(grid_, around, mesh_, normals_, spots_[i].triangle, spots_[i].b1, spots_[i].b2, eyes_[k]);
    });
  }

  /// Calls visit(chunk, spot, looks) for every texel that is seen twice, without the photographs of one fold.
  template <class Visit>
  void for_each(Job& job, const Light& light, std::uint8_t left_out, const Visit& visit) const {
    parallel_for(job, kChunks, [&](std::size_t chunk) {
      std::vector<Look> looks;
      const auto [first, last] = part(chunk);
      for (std::size_t i = first; i < last; ++i) {
        looks.clear();
        for (std::size_t k = spots_[i].first; k < spots_[i].last; ++k) {
          if (looks_[k].fold == left_out) continue;
          looks.push_back(looks_[k]);
          looks.back().mirrored_light = slf::mirrored_light(light, looks_[k].place);
        }
        if (looks.size() > 1) visit(chunk, i, looks);
      }
    });
  }

  std::span<const Look> looks(std::size_t spot) const {
    return std::span(looks_).subspan(spots_[spot].first, spots_[spot].last - spots_[spot].first);
  }

  float strength(const std::vector<float>& of, std::size_t spot) const {
    const Spot& s = spots_[spot];
    const auto& t = mesh_.triangles[s.triangle];
    return (1 - s.b1 - s.b2) * of[t[0]] + s.b1 * of[t[1]] + s.b2 * of[t[2]];
  }

  void spread(Light& light, const MirrorPlace& p, const Vector3f& value) const {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t node = alias_[p.at.node[k]];
      light[node] += p.at.weight[k] * value;
      light[grid_.size() + node] += p.at.weight[k] * p.grazing * value;
    }
  }

  /// The same values at all nodes that stand for one direction.
  Light expanded(Light light) const {
    for (std::size_t i = 0; i < grid_.size(); ++i) {
      light[i] = light[alias_[i]];
      light[grid_.size() + i] = light[grid_.size() + alias_[i]];
    }
    return light;
  }

 private:
  std::pair<std::size_t, std::size_t> part(std::size_t chunk) const {
    return {chunk * spots_.size() / kChunks, (chunk + 1) * spots_.size() / kChunks};
  }

  const hull::Mesh& mesh_;
  const std::vector<Vector3f>& normals_;
  SphereGrid grid_{kReflectionSide};
  std::vector<std::uint32_t> alias_;
  std::vector<Spot> spots_;
  std::vector<Look> looks_;
  std::vector<Vector3f> eyes_;  // of the looks
};

/// White samples take what the model says where that is more.
void raise_white(std::vector<Look>& looks, float strength) {
  for (int c = 0; c < 3; ++c) {
    float own = 0, weight = 0;
    for (const Look& l : looks)
      if (!l.white[std::size_t(c)]) own += l.weight * (l.color[c] - strength * l.mirrored_light[c]), weight += l.weight;
    if (!(weight > 0)) continue;
    own /= weight;
    for (Look& l : looks)
      if (l.white[std::size_t(c)]) l.color[c] = std::max(l.color[c], own + strength * l.mirrored_light[c]);
  }
}

template <class Of>
Vector3f mean(const std::vector<Look>& looks, const Of& of) {
  Vector3f sum = Vector3f::Zero();
  float weight = 0;
  for (const Look& l : looks) sum += l.weight * of(l), weight += l.weight;
  return sum / weight;
}

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

/// One round of conjugate gradients on E.
void improve_light(const Fit& fit, Model& model, std::uint8_t left_out, int steps, Job& job) {
  const std::size_t nodes = fit.grid().size(), size = 2 * nodes;
  Light& x = model.light;
  std::vector<Light> parts(kChunks, Light(size, Vector3f::Zero()));
  std::vector<double> weights(kChunks, 0);
  fit.for_each(job, fit.expanded(x), left_out, [&](std::size_t chunk, std::size_t spot, std::vector<Look>& looks) {
    const float s = fit.strength(model.strength, spot);
    raise_white(looks, s);
    // The residual with the reflection so far is the gradient.
    const Vector3f own = mean(looks, [&](const Look& l) -> Vector3f { return l.color - s * l.mirrored_light; });
    for (const Look& l : looks) {
      fit.spread(parts[chunk], l.place, s * l.weight * (l.color - s * l.mirrored_light - own));
      weights[chunk] += double(s * s * l.weight);
    }
  });
  Light residual = sum_of(parts, size);
  double weight = 0;
  for (const double w : weights) weight += w;
  const auto node_weight = float(weight / double(nodes));
  {
    Light pull(size, Vector3f::Zero());
    add_smoothness(fit.grid(), x, node_weight, pull);
    for (std::size_t i = 0; i < size; ++i) residual[i] -= pull[i];
  }
  const auto multiplied = [&](const Light& v) {
    for (Light& p : parts) std::fill(p.begin(), p.end(), Vector3f::Zero());
    fit.for_each(job, fit.expanded(v), left_out, [&](std::size_t chunk, std::size_t spot, std::vector<Look>& looks) {
      const float s = fit.strength(model.strength, spot);
      const Vector3f middle = mean(looks, [](const Look& l) { return l.mirrored_light; });
      for (const Look& l : looks) fit.spread(parts[chunk], l.place, s * s * l.weight * (l.mirrored_light - middle));
    });
    Light product = sum_of(parts, size);
    add_smoothness(fit.grid(), v, node_weight, product);
    return product;
  };
  Light direction = residual;
  Eigen::Array3d squares = dot(residual, residual);
  for (int step = 0; step < steps; ++step) {
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
}

/// How strongly each vertex mirrors, given E: least squares over the texels around it, each by its share, and those of
/// its neighbours half as much.
void improve_strength(const Fit& fit, Model& model, std::uint8_t left_out, Job& job) {
  const hull::Mesh& mesh = fit.mesh();
  const std::size_t vertices = mesh.vertices.size();
  std::vector<std::array<float, 2>> sums(fit.spots(), {0, 0});
  fit.for_each(job, fit.expanded(model.light), left_out, [&](std::size_t, std::size_t spot, std::vector<Look>& looks) {
    raise_white(looks, fit.strength(model.strength, spot));
    const Vector3f own = mean(looks, [](const Look& l) { return l.color; });
    const Vector3f middle = mean(looks, [](const Look& l) { return l.mirrored_light; });
    for (const Look& l : looks) {
      const Vector3f m = l.mirrored_light - middle;
      sums[spot][0] += l.weight * m.dot(l.color - own);
      sums[spot][1] += l.weight * m.squaredNorm();
    }
  });
  std::vector<double> with(vertices, 0), square(vertices, 0);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const Spot& s = fit.spot(i);
    const auto& t = mesh.triangles[s.triangle];
    const float share[3] = {1 - s.b1 - s.b2, s.b1, s.b2};
    for (int j = 0; j < 3; ++j)
      with[t[j]] += double(share[j] * sums[i][0]), square[t[j]] += double(share[j] * sums[i][1]);
  }
  std::vector<double> with_around = with, square_around = square;
  for (const auto& t : mesh.triangles)
    for (int j = 0; j < 3; ++j)
      for (const int k : {(j + 1) % 3, (j + 2) % 3}) {  // an edge has two triangles
        with_around[t[j]] += 0.25 * with[t[k]];
        square_around[t[j]] += 0.25 * square[t[k]];
      }
  double total = 0;
  for (const double s : square_around) total += s;
  const double pull = double(kStrengthTowardsOne) * total / double(vertices);
  if (!(pull > 0)) return;
  for (std::size_t v = 0; v < vertices; ++v)
    model.strength[v] =
        float(std::clamp((with_around[v] + pull) / (square_around[v] + pull), 0.0, double(kMostStrength)));
}

struct Explained {
  double before = 0, after = 0, weight = 0;
};

/// An sRGB colour.
Vector3f shown(const Vector3f& light) {
  return light.unaryExpr([](float v) { return srgb_from_linear(std::clamp(v, 0.0f, 1.0f)); });
}

/// At the samples of a fold, with each texel's own colour from the others: squared errors in sRGB, of the mean colour
/// alone and with what is mirrored.
Explained explained(const Fit& fit, const Model& model, std::uint8_t fold, Job& job) {
  std::vector<Explained> sums(kChunks);
  const Light light = fit.expanded(model.light);
  fit.for_each(job, light, fold, [&](std::size_t chunk, std::size_t spot, std::vector<Look>& looks) {
    const float s = fit.strength(model.strength, spot);
    const Vector3f alone = mean(looks, [](const Look& l) { return shown(l.color); });
    raise_white(looks, s);
    const Vector3f own = mean(looks, [&](const Look& l) -> Vector3f { return l.color - s * l.mirrored_light; });
    for (const Look& l : fit.looks(spot)) {
      if (l.fold != fold) continue;
      const Vector3f seen = shown(l.color);
      sums[chunk].before += double(l.weight * (seen - alone).squaredNorm());
      sums[chunk].after += double(l.weight * (seen - shown(own + s * mirrored_light(light, l.place))).squaredNorm());
      sums[chunk].weight += double(l.weight);
    }
  });
  Explained all;
  for (const Explained& s : sums) all.before += s.before, all.after += s.after, all.weight += s.weight;
  return all;
}

Model solved(const Fit& fit, std::uint8_t left_out, int rounds, int steps, Job& job) {
  Model model{Light(2 * fit.grid().size(), Vector3f::Zero()), std::vector<float>(fit.mesh().vertices.size(), 1)};
  for (int round = 0; round < rounds; ++round) {
    improve_light(fit, model, left_out, steps, job);
    improve_strength(fit, model, left_out, job);
  }
  return model;
}

/// At the samples of a fold, by the others.
Explained left_out(const Fit& fit, std::uint8_t fold, Job& job) {
  return explained(fit, solved(fit, fold, kTrialRounds, kTrialSteps, job), fold, job);
}

/// Where what is mirrored is: the sphere around the object by which a fold's samples are met best.
Surroundings surroundings(Fit& fit, Job& job) {
  Eigen::AlignedBox3f box;
  for (const auto& v : fit.mesh().vertices) box.extend(v);
  float radius = 0;
  for (const auto& v : fit.mesh().vertices) radius = std::max(radius, (v - box.center()).norm());
  Surroundings best{box.center(), 0};
  double least = std::numeric_limits<double>::infinity();
  const auto try_nearness = [&](float nearness) {
    const Surroundings around{box.center(), radius > 0 ? nearness / radius : 0};
    fit.place(around, job);
    const double left = left_out(fit, 0, job).after;
    if (left < least) least = left, best = around;
  };
  for (int i = 0; i < kNearnesses; ++i) try_nearness(float(i) * kNearnessStep);
  const float nearness = best.inverse_radius * radius;
  for (const float side : {-0.5f, 0.5f})
    if (nearness + side * kNearnessStep > 0) try_nearness(nearness + side * kNearnessStep);
  return best;
}

/// What a texel mirrors to an eye, linear light.
Vector3f mirrored_at(const ReflectionFit& reflection, const hull::Mesh& mesh, const Texel& texel, const Vector3f& eye) {
  const auto& t = mesh.triangles[texel.triangle];
  const float strength = (1 - texel.b1 - texel.b2) * reflection.strength[t[0]] + texel.b1 * reflection.strength[t[1]] +
                         texel.b2 * reflection.strength[t[2]];
  return strength *
         mirrored_light(reflection.light, mirror_place(SphereGrid(kReflectionSide), reflection.around, mesh,
                                                       reflection.normals, texel.triangle, texel.b1, texel.b2, eye));
}

}  // namespace

ReflectionFit fit_reflection(const hull::Mesh& mesh, const Atlas& atlas, std::span<const PhotoSamples> photos,
                             Job& job) {
  ReflectionFit out;
  out.normals = hull::vertex_normals(mesh);
  for (auto& n : out.normals)
    if (n.isZero()) n = Vector3f::UnitZ();  // no triangle with an area uses it
  job.begin("reflections", 3);
  {
    Fit fit(mesh, out.normals, atlas, photos, kTrialSamples);
    out.around = surroundings(fit, job);
    job.advance();
    fit.place(out.around, job);
    Explained held;
    for (std::uint8_t fold = 0; fold < kFolds; ++fold) {
      const Explained e = left_out(fit, fold, job);
      held.before += e.before, held.after += e.after, held.weight += e.weight;
    }
    out.held = held.before > 0 ? 1 - held.after / held.before : 0;
    out.held_rms = held.weight > 0 ? std::sqrt(std::max(0.0, held.before - held.after) / (3 * held.weight)) : 0;
    job.advance();
  }
  Fit fit(mesh, out.normals, atlas, photos, kSamples);
  fit.place(out.around, job);
  Model model = solved(fit, kNoFold, kRounds, kSteps, job);
  out.light = fit.expanded(std::move(model.light));
  out.strength = std::move(model.strength);
  job.advance();
  job.end();
  return out;
}

void take_off(const ReflectionFit& reflection, const hull::Mesh& mesh, const Atlas& atlas,
              std::span<PhotoSamples> photos, Job& job) {
  parallel_for(job, photos.size(), [&](std::size_t p) {
    PhotoSamples& photo = photos[p];
    for (std::size_t b = 0; b + 1 < atlas.blocks.size(); ++b) {
      if (photo.first[b] == kUnseen) continue;
      for (std::uint32_t texel = atlas.blocks[b]; texel < atlas.blocks[b + 1]; ++texel) {
        SurfaceSample8& s = photo.samples[photo.first[b] + texel - atlas.blocks[b]];
        if (s.root_weight == 0) continue;
        const Vector3f off = mirrored_at(reflection, mesh, atlas.texels[texel], photo.center);
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
