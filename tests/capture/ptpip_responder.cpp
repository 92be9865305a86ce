#include "ptpip_responder.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace lumihull::test {
namespace {

/// Little-endian numbers, PTP's texts and arrays.
class Out {
 public:
  Out& u8(std::uint64_t v) { return number(v, 1); }
  Out& u16(std::uint64_t v) { return number(v, 2); }
  Out& u32(std::uint64_t v) { return number(v, 4); }
  Out& u64(std::uint64_t v) { return number(v, 8); }
  Out& text(const std::string& t) {  // ASCII alone
    if (t.empty()) return u8(0);
    u8(t.size() + 1);
    for (const char c : t) u16(static_cast<unsigned char>(c));
    return u16(0);
  }
  Out& words(const std::vector<std::uint16_t>& list) {
    u32(list.size());
    for (const auto v : list) u16(v);
    return *this;
  }
  Out& raw(const std::string& b) {
    bytes += b;
    return *this;
  }
  std::string bytes;

 private:
  Out& number(std::uint64_t v, int size) {
    for (int i = 0; i < size; ++i) bytes += char(v >> 8 * i & 255);
    return *this;
  }
};

std::uint32_t u32_at(const std::string& b, std::size_t at) {
  std::uint32_t v = 0;
  for (std::size_t i = 0; i < 4 && at + i < b.size(); ++i)
    v |= std::uint32_t(static_cast<unsigned char>(b[at + i])) << 8 * i;
  return v;
}

bool put(int connection, const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t n = ::send(connection, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (n <= 0) return false;
    at += std::size_t(n);
  }
  return true;
}

bool packet(int connection, std::uint32_t type, const std::string& body) {
  return put(connection, Out().u32(8 + body.size()).u32(type).raw(body).bytes);
}

bool take(int connection, std::size_t count, std::string& bytes) {
  bytes.assign(count, '\0');
  for (std::size_t at = 0; at < count;) {
    const ssize_t n = ::recv(connection, bytes.data() + at, count - at, 0);
    if (n <= 0) return false;
    at += std::size_t(n);
  }
  return true;
}

bool take_packet(int connection, std::uint32_t& type, std::string& body) {
  std::string head;
  if (!take(connection, 8, head)) return false;
  type = u32_at(head, 4);
  const std::uint32_t length = u32_at(head, 0);
  return length >= 8 && length < (1u << 20) && take(connection, length - 8, body);
}

bool respond(int connection, std::uint16_t code, std::uint32_t transaction, const std::vector<std::uint32_t>& p = {}) {
  Out out;
  out.u16(code).u32(transaction);
  for (const auto v : p) out.u32(v);
  return packet(connection, 7, out.bytes);
}

bool data(int connection, std::uint32_t transaction, const std::string& bytes) {
  return packet(connection, 9, Out().u32(transaction).u64(bytes.size()).bytes) &&
         packet(connection, 12, Out().u32(transaction).raw(bytes).bytes);
}

constexpr std::uint16_t kOk = 0x2001, kGeneralError = 0x2002, kNotSupported = 0x2005, kBadHandle = 0x2009,
                        kStoreFull = 0x200c, kBusy = 0x2019;
constexpr std::uint16_t kObjectAdded = 0x4002, kCaptureComplete = 0x400d;
constexpr std::uint32_t kStorage = 0x00010001, kDcim = 1, kFolder = 2;

}  // namespace

PtpIpResponder::PtpIpResponder(std::string picture) : picture_(std::move(picture)) {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (listener_ < 0 || ::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::listen(listener_, 8) != 0 || ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("no port on loopback");
  port_ = ntohs(address.sin_port);
  objects_[kDcim] = {"DCIM", 0x3001, ""};
  objects_[kFolder] = {"100LUMIX", 0x3001, ""};
  acceptor_ = std::jthread([this](std::stop_token stop) { accept_all(stop); });
}

PtpIpResponder::~PtpIpResponder() {
  stopping_ = true;
  acceptor_.request_stop();
  acceptor_.join();
  {
    const std::lock_guard lock(mutex_);
    for (const int c : connections_) ::shutdown(c, SHUT_RDWR);
  }
  for (std::thread& t : servers_) t.join();
  for (const int c : connections_) ::close(c);
  ::close(listener_);
}

std::string PtpIpResponder::picture(int exposure) const { return picture_ + "exposure " + std::to_string(exposure); }

std::size_t PtpIpResponder::objects_left() {
  const std::lock_guard lock(mutex_);
  return objects_.size() - 2;
}

void PtpIpResponder::accept_all(std::stop_token stop) {
  while (!stop.stop_requested()) {
    pollfd waiting{listener_, POLLIN, 0};
    if (::poll(&waiting, 1, 50) <= 0) continue;
    const int connection = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) continue;
    if (refuse_connections_) {
      ::close(connection);
      continue;
    }
    const std::lock_guard lock(mutex_);
    connections_.push_back(connection);
    servers_.emplace_back([this, connection] { serve(connection); });
  }
}

