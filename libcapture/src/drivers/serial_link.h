#pragma once

// Requests and replies over a serial port: libcapture/firmware/PROTOCOL.md, section 2.

#include <lumihull/capture/serial.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "serial_frames.h"
#include "serial_messages.h"
#include "serial_port.h"

namespace lumihull::capture {

/// Any thread may call any function. One thread of its own reads the port and sends heartbeats.
class SerialLink {
 public:
  explicit SerialLink(const SerialOptions& options);
  SerialLink(const SerialLink&) = delete;
  SerialLink& operator=(const SerialLink&) = delete;
  ~SerialLink();

  struct Answer {
    enum class Kind : std::uint8_t {
      ack,
      nak,
      restarted,  ///< the controller has another nonce now: whether it obeyed before it restarted is not known
      silent,     ///< no reply to three tries: whether it obeyed is not known
    };
    Kind kind = Kind::silent;
    std::uint32_t nonce =
        0;  ///< of the start of the controller that was spoken to; 0: HELLO was not answered, nothing else said
    internal::NakCode code = internal::NakCode::none;
    std::int32_t detail = 0;
    internal::Bytes data;  ///< of an ACK, behind the request's type
  };

  /// Says HELLO before, where the last word of the controller was no reply. At most 3.5 s. Error{io}: the port is gone.
  Answer request(internal::Type type, const internal::Bytes& payload = {});

  struct Fired {
    std::uint32_t shot = 0, exposed_ms = 0;
    internal::FiredState state = internal::FiredState::none;
  };
  /// Waits for the controller's DONE; nothing: it did not come in time, or the controller restarted. Error{io}: the
  /// port is gone.
  std::optional<Fired> await_done(std::uint32_t shot, std::uint32_t nonce, double patience_s);

  /// What HELLO said last.
  struct Controller {
    std::uint32_t nonce = 0, max_exposure_ms = 0, max_solenoid_ms = 0;
    unsigned winches = 0, queue = 0;
  };
  Controller controller() const;

  /// Error{io}: the port is gone.
  void check() const;

  /// In the controller's seconds.
  void sleep(double seconds) const { std::this_thread::sleep_for(scaled(seconds)); }
  const std::string& device() const { return port_.device(); }

 private:
  std::chrono::nanoseconds scaled(double seconds) const;
  bool hello();
  std::optional<internal::Frame> exchange(const internal::Frame& request);
  void send(const internal::Frame& frame);
  void listen();
  void take(const internal::Frame& frame);
  void check_port() const;

  const double time_scale_;
  const std::uint32_t session_;
  internal::SerialPort port_;

  std::mutex one_request_;  ///< held for a whole request; before the others
  std::uint16_t sequence_;

  std::mutex writing_;

  mutable std::mutex mutex_;  ///< for all below
  std::condition_variable news_;
  Controller controller_;
  bool linked_ = false;  ///< the nonce is the controller's, as far as we know
  const internal::Frame* asked_ = nullptr;
  std::optional<internal::Frame> reply_;
  std::deque<Fired> fired_;
  std::exception_ptr lost_;  ///< why the port can't be used any more

  std::uint16_t beat_ = 0;
  std::atomic<bool> ending_{false};
  std::thread listener_;
};

/// For messages: why the controller refused. Without the name of a winch.
std::string nak_words(internal::NakCode code);

}  // namespace lumihull::capture
