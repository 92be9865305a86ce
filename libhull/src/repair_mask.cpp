#include "repair_mask.h"

#include <lumihull/base/parallel.h>
#include <lumihull/calib/key_image.h>

#include <algorithm>
#include <cmath>

#include "local_colors.h"

namespace lumihull::hull {
namespace {

constexpr std::size_t kLeastViews = 5;
constexpr int kResolution = 96;          // voxels a side
constexpr double kMistakenViews = 0.04;  // share of the views that bleed at the same place
constexpr double kWide = 0.3;            // the same, where all that may be object is wanted
constexpr int kRounds = 2;               // of deciding and carving again
constexpr double kLeastMended = 5e-5;    // of the picture's pixels: what is no speck
constexpr int kPaperReach = 16;          // sheets' colours abstain as far as a sixteenth of the picture from the hull
constexpr double kShadow = 1.2;          // a shadow's saturation over the enclosure's
constexpr int kLeastLight = 24;          // red + green + blue below which a colour has no hue to speak of
constexpr double kGrey = 0.01;           // squared saturation below which an enclosure has none

void remove_specks(Image& mask) {
  const double pixels = double(mask.width()) * mask.height();
  calib::clean_mask(mask, int(2e-4 * pixels), int(1e-4 * pixels));
}

}  // namespace

void take_shadows(Image& mask, const Image& photo, const calib::Rgb& background) {
  const int light = background[0] + background[1] + background[2];
  if (light == 0) return;
  // Along the enclosure's own hue: how far a colour is from grey, as a share of its brightness.
  double hue[3], square = 0;
  for (int c = 0; c < 3; ++c) hue[c] = double(background[std::size_t(c)]) / light - 1. / 3, square += hue[c] * hue[c];
  if (square < kGrey) return;
  for (int y = 0; y < mask.height(); ++y) {
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    const std::uint8_t* p = photo.row<std::uint8_t>(y);
    for (int x = 0; x < mask.width(); ++x, p += 3) {
      const int sum = p[0] + p[1] + p[2];
      if (row[x] < 128 || sum > light || sum < kLeastLight) continue;
      if (hue[0] * p[0] + hue[1] * p[1] + hue[2] * p[2] >= kShadow * square * sum) row[x] = 0;
    }
  }
}

std::optional<MaskRepair> MaskRepair::carve(std::span<const CoarseView> views, Job& job) {
  const double forgiven = std::max(1.0, std::floor(kMistakenViews * double(views.size()) + 0.5));
  const double tolerance = (forgiven + 0.5) / double(views.size());
  auto hull = CoarseHull::carve(views, kResolution, tolerance, job);
  auto wide = CoarseHull::carve(views, kResolution, std::max(kWide, tolerance), job);
  if (!hull || !wide) return std::nullopt;
  return MaskRepair(std::move(*hull), std::move(*wide));
}

std::optional<MaskRepair> MaskRepair::learn(const Source& source, Job& job) {
  const std::size_t n = source.views.size();
  if (n < kLeastViews) return std::nullopt;
  std::vector<CoarseView> keyed(source.views.begin(), source.views.end());
  if (source.background)
    parallel_for(job, n, [&](std::size_t i) {
      if (!source.fixed[i]) take_shadows(keyed[i].mask, source.photos[i], *source.background);
    });
  std::vector<CoarseView> voting = keyed;
  const auto carve_voting = [&] {
    parallel_for(job, n, [&](std::size_t i) {
      if (!source.fixed[i]) remove_specks(voting[i].mask);
    });
    return carve(voting, job);
  };
  std::optional<MaskRepair> repair = carve_voting();
  if (!repair) return std::nullopt;
  std::optional<PaperColors> paper;
  if (!source.sheets.empty())
    paper = PaperColors::learn(source.sheets, source.views, source.photos, repair->hull_, job);
  if (paper) {
    // A sheet's colour near the object is no vote against it.
    voting = keyed;
    parallel_for(job, n, [&](std::size_t i) {
      if (source.fixed[i]) return;
      Image& mask = voting[i].mask;
      const Image near = repair->wide_.silhouette(voting[i], std::max(mask.width(), mask.height()) / kPaperReach);
      for (int y = 0; y < mask.height(); ++y) {
        const std::uint8_t *is_near = near.row<std::uint8_t>(y), *p = source.photos[i].row<std::uint8_t>(y);
        std::uint8_t* row = mask.row<std::uint8_t>(y);
        for (int x = 0; x < mask.width(); ++x, p += 3)
          if (is_near[x] && paper->is_paper(p)) row[x] = 255;
      }
    });
    if (auto better = carve(voting, job)) repair = std::move(better);
  }
  for (int round = 0; round < kRounds; ++round) {
    voting = keyed;
    parallel_for(job, n, [&](std::size_t i) {
      if (!source.fixed[i])
        decide_by_surroundings(voting[i].mask, source.photos[i], voting[i], repair->hull_, repair->wide_,
                               paper ? &*paper : nullptr, source.least_deep);
    });
    if (auto better = carve_voting()) repair = std::move(better);
  }
  repair->paper_ = std::move(paper);
  repair->background_ = source.background;
  repair->least_deep_ = source.least_deep;
  return repair;
}

bool MaskRepair::mend(Image& mask, const Image& photo, const CoarseView& view) const {
  if (background_) take_shadows(mask, photo, *background_);
  const std::size_t mended =
      decide_by_surroundings(mask, photo, view, hull_, wide_, paper_ ? &*paper_ : nullptr, least_deep_);
  return double(mended) >= std::max(4.0, kLeastMended * mask.width() * mask.height());
}

}  // namespace lumihull::hull
