#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::test {

/// What a run of a program left: exit status (128 + n where signal n ended it) and what it wrote.
struct Outcome {
  int status = -1;
  std::string out, err;
};

struct ProcessOptions {
  long file_size_limit = 0;  ///< bytes that one file may grow to: stands in for a full disk; 0: no limit
  double kill_after_s = 0;   ///< sends `signal` after so long; 0: never
  int signal = 9;
};

/// Runs a program to its end.
Outcome run_process(const std::vector<std::string>& command, const ProcessOptions& options = {});

/// The `lumihull` program with arguments.
Outcome lumihull(std::vector<std::string> arguments, const ProcessOptions& options = {});

}  // namespace lumihull::test
