#pragma once

// capture.json and cameras.json as text: parsing and printing apart from the disk, so that both can be fuzzed.

#include <lumihull/base/capture.h>

#include <string>
#include <string_view>

namespace lumihull::internal {

/// Fills everything but cameras and poses. `name` is used in errors.
LUMIHULL_API void parse_capture_json(std::string_view text, const std::string& name, Capture& capture);
/// `name` is the file that it is for. Errors: bad_input (a text that is not UTF-8).
LUMIHULL_API std::string print_capture_json(const Capture& capture, const std::string& name);

/// Fills cameras and the shots' poses; parse_capture_json must have run before.
LUMIHULL_API void parse_cameras_json(std::string_view text, const std::string& name, Capture& capture);
std::string print_cameras_json(const Capture& capture, const std::string& name);

}  // namespace lumihull::internal
