// termios of POSIX.1-2017; libserialport of Debian 12 can't open pseudo-terminals, on which simulators listen.
#include "serial_port.h"

#include <fcntl.h>
#include <lumihull/base/error.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace lumihull::capture::internal {
namespace {

constexpr int kWriteMs = 1000;

speed_t speed_of(unsigned baud) {
  constexpr std::array<std::pair<unsigned, speed_t>, 8> kSpeeds{{{9600, B9600},
                                                                 {19200, B19200},
                                                                 {38400, B38400},
                                                                 {57600, B57600},
                                                                 {115200, B115200},
                                                                 {230400, B230400},
                                                                 {460800, B460800},
                                                                 {921600, B921600}}};
  for (const auto& [number, speed] : kSpeeds)
    if (number == baud) return speed;
  throw Error(ErrorCode::invalid_argument, "baud must be 9600, 19200, 38400, 57600, 115200, 230400, 460800 or 921600",
              std::to_string(baud));
}

[[noreturn]] void fail_open(int error, const std::string& device) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      throw Error(ErrorCode::not_found, "no such serial port: plug the controller in, or name another", device);
    case EACCES:
    case EPERM:
      throw Error(ErrorCode::io, "no permission: add yourself to the port's group (often \"dialout\") and log in again",
                  device);
    case EBUSY:
      throw Error(ErrorCode::io, "is in use by another program: end that first", device);
    default:
      throw Error(ErrorCode::io, std::string("can't be opened: ") + std::strerror(error), device);
  }
}

}  // namespace

SerialPort::SerialPort(const std::string& device, unsigned baud) : device_(device) {
  const speed_t checked = speed_of(baud);
  // Without O_NONBLOCK the open itself may wait for a carrier for ever.
  descriptor_ = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor_ < 0) fail_open(errno, device);
  bool exclusive = false;
  try {
    if (!::isatty(descriptor_)) throw Error(ErrorCode::io, "is no serial port: name one such as /dev/ttyUSB0", device);
    // TIOCEXCL keeps others out, but not root; the lock keeps out root's second copy of this program, too.
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) fail_open(errno == EWOULDBLOCK ? EBUSY : errno, device);
    if (::ioctl(descriptor_, TIOCEXCL) != 0) fail_open(errno, device);
    exclusive = true;
    configure(checked);
    wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (wake_ < 0) fail_open(errno, device);
  } catch (...) {
    if (exclusive) ::ioctl(descriptor_, TIOCNXCL);
    ::close(descriptor_);
    throw;
  }
}

SerialPort::~SerialPort() {
  // The mark stays with the device, not with us: whoever opens it next would find it taken.
  ::ioctl(descriptor_, TIOCNXCL);
  ::close(descriptor_);
  ::close(wake_);
}

void SerialPort::configure(unsigned speed) {
  termios settings{};
  if (::tcgetattr(descriptor_, &settings) != 0) fail_gone("can't be set up");
  settings.c_iflag &= ~tcflag_t(IGNBRK | BRKINT | PARMRK | ISTRIP | INLCR | IGNCR | ICRNL | IXON | IXOFF);
  settings.c_oflag &= ~tcflag_t(OPOST);
  settings.c_lflag &= ~tcflag_t(ECHO | ECHONL | ICANON | ISIG | IEXTEN);
  // No HUPCL: many boards restart when DTR falls, and then they would have lost their position.
  settings.c_cflag &= ~tcflag_t(CSIZE | PARENB | CSTOPB | CRTSCTS | HUPCL);
  settings.c_cflag |= CS8 | CREAD | CLOCAL;
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  ::cfsetispeed(&settings, speed);
  ::cfsetospeed(&settings, speed);
  if (::tcsetattr(descriptor_, TCSANOW, &settings) != 0) fail_gone("can't be set up");
  ::tcflush(descriptor_, TCIOFLUSH);  // what was said to a program before us
}

void SerialPort::fail_gone(const char* what) const {
  throw Error(ErrorCode::io, std::string(what) + ": the port is gone; plug the controller in again and start again",
              device_);
}

std::size_t SerialPort::read(std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) {
  const auto count = patience.count() > 0 ? patience.count() : 0;
  const timespec wait{time_t(count / 1'000'000'000), long(count % 1'000'000'000)};
  std::array<pollfd, 2> waiting{{{descriptor_, POLLIN, 0}, {wake_, POLLIN, 0}}};
  if (::ppoll(waiting.data(), waiting.size(), &wait, nullptr) < 0) {
    if (errno == EINTR) return 0;
    fail_gone("can't be read");
  }
  if (waiting[1].revents) {
    std::uint64_t times = 0;
    if (::read(wake_, &times, sizeof times) > 0 && !waiting[0].revents) return 0;
  }
  if (!waiting[0].revents) return 0;
  const ssize_t n = ::read(descriptor_, bytes.data(), bytes.size());
  if (n > 0) return std::size_t(n);
  const bool nothing = n == 0 || errno == EINTR || errno == EAGAIN;
  if (nothing && !(waiting[0].revents & (POLLHUP | POLLERR | POLLNVAL))) return 0;
  fail_gone("hung up");
}

void SerialPort::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
    if (n > 0) {
      bytes = bytes.subspan(std::size_t(n));
      continue;
    }
    if (n < 0 && errno != EINTR && errno != EAGAIN) fail_gone("can't be written");
    pollfd waiting{descriptor_, POLLOUT, 0};
    const int ready = ::poll(&waiting, 1, kWriteMs);
    if (ready == 0)
      throw Error(ErrorCode::io, "takes no more bytes: check the cable and the controller's power", device_);
    if (ready > 0 && waiting.revents & (POLLHUP | POLLERR | POLLNVAL)) fail_gone("hung up");
  }
}

void SerialPort::wake() noexcept {
  const std::uint64_t once = 1;
  [[maybe_unused]] const ssize_t n = ::write(wake_, &once, sizeof once);
}

}  // namespace lumihull::capture::internal
