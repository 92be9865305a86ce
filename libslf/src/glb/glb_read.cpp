#include "glb_read.h"

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/slf/glb.h>

#include <array>
#include <cstring>
#include <span>
#include <utility>

namespace lumihull::slf {
namespace {

using internal::JsonReader;

constexpr std::int64_t kMost = std::int64_t(1) << 32;  // bytes and counts in a file of at most 4 GB

[[noreturn]] void bad(const std::string& file, const std::string& what) {
  throw Error(ErrorCode::bad_input, what, file);
}

std::uint32_t u32_at(std::string_view bytes, std::size_t at) {
  std::uint32_t v;
  std::memcpy(&v, bytes.data() + at, 4);
  return v;
}

struct Chunks {
  std::string_view json, binary;
};

Chunks chunks_of(std::string_view bytes, const std::string& file) {
  if (bytes.size() < 20 || u32_at(bytes, 0) != 0x46546C67)
    bad(file, "not a glTF binary: expected it to start with 'glTF'");
  if (u32_at(bytes, 4) != 2)
    throw Error(ErrorCode::unsupported, "glTF version " + std::to_string(u32_at(bytes, 4)) + ", expected 2", file);
  if (u32_at(bytes, 8) > bytes.size())
    bad(file, "truncated: its header says " + std::to_string(u32_at(bytes, 8)) + " bytes, the file has " +
                  std::to_string(bytes.size()));
  bytes = bytes.substr(0, u32_at(bytes, 8));
  Chunks chunks;
  for (std::size_t at = 12; at + 8 <= bytes.size();) {
    const std::size_t length = u32_at(bytes, at);
    const std::uint32_t type = u32_at(bytes, at + 4);
    if (length > bytes.size() - at - 8) bad(file, "truncated: a chunk reaches beyond the end of the file");
    const std::string_view content = bytes.substr(at + 8, length);
    if (type == 0x4E4F534A && chunks.json.empty()) chunks.json = content;
    if (type == 0x004E4942 && chunks.binary.empty()) chunks.binary = content;
    at += 8 + (length + 3) / 4 * 4;
  }
  if (chunks.json.empty()) bad(file, "expected a JSON chunk");
  return chunks;
}

std::int64_t optional_integer(const JsonReader& object, std::string_view key, std::int64_t fallback,
                              std::int64_t high) {
  return object.has(key) ? object.at(key).integer(0, high) : fallback;
}

struct Accessor {
  std::string_view bytes;  // from the first element on
  std::size_t count, stride;
  std::int64_t component;
};

/// Checks that all elements lie within their view.
Accessor accessor_of(const GlbFile& file, std::size_t index, std::string_view type, std::size_t components) {
  const JsonReader top = file.top();
  const JsonReader a = top.at("accessors").at(index);
  if (a.has("sparse")) throw Error(ErrorCode::unsupported, "sparse accessors are not read", a.file());
  if (a.at("type").string() != type) a.at("type").fail("\"" + std::string(type) + "\"");
  Accessor out;
  out.component = a.at("componentType").integer(5120, 5126);
  const std::size_t size = (out.component == 5126 || out.component == 5125 ? 4u
                            : out.component >= 5122                        ? 2u
                                                                           : 1u) *
                           components;
  out.count = std::size_t(a.at("count").integer(1, kMost));
  const auto view_index = std::size_t(a.at("bufferView").integer(0, kMost));
  out.bytes = file.view(view_index);
  const auto offset = std::size_t(optional_integer(a, "byteOffset", 0, kMost));
  out.stride =
      std::size_t(optional_integer(top.at("bufferViews").at(view_index), "byteStride", std::int64_t(size), 252));
  if (out.stride < size || offset > out.bytes.size() || out.bytes.size() - offset < size ||
      (out.bytes.size() - offset - size) / out.stride < out.count - 1)
    a.fail("elements that lie within their buffer view");
  out.bytes.remove_prefix(offset);
  return out;
}

template <class V>
std::vector<V> read_vectors(const GlbFile& file, std::size_t index, const char* type) {
  const Accessor a = accessor_of(file, index, type, V::RowsAtCompileTime);
  if (a.component != 5126) throw Error(ErrorCode::unsupported, "expected float vertex attributes", file.name());
  std::vector<V> out(a.count);
  for (std::size_t i = 0; i < a.count; ++i) std::memcpy(out[i].data(), a.bytes.data() + i * a.stride, sizeof(V));
  return out;
}

}  // namespace

std::size_t glb_index(const JsonReader& value) { return std::size_t(value.integer(0, kMost)); }

GlbFile::GlbFile(const std::filesystem::path& path) : GlbFile(read_file(path, std::size_t(kMost)), path.string()) {}

GlbFile::GlbFile(std::string bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {
  const Chunks chunks = chunks_of(bytes_, name_);
  binary_ = chunks.binary;
  document_ = internal::parse_json(chunks.json, name_);
}

JsonReader GlbFile::primitive() const {
  const JsonReader out = top().at("meshes").at(std::size_t(0)).at("primitives").at(std::size_t(0));
  if (optional_integer(out, "mode", 4, 6) != 4) throw Error(ErrorCode::unsupported, "expected triangles", name_);
  return out;
}

std::string_view GlbFile::view(std::size_t index) const {
  const JsonReader view = top().at("bufferViews").at(index);
  if (view.at("buffer").integer(0, 1 << 20) != 0) view.at("buffer").fail("0, the file's own buffer");
  const auto offset = std::size_t(optional_integer(view, "byteOffset", 0, kMost));
  const auto length = std::size_t(view.at("byteLength").integer(1, kMost));
  if (offset > binary_.size() || length > binary_.size() - offset) view.fail("a view within the binary chunk");
  return binary_.substr(offset, length);
}

std::vector<Eigen::Vector3f> GlbFile::vectors3(std::size_t accessor) const {
  return read_vectors<Eigen::Vector3f>(*this, accessor, "VEC3");
}

std::vector<Eigen::Vector2f> GlbFile::vectors2(std::size_t accessor) const {
  return read_vectors<Eigen::Vector2f>(*this, accessor, "VEC2");
}

std::vector<std::uint32_t> GlbFile::integers(std::size_t index) const {
  const Accessor a = accessor_of(*this, index, "SCALAR", 1);
  if (a.component != 5121 && a.component != 5123 && a.component != 5125)
    throw Error(ErrorCode::unsupported, "expected unsigned indices", name_);
  std::vector<std::uint32_t> out(a.count, 0);
  const std::size_t size = a.component == 5121 ? 1 : a.component == 5123 ? 2 : 4;
  for (std::size_t i = 0; i < a.count; ++i) std::memcpy(&out[i], a.bytes.data() + i * a.stride, size);
  return out;
}

std::span<const std::byte> GlbFile::picture(std::size_t texture) const {
  const JsonReader image = top().at("images").at(glb_index(top().at("textures").at(texture).at("source")));
  const std::string_view bytes = view(glb_index(image.at("bufferView")));
  return std::as_bytes(std::span(bytes.data(), bytes.size()));
}

std::string GlbFile::texture_name(std::size_t index) const {
  return name_ + " (texture " + std::to_string(index) + ")";
}

Image GlbFile::texture(std::size_t index) const {
  Image out = decode_image(picture(index), texture_name(index), {false, 3});
  return out.type() == PixelType::u8 ? std::move(out) : converted(out, PixelType::u8, 3);
}

Image GlbFile::texture_like(const Image& other, std::size_t index) const {
  const ImageInfo info = decode_image_info(picture(index), texture_name(index));
  if (info.width != other.width() || info.height != other.height())
    bad(texture_name(index), "expected " + std::to_string(other.width()) + " x " + std::to_string(other.height()) +
                                 " pixels, found " + std::to_string(info.width) + " x " + std::to_string(info.height));
  return texture(index);
}

TexturedMesh GlbFile::textured_mesh() const {
  const JsonReader triangles = primitive();
  const JsonReader attributes = triangles.at("attributes");

  TexturedMesh textured;
  textured.mesh.vertices = vectors3(glb_index(attributes.at("POSITION")));
  const auto uv = vectors2(glb_index(attributes.at("TEXCOORD_0")));
  if (uv.size() != textured.mesh.vertices.size()) bad(name_, "expected one texture coordinate a vertex");
  const auto indices = integers(glb_index(triangles.at("indices")));
  if (indices.size() % 3)
    bad(name_, "expected three indices a triangle, not " + std::to_string(indices.size()) + " in all");
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    std::array<Eigen::Vector2f, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      if (indices[i + k] >= uv.size())
        bad(name_, "index " + std::to_string(indices[i + k]) + " of " + std::to_string(uv.size()) + " vertices");
      corners[k] = uv[indices[i + k]];
    }
    textured.mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    textured.uv.push_back(corners);
  }
  const JsonReader material = top().at("materials").at(glb_index(triangles.at("material")));
  textured.texture = texture(glb_index(material.at("pbrMetallicRoughness").at("baseColorTexture").at("index")));
  validate(textured, name_);
  return textured;
}

TexturedMesh read_glb(const std::filesystem::path& path) { return GlbFile(path).textured_mesh(); }

}  // namespace lumihull::slf
