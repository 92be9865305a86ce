#include "terminal_operator.h"

#include <lumihull/base/error.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace lumihull::program {

using namespace capture;

TerminalOperator::TerminalOperator(std::function<void(const std::string&)> say, bool yes, Job& interrupted)
    : say_(std::move(say)), yes_(yes), interrupted_(interrupted) {}

std::string TerminalOperator::read_line(Job& job) {
  for (;;) {
    if (const std::size_t end = typed_.find('\n'); end != std::string::npos) {
      std::string line = typed_.substr(0, end);
      typed_.erase(0, end + 1);
      while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.pop_back();
      return line;
    }
    // Ctrl-C must be heard while nobody types; the job at hand may be one that lets an exposure end.
    interrupted_.check();
    job.check();
    pollfd in{STDIN_FILENO, POLLIN, 0};
    if (poll(&in, 1, 100) <= 0) continue;
    char bytes[256];
    const ssize_t n = read(STDIN_FILENO, bytes, sizeof bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw Error(ErrorCode::cancelled, "standard input was closed", "operator");
    typed_.append(bytes, std::size_t(n));
  }
}

std::string TerminalOperator::ask(const Question& question, Job& job) {
  if (yes_ && question.about == Question::About::motion) return question.choices.front();
  if (!isatty(STDIN_FILENO)) return AbsentOperator().ask(question, job);
  std::string choices;
  for (const std::string& choice : question.choices) choices += (choices.empty() ? "" : ", ") + choice;
  // What only confirms a task is Enter; all else is typed, so that nothing is agreed to by accident.
  const bool enter = question.about == Question::About::task && question.choices.size() == 2;
  for (;;) {
    say_(question.text + (enter ? "  [Enter = " + question.choices.front() + "; " + question.choices.back() + "]"
                                : "  [" + choices + "]"));
    const std::string line = read_line(job);
    if (enter && line.empty()) return question.choices.front();
    if (std::find(question.choices.begin(), question.choices.end(), line) != question.choices.end()) return line;
  }
}

}  // namespace lumihull::program
