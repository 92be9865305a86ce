#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/background.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/hull/auto_key.h>

#include <algorithm>
#include <cmath>

#include "learn_key.h"
#include "repair_mask.h"

namespace lumihull::hull {
namespace {

constexpr double kSpeck = 2e-4, kHole = 1e-4;  // of the picture; what `clean` takes away and fills
constexpr double kShadowHole = 3e-3;           // as kHole, for shadows before a dark enclosure
constexpr std::size_t kMostLooks = 64;         // photographs that are compared before any mask is written

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::invalid_argument, message, "key options"); }

calib::ColorKey train(const std::vector<calib::ColorCount>& background, const KeyOptions& options, Job& job) {
  std::vector<calib::Rgb> list;
  for (const auto& s : calib::subsample(background, options.max_samples)) list.insert(list.end(), s.count, s.color);
  return calib::ColorKey::train(list, {options.k, options.foreground_share, options.seed}, job);
}

calib::ColorKey key_of_enclosure(const Capture& capture, const KeyOptions& options, Job& job) {
  if (capture.enclosure.empty())
    throw Error(ErrorCode::not_found,
                "the capture has no photographs of the empty enclosure: expected them in enclosure/",
                capture.folder().string());
  calib::ColorHistogram histogram;
  job.begin("reading the empty enclosure", capture.enclosure.size());
  parallel_for(
      job, capture.enclosure.size(),
      [&](std::size_t i) {
        histogram.add_pixels(calib::keyable(read_image(capture.photo_path(capture.enclosure[i]), {.channels = 3})));
      },
      true);
  job.end();
  return train(histogram.counts(), options, job);
}

calib::ColorKey key_of_regions(const Capture& capture, const KeyOptions& options, Job& job) {
  const std::vector<calib::Region> regions = calib::parse_regions(options.regions);
  calib::ColorHistogram histogram;
  for (const calib::Region& region : regions) {
    job.check();
    const auto shot =
        std::find_if(capture.shots.begin(), capture.shots.end(), [&](const Shot& s) { return s.name == region.photo; });
    if (shot == capture.shots.end())
      throw Error(ErrorCode::invalid_argument, "the regions name a photograph that the capture does not have",
                  region.photo);
    const Image photo = calib::keyable(capture.read_photo(std::size_t(shot - capture.shots.begin())));
    if (region.x > photo.width() - region.width || region.y > photo.height() - region.height)
      throw Error(ErrorCode::invalid_argument,
                  "a region reaches beyond the photograph of " + std::to_string(photo.width()) + " x " +
                      std::to_string(photo.height()) + " pixels",
                  region.photo);
    for (int y = region.y; y < region.y + region.height; ++y) {
      const std::uint8_t* p = photo.row<std::uint8_t>(y) + 3 * region.x;
      for (int x = 0; x < region.width; ++x, p += 3) histogram.add({p[0], p[1], p[2]});
    }
  }
  return train(histogram.counts(), options, job);
}

CoarseView coarse_view(const Capture& capture, std::size_t shot, const Image& photo) {
  CoarseView view;
  view.step = thinning_step(photo.width(), photo.height());
  view.view = capture.view(shot);
  view.frame = {0, 0, std::max(1, photo.width() / view.step), std::max(1, photo.height() / view.step)};
  return view;
}

bool is_given(const Capture& capture, std::size_t shot) {
  const MaskSource source = capture.mask_state(capture.shots[shot]);
  return source == MaskSource::imported || source == MaskSource::edited;
}

