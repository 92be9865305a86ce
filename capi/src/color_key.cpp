#include <lumihull/calib/color_key.h>
#include <lumihull/calib/key_image.h>

#include <vector>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;
using calib::ColorKey;
using calib::Rgb;

static_assert(sizeof(Rgb) == 3, "an array of colours is an array of bytes");

namespace {

std::span<const Rgb> colors(const uint8_t* rgb, size_t n, const char* name) {
  return {reinterpret_cast<const Rgb*>(array(rgb, n, 3, name).data()), n};
}

}  // namespace

lh_status lh_color_key_train(lh_context* ctx, const uint8_t* background, size_t n, const uint8_t* foreground, size_t m,
                             const lh_color_key_options* user, lh_color_key** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const lh_color_key_options o = read_struct(user, "options");
    calib::ColorKeyOptions options;
    options.k = or_default(int(o.k), options.k);
    options.seed = or_default(uint64_t(o.seed), options.seed);
    options.foreground_share = or_default(o.foreground_share, options.foreground_share);
    options.validate();
    const auto back = colors(background, n, "background");
    if (!foreground && m == 0) return give(out, ColorKey::train(back, options, job));
    const auto front = colors(foreground, m, "foreground");
    if (n > calib::kMaxKeySamples || m > calib::kMaxKeySamples)
      invalid("expected at most ten million samples of a kind", n > m ? "background" : "foreground");
    give(out, ColorKey::train(calib::count_colors(back), calib::count_colors(front), options.k, job));
  });
}

lh_status lh_color_key_load(lh_context* ctx, const char* file, lh_color_key** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    give(out, ColorKey::load(path(file, "file"), job));
  });
}

lh_status lh_color_key_save(lh_context* ctx, const lh_color_key* key, const char* file) {
  return guarded(ctx, [&] { given(key, "key").value.save(path(file, "file")); });
}

void lh_color_key_destroy(lh_color_key* key) { delete key; }

lh_status lh_color_key_decide(lh_context* ctx, const lh_color_key* key, const uint8_t* rgb, size_t n, uint8_t* mask) {
  return guarded(ctx, [&] {
    const ColorKey& k = given(key, "key").value;
    const auto pixels = colors(rgb, n, "rgb");
    array(mask, n, 1, "mask");
    for (size_t i = 0; i < n; ++i) mask[i] = k.is_object(pixels[i]) ? 255 : 0;
  });
}

lh_status lh_color_key_probability(lh_context* ctx, const lh_color_key* key, const uint8_t* rgb, size_t n,
                                   double* probability) {
  return guarded(ctx, [&] {
    const ColorKey& k = given(key, "key").value;
    const auto pixels = colors(rgb, n, "rgb");
    array(probability, n, 1, "probability");
    for (size_t i = 0; i < n; ++i) probability[i] = k.probability(pixels[i]);
  });
}

lh_status lh_color_key_silhouette(lh_context* ctx, const lh_color_key* key, const lh_image* photo,
                                  const lh_silhouette_options* user, lh_image** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const lh_silhouette_options o = read_struct(user, "options");
    calib::KeyImageOptions options;
    switch (o.edges) {
      case LH_EDGES_SOFT:
        options.edges = calib::EdgeMode::soft;
        break;
      case LH_EDGES_HARD:
        options.edges = calib::EdgeMode::hard;
        break;
      case LH_EDGES_MATTE:
        options.edges = calib::EdgeMode::matte;
        break;
      default:
        invalid("expected LH_EDGES_SOFT, LH_EDGES_HARD or LH_EDGES_MATTE, found " + std::to_string(o.edges), "edges");
    }
    options.smallest_object_px = o.smallest_object_px;
    options.largest_hole_px = o.largest_hole_px;
    options.validate();
    give(out, calib::key_image(given(key, "key").value, given(photo, "photo").value, options));
  });
}
