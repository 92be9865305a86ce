#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::internal {

/// Another program as a child of this one, in a process group of its own: Ctrl-C at a terminal reaches this program
/// alone, which then ends the child in order. The destructor ends it.
class LUMIHULL_API ChildProcess {
 public:
  enum class Talk {
    listen,    ///< no standard input; standard output and standard error come together
    converse,  ///< `write` reaches its standard input; standard error is dropped
  };
  /// command[0] is searched in PATH where it has no '/'. Errors: not_found (no such program), io.
  explicit ChildProcess(const std::vector<std::string>& command, Talk talk = Talk::listen);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  /// Appends more of what it says; waits no longer than `wait_ms`. False at its end.
  bool read(std::string& text, int wait_ms);
  /// False where it does not take the bytes within `wait_ms` or is gone.
  bool write(std::string_view bytes, int wait_ms);
  /// Until it has ended by itself: exit status, 128 + n where signal n ended it.
  int wait();
  /// Closes its input, waits up to `patience_ms`, then SIGTERM to its group, after three more seconds SIGKILL.
  void end(int patience_ms = 0) noexcept;

  int pid() const { return pid_; }

 private:
  bool ended_within(int ms) noexcept;

  int pid_ = 0;
  int input_ = -1, output_ = -1;
  bool ended_ = false;
};

/// Runs a program to its end and returns its exit status (128 + n where signal n ended it). `line` is called on the
/// caller's thread with each line of its standard output and standard error. job.cancel() ends the program, too.
/// Errors: not_found (no such program), io, cancelled.
LUMIHULL_API int run_child(const std::vector<std::string>& command, Job& job,
                           const std::function<void(const std::string&)>& line);

}  // namespace lumihull::internal
