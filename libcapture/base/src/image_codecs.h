#pragma once

// What the picture readers and writers of this library share.

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace lumihull::internal {

using Bytes = std::span<const std::byte>;

inline std::uint32_t big_endian16(const std::byte* p) { return std::uint32_t(p[0]) << 8 | std::uint32_t(p[1]); }
inline std::uint32_t big_endian32(const std::byte* p) { return big_endian16(p) << 16 | big_endian16(p + 2); }

/// Random access to a file's bytes, so that headers can be walked without reading the pixels.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Bytes offset … offset + count; shorter at the end of the data. Valid until the next call.
  virtual Bytes read(std::uint64_t offset, std::size_t count) = 0;
};

class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(Bytes bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  Bytes read(std::uint64_t offset, std::size_t count) override {
    if (offset >= bytes_.size()) return {};
    return bytes_.subspan(offset, std::min<std::uint64_t>(count, bytes_.size() - offset));
  }

 private:
  Bytes bytes_;
};

class FileSource final : public ByteSource {
 public:
  /// Errors: not_found, io, bad_input (not a regular file).
  explicit FileSource(const std::filesystem::path& file);
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  ~FileSource() override;
  std::uint64_t size() const override { return size_; }
  Bytes read(std::uint64_t offset, std::size_t count) override;

 private:
  std::string name_;
  int descriptor_;
  std::uint64_t size_ = 0;
  std::uint64_t buffer_offset_ = 0;
  std::vector<std::byte> buffer_;  // what was read last; headers mostly stand in the first few kilobytes
};

bool is_jpeg(Bytes start);
bool is_png(Bytes start);

/// `channels`: 0 = as stored, or what is wanted, done by the decoder itself where that is cheaper.
Image decode_jpeg(Bytes bytes, const std::string& name, int channels, int reduction);
Image decode_png(Bytes bytes, const std::string& name, int channels);
/// Grey, 8 bits, not interlaced, no filters, one IDAT chunk and no chunk of other kinds: what encode_mask writes. Empty
/// if the file is anything else.
Image decode_plain_grey_png(Bytes bytes);
ImageInfo jpeg_info(ByteSource& source, const std::string& name);
ImageInfo png_info(ByteSource& source, const std::string& name);

/// Fills in what an EXIF block (a TIFF structure, without the "Exif\0\0" before it) says. Hostile data are harmless:
/// what can't be read is left out, for the picture itself may be sound.
void parse_exif(Bytes tiff, ImageInfo& info);

/// EXIF's "YYYY:MM:DD hh:mm:ss" as ISO 8601; empty where it is not a date.
std::string iso_time(std::string_view exif_time);
/// Printable ASCII of at most 255 characters without spaces at either end; other bytes become '?'.
std::string clean_text(std::string_view text);

/// Throws bad_input where a header's size is beyond the limits of image.h.
void check_size(std::uint64_t width, std::uint64_t height, const std::string& name);

/// Formats other than JPEG and PNG, by the module around OpenImageIO.
Image read_by_module(const std::filesystem::path& file, const ReadOptions& options);
ImageInfo info_by_module(const std::filesystem::path& file);

}  // namespace lumihull::internal
