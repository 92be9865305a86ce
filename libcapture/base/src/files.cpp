#include <fcntl.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <openssl/evp.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <utility>

#include "claim.h"

namespace lumihull {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(int error, const std::string& what, const fs::path& file) {
  const ErrorCode code = error == ENOENT || error == ENOTDIR ? ErrorCode::not_found : ErrorCode::io;
  throw Error(code, what + ": " + std::strerror(error), file.string());
}

/// A file descriptor that closes itself.
struct Descriptor {
  int value = -1;
  explicit Descriptor(int v) : value(v) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

/// Opens a regular file for reading and tells its size: a folder, pipe or device is refused before it can block.
std::size_t open_regular(const fs::path& file, Descriptor& descriptor) {
  descriptor.value = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor.value < 0) fail(errno, "can't open", file);
  struct stat status {};
  if (::fstat(descriptor.value, &status) != 0) fail(errno, "can't look at", file);
  if (!S_ISREG(status.st_mode))
    throw Error(ErrorCode::bad_input, "expected a file, found something else", file.string());
  return std::size_t(status.st_size);
}

std::size_t read_some(int descriptor, char* to, std::size_t n, const fs::path& file) {
  for (;;) {
    const ssize_t got = ::read(descriptor, to, n);
    if (got >= 0) return std::size_t(got);
    if (errno != EINTR) fail(errno, "can't read", file);
  }
}

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    if (!context_ || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1)
      throw Error(ErrorCode::internal, "SHA-256 is not available");
  }
  void add(const void* data, std::size_t n) { EVP_DigestUpdate(context_.get(), data, n); }
  std::string hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned n = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &n);
    std::string s;
    for (unsigned i = 0; i < n; ++i) {
      s += "0123456789abcdef"[digest[i] >> 4];
      s += "0123456789abcdef"[digest[i] & 15];
    }
    return s;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace

std::string read_file(const fs::path& file, std::size_t max_bytes) {
  Descriptor descriptor(-1);
  const std::size_t size = open_regular(file, descriptor);
  if (size > max_bytes)
    throw Error(ErrorCode::bad_input,
                "expected at most " + std::to_string(max_bytes) + " bytes, found " + std::to_string(size),
                file.string());
  std::string bytes(size, '\0');
  std::size_t n = 0;
  while (n < size) {
    const std::size_t got = read_some(descriptor.value, bytes.data() + n, size - n, file);
    if (got == 0) break;  // it shrank while being read
    n += got;
  }
  bytes.resize(n);
  return bytes;
}

namespace internal {

namespace {

constexpr int kMostClaims = 1000;  ///< far more than anybody writes of one name at a time

int create(const fs::path& path, ClaimKind kind) {
  if (kind == ClaimKind::file) return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (::mkdir(path.c_str(), 0777) != 0) return -1;
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) {
    const int error = errno;
    ::rmdir(path.c_str());
    errno = error;
  }
  return descriptor;
}

/// Whether a path still leads to what was opened there.
bool is_at(int descriptor, const fs::path& path) {
  struct stat ours {
  }, there{};
  return ::fstat(descriptor, &ours) == 0 && ::lstat(path.c_str(), &there) == 0 && ours.st_ino == there.st_ino &&
         ours.st_dev == there.st_dev;
}

/// Removes what nobody holds; false where somebody does, or where that can't be told.
bool remove_leftover(const fs::path& path, ClaimKind kind) {
  const int folder = kind == ClaimKind::folder ? O_DIRECTORY : 0;
  const Descriptor found(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC | folder));
  if (found.value < 0) return errno == ENOENT;
  if (::flock(found.value, LOCK_EX | LOCK_NB) != 0) return false;
  if (!is_at(found.value, path)) return true;  // its holder has just put it in place
  if (kind == ClaimKind::file) return ::unlink(path.c_str()) == 0;
  std::error_code error;
  fs::remove_all(path, error);
  return !error;
}

}  // namespace

Claim claim(const fs::path& prefix, ClaimKind kind, const fs::path& subject) {
  for (int number = 0; number < kMostClaims;) {
    fs::path path = prefix;
    path += std::to_string(number);
    const int descriptor = create(path, kind);
    if (descriptor < 0) {
      if (errno != EEXIST) fail(errno, "can't write here", subject);
      if (!remove_leftover(path, kind)) ++number;
      continue;
    }
    // Between the two calls another process may have taken it for a leftover: then again.
    const bool locked = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    if (locked && is_at(descriptor, path)) return {path, descriptor};
    ::close(descriptor);
  }
  fail(EEXIST, "can't write here, too many unfinished files of this name", subject);
}

}  // namespace internal

AtomicFile::AtomicFile(fs::path file) : file_(std::move(file)) {
  fs::path prefix = file_;
  prefix += ".part-";
  internal::Claim claim = internal::claim(prefix, internal::ClaimKind::file, file_);
  temporary_ = std::move(claim.path);
  descriptor_ = claim.descriptor;
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::unlink(temporary_.c_str());
  ::close(descriptor_);
}

void AtomicFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
    if (n < 0) {
      if (errno == EINTR) continue;
      fail(errno, "can't write", file_);
    }
    bytes.remove_prefix(std::size_t(n));
  }
}

namespace {

void sync_folder_of(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const Descriptor parent(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (parent.value >= 0) ::fsync(parent.value);  // some file systems can't; the rename itself is atomic anyway
}

/// Renames where the new name is free; else -1 with EEXIST.
int rename_new(const fs::path& from, const fs::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return -1;
  // A file system without that call: a second name, then one less.
  return ::link(from.c_str(), to.c_str()) == 0 ? ::unlink(from.c_str()) : -1;
}

}  // namespace

void AtomicFile::commit() {
  if (::fsync(descriptor_) != 0) fail(errno, "can't write", file_);
  // Renamed while it is held, so that nobody takes it for a leftover; what can fail in closing, fsync has told already.
  if (::rename(temporary_.c_str(), file_.c_str()) != 0) fail(errno, "can't replace", file_);
  ::close(std::exchange(descriptor_, -1));
  sync_folder_of(file_);
}

bool AtomicFile::commit_new() {
  if (::fsync(descriptor_) != 0) fail(errno, "can't write", file_);
  if (rename_new(temporary_, file_) != 0) {
    if (errno != EEXIST) fail(errno, "can't put in place", file_);
    return false;  // the destructor removes what was written
  }
  ::close(std::exchange(descriptor_, -1));
  sync_folder_of(file_);
  return true;
}

void write_file(const fs::path& file, std::string_view bytes) {
  AtomicFile out(file);
  out.write(bytes);
  out.commit();
}

std::string sha256(std::string_view bytes) {
  Sha256 digest;
  digest.add(bytes.data(), bytes.size());
  return digest.hex();
}

std::string sha256_of_file(const fs::path& file) {
  Descriptor descriptor(-1);
  open_regular(file, descriptor);
  Sha256 digest;
  std::string buffer(1 << 18, '\0');
  while (const std::size_t n = read_some(descriptor.value, buffer.data(), buffer.size(), file))
    digest.add(buffer.data(), n);
  return digest.hex();
}

std::uint64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line))
    if (line.rfind("VmHWM:", 0) == 0) return std::stoull(line.substr(6)) * 1024;
  return 0;
}

void reset_peak_memory() {
  // "5" resets the high-water mark (proc(5)); where that is refused the mark stays that of the whole process.
  std::ofstream("/proc/self/clear_refs") << "5";
}

}  // namespace lumihull
