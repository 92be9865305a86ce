#pragma once

#include <lumihull/base/image.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace lumihull::slf {

/// Text for HTML's content and attributes: & < > " ' escaped, control characters replaced.
std::string html_escaped(std::string_view text);

/// A picture with words below it, embedded as JPEG; what is transparent in it becomes grey (alpha takes PNG, many times
/// as large).
std::string figure(const Image& picture, const std::string& caption);

/// A number as printf's format says; a dash where it is not finite.
std::string formatted(const char* format, double value);
std::string megabytes(std::uint64_t bytes);

/// The picture made smaller to fit into `side` x `side` by averaging (8-bit, on stored values); never larger.
Image fitted(const Image& picture, int side);

}  // namespace lumihull::slf
