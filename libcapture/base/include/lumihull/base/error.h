#pragma once

#include <lumihull/base/api.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace lumihull {

/// What kind of thing went wrong. The C API returns the negated value.
enum class ErrorCode : std::int32_t {
  invalid_argument = 1,  ///< the caller's value is outside its documented range
  bad_input = 2,         ///< a file, image or number from outside is not what it should be
  not_found = 3,         ///< a file, folder or entry does not exist
  io = 4,                ///< the operating system refused to read or write (disk full, permissions)
  unsupported = 5,       ///< valid, but this build or version can't do it
  degenerate = 6,        ///< the data are valid, but their geometry has no (unique) answer
  out_of_memory = 7,
  cancelled = 8,  ///< `Job::cancel` was called
  internal = 9,   ///< a defect of Lumihull
};

/// The one exception type of Lumihull.
///
/// `message()` is one line, objective, and says what was expected or what to do; `subject()` names the thing it is
/// about (a file, a photograph, a JSON pointer), and may be empty. `what()` is "subject: message". All three are UTF-8
/// without control characters: each byte of what a file or a name brought along besides is a '?'.
class LUMIHULL_API Error : public std::runtime_error {
 public:
  Error(ErrorCode code, std::string message, std::string subject = {});
  ~Error() override;

  ErrorCode code() const noexcept { return code_; }
  const std::string& message() const noexcept { return message_; }
  const std::string& subject() const noexcept { return subject_; }

 private:
  ErrorCode code_;
  std::string message_;
  std::string subject_;
};

}  // namespace lumihull
