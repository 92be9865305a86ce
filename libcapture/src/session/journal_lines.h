#pragma once

// Lines of the journal, apart from the disk: so that both directions can be fuzzed.

#include <lumihull/capture/journal.h>

#include <string>
#include <string_view>

namespace lumihull::capture::internal {

/// The line of an event that follows a line with checksum `sum` (empty: none); with its end of line. `number` counts
/// from 1. `sum` becomes the line's own.
std::string print_line(const JournalEvent& event, const JournalHead* head, std::size_t number, std::string& sum);

/// Applies the event to the state; Error{bad_input} with `subject` where it can't follow, the state then is as before.
void apply(JournalState& state, const JournalEvent& event, const std::string& subject);

struct ParsedJournal {
  JournalState state;
  std::size_t length = 0;  ///< bytes of whole lines; what follows was torn by a crash
  std::string sum;         ///< of the last line
};

/// Errors: bad_input.
LUMIHULL_API ParsedJournal parse_journal(std::string_view text, const std::string& file);

/// Every photograph waiting.
std::vector<ShotProgress> planned_shots(const JournalHead& head);

/// Error{invalid_argument}: no stops or cameras, names empty or used twice.
void check(const JournalHead& head);

}  // namespace lumihull::capture::internal