void PtpIpResponder::serve(int connection) {
  std::uint32_t type = 0;
  std::string body;
  if (!take_packet(connection, type, body)) return;
  if (type == 3) {
    packet(connection, 4, "");
    const std::lock_guard lock(mutex_);
    events_ = connection;
    return;
  }
  if (type != 1) return;
  Out ack;
  ack.u32(1).raw(std::string(16, 'L'));
  for (const char c : std::string("Lumi")) ack.u16(std::uint64_t(c));
  packet(connection, 2, ack.u16(0).u32(0x10000).bytes);
  commands(connection);
  ::shutdown(connection, SHUT_RDWR);
}

void PtpIpResponder::commands(int connection) {
  std::uint32_t type = 0;
  std::string body;
  while (take_packet(connection, type, body)) {
    if (type != 6 || body.size() < 10) continue;
    const auto code = std::uint16_t(u32_at(body, 4) & 0xffff);
    std::vector<std::uint32_t> p(5, 0);
    for (std::size_t i = 0; i < 5 && 10 + 4 * i + 4 <= body.size(); ++i) p[i] = u32_at(body, 10 + 4 * i);
    if (!operate(connection, code, u32_at(body, 6), p)) return;
  }
}

bool PtpIpResponder::operate(int c, std::uint16_t code, std::uint32_t t, const std::vector<std::uint32_t>& p) {
  const auto reply = [&](const std::string& bytes) { return data(c, t, bytes) && respond(c, kOk, t); };
  if (code == 0x1001) {  // GetDeviceInfo
    Out info;
    info.u16(100).u32(0xffffffff).u16(0).text("").u16(0);
    info.words({0x1001, 0x1002, 0x1003, 0x1004, 0x1005, 0x1006, 0x1007, 0x1008, 0x1009, 0x100b, 0x100e});
    info.words({kObjectAdded, kCaptureComplete}).words({}).words({0x3801}).words({0x3801, 0x3001});
    return reply(info.text("Lumihull").text("Responder").text("1").text("0001").bytes);
  }
  if (code == 0x1002) {  // OpenSession
    ++sessions_;
    return respond(c, kOk, t);
  }
  if (code == 0x1003) return respond(c, kOk, t);                       // CloseSession
  if (code == 0x1004) return reply(Out().u32(1).u32(kStorage).bytes);  // GetStorageIDs
  if (code == 0x1005)                                                  // GetStorageInfo
    return reply(Out().u16(4).u16(3).u16(0).u64(1ull << 35).u64(1ull << 34).u32(1000).text("card").text("").bytes);
  if (code == 0x100e) return capture(c, t);  // InitiateCapture

  std::unique_lock lock(mutex_);
  if (code == 0x1006 || code == 0x1007) {  // GetNumObjects, GetObjectHandles
    Out out;
    std::uint32_t count = 0;
    for (const auto& [handle, object] : objects_) {
      const std::uint32_t parent = handle == kDcim ? 0 : handle == kFolder ? kDcim : kFolder;
      if (p[2] != 0 && (p[2] == 0xffffffff ? 0 : p[2]) != parent) continue;
      out.u32(handle);
      ++count;
    }
    lock.unlock();
    if (code == 0x1006) return respond(c, kOk, t, {count});
    return reply(Out().u32(count).raw(out.bytes).bytes);
  }
  const auto found = objects_.find(p[0]);
  if (code == 0x1008 || code == 0x1009 || code == 0x100b) {
    if (found == objects_.end()) return respond(c, kBadHandle, t);
    const Object object = found->second;
    if (code == 0x100b) objects_.erase(found);
    lock.unlock();
    if (code == 0x100b) return respond(c, kOk, t);  // DeleteObject
    if (code == 0x1009) return send_object(c, t, object.bytes);
    const bool is_folder = object.format == 0x3001;
    const std::uint32_t parent = p[0] == kDcim ? 0 : p[0] == kFolder ? kDcim : kFolder;
    Out info;
    info.u32(kStorage).u16(object.format).u16(0).u32(object.bytes.size());
    info.u16(is_folder ? 0 : 0x3808).u32(0).u32(0).u32(0);  // without a thumbnail libgphoto2 gives no RAW
    info.u32(3072).u32(2048).u32(24).u32(parent).u16(is_folder ? 1 : 0).u32(0).u32(0).text(object.name);
    return reply(info.text("20190703T140559").text("20190703T140559").text("").bytes);
  }
  return respond(c, kNotSupported, t);
}

