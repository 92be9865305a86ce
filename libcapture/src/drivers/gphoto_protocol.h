#pragma once

// What passes between gphoto_camera.cpp and its helper program over two pipes. Requests and answers are lines of words
// with single spaces between them; a word is written by `word`, so that names from a camera can't break a line.
//
//   hello                                            <- at its start: "hello 1"
//   cameras              -> "camera MODEL PORT" each, then "ok"
//   open PORT MODEL      -> "ok MODEL"
//   drain                -> "ok COUNT": events that were waiting; COUNT pictures among them
//   trigger              -> "ok"; "refused WHY": surely no exposure; "doubt WHY"
//   event MILLISECONDS   -> "added SIZE FOLDER NAME", "complete", "nothing"
//   get FOLDER NAME      -> "data N" and N bytes behind the line end, again and again, then "ok"
//   delete FOLDER NAME   -> "ok"
//
// and "error WHY" to any of them. The end of its input ends the helper, even while libgphoto2 hangs.

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::capture::gphoto {

inline constexpr std::string_view kHello = "hello 1";
inline constexpr std::size_t kMaxLine = 8192;
inline constexpr std::size_t kMaxChunk = std::size_t(1) << 20;

/// Printable ASCII as it is, other bytes, blanks and '%' as "%hh"; an empty text as "%".
inline std::string word(std::string_view text) {
  if (text.empty()) return "%";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 0x20 && byte < 0x7f && c != '%') {
      out += c;
    } else {
      out += '%';
      out += "0123456789abcdef"[byte >> 4];
      out += "0123456789abcdef"[byte & 15];
    }
  }
  return out;
}

/// The inverse; nullopt for what `word` never writes.
inline std::optional<std::string> unword(std::string_view text) {
  if (text == "%") return std::string();
  const auto digit = [](char c) { return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1; };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const int high = digit(text[i + 1]), low = digit(text[i + 2]);
    if (high < 0 || low < 0) return std::nullopt;
    out += char(high * 16 + low);
    i += 2;
  }
  return out;
}

/// A line's words; nullopt where one of them is none.
inline std::optional<std::vector<std::string>> words(std::string_view line) {
  std::vector<std::string> out;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(' '), line.size());
    const auto one = unword(line.substr(0, end));
    if (!one) return std::nullopt;
    out.push_back(*one);
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return out;
}

}  // namespace lumihull::capture::gphoto
