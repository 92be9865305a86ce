// plan.json: whatever it holds, reading it ends with a plan or an Error; what was read is written and read again alike.
#include <lumihull/base/error.h>

#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "plan_json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lumihull::capture;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const Plan plan = internal::parse_plan(text, "fuzz");
    const std::string once = internal::print_plan(plan, "fuzz");
    if (internal::print_plan(internal::parse_plan(once, "fuzz"), "fuzz") != once) std::abort();
  } catch (const lumihull::Error&) {
  }
  return 0;
}