/// Looks at some of the shots coarsely, to know what masks the others contradict.
std::optional<MaskRepair> look_around(const Capture& capture, std::span<const std::size_t> shots,
                                      const calib::ColorKey& key, Job& job) {
  std::vector<std::size_t> positioned;
  for (const std::size_t shot : shots)
    if (capture.positioned(shot)) positioned.push_back(shot);
  const std::size_t n = positioned.size(), used = std::min(n, kMostLooks);
  std::vector<CoarseView> views(used);
  std::vector<Image> photos(used);
  std::vector<std::uint8_t> given(used, 0);
  job.begin("comparing silhouettes", used);
  parallel_for(
      job, used,
      [&](std::size_t i) {
        // One of each stretch of shots, at changing places in it: a fixed step could follow the trajectory's own.
        const std::size_t first = i * n / used, stretch = (i + 1) * n / used - first;
        const std::size_t shot = positioned[first + i * 0x9E3779B97F4A7C15u % 1009 % stretch];
        const Image photo = calib::keyable(capture.read_photo(shot));
        views[i] = coarse_view(capture, shot, photo);
        photos[i] = thinned(photo, views[i].step);
        given[i] = is_given(capture, shot);
        views[i].mask = given[i] ? thinned(capture.read_mask(shot), views[i].step)
                                 : calib::key_image(key, photos[i], {calib::EdgeMode::hard, 0, 0});
      },
      true);
  std::optional<calib::TargetModel> model;
  if (std::filesystem::exists(calib::target_model_path(capture))) model = calib::TargetModel::of(capture);
  std::span<const calib::CalibratedBody> sheets;
  if (model) sheets = model->calibration.bodies;
  auto repair = MaskRepair::learn({views, photos, given, sheets, &key, key.background_median(), 0}, job);
  job.end();
  return repair;
}

/// Sets to background what is in the scan's frame, or where the object can't be.
void confine(Image& mask, const Image& photo, const Capture& capture, std::size_t shot, const LearnedKey& learned) {
  CoarseView view;
  view.step = thinning_step(photo.width(), photo.height());
  std::optional<Image> near;
  if (learned.hull && capture.positioned(shot)) {
    view.view = capture.view(shot);
    view.mask = Image(std::max(1, photo.width() / view.step), std::max(1, photo.height() / view.step), 1);
    near = learned.hull->silhouette(view, learned.hull->margin_px(view));
  }
  const calib::Frame frame = calib::find_frame(photo);
  for (int y = 0; y < mask.height(); ++y) {
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    if (y < frame.y0 || y >= frame.y1) {
      std::fill(row, row + mask.width(), std::uint8_t(0));
      continue;
    }
    std::fill(row, row + frame.x0, std::uint8_t(0));
    std::fill(row + frame.x1, row + mask.width(), std::uint8_t(0));
    if (!near) continue;
    const std::uint8_t* can_be = near->row<std::uint8_t>(std::min(y / view.step, near->height() - 1));
    for (int first = 0, i = 0; first < mask.width(); first += view.step, i = std::min(i + 1, near->width() - 1))
      if (!can_be[i]) std::fill(row + first, row + std::min(first + view.step, mask.width()), std::uint8_t(0));
  }
}

/// Fills holes of the size that shadows have, where all but a few views agree that the object is there.
void fill_shadows(Image& mask, const Capture& capture, std::size_t shot, const LearnedKey& learned) {
  if (!learned.solid || !capture.positioned(shot)) return;
  CoarseView view;
  view.step = thinning_step(mask.width(), mask.height());
  view.view = capture.view(shot);
  view.mask = Image(std::max(1, mask.width() / view.step), std::max(1, mask.height() / view.step), 1);
  const Image solid = shrunk(learned.solid->silhouette(view, 0), learned.solid->margin_px(view) / 2);
  Image filled = mask;
  calib::clean_mask(filled, 0, int(kShadowHole * double(mask.width()) * mask.height()));
  for (int y = 0; y < mask.height(); ++y) {
    const std::uint8_t* in = filled.row<std::uint8_t>(y);
    const std::uint8_t* is_solid = solid.row<std::uint8_t>(std::min(y / view.step, solid.height() - 1));
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    for (int x = 0; x < mask.width(); ++x)
      if (in[x] && is_solid[std::min(x / view.step, solid.width() - 1)]) row[x] = 255;
  }
}

}  // namespace

void KeyOptions::validate() const {
  calib::ColorKeyOptions{k, foreground_share, seed}.validate();
  if (background.empty()) fail("background: expected auto, enclosure, photos, regions or a key file");
  if (max_samples < 100 || max_samples > 1'000'000) fail("max samples: expected 100 to 1000000");
  if (background == "regions") calib::parse_regions(regions);
  if (background != "regions" && !regions.empty()) fail("regions are used with background = regions only");
}

