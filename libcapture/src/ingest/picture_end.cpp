#include "picture_end.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <system_error>

namespace lumihull::capture {
namespace {

std::uint32_t byte_at(std::string_view b, std::size_t i) { return static_cast<unsigned char>(b[i]); }

/// Walks a JPEG's segments; between a scan's start and the next marker the data are coded, with FF as FF 00.
bool jpeg_is_whole(std::string_view b) {
  std::size_t at = 2;
  bool coded = false;
  for (;;) {
    if (coded) {
      const void* mark = std::memchr(b.data() + at, 0xff, b.size() - at);
      if (!mark) return false;
      at = std::size_t(static_cast<const char*>(mark) - b.data());
    }
    while (at + 1 < b.size() && byte_at(b, at) == 0xff && byte_at(b, at + 1) == 0xff) ++at;  // fill bytes
    if (at + 1 >= b.size() || byte_at(b, at) != 0xff) return false;
    const std::uint32_t marker = byte_at(b, at + 1);
    at += 2;
    if (marker == 0xd9) return coded;
    if (marker == 0x00 || marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) {
      if (!coded) return false;
      continue;
    }
    if (at + 2 > b.size()) return false;
    const std::size_t length = byte_at(b, at) << 8 | byte_at(b, at + 1);
    if (length < 2 || length > b.size() - at) return false;
    at += length;
    coded = coded || marker == 0xda;
    if (at >= b.size()) return false;
  }
}

bool png_is_whole(std::string_view b) {
  for (std::size_t at = 8; at + 12 <= b.size();) {
    const std::size_t length =
        std::size_t(byte_at(b, at)) << 24 | byte_at(b, at + 1) << 16 | byte_at(b, at + 2) << 8 | byte_at(b, at + 3);
    if (length > b.size() - at - 12) return false;
    if (b.substr(at + 4, 4) == "IEND") return true;
    at += length + 12;
  }
  return false;
}

constexpr std::array<std::string_view, 20> kRaw{"arw", "cr2", "cr3", "crw", "dng", "erf", "iiq", "mef", "mrw", "nef",
                                                "nrw", "orf", "pef", "raf", "raw", "rw2", "rwl", "sr2", "srf", "srw"};
constexpr std::array<std::string_view, 8> kPictures{"jpg", "jpeg", "png", "tif", "tiff", "heic", "heif", "hif"};

}  // namespace

std::string picture_fault(std::string_view bytes) {
  if (bytes.empty()) return "an empty file";
  if (bytes.substr(0, 3) == "\xff\xd8\xff") return jpeg_is_whole(bytes) ? "" : "a JPEG that stops in the middle";
  if (bytes.substr(0, 8) == "\x89PNG\r\n\x1a\n") return png_is_whole(bytes) ? "" : "a PNG that stops in the middle";
  return "";
}

std::string small_extension(const std::filesystem::path& file) {
  std::string out = file.extension().string();
  if (!out.empty()) out.erase(0, 1);
  std::transform(out.begin(), out.end(), out.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  return out;
}

bool is_raw_name(const std::filesystem::path& file) {
  return std::find(kRaw.begin(), kRaw.end(), small_extension(file)) != kRaw.end();
}

bool is_picture_name(const std::filesystem::path& file) {
  return is_raw_name(file) || std::find(kPictures.begin(), kPictures.end(), small_extension(file)) != kPictures.end();
}

std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem,
                                const std::string& extension) {
  for (int number = 1;; ++number) {
    const std::string name = number == 1 ? stem : stem + "-" + std::to_string(number);
    std::filesystem::path file = folder / (extension.empty() ? name : name + "." + extension);
    std::error_code error;
    if (std::filesystem::symlink_status(file, error).type() == std::filesystem::file_type::not_found) return file;
    if (number > 100000) return file;  // the caller's writing will say what is wrong with the folder
  }
}

}  // namespace lumihull::capture
