// Another program as a child of this one.
#include <fcntl.h>
#include <lumihull/base/error.h>
#include <lumihull/internal/child_process.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

extern char** environ;

namespace lumihull::internal {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPollMs = 100;
constexpr int kPatienceMs = 3000;  ///< for a child that was asked to end

[[noreturn]] void fail(const std::string& what, int error, const std::string& program) {
  throw Error(ErrorCode::io, what + ": " + std::strerror(error), program);
}

void close_all(std::array<int, 2>& ends) {
  for (int& end : ends)
    if (end >= 0) ::close(end);
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command, Talk talk) {
  std::array<int, 2> out{-1, -1}, in{-1, -1};
  if (::pipe2(out.data(), O_CLOEXEC) != 0) fail("can't make a pipe", errno, command[0]);
  // A socket, for writing to one whose reader is gone need not raise SIGPIPE.
  if (talk == Talk::converse && ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, in.data()) != 0) {
    const int error = errno;
    close_all(out);
    fail("can't make a pipe", error, command[0]);
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (talk == Talk::converse) {
    posix_spawn_file_actions_adddup2(&actions, in[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDERR_FILENO);
  }
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const int error = ::posix_spawnp(&pid_, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  output_ = std::exchange(out[0], -1);
  input_ = std::exchange(in[0], -1);
  close_all(out);
  close_all(in);
  if (error == 0) return;
  ::close(output_);
  if (input_ >= 0) ::close(input_);
  if (error == ENOENT) throw Error(ErrorCode::not_found, "no such program is installed", command[0]);
  fail("can't be started", error, command[0]);
}

ChildProcess::~ChildProcess() {
  end();
  ::close(output_);
}

bool ChildProcess::read(std::string& text, int wait_ms) {
  pollfd waiting{output_, POLLIN, 0};
  if (::poll(&waiting, 1, wait_ms) <= 0) return true;
  std::array<char, 65536> buffer;
  const ssize_t n = ::read(output_, buffer.data(), buffer.size());
  if (n < 0) return errno == EINTR || errno == EAGAIN;
  text.append(buffer.data(), std::size_t(n));
  return n > 0;
}

bool ChildProcess::write(std::string_view bytes, int wait_ms) {
  const auto deadline = Clock::now() + std::chrono::milliseconds(wait_ms);
  while (!bytes.empty() && input_ >= 0) {
    const ssize_t n = ::send(input_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n >= 0) {
      bytes.remove_prefix(std::size_t(n));
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN || Clock::now() >= deadline) return false;
    pollfd waiting{input_, POLLOUT, 0};
    ::poll(&waiting, 1, kPollMs);
  }
  return bytes.empty();
}

int ChildProcess::wait() {
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  ended_ = true;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

bool ChildProcess::ended_within(int ms) noexcept {
  constexpr int kStepMs = 10;
  for (int waited = 0;; waited += kStepMs) {
    if (::waitpid(pid_, nullptr, WNOHANG) != 0) return true;
    if (waited >= ms) return false;
    ::poll(nullptr, 0, kStepMs);
  }
}

void ChildProcess::end(int patience_ms) noexcept {
  if (input_ >= 0) ::close(std::exchange(input_, -1));
  if (ended_) return;
  ended_ = true;
  if (ended_within(patience_ms)) return;
  ::kill(-pid_, SIGTERM);
  if (ended_within(kPatienceMs)) return;
  ::kill(-pid_, SIGKILL);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

int run_child(const std::vector<std::string>& command, Job& job, const std::function<void(const std::string&)>& line) {
  ChildProcess child(command);
  std::string text;
  bool more = true;
  while (more) {
    job.check();
    more = child.read(text, kPollMs);
    std::size_t start = 0;
    for (std::size_t end; (end = text.find('\n', start)) != std::string::npos; start = end + 1)
      line(text.substr(start, end - start));
    text.erase(0, start);
  }
  if (!text.empty()) line(text);
  return child.wait();
}

}  // namespace lumihull::internal
