// JPEG by libjpeg-turbo. libjpeg leaves a failed call by longjmp: each function that calls it holds only plain data, so
// that no destructor is jumped over; the Image is made between two such functions.

#include <lumihull/base/files.h>

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>

// Both want <cstdio> before them.
#include <jerror.h>
#include <jpeglib.h>

#include "image_codecs.h"

namespace lumihull {
namespace internal {
namespace {

/// A progressive file may hold thousands of scans of the whole picture: hours of work in a few kilobytes.
constexpr int kMaxScans = 500;

struct Failure {
  jpeg_error_mgr manager;  // first: libjpeg hands back a pointer to it
  std::jmp_buf jump;
  char message[JMSG_LENGTH_MAX];
};

[[noreturn]] void leave(j_common_ptr info) {
  Failure* failure = reinterpret_cast<Failure*>(info->err);
  failure->manager.format_message(info, failure->message);
  std::longjmp(failure->jump, 1);
}

/// Whether the stray bytes of which libjpeg warns are those that some cameras leave between the last row and the end
/// marker: padding (00 and FF), or one or two bytes of any kind. A scan that was damaged ends early as often as late,
/// but what is left of it is more, and is not padding (README.md has the figures).
bool harmless_stray_bytes(j_common_ptr info) {
  const jpeg_source_mgr& source = *reinterpret_cast<j_decompress_ptr>(info)->src;
  const int count = info->err->msg_parm.i[0], marker = info->err->msg_parm.i[1];
  if (marker != JPEG_EOI) return false;
  // They stand right before what is read next.
  for (int i = 1; count > 2 && i <= count; ++i)
    if (source.next_input_byte[-i] != 0x00 && source.next_input_byte[-i] != 0xff) return false;
  return true;
}

/// Warnings about the data are failures: libjpeg would go on and leave the rest of the picture grey.
void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;
  const int code = info->err->msg_code;
  if (code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM || code == JWRN_BOGUS_ICC) return;
  if (code == JWRN_EXTRANEOUS_DATA && harmless_stray_bytes(info)) return;
  leave(info);
}

void install(Failure& failure, j_common_ptr info) {
  info->err = jpeg_std_error(&failure.manager);
  failure.manager.error_exit = leave;
  failure.manager.emit_message = on_message;
  failure.message[0] = '\0';
}

struct Decoder {
  jpeg_decompress_struct info;
  Failure failure;
  jpeg_progress_mgr progress;
};

void check_scans(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number > kMaxScans) ERREXIT(info, JERR_BAD_PROGRESSION);
}

bool start(Decoder* d, const unsigned char* bytes, unsigned long count, int channels, int reduction) {
  if (setjmp(d->failure.jump)) return false;
  jpeg_create_decompress(&d->info);
  d->progress.progress_monitor = check_scans;
  d->info.progress = &d->progress;
  jpeg_mem_src(&d->info, bytes, count);
  jpeg_read_header(&d->info, TRUE);
  if (d->info.jpeg_color_space == JCS_GRAYSCALE)
    d->info.out_color_space = channels == 3 ? JCS_RGB : channels == 4 ? JCS_EXT_RGBA : JCS_GRAYSCALE;
  else if (d->info.num_components == 3)
    d->info.out_color_space = channels == 4 ? JCS_EXT_RGBA : JCS_RGB;
  d->info.scale_num = 1;
  d->info.scale_denom = unsigned(reduction);
  jpeg_calc_output_dimensions(&d->info);
  return true;
}

bool read_pixels(Decoder* d, unsigned char* pixels, std::size_t row_bytes) {
  if (setjmp(d->failure.jump)) return false;
  jpeg_start_decompress(&d->info);
  while (d->info.output_scanline < d->info.output_height) {
    JSAMPROW rows[16];
    const JDIMENSION left = d->info.output_height - d->info.output_scanline, count = left < 16 ? left : 16;
    for (JDIMENSION i = 0; i < count; ++i) rows[i] = pixels + row_bytes * (d->info.output_scanline + i);
    jpeg_read_scanlines(&d->info, rows, count);
  }
  jpeg_finish_decompress(&d->info);
  return true;
}

[[noreturn]] void fail(const Failure& failure, const std::string& name) {
  const int code = failure.manager.msg_code;
  const bool valid = code == JERR_BAD_PRECISION || code == JERR_SOF_UNSUPPORTED || code == JERR_CONVERSION_NOTIMPL ||
                     code == JERR_ARITH_NOTIMPL;
  if (code == JERR_OUT_OF_MEMORY) throw Error(ErrorCode::out_of_memory, "no memory to decode the JPEG", name);
  throw Error(
      valid ? ErrorCode::unsupported : ErrorCode::bad_input,
      std::string(valid ? "a kind of JPEG that is not supported: " : "damaged or truncated JPEG: ") + failure.message,
      name);
}

}  // namespace

bool is_jpeg(Bytes start) {
  return start.size() >= 3 && start[0] == std::byte(0xff) && start[1] == std::byte(0xd8) && start[2] == std::byte(0xff);
}

