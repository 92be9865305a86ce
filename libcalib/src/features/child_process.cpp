// Another program as a child of this one.
#include "child_process.h"

#include <fcntl.h>
#include <lumihull/base/error.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

extern char** environ;

namespace lumihull::calib {
namespace {

constexpr int kPollMs = 100;
constexpr int kPatiencePolls = 30;  ///< for a child that was asked to end

class Child {
 public:
  explicit Child(const std::vector<std::string>& command) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail("can't make a pipe", errno, command[0]);
    output_ = ends[0];
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    // A group of its own: Ctrl-C at a terminal reaches this program alone, which then ends the child in order.
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const int error = ::posix_spawnp(&pid_, arguments[0], &actions, &attributes, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    ::close(ends[1]);
    if (error == 0) return;
    ::close(output_);
    if (error == ENOENT) throw Error(ErrorCode::not_found, "no such program is installed", command[0]);
    fail("can't be started", error, command[0]);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (!ended_) end();
    ::close(output_);
  }

  /// More of what it says; false at its end. Waits no longer than a tenth of a second.
  bool read(std::string& text) const {
    pollfd waiting{output_, POLLIN, 0};
    if (::poll(&waiting, 1, kPollMs) <= 0) return true;
    std::array<char, 4096> buffer;
    const ssize_t n = ::read(output_, buffer.data(), buffer.size());
    if (n < 0) return errno == EINTR || errno == EAGAIN;
    text.append(buffer.data(), std::size_t(n));
    return n > 0;
  }

  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    ended_ = true;
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  }

 private:
  [[noreturn]] static void fail(const std::string& what, int error, const std::string& program) {
    throw Error(ErrorCode::io, what + ": " + std::strerror(error), program);
  }
  void end() {
    ::kill(-pid_, SIGTERM);
    for (int i = 0; i < kPatiencePolls; ++i) {
      if (::waitpid(pid_, nullptr, WNOHANG) != 0) return;
      ::poll(nullptr, 0, kPollMs);
    }
    ::kill(-pid_, SIGKILL);
    wait();
  }

  pid_t pid_ = 0;
  int output_ = -1;
  bool ended_ = false;
};

}  // namespace

int run_child(const std::vector<std::string>& command, Job& job, const std::function<void(const std::string&)>& line) {
  Child child(command);
  std::string text;
  bool more = true;
  while (more) {
    job.check();
    more = child.read(text);
    std::size_t start = 0;
    for (std::size_t end; (end = text.find('\n', start)) != std::string::npos; start = end + 1)
      line(text.substr(start, end - start));
    text.erase(0, start);
  }
  if (!text.empty()) line(text);
  return child.wait();
}

}  // namespace lumihull::calib
