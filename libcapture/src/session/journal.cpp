// The journal on disk: append, synchronise, and what a crash left.

#include <fcntl.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/journal.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <utility>

#include "journal_lines.h"

namespace lumihull::capture {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostBytes = std::size_t(1) << 30;

[[noreturn]] void fail(const std::string& what, int error, const fs::path& file) {
  throw Error(error == ENOENT ? ErrorCode::not_found : ErrorCode::io, what + ": " + std::strerror(error),
              file.string());
}

std::string now() {
  const auto time = std::chrono::system_clock::now();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
  const std::time_t seconds = std::time_t(ms / 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char day[32], text[40];
  std::strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(text, sizeof text, "%s.%03dZ", day, int(ms % 1000));
  return text;
}

/// Devices' and operators' words may be anything; the journal takes what can be read back: as Error has it, UTF-8 on
/// one line.
std::string printable(const std::string& text) {
  constexpr std::size_t kMost = 4000;
  return Error(ErrorCode::internal, text.substr(0, kMost)).message();
}

void sync_folder(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) fail("can't open the folder", errno, folder);
  const int result = ::fsync(descriptor), error = errno;
  ::close(descriptor);
  if (result != 0 && error != EINVAL) fail("can't synchronise the folder", error, folder);
}

}  // namespace

Journal::Journal(Journal&& other) noexcept
    : file_(std::move(other.file_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      length_(other.length_),
      broken_(other.broken_),
      sum_(std::move(other.sum_)),
      state_(std::move(other.state_)) {}

Journal::~Journal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Journal Journal::create(const fs::path& file, const JournalHead& head) {
  internal::check(head);
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) fail("can't make the journal", errno, file);
  Journal journal(file, descriptor);
  // A crash before the first line was on the disk leaves nothing, or a torn line: nothing has happened then.
  if (internal::parse_journal(read_file(file, kMostBytes), file.string()).length != 0)
    throw Error(ErrorCode::invalid_argument, "there is a journal already", file.string());
  if (::ftruncate(descriptor, 0) != 0) fail("can't write", errno, file);
  journal.state_.head = head;
  journal.state_.shots = internal::planned_shots(head);
  journal.append({.kind = EventKind::begin});
  sync_folder(file);
  return journal;
}

Journal Journal::open(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) fail("can't open the journal", errno, file);
  Journal journal(file, descriptor);
  const std::string text = read_file(file, kMostBytes);
  internal::ParsedJournal parsed = internal::parse_journal(text, file.string());
  if (parsed.length == 0) throw Error(ErrorCode::not_found, "an empty journal", file.string());
  journal.state_ = std::move(parsed.state);
  journal.sum_ = std::move(parsed.sum);
  journal.length_ = parsed.length;
  if (parsed.length != text.size() && (::ftruncate(descriptor, off_t(parsed.length)) != 0 || ::fsync(descriptor) != 0))
    fail("can't take off the torn last line", errno, file);
  sync_folder(file);
  return journal;
}

void Journal::append(JournalEvent event) {
  event.time = now();
  event.text = printable(event.text);
  event.answer = printable(event.answer);
  try {
    internal::apply(state_, event, file_.string());
  } catch (const Error& e) {
    throw Error(ErrorCode::internal, e.message(), file_.string());
  }
  std::string sum = sum_;
  const bool first = event.kind == EventKind::begin;
  try {
    write_line(internal::print_line(event, first ? &state_.head : nullptr, state_.events, sum));
  } catch (const Error&) {
    // What is not on the disk has not happened.
    if (!broken_ && !first) state_ = internal::parse_journal(read_file(file_, kMostBytes), file_.string()).state;
    throw;
  }
  sum_ = std::move(sum);
}

void Journal::write_line(const std::string& line) {
  if (broken_)
    throw Error(ErrorCode::io, "an earlier write failed; start again to see what the disk holds", file_.string());
  const auto undo = [&](const char* what, int error) {
    broken_ = ::ftruncate(descriptor_, off_t(length_)) != 0;
    fail(what, error, file_);
  };
  std::size_t written = 0;
  while (written < line.size()) {
    const ssize_t n = ::pwrite(descriptor_, line.data() + written, line.size() - written, off_t(length_ + written));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) undo("can't write the journal", errno);
    written += std::size_t(n);
  }
  if (::fsync(descriptor_) != 0) {
    broken_ = true;  // which pages are on the disk is not known, and a second fsync would not tell
    fail("can't synchronise the journal", errno, file_);
  }
  length_ += line.size();
}

JournalState read_journal(const fs::path& file) {
  internal::ParsedJournal parsed = internal::parse_journal(read_file(file, kMostBytes), file.string());
  if (parsed.length == 0) throw Error(ErrorCode::not_found, "an empty journal", file.string());
  return std::move(parsed.state);
}

}  // namespace lumihull::capture
