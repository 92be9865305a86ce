// The serial link: frames a second of the codec beside peers, and how long a request takes on a pseudo-terminal beside
// the bare way there and back. The firmware's simulator must stand beside this program.

#include <fcntl.h>
#include <lumihull/capture/serial.h>
#include <poll.h>
#include <serial_frames.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <functional>
#include <random>
#include <span>
#include <thread>
#include <vector>

extern "C" {
#include <fw_frame.h>
}

namespace {

using namespace lumihull::capture;
using namespace lumihull::capture::internal;

double cpu_seconds(const std::function<void()>& body) {
  double least = 1e9;
  for (int i = 0; i < 10; ++i) {
    timespec a{}, b{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    body();
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    least = std::min(least, double(b.tv_sec - a.tv_sec) + 1e-9 * double(b.tv_nsec - a.tv_nsec));
  }
  return least;
}

// ---- the peer: as the definitions read, and with Boost's sum ----

std::uint16_t crc_by_bits(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xffff;
  for (const auto byte : bytes) {
    crc ^= unsigned(byte) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1) & 0xffff;
  }
  return std::uint16_t(crc);
}

std::uint16_t crc_by_boost(std::span<const std::uint8_t> bytes) {
  boost::crc_optimal<16, 0x1021, 0xFFFF, 0, false, false> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return std::uint16_t(crc.checksum());
}

template <class Crc>
Bytes plain_encode(const Frame& frame, Crc crc) {
  Bytes bytes{frame.version, frame.type};
  append_u32(bytes, frame.nonce);
  append_u16(bytes, frame.sequence);
  append_u8(bytes, std::uint8_t(frame.payload.size()));
  bytes.insert(bytes.end(), frame.payload.begin(), frame.payload.end());
  append_u16(bytes, crc(bytes));
  Bytes wire{0}, piece;
  bytes.push_back(0);
  for (const auto byte : bytes) {
    if (byte != 0) {
      piece.push_back(byte);
      continue;
    }
    wire.push_back(std::uint8_t(piece.size() + 1));
    wire.insert(wire.end(), piece.begin(), piece.end());
    piece.clear();
  }
  wire.push_back(0);
  return wire;
}

template <class Crc>
bool plain_decode(const Bytes& wire, Frame& frame, Crc crc) {
  Bytes bytes;
  for (std::size_t i = 1; i + 1 < wire.size();) {
    const std::size_t piece = wire[i];
    if (i + piece >= wire.size()) return false;
    for (std::size_t k = i + 1; k < i + piece; ++k) bytes.push_back(wire[k]);
    i += piece;
    if (i + 1 < wire.size()) bytes.push_back(0);
  }
  if (bytes.size() < 11 || bytes[8] + 11u != bytes.size()) return false;
  if (crc({bytes.data(), bytes.size() - 2}) != (bytes[bytes.size() - 2] | bytes.back() << 8)) return false;
  PayloadReader in(bytes);
  frame.version = in.u8();
  frame.type = in.u8();
  frame.nonce = in.u32();
  frame.sequence = in.u16();
  frame.payload.assign(bytes.begin() + 9, bytes.end() - 2);
  return true;
}

// ---- codec ----

void measure_codec(std::size_t payload) {
  constexpr int kFrames = 20000;
  std::mt19937 random(1);
  std::vector<Frame> frames(kFrames);
  for (Frame& frame : frames) {
    frame.type = 0x22;
    frame.nonce = random();
    frame.sequence = std::uint16_t(random());
    for (std::size_t i = 0; i < payload; ++i)
      frame.payload.push_back(i % 4 == 3 ? 0
                                         : std::uint8_t(random()));  // lengths in micrometres: each fourth byte is 0
  }
  int wrong = 0;
  const double ours = cpu_seconds([&] {
    FrameReceiver receiver;
    for (const Frame& frame : frames) {
      std::optional<Frame> back;
      for (const auto byte : encode_frame(frame))
        if (auto got = receiver.put(byte)) back = std::move(got);
      wrong += back != frame;
    }
  });
  const double firmware = cpu_seconds([&] {
    fw_receiver receiver{};
    for (const Frame& frame : frames) {
      fw_frame c{}, back{};
      c.version = frame.version;
      c.type = frame.type;
      c.nonce = frame.nonce;
      c.sequence = frame.sequence;
      c.length = std::uint8_t(frame.payload.size());
      std::copy(frame.payload.begin(), frame.payload.end(), c.payload);
      std::array<std::uint8_t, FW_MAX_WIRE> wire;
      const std::size_t n = fw_encode(&c, wire.data());
      for (std::size_t i = 0; i < n; ++i) fw_receive(&receiver, wire[i], &back);
      wrong += std::memcmp(c.payload, back.payload, c.length) != 0 || c.sequence != back.sequence;
    }
  });
  auto peer = [&](auto crc) {
    return cpu_seconds([&] {
      for (const Frame& frame : frames) {
        Frame back;
        const Bytes wire = plain_encode(frame, crc);
        wrong += !plain_decode(wire, back, crc) || back != frame || wire != encode_frame(frame);
      }
    });
  };
  const double check = cpu_seconds([&] {
    for (const Frame& frame : frames) wrong += encode_frame(frame).empty();
  });
  const double bits = peer(crc_by_bits) - check, boost = peer(crc_by_boost) - check;
  std::printf(
      "%2zu bytes of payload, encoded and decoded: host %5.2f, firmware %5.2f, plain %5.2f, plain with Boost.CRC %5.2f "
      "million frames/s; host / best peer %.1f; %d wrong\n",
      payload, kFrames / ours * 1e-6, kFrames / firmware * 1e-6, kFrames / bits * 1e-6, kFrames / boost * 1e-6,
      std::min(bits, boost) / ours, wrong);
}

// ---- the line ----

struct Times {
  double median_us = 0, p99_us = 0;
};

Times time_each(int count, const std::function<void()>& body) {
  std::vector<double> us;
  for (int i = 0; i < count; ++i) {
    const auto start = std::chrono::steady_clock::now();
    body();
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(us.begin(), us.end());
  return {us[us.size() / 2], us[us.size() * 99 / 100]};
}

/// As many bytes there and back as a STATUS of six winches, without any protocol.
Times bare_terminal() {
  const int master = posix_openpt(O_RDWR | O_NOCTTY);
  if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) return {};
  const int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
  termios settings{};
  tcgetattr(slave, &settings);
  cfmakeraw(&settings);
  tcsetattr(slave, TCSANOW, &settings);
  constexpr std::size_t kThere = 14, kBack = 46;
  auto read_all = [](int descriptor, std::size_t n) {
    std::array<char, 64> bytes;
    while (n > 0) {
      const ssize_t got = read(descriptor, bytes.data(), n);
      if (got <= 0) return false;
      n -= std::size_t(got);
    }
    return true;
  };
  const std::array<char, 64> bytes{};
  constexpr int kCount = 5000;
  std::thread other([&] {
    for (int i = 0; i < kCount && read_all(master, kThere); ++i)
      if (write(master, bytes.data(), kBack) < 0) return;
  });
  const Times times = time_each(kCount, [&] {
    if (write(slave, bytes.data(), kThere) > 0) read_all(slave, kBack);
  });
  other.join();
  close(slave);
  close(master);
  return times;
}

void measure_line(const std::string& simulator) {
  std::array<int, 2> in{};
  if (pipe2(in.data(), O_CLOEXEC) != 0) return;
  // The program reads orders from standard input, whose end ends it.
  FILE* out = popen((simulator + " --log /dev/null --speed 1 <&" + std::to_string(dup(in[0]))).c_str(), "r");
  std::array<char, 256> name{};
  if (!out || !fgets(name.data(), name.size(), out)) {
    std::printf("no simulator at %s\n", simulator.c_str());
    return;
  }
  SerialOptions options;
  options.device = std::string(name.data(), std::strcspn(name.data(), "\n"));
  {
    const auto robot = open_serial_robot(open_serial_link(options), paper_mechanism());
    int lost = 0;
    const Times times = time_each(5000, [&] { lost += !robot->state().ready; });
    const Times bare = bare_terminal();
    std::printf(
        "STATUS of six winches: median %.0f us, 99 %% below %.0f us, %.0f requests/s; bare bytes: %.0f us, %.0f us; "
        "%d lost\n",
        times.median_us, times.p99_us, 1e6 / times.median_us, bare.median_us, bare.p99_us, lost);
  }
  close(in[1]);
  pclose(out);
}

}  // namespace

int main(int, char** argv) {
  measure_codec(25);
  measure_codec(64);
  measure_line((std::filesystem::path(argv[0]).parent_path() / "lumihull-firmware-sim").string());
}
