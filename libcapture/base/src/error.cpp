#include <lumihull/base/error.h>

#include <utility>

namespace lumihull {

Error::Error(ErrorCode code, std::string message, std::string subject)
    : std::runtime_error(subject.empty() ? message : subject + ": " + message),
      code_(code),
      message_(std::move(message)),
      subject_(std::move(subject)) {}

Error::~Error() = default;

}  // namespace lumihull
