#pragma once

// The person at the terminal, who is asked.

#include <lumihull/capture/operator.h>

#include <functional>
#include <string>

namespace lumihull::program {

/// Asks at the terminal; where standard input is none it is nobody (AbsentOperator).
class TerminalOperator : public capture::Operator {
 public:
  /// say: prints a line, above the progress bar. yes: agrees to motion. interrupted: the program's job.
  TerminalOperator(std::function<void(const std::string&)> say, bool yes, Job& interrupted);
  std::string ask(const capture::Question& question, Job& job) override;
  void tell(const std::string& line) override { say_("note: " + line); }

 private:
  std::string read_line(Job& job);

  std::function<void(const std::string&)> say_;
  bool yes_;
  Job& interrupted_;
  std::string typed_;
};

}  // namespace lumihull::program
