// Frames: two implementations, written apart from one document, and the bytes in that document.
#include <gtest/gtest.h>
#include <support.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>

#include "fake_machine.h"

namespace lumihull::test {
namespace {

using namespace capture::internal;

Bytes random_bytes(std::mt19937& random, std::size_t n, unsigned zeros_in_16) {
  Bytes bytes(n);
  for (auto& byte : bytes) byte = random() % 16 < zeros_in_16 ? 0 : std::uint8_t(random());
  return bytes;
}

/// The sum of the definition, bit by bit.
std::uint16_t crc_by_bits(const Bytes& bytes) {
  unsigned crc = 0xffff;
  for (const auto byte : bytes)
    for (int bit = 7; bit >= 0; --bit) {
      const bool top = ((crc >> 15) ^ (byte >> bit)) & 1;
      crc = (crc << 1 & 0xffff) ^ (top ? 0x1021 : 0);
    }
  return std::uint16_t(crc);
}

fw_frame c_frame(const Frame& frame) {
  fw_frame c{};
  c.version = frame.version;
  c.type = frame.type;
  c.nonce = frame.nonce;
  c.sequence = frame.sequence;
  c.length = std::uint8_t(frame.payload.size());
  std::copy(frame.payload.begin(), frame.payload.end(), c.payload);
  return c;
}

Frame cpp_frame(const fw_frame& c) {
  return {c.version, c.type, c.nonce, c.sequence, Bytes(c.payload, c.payload + c.length)};
}

std::vector<Frame> host_hears(const Bytes& wire) {
  std::vector<Frame> frames;
  FrameReceiver receiver;
  for (const auto byte : wire)
    if (auto frame = receiver.put(byte)) frames.push_back(*frame);
  return frames;
}

std::vector<Frame> firmware_hears(const Bytes& wire) {
  std::vector<Frame> frames;
  fw_receiver receiver{};
  fw_frame frame;
  for (const auto byte : wire)
    if (fw_receive(&receiver, byte, &frame)) frames.push_back(cpp_frame(frame));
  return frames;
}

Bytes framed(const Bytes& decoded) {
  Bytes wire = cobs_encode(decoded);
  wire.insert(wire.begin(), 0);
  wire.push_back(0);
  return wire;
}

Bytes with_crc(Bytes bytes) {
  append_u16(bytes, crc16(bytes));
  return bytes;
}

struct Line {
  std::uint32_t ms = 0;
  bool by_host = false;
  std::string name;
  Bytes frame, wire;
};

Bytes parse_hex(const std::string& text) {
  std::istringstream in(text);
  Bytes bytes;
  for (std::string word; in >> word;) bytes.push_back(std::uint8_t(std::stoul(word, nullptr, 16)));
  return bytes;
}

/// The conversation of section 7: "MS host|controller NAME: BYTES -> BYTES".
std::vector<Line> document() {
  std::ifstream in(LUMIHULL_SOURCE_DIR "/libcapture/firmware/PROTOCOL.md");
  std::vector<Line> lines;
  bool inside = false;
  for (std::string text; std::getline(in, text);) {
    if (text.rfind("```", 0) == 0) {
      inside = !inside;
      continue;
    }
    if (!inside) continue;
    const auto colon = text.find(": "), arrow = text.find(" -> ");
    if (colon == std::string::npos || arrow == std::string::npos) throw std::runtime_error("not a line: " + text);
    std::istringstream head(text.substr(0, colon));
    Line line;
    std::string who;
    head >> line.ms >> who;
    std::getline(head, line.name);
    line.by_host = who == "host";
    line.frame = parse_hex(text.substr(colon + 2, arrow - colon - 2));
    line.wire = parse_hex(text.substr(arrow + 4));
    lines.push_back(line);
  }
  return lines;
}

TEST(SerialFrames, TheCrcHasItsCheckValue) {
  const std::string check = "123456789";
  const Bytes bytes(check.begin(), check.end());
  EXPECT_EQ(crc16(bytes), 0x29B1);
  EXPECT_EQ(fw_crc16(bytes.data(), bytes.size()), 0x29B1);
  std::mt19937 random(1);
  for (std::size_t n = 0; n < 300; ++n) {
    const Bytes any = random_bytes(random, n, 2);
    EXPECT_EQ(crc16(any), crc_by_bits(any));
    EXPECT_EQ(fw_crc16(any.data(), any.size()), crc_by_bits(any));
  }
}

TEST(SerialFrames, CobsGivesBackWhatItWasGiven) {
  // The examples of Cheshire & Baker's article, section 3, and of its limit of 254.
  EXPECT_EQ(cobs_encode(Bytes{}), Bytes{1});
  EXPECT_EQ(cobs_encode(Bytes{0}), (Bytes{1, 1}));
  EXPECT_EQ(cobs_encode(Bytes{1, 2, 0, 3}), (Bytes{3, 1, 2, 2, 3}));
  Bytes long_one(254, 7);
  Bytes expected = long_one;
  expected.insert(expected.begin(), 255);
  EXPECT_EQ(cobs_encode(long_one), expected);

  std::mt19937 random(2);
  for (std::size_t n = 0; n < 800; ++n)
    for (const unsigned zeros : {0u, 1u, 8u, 16u}) {
      SCOPED_TRACE(n);
      const Bytes bytes = random_bytes(random, n, zeros);
      const Bytes stuffed = cobs_encode(bytes);
      EXPECT_EQ(std::count(stuffed.begin(), stuffed.end(), 0), 0);
      EXPECT_LE(stuffed.size(), n + 1 + n / 254);
      EXPECT_EQ(cobs_decode(stuffed), bytes);
    }
  EXPECT_EQ(cobs_decode(Bytes{3, 1}), std::nullopt);
  EXPECT_EQ(cobs_decode(Bytes{3, 0, 1}), std::nullopt);
}

TEST(SerialFrames, BothSidesReadWhatEitherWrites) {
  std::mt19937 random(3);
  for (int i = 0; i < 5000; ++i) {
    Frame frame;
    frame.version = std::uint8_t(random());
    frame.type = std::uint8_t(random());
    frame.nonce = random() % 4 ? std::uint32_t(random()) : 0;
    frame.sequence = std::uint16_t(random());
    frame.payload = random_bytes(random, random() % (kMaxPayload + 1), random() % 17);
    const Bytes wire = encode_frame(frame);
    std::array<std::uint8_t, FW_MAX_WIRE> c_wire;
    const fw_frame c = c_frame(frame);
    const std::size_t n = fw_encode(&c, c_wire.data());
    ASSERT_EQ(Bytes(c_wire.data(), c_wire.data() + n), wire);
    ASSERT_EQ(host_hears(wire), std::vector{frame});
    ASSERT_EQ(firmware_hears(wire), std::vector{frame});
  }
}

TEST(SerialFrames, AFrameOfAnyLengthIsTakenOrPassedOverAndTheNextOneIsHeard) {
  std::mt19937 random(4);
  Frame next;
  next.type = 5;
  next.payload = {1, 0, 2};
  for (std::size_t n = 0; n <= 300; ++n)
    for (const bool sound : {false, true}) {
      SCOPED_TRACE(n);
      // With a sound sum and, from 9 bytes on, a length field that fits as far as a byte can.
      Bytes bytes = random_bytes(random, n, 1);
      if (n > 8) bytes[8] = std::uint8_t(n - 9);
      Bytes wire = framed(sound ? with_crc(bytes) : bytes);
      const bool good = sound && n >= 9 && n - 9 <= kMaxPayload;
      const Bytes after = encode_frame(next);
      wire.insert(wire.end(), after.begin(), after.end());
      EXPECT_EQ(host_hears(wire).size(), good ? 2u : 1u);
      EXPECT_EQ(host_hears(wire).back(), next);
      EXPECT_EQ(firmware_hears(wire), host_hears(wire));
    }
}

TEST(SerialFrames, EveryByteMattersAndEveryCutIsSeen) {
  Frame frame;
  frame.type = 0x10;
  frame.nonce = 0xC0FFEE01;
  frame.payload = {1, 0, 0, 0, 250, 0, 0, 0};
  const Bytes wire = encode_frame(frame);
  for (std::size_t at = 0; at < wire.size(); ++at)
    for (int value = 0; value < 256; ++value) {
      Bytes damaged = wire;
      damaged[at] = std::uint8_t(value);
      if (damaged == wire) continue;
      EXPECT_EQ(firmware_hears(damaged), host_hears(damaged));
      // The zero in front is for what came before.
      EXPECT_TRUE(at == 0 || host_hears(damaged).empty()) << at << " " << value;
    }
  for (std::size_t at = 1; at + 1 < wire.size(); ++at) {
    Bytes cut = wire;
    cut.erase(cut.begin() + std::ptrdiff_t(at));
    EXPECT_TRUE(host_hears(cut).empty()) << at;
    EXPECT_TRUE(firmware_hears(cut).empty()) << at;
  }
}

TEST(SerialFrames, AFloodOfNoiseIsPassedOver) {
  std::mt19937 random(5);
  Frame frame;
  frame.type = 2;
  Bytes wire = random_bytes(random, 1'000'000, 1);
  const Bytes good = encode_frame(frame);
  wire.insert(wire.end(), good.begin(), good.end());
  const auto heard = host_hears(wire);
  EXPECT_EQ(heard, firmware_hears(wire));
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.back(), frame);
  EXPECT_LE(heard.size(), 3u);  // of some 60,000 stretches one in 65,536 has the right sum, fewer the right length
}

TEST(ProtocolDocument, ItsBytesAreThoseOfBothCodecs) {
  const auto lines = document();
  ASSERT_GT(lines.size(), 40u);
  for (const Line& line : lines) {
    SCOPED_TRACE(line.name);
    EXPECT_EQ(framed(line.frame), line.wire);
    const auto host = host_hears(line.wire);
    ASSERT_EQ(host.size(), 1u);
    EXPECT_EQ(firmware_hears(line.wire), host);
    EXPECT_EQ(encode_frame(host[0]), line.wire);
    EXPECT_EQ(host[0].nonce, line.by_host ? host[0].nonce : 0xC0FFEE01u);
    std::array<std::uint8_t, FW_MAX_WIRE> wire;
    const fw_frame c = c_frame(host[0]);
    EXPECT_EQ(Bytes(wire.data(), wire.data() + fw_encode(&c, wire.data())), line.wire);
  }
}

TEST(ProtocolDocument, TheFirmwareAnswersAsItSays) {
  const auto lines = document();
  FakeMachine machine;
  for (std::size_t i = 0; i < lines.size();) {
    ASSERT_GE(lines[i].ms, machine.now_ms);
    machine.pass(lines[i].ms - machine.now_ms);
    if (lines[i].by_host) machine.hear(lines[i++].wire);
    Bytes expected;
    for (; i < lines.size() && !lines[i].by_host && lines[i].ms == machine.now_ms; ++i)
      expected.insert(expected.end(), lines[i].wire.begin(), lines[i].wire.end());
    EXPECT_EQ(machine.sent, expected) << "before line " << i;
    machine.sent.clear();
  }
}

}  // namespace
}  // namespace lumihull::test
