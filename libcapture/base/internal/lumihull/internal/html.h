#pragma once

// Text in HTML and SVG, for the pages that Lumihull's libraries write.

#include <cstdint>
#include <string>
#include <string_view>

namespace lumihull::internal {

/// Text for HTML's content and attributes: & < > " ' escaped, control characters replaced by spaces.
inline std::string html_escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += std::uint8_t(c) < 32 && c != '\n' ? ' ' : c;
    }
  }
  return out;
}

}  // namespace lumihull::internal
