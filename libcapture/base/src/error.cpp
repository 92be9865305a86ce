#include <lumihull/base/error.h>

#include "text.h"

namespace lumihull {

namespace {

std::string what(const std::string& message, const std::string& subject) {
  return internal::printable(subject.empty() ? message : subject + ": " + message, '?');
}

}  // namespace

// Messages and subjects hold names and words from files, which may hold anything.
Error::Error(ErrorCode code, std::string message, std::string subject)
    : std::runtime_error(lumihull::what(message, subject)),
      code_(code),
      message_(internal::printable(message, '?')),
      subject_(internal::printable(subject, '?')) {}

Error::~Error() = default;

}  // namespace lumihull
