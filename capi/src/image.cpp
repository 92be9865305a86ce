#include <lumihull/base/image.h>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

namespace {

ReadOptions read_options(const lh_image_options* user) {
  const lh_image_options o = read_struct(user, "options");
  if (o.channels != 0 && o.channels != 1 && o.channels != 3 && o.channels != 4)
    invalid("expected 0, 1, 3 or 4, found " + std::to_string(o.channels), "channels");
  return {.apply_orientation = o.apply_orientation != 0, .channels = o.channels};
}

PixelType pixel_type(int32_t type) {
  switch (type) {
    case LH_PIXEL_U8:
      return PixelType::u8;
    case LH_PIXEL_U16:
      return PixelType::u16;
    case LH_PIXEL_F32:
      return PixelType::f32;
    default:
      invalid("expected LH_PIXEL_U8, LH_PIXEL_U16 or LH_PIXEL_F32, found " + std::to_string(type), "pixel_type");
  }
}

}  // namespace

lh_status lh_image_read(lh_context* ctx, const char* file, const lh_image_options* options, lh_image** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, read_image(path(file, "file"), read_options(options)));
  });
}

lh_status lh_image_decode(lh_context* ctx, const void* bytes, size_t size, const char* name,
                          const lh_image_options* options, lh_image** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const auto data = array(static_cast<const std::byte*>(bytes), size, 1, "bytes");
    give(out, decode_image(data, text(name, "name"), read_options(options)));
  });
}

lh_status lh_image_from_array(lh_context* ctx, const void* data, int32_t width, int32_t height, int32_t channels,
                              int32_t type, size_t row_bytes, lh_image** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const auto* from = static_cast<const std::byte*>(data);
    given(from, "data");
    if (channels != 1 && channels != 3 && channels != 4)
      invalid("expected 1, 3 or 4, found " + std::to_string(channels), "channels");
    Image image = Image::uninitialized(width, height, channels, pixel_type(type));
    const size_t own = image.row_bytes();
    if (row_bytes == 0) row_bytes = own;
    if (row_bytes < own)
      invalid("expected 0 or at least " + std::to_string(own) + ", found " + std::to_string(row_bytes), "row_bytes");
    for (int y = 0; y < height; ++y) std::memcpy(image.data() + own * size_t(y), from + row_bytes * size_t(y), own);
    give(out, std::move(image));
  });
}

void lh_image_destroy(lh_image* image) { delete image; }

int32_t lh_image_width(const lh_image* image) { return image ? image->value.width() : 0; }
int32_t lh_image_height(const lh_image* image) { return image ? image->value.height() : 0; }
int32_t lh_image_channels(const lh_image* image) { return image ? image->value.channels() : 0; }
int32_t lh_image_pixel_type(const lh_image* image) { return image ? int32_t(size_of(image->value.type())) : 0; }
const void* lh_image_data(const lh_image* image) { return image ? image->value.data() : nullptr; }

lh_status lh_image_write_png(lh_context* ctx, const lh_image* image, const char* file) {
  return guarded(ctx, [&] { write_png(path(file, "file"), given(image, "image").value); });
}

lh_status lh_image_write_jpeg(lh_context* ctx, const lh_image* image, const char* file, int32_t quality) {
  return guarded(ctx, [&] { write_jpeg(path(file, "file"), given(image, "image").value, quality); });
}
