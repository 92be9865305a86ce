#include "serial_frames.h"

#include <algorithm>
#include <cassert>

namespace lumihull::capture::internal {
namespace {

constexpr std::array<std::uint16_t, 256> make_table() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) {
    unsigned crc = i << 8;
    for (int bit = 0; bit < 8; ++bit) crc = crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1;
    table[i] = std::uint16_t(crc);
  }
  return table;
}

constexpr auto kTable = make_table();

/// `out` holds cobs_bound(n) bytes; returns how many were written.
std::size_t stuff(std::span<const std::uint8_t> bytes, std::uint8_t* out) {
  std::uint8_t *code = out, *to = out + 1;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] != 0) *to++ = bytes[i];
    const bool full = to - code == 255;
    if (bytes[i] != 0 && !(full && i + 1 < bytes.size())) continue;
    *code = std::uint8_t(to - code);
    code = to++;
  }
  *code = std::uint8_t(to - code);
  return std::size_t(to - out);
}

/// The number of bytes, or nothing. `out` may hold as many as `bytes` and may be the same.
std::optional<std::size_t> unstuff(std::span<const std::uint8_t> bytes, std::uint8_t* out) {
  std::size_t written = 0;
  for (std::size_t i = 0; i < bytes.size();) {
    const std::size_t piece = bytes[i];
    if (piece == 0 || i + piece > bytes.size()) return std::nullopt;
    for (std::size_t k = i + 1; k < i + piece; ++k) {
      if (bytes[k] == 0) return std::nullopt;
      out[written++] = bytes[k];
    }
    i += piece;
    if (piece < 255 && i < bytes.size()) out[written++] = 0;
  }
  return written;
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = 0xffff;
  for (const std::uint8_t byte : bytes) crc = std::uint16_t(crc << 8) ^ kTable[(crc >> 8) ^ byte];
  return crc;
}

Bytes cobs_encode(std::span<const std::uint8_t> bytes) {
  Bytes out(bytes.size() + 1 + bytes.size() / 254);
  out.resize(stuff(bytes, out.data()));
  return out;
}

std::optional<Bytes> cobs_decode(std::span<const std::uint8_t> bytes) {
  Bytes out(bytes.size());
  const auto n = unstuff(bytes, out.data());
  if (!n) return std::nullopt;
  out.resize(*n);
  return out;
}

void append_u8(Bytes& bytes, std::uint8_t value) { bytes.push_back(value); }
void append_u16(Bytes& bytes, std::uint16_t value) {
  bytes.push_back(std::uint8_t(value));
  bytes.push_back(std::uint8_t(value >> 8));
}
void append_u32(Bytes& bytes, std::uint32_t value) {
  append_u16(bytes, std::uint16_t(value));
  append_u16(bytes, std::uint16_t(value >> 16));
}

std::uint32_t PayloadReader::take(std::size_t n) {
  if (bytes_.size() < n) {
    ok_ = false;
    bytes_ = {};
    return 0;
  }
  std::uint32_t value = 0;
  for (std::size_t i = n; i-- > 0;) value = value << 8 | bytes_[i];
  bytes_ = bytes_.subspan(n);
  return value;
}

Bytes encode_frame(const Frame& frame) {
  assert(frame.payload.size() <= kMaxPayload);
  std::array<std::uint8_t, kMaxFrame> bytes;
  auto* to = bytes.data();
  *to++ = frame.version;
  *to++ = frame.type;
  for (int shift = 0; shift < 32; shift += 8) *to++ = std::uint8_t(frame.nonce >> shift);
  *to++ = std::uint8_t(frame.sequence);
  *to++ = std::uint8_t(frame.sequence >> 8);
  *to++ = std::uint8_t(frame.payload.size());
  to = std::copy(frame.payload.begin(), frame.payload.end(), to);
  const std::uint16_t crc = crc16({bytes.data(), to});
  *to++ = std::uint8_t(crc);
  *to++ = std::uint8_t(crc >> 8);

  Bytes wire(kMaxFrame + 3);
  wire[0] = 0;
  const std::size_t n = stuff({bytes.data(), to}, wire.data() + 1);
  wire[n + 1] = 0;
  wire.resize(n + 2);
  return wire;
}

std::optional<Frame> FrameReceiver::put(std::uint8_t byte) {
  if (byte != 0) {
    if (count_ < bytes_.size())
      bytes_[count_++] = byte;
    else
      overflow_ = true;
    return std::nullopt;
  }
  const std::size_t encoded = overflow_ ? 0 : count_;
  count_ = 0;
  overflow_ = false;
  const auto length = unstuff({bytes_.data(), encoded}, bytes_.data());
  if (!length || *length < kHeader + 2 || bytes_[8] != *length - kHeader - 2) return std::nullopt;
  PayloadReader crc({bytes_.data() + *length - 2, 2});
  if (crc16({bytes_.data(), *length - 2}) != crc.u16()) return std::nullopt;

  PayloadReader in({bytes_.data(), kHeader});
  Frame frame;
  frame.version = in.u8();
  frame.type = in.u8();
  frame.nonce = in.u32();
  frame.sequence = in.u16();
  frame.payload.assign(bytes_.begin() + kHeader, bytes_.begin() + std::ptrdiff_t(*length) - 2);
  return frame;
}

}  // namespace lumihull::capture::internal
