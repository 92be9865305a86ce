#include <fcntl.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <utility>

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

AtomicFile::AtomicFile(fs::path file) : file_(std::move(file)) {
  static std::atomic<unsigned> counter{0};  // two threads may write files of one name: the last rename wins, whole
  temporary_ = file_;
  temporary_ += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(counter.fetch_add(1));
  descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail(errno, "can't write here", file_);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
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

void AtomicFile::commit() {
  if (::fsync(descriptor_) != 0) fail(errno, "can't write", file_);
  if (::close(std::exchange(descriptor_, -1)) != 0) {
    const int error = errno;
    ::unlink(temporary_.c_str());
    fail(error, "can't write", file_);
  }
  if (::rename(temporary_.c_str(), file_.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary_.c_str());
    fail(error, "can't replace", file_);
  }
  const fs::path folder = file_.has_parent_path() ? file_.parent_path() : fs::path(".");
  const Descriptor parent(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (parent.value >= 0) ::fsync(parent.value);  // some file systems can't; the rename itself is atomic anyway
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