Image decode_jpeg(Bytes bytes, const std::string& name, int channels, int reduction) {
  Decoder d;
  std::memset(&d, 0, sizeof d);
  install(d.failure, reinterpret_cast<j_common_ptr>(&d.info));
  struct Release {
    Decoder& d;
    ~Release() { jpeg_destroy_decompress(&d.info); }
  } release{d};
  if (!start(&d, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), channels,
             reduction))
    fail(d.failure, name);
  check_size(d.info.image_width, d.info.image_height, name);
  if (d.info.out_color_space == JCS_CMYK || d.info.jpeg_color_space == JCS_CMYK ||
      d.info.jpeg_color_space == JCS_YCCK || (d.info.num_components != 1 && d.info.num_components != 3))
    throw Error(ErrorCode::unsupported,
                "a JPEG of " + std::to_string(d.info.num_components) + " components (CMYK?): save it as RGB", name);
  // Huffman coding spends at least one bit on each block of 64 pixels, so a short file can't ask for much memory.
  if (!d.info.arith_code && std::uint64_t(d.info.image_width) * d.info.image_height > bytes.size() * 512 + (1 << 16))
    throw Error(ErrorCode::bad_input,
                "damaged or truncated JPEG: " + std::to_string(bytes.size()) + " bytes can't hold " +
                    std::to_string(d.info.image_width) + " x " + std::to_string(d.info.image_height) + " pixels",
                name);
  const int stored = d.info.out_color_space == JCS_GRAYSCALE ? 1 : d.info.out_color_space == JCS_RGB ? 3 : 4;
  Image image = Image::uninitialized(int(d.info.output_width), int(d.info.output_height), stored);
  if (!read_pixels(&d, reinterpret_cast<unsigned char*>(image.data()), image.row_bytes())) fail(d.failure, name);
  return channels == 0 || channels == stored ? std::move(image) : converted(image, PixelType::u8, channels);
}

ImageInfo jpeg_info(ByteSource& source, const std::string& name) {
  ImageInfo info;
  const auto truncated = [&]() -> Error {
    return {ErrorCode::bad_input, "damaged or truncated JPEG: it ends before the picture's size", name};
  };
  bool exif_seen = false;
  std::uint64_t at = 2;
  for (;;) {
    Bytes head = source.read(at, 4);
    if (head.size() < 4) throw truncated();
    if (head[0] != std::byte(0xff))
      throw Error(ErrorCode::bad_input, "damaged JPEG: no marker at byte " + std::to_string(at), name);
    const int marker = int(head[1]);
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8)) {  // markers without a length
      at += 2;
      continue;
    }
    if (marker == 0xd9 || marker == 0xda || marker == 0x00) throw truncated();
    const std::uint32_t length = big_endian16(&head[2]);
    if (length < 2)
      throw Error(ErrorCode::bad_input, "damaged JPEG: a segment of impossible length at byte " + std::to_string(at),
                  name);
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) {
      const Bytes b = source.read(at + 4, 6);
      if (b.size() < 6) throw truncated();
      info.height = int(big_endian16(&b[1]));
      info.width = int(big_endian16(&b[3]));
      check_size(info.width, info.height, name);
      info.channels = int(b[5]);
      return info;
    }
    if (marker == 0xe1 && !exif_seen) {
      const Bytes b = source.read(at + 4, length - 2);
      if (b.size() >= 6 && std::memcmp(b.data(), "Exif\0", 6) == 0) {
        parse_exif(b.subspan(6), info);
        exif_seen = true;
      }
    }
    at += 2 + length;
  }
}

namespace {

struct Encoder {
  jpeg_compress_struct info;
  Failure failure;
  unsigned char* bytes;
  unsigned long count;
};

bool encode(Encoder* e, const unsigned char* pixels, int width, int height, int channels, int quality) {
  if (setjmp(e->failure.jump)) return false;
  jpeg_create_compress(&e->info);
  jpeg_mem_dest(&e->info, &e->bytes, &e->count);
  e->info.image_width = JDIMENSION(width);
  e->info.image_height = JDIMENSION(height);
  e->info.input_components = channels;
  e->info.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&e->info);
  jpeg_set_quality(&e->info, quality, TRUE);
  for (int c = 0; c < e->info.num_components; ++c)
    e->info.comp_info[c].h_samp_factor = e->info.comp_info[c].v_samp_factor = 1;
  jpeg_start_compress(&e->info, TRUE);
  while (e->info.next_scanline < e->info.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(pixels) + std::size_t(e->info.next_scanline) * width * channels;
    jpeg_write_scanlines(&e->info, &row, 1);
  }
  jpeg_finish_compress(&e->info);
  return true;
}

}  // namespace
}  // namespace internal

std::string encode_jpeg(const Image& image, int quality) {
  using namespace internal;
  if (image.type() != PixelType::u8 || (image.channels() != 1 && image.channels() != 3))
    throw Error(ErrorCode::invalid_argument, "JPEG holds 8-bit pictures of 1 or 3 channels");
  if (quality < 1 || quality > 100) throw Error(ErrorCode::invalid_argument, "a JPEG's quality is 1 to 100");
  Encoder e;
  std::memset(&e, 0, sizeof e);
  install(e.failure, reinterpret_cast<j_common_ptr>(&e.info));
  struct Release {
    Encoder& e;
    ~Release() {
      jpeg_destroy_compress(&e.info);
      std::free(e.bytes);
    }
  } release{e};
  if (!encode(&e, reinterpret_cast<const unsigned char*>(image.data()), image.width(), image.height(), image.channels(),
              quality))
    throw Error(ErrorCode::internal, std::string("JPEG encoder: ") + e.failure.message);
  return {reinterpret_cast<const char*>(e.bytes), e.count};
}

void write_jpeg(const std::filesystem::path& file, const Image& image, int quality) {
  write_file(file, encode_jpeg(image, quality));
}

}  // namespace lumihull
