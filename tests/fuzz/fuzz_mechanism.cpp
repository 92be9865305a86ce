// Fuzz target: mechanism.json. What is read can be written and read again, and is the same; its functions answer or
// complain at poses inside the room and beyond.

#include <lumihull/base/error.h>
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/forward.h>
#include <lumihull/capture/sensitivity.h>
#include <mechanism_json.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace {

using namespace lumihull;
using namespace lumihull::capture;

template <class Use>
void use_or_refuse(Use use) {
  try {
    use();
  } catch (const Error& e) {
    if (e.code() == ErrorCode::internal || e.subject() == "again") std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  use_or_refuse([&] {
    const Mechanism mechanism = capture::internal::parse_mechanism(text, "fuzz");
    const std::string once = capture::internal::print_mechanism(mechanism, "again");
    if (capture::internal::print_mechanism(capture::internal::parse_mechanism(once, "again"), "again") != once)
      std::abort();
    const Pose turned{Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX())), {0.2, -0.1, 0.5}};
    const Pose outside{turned.rotation, {2000, 0, 0}};
    for (const Pose& pose : {Pose{}, turned, outside}) {
      use_or_refuse([&] {
        const Tensions found = tensions(mechanism, pose);
        if (!found.tension_N.allFinite() || found.tension_N.minCoeff() < 0) std::abort();
        static_test(mechanism, pose);
      });
      use_or_refuse([&] { sensitivity(mechanism, pose); });
      use_or_refuse([&] { clearance(mechanism, pose); });
      use_or_refuse([&] { first_crossing(mechanism, Pose{}, pose); });
      use_or_refuse([&] {
        const CableVector lengths = cable_lengths(mechanism, turned);
        hang_rigid(mechanism, {lengths.data(), std::size_t(lengths.size())}, pose);
      });
    }
  });
  return 0;
}
