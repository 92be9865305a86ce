#include <lumihull/slf/metrics.h>

#include <optional>

#include "arguments.h"
#include "context.h"

using namespace lumihull;
using namespace lumihull::capi;

namespace {

Image image_from(const uint8_t* data, int width, int height, int channels, const char* name) {
  given(data, name);
  Image image = Image::uninitialized(width, height, channels);
  std::memcpy(image.data(), data, image.bytes());
  return image;
}

template <class Metric>
void judge(Metric metric, const uint8_t* a, const uint8_t* b, const uint8_t* mask, int width, int height, double* out) {
  given(out, "out");
  const Image first = image_from(a, width, height, 3, "a"), second = image_from(b, width, height, 3, "b");
  std::optional<Image> where;
  if (mask) where = image_from(mask, width, height, 1, "mask");
  *out = metric(first, second, where ? &*where : nullptr);
}

}  // namespace

lh_status lh_picture_psnr(lh_context* ctx, const uint8_t* a, const uint8_t* b, const uint8_t* mask, int32_t width,
                          int32_t height, double* out) {
  return guarded(ctx, [&] { judge(slf::psnr, a, b, mask, width, height, out); });
}

lh_status lh_picture_ssim(lh_context* ctx, const uint8_t* a, const uint8_t* b, const uint8_t* mask, int32_t width,
                          int32_t height, double* out) {
  return guarded(ctx, [&] { judge(slf::ssim, a, b, mask, width, height, out); });
}

lh_status lh_mask_iou(lh_context* ctx, const uint8_t* a, const uint8_t* b, int32_t width, int32_t height, double* out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const Image first = image_from(a, width, height, 1, "a"), second = image_from(b, width, height, 1, "b");
    *out = slf::silhouette_iou(first, second);
  });
}