KeyReport key_capture(Capture& capture, const KeyOptions& options, Job& job) {
  options.validate();
  if (capture.shots.empty())
    throw Error(ErrorCode::not_found, "the capture has no photographs", capture.folder().string());

  KeyReport report;
  std::vector<std::size_t> training, todo;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    if (!capture.held_out(i)) training.push_back(i);
    if (is_given(capture, i))
      ++report.kept;
    else
      todo.push_back(i);
  }

  std::optional<LearnedKey> learned;
  std::optional<calib::ColorKey> key;
  const std::string source = options.background != "auto" ? options.background
                             : capture.enclosure.empty()  ? "photos"
                                                          : "enclosure";
  report.source = source;
  if (source == "enclosure") {
    key = key_of_enclosure(capture, options, job);
  } else if (source == "regions") {
    key = key_of_regions(capture, options, job);
  } else if (source == "photos") {
    learned = learn_key(capture, training, options, job);
    key = learned->key;
    report.rounds = learned->rounds;
    if (learned->hull) report.source = "photos and cameras";
  } else {
    key = calib::ColorKey::load(source, job);
    report.source = "file";
  }

  std::optional<MaskRepair> repair;
  if (options.clean && !todo.empty())
    repair = learned ? std::move(learned->repair) : look_around(capture, training, *key, job);

  std::vector<double> object_share(todo.size());  // of the picture
  std::vector<std::uint8_t> mended(todo.size(), 0);
  job.begin("keying", todo.size());
  parallel_for(
      job, todo.size(),
      [&](std::size_t i) {
        const std::size_t shot = todo[i];
        Image photo = capture.read_photo(shot);
        if (photo.type() != PixelType::u8) photo = calib::keyable(photo);
        const double pixels = double(photo.width()) * photo.height();
        const int speck = options.clean ? int(kSpeck * pixels) : 0, hole = options.clean ? int(kHole * pixels) : 0;
        const bool judged = repair && capture.positioned(shot);
        Image mask;
        if (!learned && !judged) {
          mask = calib::key_image(*key, photo, {options.edges, speck, hole});
        } else {
          mask = calib::key_image(*key, photo, {calib::EdgeMode::hard, 0, 0});
          if (learned) confine(mask, photo, capture, shot, *learned);
          if (judged) {
            CoarseView view = coarse_view(capture, shot, photo);
            view.mask = thinned(mask, view.step);
            mended[i] = repair->mend(mask, photo, view);
          }
          if (learned && options.clean) fill_shadows(mask, capture, shot, *learned);
          calib::clean_mask(mask, speck, hole);
          calib::soften_edges(mask, photo, options.edges);
          calib::clean_mask(mask, 0, hole);  // coverage opens mixed pixels anew
        }
        std::size_t object = 0;
        for (int y = 0; y < mask.height(); ++y) {
          const std::uint8_t* row = mask.row<std::uint8_t>(y);
          std::uint32_t in_row = 0;
          for (int x = 0; x < mask.width(); ++x) in_row += row[x] >> 7;
          object += in_row;
        }
        object_share[i] = double(object) / pixels;
        capture.write_mask(shot, mask, MaskSource::keyed);  // touches its own shot alone
      },
      true);
  job.end();

  std::size_t unusable = 0;
  for (std::size_t i = 0; i < todo.size(); ++i) {
    if (object_share[i] > 0 && object_share[i] < 1) continue;
    ++unusable;
    report.warnings.push_back(capture.shots[todo[i]].name + (object_share[i] > 0 ? ": everything was keyed as object"
                                                                                 : ": nothing was keyed as object"));
  }
  report.keyed = todo.size();
  report.mended = std::size_t(std::count(mended.begin(), mended.end(), 1));
  if (!todo.empty() && unusable == todo.size())
    throw Error(ErrorCode::degenerate,
                "the masks of all photographs are empty or full: give photographs of the empty enclosure, or regions",
                capture.folder().string());
  key->save(capture.folder() / "key.json");
  if (!capture.background_rgb) capture.background_rgb = key->background_median();
  return report;
}

}  // namespace lumihull::hull
