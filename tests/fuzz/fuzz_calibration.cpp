// Fuzz target: what a calibration keeps in a capture's folder: targets.json and detections/NAME.json. What is read can
// be written and read again, and is the same.

#include <detections_file.h>
#include <lumihull/base/error.h>
#include <target_model_json.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace {

using namespace lumihull;
using namespace lumihull::calib;

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
  static const TargetSet set = TargetSet::from_word("matrix5x5:18mm,aruco:6x6_250:35mm,chessboard:9x6:25mm");
  const std::string text(reinterpret_cast<const char*>(data), size);
  use_or_refuse([&] {
    const TargetModel model = calib::internal::parse_target_model(text, "fuzz");
    const std::string once = calib::internal::print_target_model(model, "again");
    if (calib::internal::print_target_model(calib::internal::parse_target_model(once, "again"), "again") != once)
      std::abort();
    calibration_json(model);
  });
  use_or_refuse([&] {
    const auto kept = calib::internal::parse_detections(text, "fuzz", set);
    const std::string once = calib::internal::print_detections(set, kept);
    if (calib::internal::print_detections(set, calib::internal::parse_detections(once, "again", set)) != once)
      std::abort();
  });
  return 0;
}
