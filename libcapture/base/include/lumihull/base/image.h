#pragma once

#include <lumihull/base/api.h>

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace lumihull {

enum class PixelType : std::uint8_t { u8, u16, f32 };

/// Bytes of one channel of one pixel.
constexpr std::size_t size_of(PixelType type) { return type == PixelType::u8 ? 1 : type == PixelType::u16 ? 2 : 4; }

/// The largest width or height, and the largest number of pixels, that any reader accepts.
inline constexpr int kMaxImageSide = 65500;
inline constexpr std::int64_t kMaxImagePixels = 400'000'000;

/// A picture in memory: height x width x channels, row-major, channels interleaved, rows without gaps.
///
/// 8- and 16-bit pictures are sRGB (0 … 255, 0 … 65535); float pictures hold the same sRGB values as 0 … 1 unless the
/// function that made one says otherwise. 1 channel: grey or a mask; 3: RGB; 4: RGB and alpha (not premultiplied).
class LUMIHULL_API Image {
 public:
  Image() = default;
  /// Pixels are zero. Throws Error{invalid_argument} for sizes that are not positive or beyond the limits above.
  Image(int width, int height, int channels, PixelType type = PixelType::u8);
  /// The same without clearing the pixels, for callers that write every one of them.
  static Image uninitialized(int width, int height, int channels, PixelType type = PixelType::u8);
  Image(const Image& other);
  Image& operator=(const Image& other);
  Image(Image&&) noexcept;
  Image& operator=(Image&&) noexcept;
  ~Image();

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  int channels() const noexcept { return channels_; }
  PixelType type() const noexcept { return type_; }
  bool empty() const noexcept { return width_ == 0; }
  std::size_t row_bytes() const noexcept { return std::size_t(width_) * channels_ * size_of(type_); }
  std::size_t bytes() const noexcept { return row_bytes() * height_; }

  std::byte* data() noexcept { return data_.get(); }
  const std::byte* data() const noexcept { return data_.get(); }

  /// Row y as width * channels values of T; T must fit type().
  template <class T>
  T* row(int y) noexcept {
    assert(sizeof(T) == size_of(type_) && y >= 0 && y < height_);
    return reinterpret_cast<T*>(data_.get() + row_bytes() * y);
  }
  template <class T>
  const T* row(int y) const noexcept {
    assert(sizeof(T) == size_of(type_) && y >= 0 && y < height_);
    return reinterpret_cast<const T*>(data_.get() + row_bytes() * y);
  }

 private:
  int width_ = 0, height_ = 0, channels_ = 0;
  PixelType type_ = PixelType::u8;
  std::unique_ptr<std::byte[]> data_;
};

/// What a file says of a photograph besides its pixels.
struct ImageInfo {
  int width = 0, height = 0;  ///< as stored: the sensor's rows and columns, before `orientation`
  int channels = 0;
  PixelType type = PixelType::u8;
  int orientation = 1;  ///< EXIF 1 … 8; 1 = as stored
  std::optional<double> focal_length_mm;
  std::optional<double> focal_length_35mm_mm;
  std::string time;  ///< EXIF DateTimeOriginal as "YYYY-MM-DDThh:mm:ss", or empty
  std::string make, model, lens;
};

struct ReadOptions {
  /// Turn the picture upright by its EXIF orientation. Off for everything that cameras and poses refer to: they live
  /// in the sensor's rows and columns, whichever way the camera was held.
  bool apply_orientation = false;
  /// 0: as stored. 1, 3 or 4: convert (alpha dropped or set opaque, grey by Rec. 709 weights).
  int channels = 0;
  /// 1, 2, 4 or 8: a picture of 1/n of each side, rounded up, for looking at (8 bits). JPEGs are decoded so, in part of the
  /// time; of other formats each n x n pixels are averaged.
  int reduction = 1;
  /// Largest file that is read, in bytes.
  std::size_t max_file_bytes = std::size_t(2) << 30;
};

/// Reads a photograph. JPEG and PNG directly; TIFF, camera RAW and the rest through a module around OpenImageIO that is
/// loaded at the first such file. A truncated or damaged file is an error, never a half-grey picture.
/// Errors: not_found, io, bad_input (what is wrong and where), unsupported (no module for the format).
LUMIHULL_API Image read_image(const std::filesystem::path& file, const ReadOptions& options = {});

/// The same from bytes in memory; `name` is used in errors. JPEG and PNG only.
LUMIHULL_API Image decode_image(std::span<const std::byte> bytes, const std::string& name,
                                const ReadOptions& options = {});

/// Reads header and EXIF alone: about 20 microseconds for a JPEG.
LUMIHULL_API ImageInfo read_image_info(const std::filesystem::path& file);
LUMIHULL_API ImageInfo decode_image_info(std::span<const std::byte> bytes, const std::string& name);

struct PngOptions {
  int compression = 4;  ///< zlib level 0 … 9
};

/// Writes 8- or 16-bit pictures of 1, 3 or 4 channels, atomically (written aside, fsync, rename).
LUMIHULL_API void write_png(const std::filesystem::path& file, const Image& image, const PngOptions& options = {});
LUMIHULL_API std::string encode_png(const Image& image, const PngOptions& options = {});
/// A mask (8 bits, one channel) as PNG, for any reader of PNG: of its runs alone, ten times as fast as encode_png where
/// rows are mostly constant. Pictures that aren't may become larger than their pixels.
LUMIHULL_API std::string encode_mask(const Image& mask);
/// Writes an 8-bit picture of 1 or 3 channels as JPEG without chroma subsampling; quality 1 … 100.
LUMIHULL_API void write_jpeg(const std::filesystem::path& file, const Image& image, int quality = 92);
LUMIHULL_API std::string encode_jpeg(const Image& image, int quality = 92);

/// The picture turned as EXIF orientation 1 … 8 asks.
LUMIHULL_API Image oriented(const Image& image, int orientation);

/// A small copy of an 8-bit picture, for people to look at: made to fit into `side` x `side` by averaging stored values;
/// never larger.
LUMIHULL_API Image fitted(const Image& image, int side);

/// Converts type and channels: values scale by full range (255, 65535, 1.0), rounded to nearest.
LUMIHULL_API Image converted(const Image& image, PixelType type, int channels);

/// sRGB's transfer function (IEC 61966-2-1), 0 … 1 each way.
LUMIHULL_API float linear_from_srgb(float value);
LUMIHULL_API float srgb_from_linear(float value);

}  // namespace lumihull
