// Silhouettes as PNG, fast. zlib looks for repetitions byte by byte, 10 ms for a mask of 6.3 megapixels that is one run
// after another; here the runs are found eight bytes at a time and written as deflate's fixed codes (RFC 1951, 3.2.6).

#include <libdeflate.h>

#include <array>
#include <bit>
#include <cstring>
#include <memory>

#include "image_codecs.h"

namespace lumihull {
namespace internal {
namespace {

constexpr unsigned kLongest = 258, kShortest = 3;  // of a deflate match

/// Deflate's bits, least significant first.
class BitWriter {
 public:
  explicit BitWriter(std::string& out) : out_(out) {}
  void put(std::uint32_t bits, int count) {
    held_ |= std::uint64_t(bits) << held_count_;
    held_count_ += count;
    for (; held_count_ >= 8; held_count_ -= 8, held_ >>= 8) out_.push_back(char(held_));
  }
  void flush() {
    if (held_count_ > 0) put(0, 8 - held_count_);
  }

 private:
  std::string& out_;
  std::uint64_t held_ = 0;
  int held_count_ = 0;
};

struct Code {
  std::uint16_t bits;
  std::uint8_t count;
};

std::uint32_t reversed(std::uint32_t value, int count) {
  std::uint32_t out = 0;
  for (int i = 0; i < count; ++i) out |= (value >> i & 1) << (count - 1 - i);
  return out;
}

/// The fixed code of literals and lengths; Huffman codes start with their most significant bit.
Code fixed_code(unsigned symbol) {
  if (symbol < 144) return {std::uint16_t(reversed(0x30 + symbol, 8)), 8};
  if (symbol < 256) return {std::uint16_t(reversed(0x190 + symbol - 144, 9)), 9};
  if (symbol < 280) return {std::uint16_t(reversed(symbol - 256, 7)), 7};
  return {std::uint16_t(reversed(0xC0 + symbol - 280, 8)), 8};
}

/// A match of each length at distance 1: length code, its extra bits, five zero bits for the distance.
std::array<Code, kLongest + 1> match_codes() {
  std::array<Code, kLongest + 1> codes{};
  for (unsigned length = kShortest; length < kLongest; ++length) {
    const unsigned from = length - kShortest;
    const int extra = from < 8 ? 0 : std::bit_width(from) - 3;
    const unsigned symbol = 257 + 4 * unsigned(extra) + (from >> extra);
    const Code code = fixed_code(symbol);
    codes[length] = {std::uint16_t(code.bits | (from & ((1u << extra) - 1)) << code.count),
                     std::uint8_t(code.count + extra + 5)};
  }
  const Code longest = fixed_code(285);
  codes[kLongest] = {longest.bits, std::uint8_t(longest.count + 5)};
  return codes;
}

/// Writes bytes as literals and runs (matches at distance 1).
class RunWriter {
 public:
  explicit RunWriter(std::string& out) : bits_(out), matches_(match_codes()) {
    for (unsigned i = 0; i < 256; ++i) literals_[i] = fixed_code(i);
    bits_.put(1, 1);  // the last block
    bits_.put(1, 2);  // fixed codes
  }

  void add(const std::uint8_t* bytes, std::size_t count) {
    for (std::size_t i = 0; i < count;) {
      const std::size_t same = run(bytes + i, count - i);
      pending_ += same;
      i += same;
      if (i == count) break;
      end_run();
      put(literals_[bytes[i]]);
      last_ = bytes[i++];
    }
  }

  void finish() {
    end_run();
    bits_.put(0, 7);  // end of block
    bits_.flush();
  }

 private:
  /// How many of the bytes equal the last one that was added.
  std::size_t run(const std::uint8_t* bytes, std::size_t count) const {
    if (last_ < 0) return 0;
    const std::uint64_t wanted = std::uint64_t(last_) * 0x0101010101010101u;
    std::size_t i = 0;
    for (; i + 8 <= count; i += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, bytes + i, 8);
      if (eight != wanted) break;
    }
    while (i < count && bytes[i] == last_) ++i;
    return i;
  }

  void end_run() {
    for (; pending_ >= kLongest + kShortest; pending_ -= kLongest) put(matches_[kLongest]);
    if (pending_ > kLongest) {  // what is left must be long enough for a match, too
      put(matches_[kLongest - kShortest]);
      pending_ -= kLongest - kShortest;
    }
    if (pending_ >= kShortest) {
      put(matches_[pending_]);
      pending_ = 0;
    }
    for (; pending_ > 0; --pending_) put(literals_[std::size_t(last_)]);
  }

  void put(Code code) { bits_.put(code.bits, code.count); }

