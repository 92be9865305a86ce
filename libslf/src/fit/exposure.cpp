#include "exposure.h"

#include <lumihull/base/image.h>
#include <lumihull/base/parallel.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "color.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kParts = 16;    // of the texels: summed each by itself, so that the answer knows no threads
constexpr double kPairsWanted = 4e6;  // of photographs at a texel: their number is what takes time
constexpr std::uint8_t kDarkest = 12, kBrightest = 250;
constexpr double kUnlike = 0.1;  // log residual at which a sample counts half
constexpr int kReweighings = 5;
constexpr double kFirm = 1e-9;  // holds what no texel ties to the others, in shares of the diagonal's mean

/// log of the linear light of every byte.
std::array<double, 256> log_light() {
  std::array<double, 256> out{};
  for (int i = 0; i < 256; ++i)
    out[std::size_t(i)] = std::log(double(linear_from_srgb(unit_of_srgb8(std::uint8_t(i)))) + 1e-12);
  return out;
}

struct Observation {
  std::size_t photo;
  double log_light, weight;
};

std::uint8_t channel_of(const SurfaceSample8& s, int channel) { return channel == 0 ? s.r : channel == 1 ? s.g : s.b; }

/// What the photographs say of a texel in one channel. Noise is about as large for all bytes, so that a logarithm
/// counts with the square of its light.
void observe(std::span<const PhotoSamples> photos, std::size_t block, std::size_t texel, int channel,
             const std::array<double, 256>& logs, std::vector<Observation>& out) {
  out.clear();
  for (std::size_t p = 0; p < photos.size(); ++p) {
    if (photos[p].first[block] == kUnseen) continue;
    const SurfaceSample8& s = photos[p].samples[photos[p].first[block] + texel];
    const std::uint8_t byte = channel_of(s, channel);
    if (s.root_weight == 0 || byte < kDarkest || byte > kBrightest) continue;
    const double unit = unit_of_srgb8(byte);
    out.push_back({p, logs[byte], double(s.weight()) * unit * unit});
  }
}

/// The less, the farther from the texel's middle one: a highlight that one photograph shows must not move the others.
void reweigh(std::vector<Observation>& seen, const Eigen::VectorXd& gains) {
  std::vector<double> lights;
  for (const Observation& o : seen) lights.push_back(o.log_light - gains[std::ptrdiff_t(o.photo)]);
  const auto at = lights.begin() + std::ptrdiff_t(lights.size() / 2);
  std::nth_element(lights.begin(), at, lights.end());
  for (Observation& o : seen) {
    const double left = (o.log_light - gains[std::ptrdiff_t(o.photo)] - *at) / kUnlike;
    o.weight /= 1 + left * left;
  }
}

}  // namespace

std::vector<Eigen::Vector3f> exposure_gains(const Atlas& atlas, std::span<const PhotoSamples> photos, Job& job) {
  const auto n = std::ptrdiff_t(photos.size());
  const std::size_t blocks = atlas.blocks.size() - 1;
  const std::array<double, 256> logs = log_light();
  double pairs = 0;  // of photographs at a texel, over all blocks
  for (std::size_t b = 0; b < blocks; ++b) {
    double seen = 0;
    for (const PhotoSamples& p : photos) seen += p.first[b] != kUnseen;
    pairs += seen * seen * double(atlas.blocks[b + 1] - atlas.blocks[b]);
  }
  const std::size_t stride = std::size_t(std::max(1.0, pairs / kPairsWanted));

  Eigen::MatrixXd gains = Eigen::MatrixXd::Zero(n, 3);  // logarithms
  job.begin("exposures", kReweighings);
  for (int round = 0; round < kReweighings; ++round) {
    std::vector<std::array<Eigen::MatrixXd, 3>> normals(kParts);
    std::vector<Eigen::MatrixXd> rights(kParts, Eigen::MatrixXd::Zero(n, 3));
    parallel_for(job, kParts, [&](std::size_t part) {
      for (auto& normal : normals[part]) normal = Eigen::MatrixXd::Zero(n, n);
      std::vector<Observation> seen;
      for (std::size_t b = part; b < blocks; b += kParts)
        // A stride over all texels, so that a coarse choice still meets every part of the surface.
        for (std::size_t texel = (stride - atlas.blocks[b] % stride) % stride;
             texel < atlas.blocks[b + 1] - atlas.blocks[b]; texel += stride)
          for (int ch = 0; ch < 3; ++ch) {
            observe(photos, b, texel, ch, logs, seen);
            if (seen.size() < 2) continue;
            if (round > 0) reweigh(seen, gains.col(ch));
            double weight = 0, light = 0;
            for (const Observation& o : seen) weight += o.weight, light += o.weight * o.log_light;
            light /= weight;
            // The texel's own colour eliminated: Σ w (l_i - g_i - mean(l - g))².
            Eigen::MatrixXd& normal = normals[part][std::size_t(ch)];
            for (const Observation& a : seen) {
              const auto i = std::ptrdiff_t(a.photo);
              normal(i, i) += a.weight;
              rights[part](i, ch) += a.weight * (a.log_light - light);
              for (const Observation& o : seen) normal(i, std::ptrdiff_t(o.photo)) -= a.weight * o.weight / weight;
            }
          }
    });
    for (int ch = 0; ch < 3; ++ch) {
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
      for (std::size_t part = 0; part < kParts; ++part)
        normal += normals[part][std::size_t(ch)], right += rights[part].col(ch);
      const Eigen::VectorXd tied = normal.diagonal();
      normal.diagonal().array() += kFirm * normal.diagonal().mean() + 1e-30;
      gains.col(ch) = normal.ldlt().solve(right);
      // Only differences are known: their mean over the photographs that have any is set to 0.
      double sum = 0;
      int count = 0;
      for (std::ptrdiff_t i = 0; i < n; ++i)
        if (tied[i] > 0) sum += gains(i, ch), ++count;
      for (std::ptrdiff_t i = 0; i < n; ++i) gains(i, ch) = tied[i] > 0 ? gains(i, ch) - sum / count : 0;
    }
    job.advance();
  }
  job.end();
  std::vector<Eigen::Vector3f> out;
  for (std::ptrdiff_t i = 0; i < n; ++i) out.push_back(gains.row(i).transpose().array().exp().cast<float>());
  return out;
}

void divide_by_gain(PhotoSamples& photo, const Eigen::Vector3f& gain) {
  std::array<std::array<std::uint8_t, 256>, 3> table;
  for (std::size_t ch = 0; ch < 3; ++ch)
    for (std::size_t i = 0; i < 256; ++i) {
      const float light = linear_from_srgb(unit_of_srgb8(std::uint8_t(i))) / gain[std::ptrdiff_t(ch)];
      table[ch][i] = srgb8_of_unit(srgb_from_linear(std::min(light, 1.0f)));
    }
  for (SurfaceSample8& s : photo.samples) s.r = table[0][s.r], s.g = table[1][s.g], s.b = table[2][s.b];
}

}  // namespace lumihull::slf
