#pragma once

// A serial port of the operating system: raw, ours alone, with deadlines.

#include <chrono>
#include <cstdint>
#include <span>
#include <string>

namespace lumihull::capture::internal {

/// One thread may read while another writes; each of both one at a time.
///
/// All errors are Error{io} (open: or not_found, invalid_argument) that name the device and say what to do.
class SerialPort {
 public:
  SerialPort(const std::string& device, unsigned baud);
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;
  ~SerialPort();

  /// What has come, at least a byte where one came in time; 0: nothing came, or `wake` was called.
  std::size_t read(std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience);
  /// All bytes, or Error{io} where the port takes none for a second.
  void write(std::span<const std::uint8_t> bytes);
  /// Ends the read of another thread, or the next one.
  void wake() noexcept;

  const std::string& device() const { return device_; }

 private:
  [[noreturn]] void fail_gone(const char* what) const;
  void configure(unsigned speed);  ///< a speed_t

  std::string device_;
  int descriptor_ = -1;
  int wake_ = -1;
};

}  // namespace lumihull::capture::internal
