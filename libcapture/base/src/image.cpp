// The picture in memory: storage, turning, conversion of type and channels.

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace lumihull {
namespace {

/// Has the system back a large picture by large pages, where it does so on request: else touching one for the first
/// time costs as much as the simpler computations on it.
void ask_for_large_pages([[maybe_unused]] std::byte* data, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__)
  constexpr std::size_t kPage = std::size_t(2) << 20;
  const std::size_t begin = (reinterpret_cast<std::uintptr_t>(data) + kPage - 1) / kPage * kPage,
                    end = (reinterpret_cast<std::uintptr_t>(data) + bytes) / kPage * kPage;
  if (bytes >= 2 * kPage && begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

}  // namespace

Image Image::uninitialized(int width, int height, int channels, PixelType type) {
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " x " + std::to_string(channels);
  if (width < 1 || height < 1 || channels < 1 || channels > 4 || width > kMaxImageSide || height > kMaxImageSide ||
      std::int64_t(width) * height > kMaxImagePixels)
    throw Error(ErrorCode::invalid_argument, "a picture can't be of " + size +
                                                 ": expected sides of 1 to 65500, at most 400 million pixels and 1 to "
                                                 "4 channels");
  Image image;
  image.width_ = width;
  image.height_ = height;
  image.channels_ = channels;
  image.type_ = type;
  try {
    image.data_ = std::make_unique_for_overwrite<std::byte[]>(image.bytes());
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::out_of_memory, "no memory for a picture of " + size);
  }
  ask_for_large_pages(image.data(), image.bytes());
  return image;
}

Image::Image(int width, int height, int channels, PixelType type) {
  *this = uninitialized(width, height, channels, type);
  std::memset(data_.get(), 0, bytes());
}

Image::Image(const Image& other) {
  if (other.empty()) return;
  *this = uninitialized(other.width_, other.height_, other.channels_, other.type_);
  std::memcpy(data_.get(), other.data_.get(), bytes());
}

Image& Image::operator=(const Image& other) {
  if (this != &other) *this = Image(other);
  return *this;
}

Image::Image(Image&& other) noexcept
    : width_(std::exchange(other.width_, 0)),
      height_(std::exchange(other.height_, 0)),
      channels_(std::exchange(other.channels_, 0)),
      type_(std::exchange(other.type_, PixelType::u8)),
      data_(std::move(other.data_)) {}

Image& Image::operator=(Image&& other) noexcept {
  width_ = std::exchange(other.width_, 0);
  height_ = std::exchange(other.height_, 0);
  channels_ = std::exchange(other.channels_, 0);
  type_ = std::exchange(other.type_, PixelType::u8);
  data_ = std::move(other.data_);
  return *this;
}

Image::~Image() = default;

Image oriented(const Image& image, int orientation) {
  if (orientation < 1 || orientation > 8)
    throw Error(ErrorCode::invalid_argument, "an EXIF orientation is 1 to 8, not " + std::to_string(orientation));
  if (orientation == 1 || image.empty()) return image;
  const bool transposed = orientation >= 5;
  const int w = image.width(), h = image.height();
  Image out = Image::uninitialized(transposed ? h : w, transposed ? w : h, image.channels(), image.type());
  const std::size_t pixel = image.channels() * size_of(image.type());
  // The stored pixel (x, y) that is shown at the upright picture's first pixel, and the steps along its rows and
  // columns (EXIF 2.32, table 6).
  constexpr std::array<std::array<int, 6>, 9> kMap = {{{},
                                                       {0, 0, 1, 0, 0, 1},
                                                       {1, 0, -1, 0, 0, 1},
                                                       {1, 1, -1, 0, 0, -1},
                                                       {0, 1, 1, 0, 0, -1},
                                                       {0, 0, 0, 1, 1, 0},
                                                       {0, 1, 0, -1, 1, 0},
                                                       {1, 1, 0, -1, -1, 0},
                                                       {1, 0, 0, 1, -1, 0}}};
  const auto& m = kMap[orientation];
  const std::ptrdiff_t row = image.row_bytes(), step = m[2] * std::ptrdiff_t(pixel) + m[3] * row,
                       line = m[4] * std::ptrdiff_t(pixel) + m[5] * row;
  const std::byte* first = image.data() + (m[0] ? std::ptrdiff_t(w - 1) * pixel : 0) + (m[1] ? (h - 1) * row : 0);
  // Tiles keep both pictures' lines in the cache where rows become columns.
  constexpr int kTile = 32;
  for (int y0 = 0; y0 < out.height(); y0 += kTile)
    for (int x0 = 0; x0 < out.width(); x0 += kTile)
      for (int y = y0; y < std::min(y0 + kTile, out.height()); ++y) {
        const std::byte* from = first + y * line + x0 * step;
        std::byte* to = out.data() + out.row_bytes() * y + x0 * pixel;
        for (int x = x0; x < std::min(x0 + kTile, out.width()); ++x, from += step, to += pixel)
          std::memcpy(to, from, pixel);
      }
  return out;
}

namespace {

template <class To, class From>
To scaled(From v) {
  if constexpr (std::is_same_v<To, From>) {
    return v;
  } else if constexpr (std::is_same_v<From, std::uint8_t> && std::is_same_v<To, std::uint16_t>) {
    return std::uint16_t(v * 257);
  } else if constexpr (std::is_same_v<From, std::uint16_t> && std::is_same_v<To, std::uint8_t>) {
    return std::uint8_t((v * 255u + 32767u) / 65535u);
  } else if constexpr (std::is_same_v<To, float>) {
    return v / float(std::numeric_limits<From>::max());
  } else {
    constexpr float kMax = std::numeric_limits<To>::max();
    return v > 0 ? To(std::min(v, 1.0f) * kMax + 0.5f) : To(0);  // NaN becomes 0
  }
}

/// Rec. 709 weights on the encoded values, in 2^-16.
template <class T>
T grey(const T* p) {
  if constexpr (std::is_same_v<T, float>)
    return 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];
  else
    return T((std::uint64_t(13933) * p[0] + std::uint64_t(46871) * p[1] + std::uint64_t(4732) * p[2] + 32768) >> 16);
}

template <class To, class From>
void convert_row(const From* from, int from_channels, To* to, int to_channels, int width) {
  if (from_channels == to_channels) {
    for (int i = 0; i < width * to_channels; ++i) to[i] = scaled<To>(from[i]);
    return;
  }
  const To opaque = std::is_same_v<To, float> ? To(1) : std::numeric_limits<To>::max();
  for (int x = 0; x < width; ++x, from += from_channels, to += to_channels) {
    if (to_channels == 1) {
      to[0] = scaled<To>(grey(from));
    } else {
      for (int c = 0; c < 3; ++c) to[c] = scaled<To>(from[from_channels == 1 ? 0 : c]);
      if (to_channels == 4) to[3] = opaque;
    }
  }
}

template <class From>
void convert_rows(const Image& image, Image& out) {
  for (int y = 0; y < image.height(); ++y) {
    const From* from = image.row<From>(y);
    switch (out.type()) {
      case PixelType::u8:
        convert_row(from, image.channels(), out.row<std::uint8_t>(y), out.channels(), image.width());
        break;
      case PixelType::u16:
        convert_row(from, image.channels(), out.row<std::uint16_t>(y), out.channels(), image.width());
        break;
      case PixelType::f32:
        convert_row(from, image.channels(), out.row<float>(y), out.channels(), image.width());
        break;
    }
  }
}

}  // namespace