  BitWriter bits_;
  std::array<Code, 256> literals_;
  const std::array<Code, kLongest + 1> matches_;
  int last_ = -1;
  std::size_t pending_ = 0;
};

void append_big_endian32(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(char(value >> shift & 255));
}

/// A chunk is begun with its length unknown, and closed with its length and check sum.
std::size_t begin_chunk(std::string& out, const char* type) {
  out.append(4, '\0').append(type, 4);
  return out.size() - 8;
}

void end_chunk(std::string& out, std::size_t start) {
  const std::uint32_t length = std::uint32_t(out.size() - start - 8);
  for (std::size_t i = 0; i < 4; ++i) out[start + i] = char(length >> (24 - 8 * i) & 255);
  append_big_endian32(out, libdeflate_crc32(0, out.data() + start + 4, length + 4));
}

constexpr std::size_t kHeader = 33;  // signature and IHDR

}  // namespace

Image decode_plain_grey_png(Bytes bytes) {
  // Bit depth 8, grey, deflate, filter method 0, not interlaced.
  if (bytes.size() < kHeader || std::memcmp(&bytes[8], "\0\0\0\rIHDR", 8) != 0 ||
      std::memcmp(&bytes[24], "\x08\0\0\0\0", 5) != 0)
    return {};
  const std::uint64_t width = big_endian32(&bytes[16]), height = big_endian32(&bytes[20]);
  if (width == 0 || height == 0 || width > kMaxImageSide || height > kMaxImageSide || width * height > kMaxImagePixels)
    return {};
  Bytes data;
  for (std::size_t at = 8;;) {
    if (bytes.size() - at < 12) return {};
    const std::size_t length = big_endian32(&bytes[at]);
    if (length > bytes.size() - at - 12) return {};
    const std::byte* const type = &bytes[at + 4];
    if (libdeflate_crc32(0, type, length + 4) != big_endian32(type + 4 + length)) return {};
    if (std::memcmp(type, "IEND", 4) == 0) break;
    if (std::memcmp(type, "IDAT", 4) == 0) {
      if (!data.empty()) return {};
      data = bytes.subspan(at + 8, length);
    } else if (at != 8) {
      return {};
    }
    at += 12 + length;
  }
  // Deflate shrinks by at most 1032 (zlib's technical notes), so a short file can't ask for much memory.
  const std::size_t row = width + 1;
  if (row * height > data.size() * 1032) return {};
  const auto filtered = std::make_unique_for_overwrite<std::uint8_t[]>(row * height);
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflater(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!inflater || libdeflate_zlib_decompress(inflater.get(), data.data(), data.size(), filtered.get(), row * height,
                                              nullptr) != LIBDEFLATE_SUCCESS)
    return {};
  Image image = Image::uninitialized(int(width), int(height), 1);
  for (std::size_t y = 0; y < height; ++y) {
    if (filtered[y * row] != 0) return {};
    std::memcpy(image.row<std::uint8_t>(int(y)), &filtered[y * row + 1], width);
  }
  return image;
}

}  // namespace internal

std::string encode_mask(const Image& mask) {
  using namespace internal;
  if (mask.empty() || mask.type() != PixelType::u8 || mask.channels() != 1)
    throw Error(ErrorCode::invalid_argument, "expected a mask of 8 bits and one channel");
  std::string out("\x89PNG\r\n\x1a\n", 8);
  out.reserve(1 << 17);
  std::size_t chunk = begin_chunk(out, "IHDR");
  append_big_endian32(out, std::uint32_t(mask.width()));
  append_big_endian32(out, std::uint32_t(mask.height()));
  out.append("\x08\0\0\0\0", 5);
  end_chunk(out, chunk);
  chunk = begin_chunk(out, "IDAT");
  out.append("\x78\x01", 2);  // zlib: deflate, fastest
  RunWriter writer(out);
  std::uint32_t checksum = 1;
  const std::uint8_t no_filter = 0;
  for (int y = 0; y < mask.height(); ++y) {
    const std::uint8_t* row = mask.row<std::uint8_t>(y);
    writer.add(&no_filter, 1);
    writer.add(row, std::size_t(mask.width()));
    checksum = libdeflate_adler32(checksum, &no_filter, 1);
    checksum = libdeflate_adler32(checksum, row, std::size_t(mask.width()));
  }
  writer.finish();
  append_big_endian32(out, checksum);
  if (out.size() - chunk > 0x7fffffffu)
    throw Error(ErrorCode::unsupported, "the mask is too large and too busy for one PNG chunk");
  end_chunk(out, chunk);
  end_chunk(out, begin_chunk(out, "IEND"));
  return out;
}

}  // namespace lumihull
