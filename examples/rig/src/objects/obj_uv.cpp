#include "obj_uv.h"

#include <lumihull/base/error.h>

#include <charconv>
#include <cmath>
#include <cstdint>

namespace lumihull::rig {

namespace {

/// Splits off the next word; empty at the end.
std::string_view next_word(std::string_view& text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return text = {};
  text.remove_prefix(begin);
  const std::string_view word = text.substr(0, text.find_first_of(kBlank));
  text.remove_prefix(word.size());
  return word;
}

template <class Number>
bool parse(std::string_view word, Number& out) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc() && end == word.data() + word.size();
}

}  // namespace

std::vector<std::array<Eigen::Vector2f, 3>> obj_texture_coordinates(std::string_view text, const std::string& name) {
  std::size_t line_number = 0;
  const auto fail = [&](const char* what) {
    throw Error(ErrorCode::bad_input, "line " + std::to_string(line_number) + ": " + what, name);
  };
  std::vector<Eigen::Vector2f> coordinates;
  std::vector<std::array<Eigen::Vector2f, 3>> result;
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    ++line_number;
    const std::string_view key = next_word(line);
    if (key == "vt") {
      Eigen::Vector2f uv;
      for (int i = 0; i < 2; ++i)
        if (!parse(next_word(line), uv[i]) || !std::isfinite(uv[i]) || std::fabs(uv[i]) > 1e4f)
          fail("expected two texture coordinates, at most 10000 in size");
      coordinates.push_back(uv);
    } else if (key == "f") {
      Eigen::Vector2f first, previous;
      std::size_t corners = 0;
      for (std::string_view corner = next_word(line); !corner.empty(); corner = next_word(line), ++corners) {
        const std::size_t slash = corner.find('/');
        if (slash == std::string_view::npos) fail("expected a texture coordinate at each corner of the face");
        const std::string_view rest = corner.substr(slash + 1);
        long long index = 0;
        if (!parse(rest.substr(0, rest.find('/')), index))
          fail("expected a texture coordinate at each corner of the face");
        const auto count = static_cast<long long>(coordinates.size());
        const long long i = index < 0 ? count + index : index - 1;
        if (i < 0 || i >= count) fail("texture coordinate out of range");
        const Eigen::Vector2f uv = coordinates[std::size_t(i)];
        if (corners == 0) first = uv;
        if (corners >= 2) result.push_back({first, previous, uv});
        previous = uv;
      }
    }
  }
  return result;
}

}  // namespace lumihull::rig
