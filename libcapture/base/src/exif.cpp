// EXIF: a TIFF structure inside a picture file. Only what Lumihull uses is read, and every offset is checked.

#include <algorithm>
#include <cmath>
#include <optional>

#include "image_codecs.h"

namespace lumihull::internal {
namespace {

// Tags of EXIF 2.32, tables 3 to 8.
enum Tag : std::uint16_t {
  kMake = 0x010f,
  kModel = 0x0110,
  kOrientation = 0x0112,
  kExifFolder = 0x8769,
  kDateTimeOriginal = 0x9003,
  kOffsetTimeOriginal = 0x9011,
  kSubSecTimeOriginal = 0x9291,
  kFocalLength = 0x920a,
  kFocalLength35mm = 0xa405,
  kLensModel = 0xa434,
};

/// The TIFF block; reads beyond its end give nothing.
class Tiff {
 public:
  explicit Tiff(Bytes bytes) : bytes_(bytes) {}

  /// Offset of the first folder (IFD); nullopt where this is no TIFF structure.
  std::optional<std::uint32_t> first_folder() {
    if (bytes_.size() < 8) return std::nullopt;
    const char a = char(bytes_[0]), b = char(bytes_[1]);
    if (a != b || (a != 'I' && a != 'M')) return std::nullopt;
    little_ = a == 'I';
    if (u16(2) != 42u) return std::nullopt;
    return u32(4);
  }

  std::optional<std::uint32_t> u16(std::uint64_t offset) const { return number(offset, 2); }
  std::optional<std::uint32_t> u32(std::uint64_t offset) const { return number(offset, 4); }

  /// `entry`: offset of a 12-byte folder entry. Where its values stand: in the entry itself up to four bytes.
  std::optional<std::uint64_t> values(std::uint64_t entry, std::uint64_t bytes) const {
    std::uint64_t at = entry + 8;
    if (bytes > 4) {
      const auto offset = u32(at);
      if (!offset) return std::nullopt;
      at = *offset;
    }
    if (at > bytes_.size() || bytes > bytes_.size() - at) return std::nullopt;
    return at;
  }

  std::string text(std::uint64_t entry) const {
    const auto type = u16(entry + 2), count = u32(entry + 4);
    if (!type || *type != 2 || !count) return {};
    const auto at = values(entry, *count);
    if (!at) return {};
    return {reinterpret_cast<const char*>(bytes_.data()) + *at, std::min<std::size_t>(*count, 256)};
  }

  std::optional<std::uint32_t> integer(std::uint64_t entry) const {
    const auto type = u16(entry + 2), count = u32(entry + 4);
    if (!type || !count || *count < 1) return std::nullopt;
    if (*type == 3) return *count <= 2 ? u16(entry + 8) : std::nullopt;
    if (*type == 4) return *count == 1 ? u32(entry + 8) : std::nullopt;
    return std::nullopt;
  }

  std::optional<double> positive_rational(std::uint64_t entry) const {
    const auto type = u16(entry + 2), count = u32(entry + 4);
    if (!type || *type != 5 || !count || *count < 1) return std::nullopt;
    const auto at = values(entry, 8);
    if (!at) return std::nullopt;
    const double over = *u32(*at), under = *u32(*at + 4);
    if (over <= 0 || under <= 0) return std::nullopt;
    return over / under;
  }

 private:
  std::optional<std::uint32_t> number(std::uint64_t offset, int size) const {
    if (offset > bytes_.size() || std::uint64_t(size) > bytes_.size() - offset) return std::nullopt;
    std::uint32_t value = 0;
    for (int i = 0; i < size; ++i) value = value << 8 | std::uint32_t(bytes_[offset + (little_ ? size - 1 - i : i)]);
    return value;
  }