Image converted(const Image& image, PixelType type, int channels) {
  if (image.empty() || (type == image.type() && channels == image.channels())) return image;
  const auto convertible = [](int c) { return c == 1 || c == 3 || c == 4; };
  if (image.channels() != channels && (!convertible(channels) || !convertible(image.channels())))
    throw Error(ErrorCode::invalid_argument, "pictures convert between 1, 3 and 4 channels, not from " +
                                                 std::to_string(image.channels()) + " to " + std::to_string(channels));
  Image out = Image::uninitialized(image.width(), image.height(), channels, type);
  switch (image.type()) {
    case PixelType::u8:
      convert_rows<std::uint8_t>(image, out);
      break;
    case PixelType::u16:
      convert_rows<std::uint16_t>(image, out);
      break;
    case PixelType::f32:
      convert_rows<float>(image, out);
      break;
  }
  return out;
}

float linear_from_srgb(float value) {
  return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}

float srgb_from_linear(float value) {
  return value <= 0.0031308f ? value * 12.92f : 1.055f * std::pow(value, 1 / 2.4f) - 0.055f;
}

Image fitted(const Image& picture, int side) {
  const int factor_w = (picture.width() + side - 1) / side, factor_h = (picture.height() + side - 1) / side;
  if (std::max(factor_w, factor_h) <= 1) return picture;
  const double scale = double(side) / std::max(picture.width(), picture.height());
  const int w = std::max(1, int(picture.width() * scale)), h = std::max(1, int(picture.height() * scale));
  const int channels = picture.channels();
  Image out(w, h, channels);
  for (int y = 0; y < h; ++y) {
    const int y0 = int(std::int64_t(y) * picture.height() / h), y1 = int(std::int64_t(y + 1) * picture.height() / h);
    for (int x = 0; x < w; ++x) {
      const int x0 = int(std::int64_t(x) * picture.width() / w), x1 = int(std::int64_t(x + 1) * picture.width() / w);
      for (int c = 0; c < channels; ++c) {
        std::int64_t sum = 0;
        for (int j = y0; j < y1; ++j)
          for (int i = x0; i < x1; ++i) sum += picture.row<std::uint8_t>(j)[i * channels + c];
        const std::int64_t n = std::int64_t(y1 - y0) * (x1 - x0);
        out.row<std::uint8_t>(y)[x * channels + c] = std::uint8_t((sum + n / 2) / n);
      }
    }
  }
  return out;
}

}  // namespace lumihull
