#pragma once

// Frames of libcapture/firmware/PROTOCOL.md, section 1, as the host makes and reads them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lumihull::capture::internal {

constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHeader = 9, kMaxPayload = 64, kMaxFrame = kHeader + kMaxPayload + 2;

using Bytes = std::vector<std::uint8_t>;

struct Frame {
  std::uint8_t version = kVersion;
  std::uint8_t type = 0;
  std::uint32_t nonce = 0;
  std::uint16_t sequence = 0;
  Bytes payload;  ///< at most kMaxPayload

  bool operator==(const Frame&) const = default;
};

/// CRC-16/CCITT-FALSE; of "123456789" it is 0x29B1.
std::uint16_t crc16(std::span<const std::uint8_t> bytes);

/// Consistent Overhead Byte Stuffing (Cheshire & Baker 1999) without the zeros around it. Of any length: n bytes become
/// n + 1 + n / 254 at most.
Bytes cobs_encode(std::span<const std::uint8_t> bytes);
/// Nothing where a piece reaches beyond the end or a zero stands inside.
std::optional<Bytes> cobs_decode(std::span<const std::uint8_t> bytes);

/// The bytes on the line, with a zero before and behind.
Bytes encode_frame(const Frame& frame);

/// Takes bytes from the line one by one.
class FrameReceiver {
 public:
  /// The frame that this byte completed. Noise and damaged frames are passed over.
  std::optional<Frame> put(std::uint8_t byte);

 private:
  std::array<std::uint8_t, kMaxFrame + 1> bytes_{};
  std::size_t count_ = 0;
  bool overflow_ = false;
};

/// Little-endian numbers at the end of a payload.
void append_u8(Bytes& bytes, std::uint8_t value);
void append_u16(Bytes& bytes, std::uint16_t value);
void append_u32(Bytes& bytes, std::uint32_t value);

/// Reads a payload from its beginning; beyond its end everything is 0 and `ok` is false.
class PayloadReader {
 public:
  explicit PayloadReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  explicit PayloadReader(Bytes&&) = delete;  // it reads from what it is given
  std::uint8_t u8() { return std::uint8_t(take(1)); }
  std::uint16_t u16() { return std::uint16_t(take(2)); }
  std::uint32_t u32() { return take(4); }
  std::int32_t i32() { return std::int32_t(take(4)); }
  bool ok() const { return ok_; }

 private:
  std::uint32_t take(std::size_t n);

  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace lumihull::capture::internal
