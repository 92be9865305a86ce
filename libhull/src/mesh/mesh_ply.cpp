// PLY (Turk 1994): a text header that declares elements and their properties, then ASCII or binary values.

#include <lumihull/base/error.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include "mesh_files.h"

namespace lumihull::hull {
namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Encoding { ascii, little, big };

std::size_t size_of(Type type) {
  switch (type) {
    case Type::i8:
    case Type::u8:
      return 1;
    case Type::i16:
    case Type::u16:
      return 2;
    case Type::i32:
    case Type::u32:
    case Type::f32:
      return 4;
    case Type::f64:
      return 8;
  }
  return 8;
}

std::optional<Type> type_named(std::string_view name) {
  static constexpr std::pair<std::string_view, Type> kNames[] = {
      {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
      {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
      {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
      {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};
  for (const auto& [text, type] : kNames)
    if (text == name) return type;
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type{};
  std::optional<Type> count_type;  // set: a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

class Parser {
 public:
  Parser(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Mesh parse() {
    read_header();
    Mesh mesh;
    for (const Element& element : elements_) {
      if (element.name == "vertex")
        read_vertices(element, mesh);
      else if (element.name == "face")
        read_faces(element, mesh);
      else
        for (std::uint64_t i = 0; i < element.count; ++i)
          for (const Property& p : element.properties) skip(p);
    }
    return mesh;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::bad_input, "not a valid PLY file: " + what + " at byte " + std::to_string(at_), name_);
  }

  std::size_t left() const { return bytes_.size() - at_; }

  std::string_view line() {
    const std::size_t end = bytes_.find('\n', at_);
    if (end == std::string_view::npos) fail("the header does not end");
    std::string_view text = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    return text;
  }

  static std::string_view word(std::string_view& text) {
    const std::size_t begin = text.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return text = {};
    text.remove_prefix(begin);
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    const std::string_view result = text.substr(0, end);
    text.remove_prefix(end);
    return result;
  }

  Type type(std::string_view name) const {
    const std::optional<Type> t = type_named(name);
    if (!t) fail("unknown type \"" + std::string(name.substr(0, 40)) + "\"");
    return *t;
  }

  void read_header() {
    if (line() != "ply") fail("the first line is not \"ply\"");
    bool encoded = false;
    for (;;) {
      std::string_view text = line();
      const std::string_view key = word(text);
      if (key == "end_header") break;
      if (key.empty() || key == "comment" || key == "obj_info") continue;
      if (key == "format") {
        const std::string_view encoding = word(text);
        if (encoding == "ascii")
          encoding_ = Encoding::ascii;
        else if (encoding == "binary_little_endian")
          encoding_ = Encoding::little;
        else if (encoding == "binary_big_endian")
          encoding_ = Encoding::big;
        else
          fail("unknown format");
        encoded = true;
      } else if (key == "element") {
        if (elements_.size() >= 64) fail("more than 64 elements");
        Element element{std::string(word(text)), 0, {}};
        const std::string_view count = word(text);
        const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
        if (error != std::errc() || end != count.data() + count.size()) fail("bad element count");
        elements_.push_back(std::move(element));
      } else if (key == "property") {
        if (elements_.empty()) fail("a property before the first element");
        if (elements_.back().properties.size() >= 1024) fail("more than 1024 properties");
        Property p;
        std::string_view t = word(text);
        if (t == "list") {
          p.count_type = type(word(text));
          if (*p.count_type == Type::f32 || *p.count_type == Type::f64) fail("a list's count is not an integer");
          t = word(text);
        }
        p.type = type(t);
        p.name = word(text);
        elements_.back().properties.push_back(std::move(p));
      } else {
        fail("unknown header line \"" + std::string(key.substr(0, 40)) + "\"");
      }
    }
    if (!encoded) fail("the header names no format");
    // Each value takes a byte at least (ASCII: a digit and a separator), so counts are paid for by the file's length.
    for (const Element& e : elements_) {
      if (e.count > 0 && e.properties.empty()) fail("element \"" + e.name + "\" has no properties");
      std::size_t least = 0;
      for (const Property& p : e.properties)
        least += encoding_ == Encoding::ascii ? 1 : hull::size_of(p.count_type.value_or(p.type));
      if (e.count > 0 && e.count > left() / least) fail("the file is too short for its element counts");
    }
  }

  double value(Type type) { return encoding_ == Encoding::ascii ? ascii_value() : binary_value(type); }

  double ascii_value() {
    while (at_ < bytes_.size() &&
           (bytes_[at_] == ' ' || bytes_[at_] == '\n' || bytes_[at_] == '\r' || bytes_[at_] == '\t'))
      ++at_;
    if (at_ < bytes_.size() && bytes_[at_] == '+') ++at_;
    double result = 0;
    const char* const end = bytes_.data() + bytes_.size();
    const auto [stop, error] = std::from_chars(bytes_.data() + at_, end, result);
    if (error != std::errc()) fail(at_ >= bytes_.size() ? "the file is truncated" : "expected a number");
    at_ = std::size_t(stop - bytes_.data());
    return result;
  }

  template <class T>
  double load() const {
    unsigned char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + at_, sizeof(T));
    if ((encoding_ == Encoding::big) != (std::endian::native == std::endian::big))
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    T v;
    std::memcpy(&v, raw, sizeof(T));
    return double(v);
  }

  double binary_value(Type type) {
    const std::size_t size = hull::size_of(type);
    if (left() < size) fail("the file is truncated");
    double v = 0;
    switch (type) {
      case Type::i8:
        v = load<std::int8_t>();
        break;
      case Type::u8:
        v = load<std::uint8_t>();
        break;
      case Type::i16:
        v = load<std::int16_t>();
        break;
      case Type::u16:
        v = load<std::uint16_t>();
        break;
      case Type::i32:
        v = load<std::int32_t>();
        break;
      case Type::u32:
        v = load<std::uint32_t>();
        break;
      case Type::f32:
        v = load<float>();
        break;
      case Type::f64:
        v = load<double>();
        break;
    }
    at_ += size;
    return v;
  }

  std::size_t list_length(const Property& p) {
    const double n = value(*p.count_type);
    if (!(n >= 0) || n > double(left()) || n != std::floor(n)) fail("a list is longer than the file");
    return std::size_t(n);
  }

  void skip(const Property& p) {
    const std::size_t n = p.count_type ? list_length(p) : 1;
    for (std::size_t i = 0; i < n; ++i) value(p.type);
  }

  void read_vertices(const Element& element, Mesh& mesh) {
    bool found[3] = {};
    for (const Property& p : element.properties)
      for (int axis = 0; axis < 3; ++axis)
        if (!p.count_type && p.name == std::string(1, char('x' + axis))) found[axis] = true;
    if (!(found[0] && found[1] && found[2])) fail("vertices without x, y and z");
    if (!mesh.vertices.empty()) fail("vertices declared twice");
    if (element.count >= kMaxVertices) fail("too many vertices");
    mesh.vertices.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Eigen::Vector3f position = Eigen::Vector3f::Zero();
      for (const Property& p : element.properties) {
        if (p.count_type || p.name.size() != 1 || p.name[0] < 'x' || p.name[0] > 'z') {
          skip(p);
        } else {
          position[p.name[0] - 'x'] = float(value(p.type));
        }
      }
      mesh.vertices.push_back(position);
    }
  }

  void read_faces(const Element& element, Mesh& mesh) {
    const Property* indices = nullptr;
    for (const Property& p : element.properties)
      if (p.count_type && (p.name == "vertex_indices" || p.name == "vertex_index")) indices = &p;
    if (element.count > 0 && !indices) fail("faces without vertex_indices");
    mesh.triangles.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& p : element.properties) {
        if (&p != indices) {
          skip(p);
          continue;
        }
        const std::size_t n = list_length(p);
        if (n < 3) fail("a face of fewer than three vertices");
        std::uint32_t first = 0, previous = 0;
        for (std::size_t k = 0; k < n; ++k) {
          const double v = value(p.type);
          if (!(v >= 0) || v >= double(kMaxVertices) || v != std::floor(v)) fail("a vertex index out of range");
          const auto index = std::uint32_t(v);
          if (k == 0) first = index;
          if (k >= 2) mesh.triangles.push_back({first, previous, index});
          previous = index;
        }
      }
    }
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  Encoding encoding_ = Encoding::ascii;
  std::vector<Element> elements_;
};

}  // namespace

Mesh parse_ply(std::string_view bytes, const std::string& name) { return Parser(bytes, name).parse(); }

void write_ply(AtomicFile& out, const Mesh& mesh) {
  static_assert(std::endian::native == std::endian::little, "binary PLY is written as it lies in memory");
  static_assert(sizeof(Eigen::Vector3f) == 12);
  out.write("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
            "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
            std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n");
  out.write({reinterpret_cast<const char*>(mesh.vertices.data()), mesh.vertices.size() * sizeof(Eigen::Vector3f)});
  std::string buffer;
  buffer.reserve(13 << 16);
  for (const auto& triangle : mesh.triangles) {
    buffer.push_back(3);
    buffer.append(reinterpret_cast<const char*>(triangle.data()), 12);
    if (buffer.size() >= (13 << 16)) {
      out.write(buffer);
      buffer.clear();
    }
  }
  out.write(buffer);
}

}  // namespace lumihull::hull
