#pragma once

#include <lumihull/base/image.h>
#include <lumihull/internal/html.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace lumihull::slf {

using lumihull::internal::html_escaped;

/// What the pages look like: for <style>.
std::string page_style();

/// A picture with words below it, embedded as JPEG; what is transparent in it becomes grey (alpha takes PNG, many times
/// as large).
std::string figure(const Image& picture, const std::string& caption);

/// A number as printf's format says; a dash where it is not finite.
std::string formatted(const char* format, double value);
std::string megabytes(std::uint64_t bytes);

}  // namespace lumihull::slf
