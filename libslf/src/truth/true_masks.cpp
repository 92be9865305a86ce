// Silhouettes against the true ones.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/slf/metrics.h>

#include "mask_edges.h"
#include "parts.h"
#include "stages/stage.h"

namespace lumihull::slf::truth {
namespace {

Spread spread_of(const DistanceHistogram& h) {
  if (!h.count()) return {};
  return {h.count(), h.mean(), h.rms(), h.quantile(0.5), h.quantile(0.95), h.max()};
}

/// Σ mask / 255, px
double area(const Image& mask) {
  std::uint64_t sum = 0;
  for (int y = 0; y < mask.height(); ++y) {
    const std::uint8_t* row = mask.row<std::uint8_t>(y);
    for (int x = 0; x < mask.width(); ++x) sum += row[x];
  }
  return double(sum) / 255;
}

struct Judged {
  MaskTruth::Shot shot;
  DistanceHistogram distances;
};

Judged judge(const Image& mask, const Image& truth) {
  Judged j;
  j.shot.iou = silhouette_iou(mask, truth);
  const MaskEdges found(mask), real(truth);
  for (const auto& [from, to] : {std::pair(&found, &real), std::pair(&real, &found)})
    for (const MaskEdges::Segment& s : from->segments())
      j.distances.add(to->distance(s.middle(), DistanceHistogram::kReach), s.length());
  j.shot.edge_px = spread_of(j.distances);
  j.shot.within = j.distances.within(MaskTruth::kEdgePx);
  const double length = real.length();
  j.shot.bias_px = length > 0 ? (area(mask) - area(truth)) / length : kUnknown;
  const FalseParts parts = false_parts(mask, truth);
  j.shot.holes = parts.holes, j.shot.hole_px = parts.hole_px;
  j.shot.islands = parts.islands, j.shot.island_px = parts.island_px;
  return j;
}

}  // namespace

Image true_mask(const std::filesystem::path& file, const Image& like) {
  Image mask = read_image(file, {.channels = 1});
  if (mask.type() != PixelType::u8) mask = converted(mask, PixelType::u8, 1);
  if (mask.width() != like.width() || mask.height() != like.height())
    throw Error(ErrorCode::bad_input,
                "expected a mask of " + std::to_string(like.width()) + " x " + std::to_string(like.height()) +
                    " pixels, not " + std::to_string(mask.width()) + " x " + std::to_string(mask.height()),
                file.string());
  return mask;
}

std::optional<MaskTruth> compare_masks(const Capture& capture, const std::filesystem::path& folder, Job& job) {
  MaskTruth out;
  std::vector<std::size_t> shots;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    if (!file_exists(capture.mask_path(capture.shots[i]))) continue;
    if (file_exists(folder / (capture.shots[i].name + ".png")))
      shots.push_back(i);
    else
      out.without_truth.push_back(capture.shots[i].name);
  }
  if (shots.empty()) return std::nullopt;
  out.shots.resize(shots.size());
  std::vector<DistanceHistogram> distances((shots.size() + 15) / 16);  // one for each chunk: memory stays bounded
  job.begin("masks beside the truth", shots.size());
  parallel_chunks(job, shots.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      job.check();
      const std::string& name = capture.shots[shots[i]].name;
      const Image mask = capture.read_mask(shots[i]);
      Judged judged = judge(mask, true_mask(folder / (name + ".png"), mask));
      judged.shot.name = name;
      out.shots[i] = std::move(judged.shot);
      distances[first / 16].add(judged.distances);
      job.advance();
    }
  });
  job.end();
  DistanceHistogram all;
  for (const DistanceHistogram& h : distances) all.add(h);
  out.edge_px = spread_of(all);
  out.within = all.within(MaskTruth::kEdgePx);
  out.iou_least = 1;
  double bias = 0;
  std::size_t biased = 0;
  for (const MaskTruth::Shot& s : out.shots) {
    out.iou_mean += s.iou;
    out.iou_least = std::min(out.iou_least, s.iou);
    out.holes += s.holes, out.islands += s.islands;
    if (std::isfinite(s.bias_px)) bias += s.bias_px, ++biased;
  }
  out.iou_mean /= double(out.shots.size());
  out.bias_px = biased ? bias / double(biased) : kUnknown;
  return out;
}

}  // namespace lumihull::slf::truth