  Bytes bytes_;
  bool little_ = true;
};

/// Calls visit(tag, offset of the entry) for a folder's entries. A folder has at most 65535 of them, so no loop in
/// hostile data is longer; folders are not chained here.
template <class Visit>
void for_each_entry(const Tiff& tiff, std::uint64_t folder, Visit visit) {
  const auto count = tiff.u16(folder);
  if (!count) return;
  for (std::uint64_t i = 0, entry = folder + 2; i < *count; ++i, entry += 12) {
    const auto tag = tiff.u16(entry);
    if (!tag || !tiff.u32(entry + 8)) return;
    visit(*tag, entry);
  }
}

}  // namespace

std::string clean_text(std::string_view text) {
  text = text.substr(0, std::min(text.find('\0'), std::size_t(255)));
  std::string out(text);
  for (char& c : out)
    if (c < 0x20 || c > 0x7e) c = '?';
  out.erase(0, out.find_first_not_of(' '));
  out.erase(out.find_last_not_of(' ') + 1);
  return out;
}

std::string iso_time(std::string_view t) {
  if (t.size() < 19) return {};
  std::string out(t.substr(0, 19));
  constexpr std::string_view kPattern = "dddd:dd:dd dd:dd:dd";
  for (std::size_t i = 0; i < kPattern.size(); ++i)
    if (kPattern[i] == 'd' ? (out[i] < '0' || out[i] > '9') : out[i] != kPattern[i]) return {};
  const auto two = [&](int i) { return (out[i] - '0') * 10 + out[i + 1] - '0'; };
  if (two(5) < 1 || two(5) > 12 || two(8) < 1 || two(8) > 31 || two(11) > 23 || two(14) > 59 || two(17) > 60) return {};
  out[4] = out[7] = '-';
  out[10] = 'T';
  return out;
}

std::optional<double> second_fraction(std::string_view text) {
  double value = 0, place = 1;
  std::size_t digits = 0;
  for (; digits < text.size() && text[digits] >= '0' && text[digits] <= '9' && digits < 9; ++digits)
    value += (text[digits] - '0') * (place /= 10);
  const std::size_t end = std::min(text.find_first_of(std::string_view(" \0", 2), digits), text.size());
  if (digits == 0 || digits != end) return std::nullopt;
  return value;
}

std::optional<int> utc_offset(std::string_view t) {
  if (t.size() < 6 || (t[0] != '+' && t[0] != '-') || t[3] != ':') return std::nullopt;
  for (const int i : {1, 2, 4, 5})
    if (t[std::size_t(i)] < '0' || t[std::size_t(i)] > '9') return std::nullopt;
  const int minutes = ((t[1] - '0') * 10 + t[2] - '0') * 60 + (t[4] - '0') * 10 + t[5] - '0';
  if (minutes > 15 * 60 || t[4] > '5') return std::nullopt;
  return t[0] == '-' ? -minutes : minutes;
}

void parse_exif(Bytes bytes, ImageInfo& info) {
  Tiff tiff(bytes);
  const auto folder = tiff.first_folder();
  if (!folder) return;
  std::optional<std::uint32_t> exif_folder;
  for_each_entry(tiff, *folder, [&](std::uint32_t tag, std::uint64_t entry) {
    if (tag == kMake) info.make = clean_text(tiff.text(entry));
    if (tag == kModel) info.model = clean_text(tiff.text(entry));
    if (tag == kOrientation)
      if (const auto value = tiff.integer(entry); value && *value >= 1 && *value <= 8) info.orientation = int(*value);
    if (tag == kExifFolder) exif_folder = tiff.integer(entry);
  });
  if (!exif_folder) return;
  for_each_entry(tiff, *exif_folder, [&](std::uint32_t tag, std::uint64_t entry) {
    if (tag == kDateTimeOriginal) info.time = iso_time(tiff.text(entry));
    if (tag == kSubSecTimeOriginal) info.time_fraction_s = second_fraction(tiff.text(entry));
    if (tag == kOffsetTimeOriginal) info.time_offset_min = utc_offset(tiff.text(entry));
    if (tag == kLensModel) info.lens = clean_text(tiff.text(entry));
    if (tag == kFocalLength)
      if (const auto f = tiff.positive_rational(entry)) info.focal_length_mm = *f;
    if (tag == kFocalLength35mm)
      if (const auto f = tiff.integer(entry); f && *f > 0) info.focal_length_35mm_mm = *f;
  });
}

}  // namespace lumihull::internal
