// Wavefront OBJ: `v x y z` and `f a b c …` lines; a may be i, i/t, i//n or i/t/n, counted from 1, or from -1 backwards.

#include <lumihull/base/error.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "mesh_files.h"

namespace lumihull::hull {
namespace {

class Parser {
 public:
  Parser(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Mesh parse() {
    while (!bytes_.empty()) {
      const std::size_t end = std::min(bytes_.find('\n'), bytes_.size());
      text_ = bytes_.substr(0, end);
      bytes_.remove_prefix(std::min(end + 1, bytes_.size()));
      ++line_;
      const std::string_view key = word();
      if (key == "v") read_vertex();
      if (key == "f") read_face();
    }
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::bad_input, "not a valid OBJ file: line " + std::to_string(line_) + ": " + what, name_);
  }

  std::string_view word() {
    const std::size_t begin = text_.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return text_ = {};
    text_.remove_prefix(begin);
    const std::size_t end = std::min(text_.find_first_of(" \t\r"), text_.size());
    const std::string_view result = text_.substr(0, end);
    text_.remove_prefix(end);
    return result;
  }

  void read_vertex() {
    Eigen::Vector3f position;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view number = word();
      const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), position[axis]);
      if (error != std::errc() || end != number.data() + number.size()) fail("expected three coordinates");
    }
    if (mesh_.vertices.size() + 1 >= kMaxVertices) fail("too many vertices");
    mesh_.vertices.push_back(position);
  }

  void read_face() {
    std::uint32_t first = 0, previous = 0;
    std::size_t n = 0;
    for (std::string_view corner = word(); !corner.empty(); corner = word(), ++n) {
      long long index = 0;
      const auto [end, error] = std::from_chars(corner.data(), corner.data() + corner.size(), index);
      if (error != std::errc() || (end != corner.data() + corner.size() && *end != '/'))
        fail("expected vertex numbers");
      const auto count = (long long)(mesh_.vertices.size());
      const long long i = index < 0 ? count + index : index - 1;
      // A face may name vertices that follow later; those are checked when all are known.
      if (index == 0 || i < 0 || i >= (long long)(kMaxVertices)) fail("vertex number out of range");
      if (n == 0) first = std::uint32_t(i);
      if (n >= 2) mesh_.triangles.push_back({first, previous, std::uint32_t(i)});
      previous = std::uint32_t(i);
    }
    if (n < 3) fail("a face of fewer than three vertices");
  }

  std::string_view bytes_, text_;
  const std::string& name_;
  std::size_t line_ = 0;
  Mesh mesh_;
};

}  // namespace

Mesh parse_obj(std::string_view bytes, const std::string& name) { return Parser(bytes, name).parse(); }

void write_obj(AtomicFile& out, const Mesh& mesh) {
  std::string buffer;
  const auto flush = [&](std::size_t at_least) {
    if (buffer.size() < at_least) return;
    out.write(buffer);
    buffer.clear();
  };
  char digits[32];
  for (const Eigen::Vector3f& v : mesh.vertices) {
    buffer += 'v';
    for (int axis = 0; axis < 3; ++axis) {
      buffer += ' ';
      buffer.append(digits, std::to_chars(digits, digits + sizeof digits, v[axis]).ptr);
    }
    buffer += '\n';
    flush(1 << 20);
  }
  for (const auto& triangle : mesh.triangles) {
    buffer += 'f';
    for (const std::uint32_t index : triangle) {
      buffer += ' ';
      buffer.append(digits, std::to_chars(digits, digits + sizeof digits, std::uint64_t(index) + 1).ptr);
    }
    buffer += '\n';
    flush(1 << 20);
  }
  flush(1);
}

}  // namespace lumihull::hull
