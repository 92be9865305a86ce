#pragma once

// Checked reading of JSON for Lumihull's own libraries; not installed. Every complaint names the file, the JSON pointer
// and what was expected.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace lumihull::internal {

using Json = nlohmann::ordered_json;

/// A value inside a JSON document together with where it stands.
class JsonReader {
 public:
  JsonReader(const Json& value, std::string file, std::string pointer = "")
      : value_(&value), file_(std::move(file)), pointer_(std::move(pointer)) {}

  const Json& value() const { return *value_; }
  const std::string& file() const { return file_; }
  const std::string& pointer() const { return pointer_; }

  [[noreturn]] void fail(const std::string& expected) const {
    throw Error(ErrorCode::bad_input,
                "at " + (pointer_.empty() ? std::string("/") : pointer_) + ": expected " + expected, file_);
  }

  bool has(std::string_view key) const { return value_->is_object() && value_->contains(key); }

  JsonReader at(std::string_view key) const {
    if (!value_->is_object()) fail("an object");
    const auto it = value_->find(key);
    if (it == value_->end()) fail("a field \"" + std::string(key) + "\"");
    return {*it, file_, pointer_ + "/" + std::string(key)};
  }
  JsonReader at(std::size_t index) const {
    if (!value_->is_array()) fail("an array");
    if (index >= value_->size()) fail("an array of more than " + std::to_string(index) + " values");
    return {(*value_)[index], file_, pointer_ + "/" + std::to_string(index)};
  }
  std::size_t array_size(std::size_t at_most) const {
    if (!value_->is_array()) fail("an array");
    if (value_->size() > at_most) fail("at most " + std::to_string(at_most) + " values");
    return value_->size();
  }

  double number(double low = -std::numeric_limits<double>::max(),
                double high = std::numeric_limits<double>::max()) const {
    if (!value_->is_number()) fail("a number");
    const double x = value_->get<double>();
    if (!std::isfinite(x) || x < low || x > high)
      fail(high < std::numeric_limits<double>::max() ? "a number from " + short_text(low) + " to " + short_text(high)
                                                     : "a number of at least " + short_text(low));
    return x;
  }
  double positive() const {
    const double x = number();
    if (!(x > 0)) fail("a positive number");
    return x;
  }
  std::int64_t integer(std::int64_t low, std::int64_t high) const {
    const std::string range = "an integer from " + std::to_string(low) + " to " + std::to_string(high);
    if (!value_->is_number_integer()) fail(range);
    if (value_->is_number_unsigned() && value_->get<std::uint64_t>() > std::uint64_t(INT64_MAX)) fail(range);
    const std::int64_t x = value_->get<std::int64_t>();
    if (x < low || x > high) fail(range);
    return x;
  }
  bool boolean() const {
    if (!value_->is_boolean()) fail("true or false");
    return value_->get<bool>();
  }
  std::string string(std::size_t at_most = 4096) const {
    if (!value_->is_string()) fail("a string");
    std::string s = value_->get<std::string>();
    if (s.size() > at_most) fail("a string of at most " + std::to_string(at_most) + " bytes");
    if (s.find('\0') != std::string::npos) fail("a string without NUL");
    return s;
  }

 private:
  static std::string short_text(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", x);
    return text;
  }

  const Json* value_;
  std::string file_, pointer_;
};

/// Parses text. A syntax error names the file and the byte.
inline Json parse_json(std::string_view text, const std::string& file) {
  try {
    return Json::parse(text);
  } catch (const nlohmann::json::exception& e) {
    // It quotes the token that it stumbled over, which may be as long as the file.
    throw Error(ErrorCode::bad_input, "not valid JSON: " + std::string(e.what()).substr(0, 300), file);
  }
}

/// JSON as text. Error{bad_input} naming `file`, which it is for, where a string is not UTF-8.
inline std::string print_json(const Json& json, const std::string& file) {
  try {
    return json.dump(1) + "\n";
  } catch (const nlohmann::json::exception&) {
    throw Error(ErrorCode::bad_input, "a name or another text is not UTF-8 and can't be stored as JSON", file);
  }
}

inline Json read_json(const std::filesystem::path& file, std::size_t max_bytes = std::size_t(256) << 20) {
  return parse_json(read_file(file, max_bytes), file.string());
}

/// Checks "format" and "version" at the top of one of Lumihull's own files; returns the version.
inline std::int64_t check_format(const JsonReader& top, std::string_view format, std::int64_t oldest,
                                 std::int64_t newest) {
  if (top.at("format").string() != format) top.at("format").fail("\"" + std::string(format) + "\"");
  return top.at("version").integer(oldest, newest);
}
inline void check_format(const JsonReader& top, std::string_view format, std::int64_t version) {
  check_format(top, format, version, version);
}

}  // namespace lumihull::internal
