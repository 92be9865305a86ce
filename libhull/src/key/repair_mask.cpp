#include "repair_mask.h"

#include <lumihull/base/parallel.h>
#include <lumihull/calib/key_image.h>

#include <algorithm>
#include <cmath>

#include "local_colors.h"
#include "wall_key.h"

namespace lumihull::hull {
namespace {

constexpr std::size_t kLeastViews = 5;
constexpr int kResolution = 96;          // voxels a side
constexpr double kMistakenViews = 0.04;  // share of the views that bleed at the same place
constexpr double kWide = 0.3;            // the same, where all that may be object is wanted
constexpr int kRounds = 2;               // of deciding and carving again
constexpr double kLeastMended = 5e-5;    // of the picture's pixels: what is no speck
constexpr int kPaperReach = 16;          // sheets' colours abstain as far as a sixteenth of the picture from the hull

void remove_specks(Image& mask) {
  const double pixels = double(mask.width()) * mask.height();
  calib::clean_mask(mask, int(2e-4 * pixels), int(1e-4 * pixels));
}

}  // namespace

std::optional<MaskRepair> MaskRepair::carve(std::span<const CoarseView> views, Job& job) {
  const double forgiven = std::max(1.0, std::floor(kMistakenViews * double(views.size()) + 0.5));
  const double tolerance = (forgiven + 0.5) / double(views.size());
  auto hull = CoarseHull::carve(views, kResolution, tolerance, job);
  auto wide = CoarseHull::carve(views, kResolution, std::max(kWide, tolerance), job);
  if (!hull || !wide) return std::nullopt;
  return MaskRepair(std::move(*hull), std::move(*wide));
}

void MaskRepair::learn_sheets(const Source& source, Job& job) {
  Eigen::Vector3d eyes = Eigen::Vector3d::Zero();
  for (const CoarseView& v : source.views) eyes += v.view.center() / double(source.views.size());
  sheets_ = sheets_of(source.sheets, eyes);
  paper_ = PaperColors::learn(sheets_, source.views, source.photos, hull_, job);
  if (!paper_) return;
  measure_paper(sheets_, source.views, source.photos, wide_, *paper_, job);
  beside_sheets_ = key_beside_sheets(*source.key, sheets_, source.views, source.photos, wide_, job);
}

/// A sheet's colour near the object is no vote against it.
void MaskRepair::abstain_on_sheets(const CoarseView& view, const Image& photo, const Image& parts, Image& mask) const {
  const Image near = wide_.silhouette(view, std::max(mask.width(), mask.height()) / kPaperReach);
  for (int y = 0; y < mask.height(); ++y) {
    const std::uint8_t *is_near = near.row<std::uint8_t>(y), *part = parts.row<std::uint8_t>(y);
    const std::uint8_t* p = photo.row<std::uint8_t>(y);
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    for (int x = 0; x < mask.width(); ++x, p += 3)
      if (is_near[x] && part[x] != kNoSheet && paper_->is_paper(p)) row[x] = 255;
  }
}

std::optional<MaskRepair> MaskRepair::learn(const Source& source, Job& job) {
  const std::size_t n = source.views.size();
  if (n < kLeastViews) return std::nullopt;
  std::vector<CoarseView> keyed(source.views.begin(), source.views.end());
  const auto for_each_open = [&](auto&& visit) {
    parallel_for(job, n, [&](std::size_t i) {
      if (!source.fixed[i]) visit(i);
    });
  };
  std::optional<Shadows> shadows;
  if (source.background) shadows = Shadows(*source.background);
  const auto take_shadows = [&] {
    if (shadows) for_each_open([&](std::size_t i) { shadows->take(keyed[i].mask, source.photos[i]); });
  };
  take_shadows();
  std::vector<CoarseView> voting = keyed;
  for_each_open([&](std::size_t i) { remove_specks(voting[i].mask); });
  std::optional<MaskRepair> repair = carve(voting, job);
  if (!repair) return std::nullopt;
  // The first hull is good enough to tell what is beside the object; what all that tells stays.
  if (shadows) shadows->learn(source.views, source.photos, repair->wide_, job);
  repair->shadows_ = shadows;
  repair->least_deep_ = source.least_deep;
  if (!source.sheets.empty()) repair->learn_sheets(source, job);
  const auto carve_anew = [&] {
    auto better = carve(voting, job);
    if (better) repair->hull_ = std::move(better->hull_), repair->wide_ = std::move(better->wide_);
  };
  std::vector<Image> parts(n);
  if (repair->paper_) {
    parallel_for(job, n, [&](std::size_t i) { parts[i] = sheets_in(source.views[i], repair->sheets_); });
    if (repair->beside_sheets_)
      for_each_open(
          [&](std::size_t i) { key_places(keyed[i].mask, source.photos[i], parts[i], *repair->beside_sheets_, true); });
  }
  take_shadows();
  if (repair->paper_) {
    voting = keyed;
    for_each_open(
        [&](std::size_t i) { repair->abstain_on_sheets(voting[i], source.photos[i], parts[i], voting[i].mask); });
    carve_anew();
  }
  for (int round = 0; round < kRounds; ++round) {
    voting = keyed;
    for_each_open([&](std::size_t i) {
      decide_by_surroundings(voting[i].mask, source.photos[i], voting[i], repair->hull_, repair->wide_,
                             repair->clues(parts[i]), source.least_deep);
      remove_specks(voting[i].mask);
    });
    carve_anew();
  }
  return repair;
}

Clues MaskRepair::clues(const Image& parts) const {
  return {paper_ ? &*paper_ : nullptr, paper_ ? &parts : nullptr, shadows_ ? &*shadows_ : nullptr};
}

bool MaskRepair::mend(Image& mask, const Image& photo, const CoarseView& view) const {
  Image parts;
  if (paper_) parts = sheets_in(view, sheets_);
  if (beside_sheets_) key_places(mask, photo, parts, *beside_sheets_, false);
  if (shadows_) shadows_->take(mask, photo);
  const std::size_t mended = decide_by_surroundings(mask, photo, view, hull_, wide_, clues(parts), least_deep_);
  return double(mended) >= std::max(4.0, kLeastMended * mask.width() * mask.height());
}

}  // namespace lumihull::hull
