#include "learn_key.h"

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/background.h>
#include <lumihull/calib/key_image.h>

#include <algorithm>
#include <cmath>

namespace lumihull::hull {
namespace {

constexpr std::size_t kMostPhotos = 64;  // evenly spread; they stay in memory, thinned
constexpr double kMostPixels = 500'000;  // of a thinned photograph
constexpr int kResolution = 96;          // voxels a side
constexpr double kTolerance = 0.12;      // share of the views that may call an object's voxel background
constexpr int kDark = 40;                // brightest channel of a background that shadows can't be told from
constexpr double kDarkTolerance = 0.25;  // as kTolerance, before such a background
constexpr double kShadowShare = 0.2;     // shadows among the background samples
constexpr double kObjectShare = 0.5;     // samples of the object's own colours, as a share of the background's
constexpr int kSure = 3;  // voxels below the hull's surface: no shaving of a rightful outline is so thick
constexpr int kMostRounds = 5;
constexpr double kSettled = 0.002;  // changed pixels, as a share of the object's

/// SplitMix64 (Steele, Lea & Flood 2014), 0 … 1.
double next_random(std::uint64_t& state) {
  std::uint64_t z = state += 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

std::vector<calib::Rgb> listed(std::span<const calib::ColorCount> colors) {
  std::vector<calib::Rgb> list;
  for (const auto& c : colors) list.insert(list.end(), c.count, c.color);
  return list;
}

/// Background colours in shadow: darkened by a common factor, with a little play a channel (the light that reaches a
/// shadow has another tint). The shadow beneath an object is never seen beside it, so no photograph teaches it.
void add_shadows(std::vector<calib::Rgb>& samples, std::size_t count, std::uint64_t seed) {
  if (samples.empty()) return;
  const std::size_t n = samples.size();
  samples.reserve(n + count);
  std::uint64_t state = seed;
  for (std::size_t i = 0; i < count; ++i) {
    calib::Rgb c = samples[i * n / count];
    const double light = 0.35 + 0.6 * next_random(state);
    for (std::uint8_t& v : c) v = std::uint8_t(std::clamp(v * light * (0.9 + 0.2 * next_random(state)), 0.0, 255.0));
    samples.push_back(c);
  }
}

/// Where nothing is known of the object: the paper's key.
calib::ColorKey train(std::span<const calib::ColorCount> background, const KeyOptions& options, Job& job) {
  return calib::ColorKey::train(listed(calib::subsample(background, options.max_samples)),
                                {options.k, options.foreground_share, options.seed}, job);
}

/// With the object's own colours beside the uniform foreground, and with the background's shadows.
calib::ColorKey train(std::span<const calib::ColorCount> background, std::span<const calib::ColorCount> object,
                      const KeyOptions& options, Job& job) {
  const std::size_t shadows = std::size_t(kShadowShare * double(options.max_samples));
  std::vector<calib::Rgb> samples = listed(calib::subsample(background, options.max_samples - shadows));
  add_shadows(samples, std::min(shadows, samples.size()), options.seed);
  const auto uniform = std::size_t(std::llround(options.foreground_share * double(samples.size())));
  std::vector<calib::ColorCount> foreground =
      calib::subsample(object, std::size_t(kObjectShare * double(samples.size())));
  std::uint64_t state = options.seed;
  for (std::size_t i = 0; i < std::max(uniform, std::size_t(options.k)); ++i) {
    calib::ColorCount c{{}, 1};
    for (std::uint8_t& v : c.color) v = std::uint8_t(256 * next_random(state));
    foreground.push_back(c);
  }
  return calib::ColorKey::train(calib::count_colors(samples), foreground, options.k, job);
}

/// Sets to 0 what lies outside of the frame, or where `near` is 0.
void confine(Image& mask, const calib::Frame& f, const Image* near) {
  for (int y = 0; y < mask.height(); ++y) {
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    for (int x = 0; x < mask.width(); ++x)
      if (y < f.y0 || y >= f.y1 || x < f.x0 || x >= f.x1 || (near && !near->row<std::uint8_t>(y)[x])) row[x] = 0;
  }
}

}  // namespace

int thinning_step(int width, int height) {
  return std::max(1, int(std::ceil(std::sqrt(double(width) * height / kMostPixels))));
}

Image thinned(const Image& photo, int step) {
  if (step == 1) return photo;
  Image out(std::max(1, photo.width() / step), std::max(1, photo.height() / step), photo.channels());
  const int channels = photo.channels();
  for (int y = 0; y < out.height(); ++y) {
    // (A picture narrower than a step still has a column.)
    const std::uint8_t* in = photo.row<std::uint8_t>(std::min(y * step + step / 2, photo.height() - 1)) +
                             std::min(step / 2, photo.width() - 1) * channels;
    std::uint8_t* to = out.row<std::uint8_t>(y);
    for (int x = 0; x < out.width(); ++x, in += step * channels)
      for (int c = 0; c < channels; ++c) *to++ = in[c];
  }
  return out;
}

LearnedKey learn_key(const Capture& capture, std::span<const std::size_t> shots, const KeyOptions& options, Job& job) {
  const std::size_t used = std::min(shots.size(), kMostPhotos);
  std::vector<Image> photos(used);
  std::vector<CoarseView> views(used);
  std::vector<std::uint8_t> positioned(used, 0);
  job.begin("learning the background: reading", used);
  parallel_for(
      job, used,
      [&](std::size_t i) {
        const std::size_t shot = shots[i * shots.size() / used];
        const Image photo = calib::keyable(capture.read_photo(shot));
        views[i].step = thinning_step(photo.width(), photo.height());
        photos[i] = thinned(photo, views[i].step);
        views[i].frame = calib::find_frame(photos[i]);
        positioned[i] = capture.positioned(shot);
        if (positioned[i]) views[i].view = capture.view(shot);
      },
      true);
  job.end();

  std::vector<calib::ColorCount> background = calib::background_of_photos(
      used, [&](std::size_t i) { return photos[i]; }, job);
  LearnedKey learned{train(background, options, job), {}, 0, {}, {}};

  std::vector<Image> near(used);  // where the object can be, once there is a hull
  const auto key_views = [&] {
    parallel_for(
        job, used,
        [&](std::size_t i) {
          views[i].mask = calib::key_image(learned.key, photos[i], {calib::EdgeMode::hard, 0, 0});
          confine(views[i].mask, views[i].frame, near[i].empty() ? nullptr : &near[i]);
          calib::clean_mask(views[i].mask, 64, 0);
        },
        true);
  };
  job.begin("learning the background: first silhouettes", used);
  key_views();
  job.end();
  if (std::count(positioned.begin(), positioned.end(), 1) < 3) return learned;

  const auto positioned_views = [&] {
    std::vector<CoarseView> list;
    for (std::size_t i = 0; i < used; ++i)
      if (positioned[i]) list.push_back(views[i]);
    return list;
  };
  for (int round = 1; round <= kMostRounds; ++round) {
    job.begin("learning the background: round " + std::to_string(round), 2 * used);
    std::optional<CoarseHull> hull = CoarseHull::carve(positioned_views(), kResolution, kTolerance, job);
    if (!hull) break;
    learned.hull = std::move(hull);
    learned.rounds = round;

    calib::ColorHistogram outside, inside;
    parallel_for(
        job, used,
        [&](std::size_t i) {
          if (!positioned[i]) return;
          const CoarseView& v = views[i];
          near[i] = learned.hull->silhouette(v, learned.hull->margin_px(v));
          const Image sure = shrunk(v.mask, 4);
          for (int y = v.frame.y0; y < v.frame.y1; ++y) {
            const std::uint8_t* p = photos[i].row<std::uint8_t>(y) + 3 * v.frame.x0;
            const std::uint8_t *is_near = near[i].row<std::uint8_t>(y), *is_sure = sure.row<std::uint8_t>(y);
            for (int x = v.frame.x0; x < v.frame.x1; ++x, p += 3) {
              if (!is_near[x]) outside.add({p[0], p[1], p[2]});
              if (is_near[x] && is_sure[x]) inside.add({p[0], p[1], p[2]});
            }
          }
        },
        true);
    background = outside.counts();
    if (background.empty()) break;
    learned.key = train(background, inside.counts(), options, job);

    std::vector<Image> before(used);
    for (std::size_t i = 0; i < used; ++i) before[i] = std::move(views[i].mask);
    key_views();
    job.end();
    std::size_t changed = 0, object = 0;
    for (std::size_t i = 0; i < used; ++i)
      for (int y = 0; y < before[i].height(); ++y)
        for (int x = 0; x < before[i].width(); ++x) {
          const bool is = views[i].mask.row<std::uint8_t>(y)[x] >= 128;
          changed += is != (before[i].row<std::uint8_t>(y)[x] >= 128);
          object += is;
        }
    if (double(changed) <= kSettled * double(object)) break;
  }
  const calib::Rgb median = learned.key.background_median();
  if (learned.hull && *std::max_element(median.begin(), median.end()) < kDark)
    learned.solid = CoarseHull::carve(positioned_views(), kResolution, kDarkTolerance, job);
  if (learned.hull && options.clean) {
    std::vector<CoarseView> list = positioned_views();
    std::vector<Image> pictures;
    for (std::size_t i = 0; i < used; ++i)
      if (positioned[i]) pictures.push_back(std::move(photos[i]));
    const std::vector<std::uint8_t> fixed(list.size(), 0);
    learned.repair = MaskRepair::learn({list, pictures, fixed, {}, nullptr, {}, kSure}, job);
  }
  return learned;
}

}  // namespace lumihull::hull
