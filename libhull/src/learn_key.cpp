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
constexpr int kMostRounds = 5;
constexpr double kSettled = 0.002;  // changed pixels, as a share of the object's

calib::ColorKey train(const std::vector<calib::ColorCount>& background, const std::vector<calib::ColorCount>& object,
                      const KeyOptions& options, Job& job) {
  const auto samples = calib::subsample(background, options.max_samples);
  std::vector<calib::Rgb> list;
  for (const auto& s : samples) list.insert(list.end(), s.count, s.color);
  calib::ColorKey uniform = calib::ColorKey::train(list, {options.k, options.foreground_share, options.seed}, job);
  if (object.empty()) return uniform;
  std::vector<calib::ColorCount> foreground(uniform.foreground().begin(), uniform.foreground().end());
  foreground.insert(foreground.end(), object.begin(), object.end());
  return calib::ColorKey::train(samples, foreground, options.k, job);
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
    const std::uint8_t* in = photo.row<std::uint8_t>(y * step + step / 2);
    std::uint8_t* to = out.row<std::uint8_t>(y);
    for (int x = 0; x < out.width(); ++x)
      std::copy_n(in + (x * step + step / 2) * channels, channels, to + x * channels);
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
  LearnedKey learned{train(background, {}, options, job), {}, 0};

  const auto key_views = [&] {
    parallel_for(job, used, [&](std::size_t i) {
      views[i].mask = calib::key_image(learned.key, photos[i], {calib::EdgeMode::hard, 0, 0});
      const calib::Frame& f = views[i].frame;
      for (int y = 0; y < views[i].mask.height(); ++y) {
        std::uint8_t* row = views[i].mask.row<std::uint8_t>(y);
        const bool inside = y >= f.y0 && y < f.y1;
        std::fill(row, row + (inside ? f.x0 : views[i].mask.width()), std::uint8_t(0));
        if (inside) std::fill(row + f.x1, row + views[i].mask.width(), std::uint8_t(0));
      }
      calib::clean_mask(views[i].mask, 64, 0);
    });
  };
  key_views();
  if (std::count(positioned.begin(), positioned.end(), 1) < 3) return learned;

  std::vector<CoarseView> carving;
  for (int round = 1; round <= kMostRounds; ++round) {
    job.check();
    carving.clear();
    for (std::size_t i = 0; i < used; ++i)
      if (positioned[i]) carving.push_back(views[i]);
    std::optional<CoarseHull> hull = CoarseHull::carve(carving, kResolution, kTolerance, job);
    if (!hull) break;
    learned.hull = std::move(hull);
    learned.rounds = round;

    calib::ColorHistogram outside, inside;
    parallel_for(job, used, [&](std::size_t i) {
      if (!positioned[i]) return;
      const CoarseView& v = views[i];
      const Image near_object = learned.hull->silhouette(v, 3 + int(std::ceil(learned.hull->voxel_px(v))));
      for (int y = v.frame.y0; y < v.frame.y1; ++y) {
        const std::uint8_t* p = photos[i].row<std::uint8_t>(y) + 3 * v.frame.x0;
        const std::uint8_t *near = near_object.row<std::uint8_t>(y), *mask = v.mask.row<std::uint8_t>(y);
        for (int x = v.frame.x0; x < v.frame.x1; ++x, p += 3) {
          if (!near[x]) outside.add({p[0], p[1], p[2]});
          if (near[x] && mask[x]) inside.add({p[0], p[1], p[2]});
        }
      }
    });
    background = outside.counts();
    if (background.empty()) break;
    learned.key = train(background, {}, options, job);

    std::vector<Image> before(used);
    for (std::size_t i = 0; i < used; ++i) before[i] = views[i].mask;
    key_views();
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
  return learned;
}

}  // namespace lumihull::hull