std::uint32_t PtpIpResponder::add(const std::string& name, std::string bytes, std::uint16_t format) {
  const std::lock_guard lock(mutex_);
  objects_[next_handle_] = {name, format, std::move(bytes)};
  return next_handle_++;
}

void PtpIpResponder::announce(std::uint16_t code, std::uint32_t parameter) {
  const std::lock_guard lock(mutex_);
  if (events_ >= 0) packet(events_, 8, Out().u16(code).u32(0).u32(parameter).u32(0).u32(0).bytes);
}

void PtpIpResponder::wait_for_end() {
  while (!stopping_) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

bool PtpIpResponder::capture(int c, std::uint32_t t) {
  const Fault fault = fault_;
  if (fault == Fault::refuse) return respond(c, kBusy, t);
  if (fault == Fault::store_full) return respond(c, kStoreFull, t);
  if (fault == Fault::fail) return respond(c, kGeneralError, t);

  const int exposure = ++exposures_;
  char stem[32];
  std::snprintf(stem, sizeof stem, "P100%04d", exposure);
  std::string bytes = picture(exposure);
  if (fault == Fault::damaged_jpeg) bytes.resize(picture_.size() / 2);
  std::vector<std::uint32_t> added;
  if (fault == Fault::raw_and_jpeg) added.push_back(add(std::string(stem) + ".RW2", "raw " + bytes, 0x3000));
  added.push_back(add(fault == Fault::hostile_name ? "a b%0a\n../../x\"$(x).JPG" : std::string(stem) + ".JPG", bytes));
  if (fault == Fault::two_pictures) added.push_back(add(std::string(stem) + "B.JPG", bytes + "again"));

  if (fault == Fault::hang_in_capture) {
    wait_for_end();
    return false;
  }
  if (fault == Fault::die_in_capture) {
    const std::lock_guard lock(mutex_);
    if (events_ >= 0) ::shutdown(events_, SHUT_RDWR);
    return false;
  }
  if (fault == Fault::garbage) {
    put(c, std::string("\x07\x00\x00\x00\xff\xff\xff\xff noise, noise, noise and more of it", 44));
  } else if (!respond(c, fault == Fault::fail_after ? kGeneralError : kOk, t)) {
    return false;
  }
  for (const std::uint32_t handle : std::exchange(late_, {})) announce(kObjectAdded, handle);
  if (fault == Fault::late_object_added) {
    late_ = added;
  } else if (fault != Fault::lose_object_added && fault != Fault::lose_both && fault != Fault::garbage) {
    for (const std::uint32_t handle : added) announce(kObjectAdded, handle);
  }
  if (fault != Fault::lose_complete && fault != Fault::lose_both && fault != Fault::late_object_added &&
      fault != Fault::garbage)
    announce(kCaptureComplete, t);
  return true;
}

bool PtpIpResponder::send_object(int c, std::uint32_t t, const std::string& bytes) {
  const Fault fault = fault_;
  packet(c, 9, Out().u32(t).u64(bytes.size()).bytes);
  const std::string half = bytes.substr(0, bytes.size() / 2);
  if (fault == Fault::hang_in_object || fault == Fault::die_in_object) {
    packet(c, 10, Out().u32(t).raw(half).bytes);
    if (fault == Fault::hang_in_object) wait_for_end();
    const std::lock_guard lock(mutex_);
    if (events_ >= 0) ::shutdown(events_, SHUT_RDWR);
    return false;
  }
  if (fault == Fault::short_object) return packet(c, 12, Out().u32(t).raw(half).bytes) && respond(c, kOk, t);
  constexpr std::size_t kChunk = 60000;
  for (std::size_t at = 0; at < bytes.size(); at += kChunk) {
    const bool last = at + kChunk >= bytes.size();
    if (!packet(c, last ? 12 : 10, Out().u32(t).raw(bytes.substr(at, kChunk)).bytes)) return false;
  }
  return respond(c, kOk, t);
}

}  // namespace lumihull::test
