// Which reader a file goes to, and what they share.

#include <fcntl.h>
#include <lumihull/base/files.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "image_codecs.h"

namespace lumihull {
namespace internal {

FileSource::FileSource(const std::filesystem::path& file)
    : name_(file.string()),
      descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {  // a pipe must not block
  if (descriptor_ < 0) {
    if (errno == ENOENT || errno == ENOTDIR) throw Error(ErrorCode::not_found, "no such file", name_);
    throw Error(ErrorCode::io, std::string("can't be read: ") + std::generic_category().message(errno), name_);
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    throw Error(ErrorCode::bad_input, S_ISDIR(status.st_mode) ? "a folder, not a picture" : "not a regular file",
                name_);
  }
  size_ = std::uint64_t(status.st_size);
}

FileSource::~FileSource() { ::close(descriptor_); }

Bytes FileSource::read(std::uint64_t offset, std::size_t count) {
  if (offset >= size_) return {};
  count = std::size_t(std::min<std::uint64_t>(count, size_ - offset));
  const bool buffered = offset >= buffer_offset_ && offset + count <= buffer_offset_ + buffer_.size();
  if (!buffered) {
    constexpr std::size_t kAhead = 16384;
    const std::size_t wanted = std::size_t(std::min<std::uint64_t>(std::max(count, kAhead), size_ - offset));
    buffer_.resize(wanted);
    buffer_offset_ = offset;
    std::size_t have = 0;
    while (have < wanted) {
      const ssize_t n = ::pread(descriptor_, buffer_.data() + have, wanted - have, off_t(offset + have));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) throw Error(ErrorCode::io, std::generic_category().message(errno), name_);
      if (n == 0) break;
      have += std::size_t(n);
    }
    buffer_.resize(have);
  }
  const std::size_t skip = std::size_t(offset - buffer_offset_);
  return Bytes(buffer_).subspan(skip, std::min(count, buffer_.size() - skip));
}

void check_size(std::uint64_t width, std::uint64_t height, const std::string& name) {
  if (width >= 1 && height >= 1 && width <= kMaxImageSide && height <= kMaxImageSide &&
      width * height <= std::uint64_t(kMaxImagePixels))
    return;
  throw Error(ErrorCode::bad_input,
              "a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                  " pixels: expected sides of 1 to 65500 and at most 400 million pixels",
              name);
}

namespace {

enum class Format { jpeg, png, other };

/// By content. A name that promises JPEG or PNG is held to it: such files need not go through every other reader.
Format format_of(Bytes start, std::uint64_t size, const std::string& name) {
  if (size == 0) throw Error(ErrorCode::bad_input, "an empty file", name);
  if (is_jpeg(start)) return Format::jpeg;
  if (is_png(start)) return Format::png;
  std::string extension = std::filesystem::path(name).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".jpg" || extension == ".jpeg")
    throw Error(ErrorCode::bad_input, "not a JPEG: its first bytes are not FF D8 FF", name);
  if (extension == ".png") throw Error(ErrorCode::bad_input, "not a PNG: its first bytes are not the signature", name);
  return Format::other;
}

void check_options(const ReadOptions& options) {
  if (options.channels != 0 && options.channels != 1 && options.channels != 3 && options.channels != 4)
    throw Error(ErrorCode::invalid_argument, "a picture is read with 1, 3 or 4 channels, or 0 for what it has");
  if (options.reduction != 1 && options.reduction != 2 && options.reduction != 4 && options.reduction != 8)
    throw Error(ErrorCode::invalid_argument, "a picture is read at 1/1, 1/2, 1/4 or 1/8 of its size");
}

/// Each n x n pixels averaged; at the right and at the bottom of those that are left.
Image reduced(const Image& picture, int n) {
  const Image image = converted(picture, PixelType::u8, picture.channels());
  const int channels = image.channels();
  Image out = Image::uninitialized((image.width() + n - 1) / n, (image.height() + n - 1) / n, channels);
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x)
      for (int c = 0; c < channels; ++c) {
        const int x1 = std::min((x + 1) * n, image.width()), y1 = std::min((y + 1) * n, image.height());
        int sum = 0;
        for (int j = y * n; j < y1; ++j)
          for (int i = x * n; i < x1; ++i) sum += image.row<std::uint8_t>(j)[i * channels + c];
        const int count = (x1 - x * n) * (y1 - y * n);
        out.row<std::uint8_t>(y)[x * channels + c] = std::uint8_t((sum + count / 2) / count);
      }
  return out;
}

}  // namespace
}  // namespace internal

using namespace internal;

Image decode_image(Bytes bytes, const std::string& name, const ReadOptions& options) {
  check_options(options);
  const Format format = format_of(bytes, bytes.size(), name);
  if (format == Format::other)
    throw Error(ErrorCode::unsupported, "neither JPEG nor PNG: other formats are read from files only", name);
  Image image = format == Format::jpeg ? decode_jpeg(bytes, name, options.channels, options.reduction)
                                       : decode_png(bytes, name, options.channels);
  if (format != Format::jpeg && options.reduction != 1) image = reduced(image, options.reduction);
  if (options.apply_orientation)
    if (const int orientation = decode_image_info(bytes, name).orientation; orientation != 1)
      return oriented(image, orientation);
  return image;
}

Image read_image(const std::filesystem::path& file, const ReadOptions& options) {
  check_options(options);
  {
    FileSource source(file);
    if (source.size() > options.max_file_bytes)
      throw Error(ErrorCode::bad_input,
                  "a file of " + std::to_string(source.size()) + " bytes: expected at most " +
                      std::to_string(options.max_file_bytes),
                  file.string());
    if (format_of(source.read(0, 8), source.size(), file.string()) == Format::other)
      return options.reduction == 1 ? read_by_module(file, options)
                                    : reduced(read_by_module(file, options), options.reduction);
  }
  const std::string bytes = read_file(file, options.max_file_bytes);
  return decode_image(std::as_bytes(std::span(bytes)), file.string(), options);
}

namespace {

ImageInfo info_of(ByteSource& source, const std::string& name, Format format) {
  return format == Format::jpeg ? jpeg_info(source, name) : png_info(source, name);
}

}  // namespace

ImageInfo decode_image_info(Bytes bytes, const std::string& name) {
  const Format format = format_of(bytes, bytes.size(), name);
  if (format == Format::other)
    throw Error(ErrorCode::unsupported, "neither JPEG nor PNG: other formats are read from files only", name);
  MemorySource source(bytes);
  return info_of(source, name, format);
}

ImageInfo read_image_info(const std::filesystem::path& file) {
  FileSource source(file);
  const std::string name = file.string();
  const Format format = format_of(source.read(0, 8), source.size(), name);
  return format == Format::other ? info_by_module(file) : info_of(source, name, format);
}

}  // namespace lumihull
