// Fuzz target: a journal, and events after it. A text that is refused names its line; what is accepted keeps the rules:
// counts fit, each file belongs to one photograph, and its own lines read back to the same state. The input is read
// twice: as it is, and with checksums put right, so that more than the checksum is tried.

#include <journal_lines.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <string>

namespace {

using namespace lumihull;
using namespace lumihull::capture;

void check_state(const JournalState& state) {
  if (state.shots.size() != state.head.stops.size() * state.head.cameras.size()) std::abort();
  std::set<std::string> files;
  std::size_t firing = 0;
  for (const ShotProgress& shot : state.shots) {
    for (const Take& take : shot.landed)
      if (!files.insert(take.file).second || take.shot == 0 || take.shot > state.last_id) std::abort();
    if (shot.step == ShotStep::landed && shot.landed.empty()) std::abort();
    firing += shot.step == ShotStep::firing;
  }
  if (files != state.files || state.by_id.size() > state.events || firing > state.events) std::abort();
}

void read(const std::string& text) {
  capture::internal::ParsedJournal parsed;
  try {
    parsed = capture::internal::parse_journal(text, "fuzz");
  } catch (const Error& e) {
    if (e.code() != ErrorCode::bad_input) std::abort();
    return;
  }
  if (parsed.length == 0) return;
  check_state(parsed.state);
  // Whole lines alone say the same.
  const auto again = capture::internal::parse_journal(std::string_view(text).substr(0, parsed.length), "fuzz");
  if (again.sum != parsed.sum || again.state.events != parsed.state.events) std::abort();
}

/// Each line with the number and checksum that it should have.
std::string with_sums(const std::string& text) {
  std::string out, sum;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = text.find('\n', at);
    const bool torn = end == std::string::npos;
    if (torn) end = text.size();
    std::string line = text.substr(at, end - at);
    if (const std::size_t tail = line.rfind(",\"sum\":\""); tail != std::string::npos) {
      line.resize(tail);
      sum = sha256(sum + line).substr(0, 16);
      line += ",\"sum\":\"" + sum + "\"}";
    }
    out += line;
    if (!torn) out += '\n';
    at = end + 1;
  }
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  read(text);
  read(with_sums(text));
  return 0;
}
