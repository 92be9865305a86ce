#pragma once

// Text from outside: what may stand in a message, a name, a JSON file.

#include <cstddef>
#include <string>
#include <string_view>

namespace lumihull::internal {

/// Bytes of the character that `text` begins with; 0 where that is none of UTF-8 (RFC 3629) or a control character.
inline std::size_t printable_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xc0) == 0x80; };
  const unsigned first = byte(0), second = byte(1);
  if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
  if (first >= 0xc2 && first < 0xe0)  // U+0080 to U+009F are control characters
    return follows(1) && !(first == 0xc2 && second < 0xa0) ? 2 : 0;
  if (first >= 0xe0 && first < 0xf0)  // neither longer than need be nor half of a surrogate pair
    return follows(1) && follows(2) && !(first == 0xe0 && second < 0xa0) && !(first == 0xed && second >= 0xa0) ? 3 : 0;
  if (first >= 0xf0 && first < 0xf5)
    return follows(1) && follows(2) && follows(3) && !(first == 0xf0 && second < 0x90) &&
                   !(first == 0xf4 && second >= 0x90)
               ? 4
               : 0;
  return 0;
}

/// The text with `instead` for each byte that belongs to no printable character: valid UTF-8, one line, nothing that a
/// terminal obeys. Cut after the last character that ends within `most` bytes.
inline std::string printable(std::string_view text, char instead, std::size_t most = std::string_view::npos) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = printable_length(text);
    if (out.size() + (length ? length : 1) > most) break;
    if (length)
      out += text.substr(0, length);
    else
      out += instead;
    text.remove_prefix(length ? length : 1);
  }
  return out;
}

/// Whether a shot may be called so: its masks and renderings are files of that name.
inline bool is_shot_name(std::string_view name) {
  return !name.empty() && name.size() <= 200 && name != "." && name != ".." &&
         name.find('/') == std::string_view::npos && printable(name, '?') == name;
}
inline constexpr char kShotName[] = "a name of 1 to 200 bytes, UTF-8 without '/' and control characters";

}  // namespace lumihull::internal
