// Fuzz target: plan.json. What is read can be written and read again, and is the same.

#include <lumihull/base/error.h>
#include <plan_json.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lumihull;
  using namespace lumihull::capture;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const Plan plan = capture::internal::parse_plan(text, "fuzz");
    const std::string once = capture::internal::print_plan(plan, "again");
    if (capture::internal::print_plan(capture::internal::parse_plan(once, "again"), "again") != once) std::abort();
  } catch (const Error& e) {
    if (e.code() == ErrorCode::internal || e.subject() == "again") std::abort();
  }
  return 0;
}
