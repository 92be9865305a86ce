#pragma once

// A camera on loopback that speaks PTP/IP (PIMA 15740:2000 and CIPA DC-X005): enough of it for libgphoto2 to capture
// and to download, and faults on demand.

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace lumihull::test {

class PtpIpResponder {
 public:
  enum class Fault {
    none,
    lose_object_added,  ///< the exposure is made and stored, its announcement never comes
    lose_complete,      ///< CaptureComplete never comes
    lose_both,
    late_object_added,  ///< announced when the next exposure is asked for, before that one's own
    refuse,             ///< Device_Busy, no exposure
    store_full,         ///< Store_Full, no exposure
    fail_after,         ///< General_Error, but the exposure is made and announced
    fail,               ///< General_Error, no exposure
    hang_in_capture,    ///< the exposure is made; no answer, ever
    die_in_capture,     ///< the exposure is made; both connections are closed
    garbage,            ///< the answer to the release is noise
    hang_in_object,     ///< half of the picture, then silence
    short_object,       ///< half of the picture, and the end of the data
    die_in_object,      ///< half of the picture, then both connections are closed
    two_pictures,       ///< two pictures are announced for one release
    raw_and_jpeg,       ///< a RAW file and a JPEG of one stem
    damaged_jpeg,       ///< the picture has its announced size, but stops in the middle
    hostile_name,       ///< the picture's name has blanks, '%', a line end and slashes
  };

  /// Listens on a port of its own; exposures are pictures of `picture`'s bytes with a few others behind each.
  explicit PtpIpResponder(std::string picture);
  PtpIpResponder(const PtpIpResponder&) = delete;
  PtpIpResponder& operator=(const PtpIpResponder&) = delete;
  ~PtpIpResponder();

  int port() const { return port_; }
  /// libgphoto2 takes the connection for events to be on port 15740 unless it is told otherwise.
  std::string gphoto_port() const { return "ptpip:127.0.0.1:" + std::to_string(port_) + ":" + std::to_string(port_); }
  void set_fault(Fault fault) { fault_ = fault; }
  void refuse_connections(bool on) { refuse_connections_ = on; }

  int exposures() const { return exposures_; }
  int sessions() const { return sessions_; }
  /// What a picture (counted from 1) holds; the same bytes that are sent.
  std::string picture(int exposure) const;
  std::size_t objects_left();

 private:
  struct Object {
    std::string name;
    std::uint16_t format = 0x3801;
    std::string bytes;
  };

  void accept_all(std::stop_token stop);
  void serve(int connection);
  void commands(int connection);
  /// False ends the connection.
  bool operate(int connection, std::uint16_t code, std::uint32_t transaction, const std::vector<std::uint32_t>& p);
  bool capture(int connection, std::uint32_t transaction);
  bool send_object(int connection, std::uint32_t transaction, const std::string& bytes);
  std::uint32_t add(const std::string& name, std::string bytes, std::uint16_t format = 0x3801);
  void announce(std::uint16_t code, std::uint32_t parameter);
  void wait_for_end();

  std::string picture_;
  int listener_ = -1, port_ = 0;
  std::atomic<Fault> fault_{Fault::none};
  std::atomic<bool> refuse_connections_{false};
  std::atomic<int> exposures_{0}, sessions_{0};
  std::mutex mutex_;
  std::map<std::uint32_t, Object> objects_;
  std::uint32_t next_handle_ = 0x1001;
  std::vector<std::uint32_t> late_;
  std::vector<int> connections_;
  int events_ = -1;
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> servers_;
  std::jthread acceptor_;
};

}  // namespace lumihull::test
