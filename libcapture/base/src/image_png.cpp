// PNG by libpng. As with libjpeg, the functions that libpng may leave by longjmp hold only plain data.

#include <lumihull/base/files.h>
#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <new>
#include <vector>

#include "image_codecs.h"

namespace lumihull {
namespace internal {
namespace {

struct Failure {
  std::jmp_buf jump;
  char message[200];
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  Failure* failure = static_cast<Failure*>(png_get_error_ptr(png));
  std::strncpy(failure->message, message, sizeof failure->message - 1);
  std::longjmp(failure->jump, 1);
}
/// Warnings speak of ancillary chunks (colour profiles, text), never of pixels.
void on_warning(png_structp, png_const_charp) {}

struct Decoder {
  png_structp png;
  png_infop info;
  Failure failure;
  const std::byte* bytes;
  std::size_t left;
  png_uint_32 width, height;
  int channels, depth;
};

void on_read(png_structp png, png_bytep out, png_size_t count) {
  Decoder* d = static_cast<Decoder*>(png_get_io_ptr(png));
  if (count > d->left) png_error(png, "unexpected end of file");
  std::memcpy(out, d->bytes, count);
  d->bytes += count;
  d->left -= count;
}

bool start(Decoder* d) {
  if (setjmp(d->failure.jump)) return false;
  d->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &d->failure, on_error, on_warning);
  if (!d->png) return false;
  d->info = png_create_info_struct(d->png);
  if (!d->info) return false;
  png_set_read_fn(d->png, d, on_read);
  png_set_user_limits(d->png, kMaxImageSide, kMaxImageSide);
  png_set_chunk_malloc_max(d->png, 8u << 20);
  png_set_crc_action(d->png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  // Only transparency changes pixels; everything else is skipped unread.
  png_set_keep_unknown_chunks(d->png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  static const png_byte kTransparency[] = "tRNS";
  png_set_keep_unknown_chunks(d->png, PNG_HANDLE_CHUNK_AS_DEFAULT, kTransparency, 1);
  png_read_info(d->png, d->info);
  d->width = png_get_image_width(d->png, d->info);
  d->height = png_get_image_height(d->png, d->info);
  return true;
}

/// Sets up the conversions to 8 or 16 bits and 1, 3 or 4 channels.
bool prepare(Decoder* d, int wanted) {
  if (setjmp(d->failure.jump)) return false;
  png_set_expand(d->png);  // palette to RGB, grey of 1, 2, 4 bits to 8, transparent colour to alpha
  const int colour = png_get_color_type(d->png, d->info);
  const bool alpha = (colour & PNG_COLOR_MASK_ALPHA) || png_get_valid(d->png, d->info, PNG_INFO_tRNS);
  const bool grey = !(colour & PNG_COLOR_MASK_COLOR);
  if (png_get_bit_depth(d->png, d->info) == 16 && std::endian::native == std::endian::little) png_set_swap(d->png);
  if (alpha && (wanted == 1 || wanted == 3)) png_set_strip_alpha(d->png);
  if (!alpha && wanted == 4)
    png_set_add_alpha(d->png, png_get_bit_depth(d->png, d->info) == 16 ? 0xffff : 0xff, PNG_FILLER_AFTER);
  if (grey && (wanted == 3 || wanted == 4 || (alpha && wanted == 0))) png_set_gray_to_rgb(d->png);
  png_set_interlace_handling(d->png);
  png_read_update_info(d->png, d->info);
  d->channels = png_get_channels(d->png, d->info);
  d->depth = png_get_bit_depth(d->png, d->info);
  return true;
}

bool read_pixels(Decoder* d, png_bytepp rows) {
  if (setjmp(d->failure.jump)) return false;
  png_read_image(d->png, rows);
  png_read_end(d->png, nullptr);
  return true;
}

}  // namespace

bool is_png(Bytes start) { return start.size() >= 8 && std::memcmp(start.data(), "\x89PNG\r\n\x1a\n", 8) == 0; }

Image decode_png(Bytes bytes, const std::string& name, int channels) {
  // Masks of our own; whatever is unusual or damaged is left to libpng.
  if (channels <= 1)
    if (Image grey = decode_plain_grey_png(bytes); !grey.empty()) return grey;
  Decoder d;
  std::memset(&d, 0, sizeof d);
  d.bytes = bytes.data();
  d.left = bytes.size();
  struct Release {
    Decoder& d;
    ~Release() {
      if (d.png) png_destroy_read_struct(&d.png, &d.info, nullptr);
    }
  } release{d};
  const auto fail = [&]() -> Error {
    return {ErrorCode::bad_input, std::string("damaged or truncated PNG: ") + d.failure.message, name};
  };
  if (!start(&d)) throw fail();
  check_size(d.width, d.height, name);
  // Deflate shrinks by at most 1032 (zlib's technical notes), so a short file can't ask for much memory.
  if (std::uint64_t(png_get_rowbytes(d.png, d.info)) * d.height > bytes.size() * 1032)
    throw Error(ErrorCode::bad_input,
                "damaged or truncated PNG: " + std::to_string(bytes.size()) + " bytes can't hold " +
                    std::to_string(d.width) + " x " + std::to_string(d.height) + " pixels",
                name);
  if (!prepare(&d, channels)) throw fail();
  Image image =
      Image::uninitialized(int(d.width), int(d.height), d.channels, d.depth == 16 ? PixelType::u16 : PixelType::u8);
  std::vector<png_bytep> rows(d.height);
  for (std::size_t y = 0; y < rows.size(); ++y)
    rows[y] = reinterpret_cast<png_bytep>(image.data() + image.row_bytes() * y);
  if (!read_pixels(&d, rows.data())) throw fail();
  return channels == 0 || channels == image.channels() ? std::move(image) : converted(image, image.type(), channels);
}

ImageInfo png_info(ByteSource& source, const std::string& name) {
  const auto truncated = [&]() -> Error { return {ErrorCode::bad_input, "damaged or truncated PNG", name}; };
  ImageInfo info;
  const Bytes head = source.read(8, 25);
  if (head.size() < 25 || big_endian32(&head[0]) != 13 || std::memcmp(&head[4], "IHDR", 4) != 0) throw truncated();
  const std::uint32_t width = big_endian32(&head[8]), height = big_endian32(&head[12]);
  const int depth = int(head[16]), colour = int(head[17]);
  check_size(width, height, name);
  info.width = int(width);
  info.height = int(height);
  info.type = depth == 16 ? PixelType::u16 : PixelType::u8;
  info.channels = colour == 0 ? 1 : colour == 4 || colour == 6 ? 4 : 3;
  for (std::uint64_t at = 33;;) {
    const Bytes chunk = source.read(at, 8);
    if (chunk.size() < 8) throw truncated();
    const std::uint32_t length = big_endian32(&chunk[0]);
    const bool transparency = std::memcmp(&chunk[4], "tRNS", 4) == 0, exif = std::memcmp(&chunk[4], "eXIf", 4) == 0;
    if (std::memcmp(&chunk[4], "IDAT", 4) == 0 || std::memcmp(&chunk[4], "IEND", 4) == 0) break;
    if (length > 0x7fffffffu) throw truncated();
    if (transparency) info.channels = 4;
    if (exif && length <= 1 << 20) parse_exif(source.read(at + 8, length), info);
    at += 12 + std::uint64_t(length);
  }
  return info;
}

namespace {

struct Encoder {
  png_structp png;
  png_infop info;
  Failure failure;
  std::string* out;
};

void on_write(png_structp png, png_bytep bytes, png_size_t count) {
  std::string* out = static_cast<Encoder*>(png_get_io_ptr(png))->out;
  bool full = false;
  try {
    out->append(reinterpret_cast<const char*>(bytes), count);
  } catch (const std::bad_alloc&) {
    full = true;
  }
  if (full) png_error(png, "out of memory");
}
void on_flush(png_structp) {}

bool encode(Encoder* e, png_bytepp rows, int width, int height, int channels, int depth, int level) {
  if (setjmp(e->failure.jump)) return false;
  e->png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &e->failure, on_error, on_warning);
  if (!e->png) return false;
  e->info = png_create_info_struct(e->png);
  if (!e->info) return false;
  png_set_write_fn(e->png, e, on_write, on_flush);
  png_set_compression_level(e->png, level);
  png_set_compression_buffer_size(e->png, 1 << 18);
  png_set_filter(e->png, PNG_FILTER_TYPE_BASE, PNG_ALL_FILTERS);
  png_set_IHDR(e->png, e->info, png_uint_32(width), png_uint_32(height), depth,
               channels == 1   ? PNG_COLOR_TYPE_GRAY
               : channels == 3 ? PNG_COLOR_TYPE_RGB
                               : PNG_COLOR_TYPE_RGB_ALPHA,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(e->png, e->info);
  if (depth == 16 && std::endian::native == std::endian::little) png_set_swap(e->png);
  png_write_image(e->png, rows);
  png_write_end(e->png, nullptr);
  return true;
}

}  // namespace
}  // namespace internal

std::string encode_png(const Image& image, const PngOptions& options) {
  using namespace internal;
  if (image.empty() || image.type() == PixelType::f32 || image.channels() == 2)
    throw Error(ErrorCode::invalid_argument, "PNG holds 8- and 16-bit pictures of 1, 3 or 4 channels");
  if (options.compression < 0 || options.compression > 9)
    throw Error(ErrorCode::invalid_argument, "a PNG's compression is 0 to 9");
  std::vector<png_bytep> rows(image.height());
  for (int y = 0; y < image.height(); ++y)
    rows[y] = reinterpret_cast<png_bytep>(const_cast<std::byte*>(image.data())) + image.row_bytes() * y;
  std::string out;
  Encoder e;
  std::memset(&e, 0, sizeof e);
  e.out = &out;
  struct Release {
    Encoder& e;
    ~Release() {
      if (e.png) png_destroy_write_struct(&e.png, &e.info);
    }
  } release{e};
  if (!encode(&e, rows.data(), image.width(), image.height(), image.channels(), int(size_of(image.type()) * 8),
              options.compression))
    throw Error(ErrorCode::internal, std::string("PNG encoder: ") + e.failure.message);
  return out;
}

void write_png(const std::filesystem::path& file, const Image& image, const PngOptions& options) {
  write_file(file, encode_png(image, options));
}

}  // namespace lumihull
