#pragma once

#include <lumihull/base/image.h>

#include <string>
#include <string_view>

namespace lumihull::slf {

/// Text for HTML's content and attributes: & < > " ' escaped, control characters replaced.
std::string html_escaped(std::string_view text);

/// A picture as a data URL: JPEG for 1 or 3 channels, PNG for 4.
std::string data_url(const Image& picture, int jpeg_quality = 85);

/// The picture made smaller to fit into `side` x `side` by averaging (8-bit, on stored values); never larger.
Image fitted(const Image& picture, int side);

}  // namespace lumihull::slf
