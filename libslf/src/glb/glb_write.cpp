#include "glb_write.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <limits>
#include <tuple>

namespace lumihull::slf {
namespace {

using internal::Json;

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr int kFloat = 5126, kUnsignedShort = 5123, kUnsignedInt = 5125;

void append(std::string& to, const void* data, std::size_t bytes) { to.append(static_cast<const char*>(data), bytes); }
void append_u32(std::string& to, std::uint64_t value) {
  const auto v = std::uint32_t(value);
  append(to, &v, 4);
}
void pad(std::string& to, char with) { to.append((4 - to.size() % 4) % 4, with); }

template <class V>
Json vectors_accessor(const std::vector<V>& values, std::size_t view, const char* type, bool bounds) {
  Json accessor = {{"bufferView", view}, {"componentType", kFloat}, {"count", values.size()}, {"type", type}};
  if (bounds) {
    V low = values[0], high = values[0];
    for (const V& v : values) low = low.cwiseMin(v), high = high.cwiseMax(v);
    accessor["min"] = std::vector<float>(low.data(), low.data() + low.size());
    accessor["max"] = std::vector<float>(high.data(), high.data() + high.size());
  }
  return accessor;
}

}  // namespace

FileVertices split_vertices(const TexturedMesh& textured) {
  struct Corner {
    std::uint32_t vertex;
    float u, v;
    std::uint32_t at;
  };
  std::vector<Corner> corners;
  for (std::size_t t = 0; t < textured.mesh.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      corners.push_back(
          {textured.mesh.triangles[t][i], textured.uv[t][i].x(), textured.uv[t][i].y(), std::uint32_t(3 * t + i)});
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return std::tie(a.vertex, a.u, a.v, a.at) < std::tie(b.vertex, b.u, b.v, b.at);
  });
  FileVertices file;
  file.indices.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Corner& c = corners[i];
    if (i == 0 || std::tie(c.vertex, c.u, c.v) != std::tie(corners[i - 1].vertex, corners[i - 1].u, corners[i - 1].v)) {
      file.vertex.push_back(c.vertex);
      file.uv.push_back({c.u, c.v});
    }
    file.indices[c.at] = std::uint32_t(file.vertex.size() - 1);
  }
  return file;
}

std::size_t GlbBuffer::add_view(const void* data, std::size_t bytes, int target) {
  pad(bytes_, '\0');
  Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}};
  if (target) view["target"] = target;
  append(bytes_, data, bytes);
  views_.push_back(view);
  return views_.size() - 1;
}

std::size_t GlbBuffer::add_accessor(Json accessor) {
  accessors_.push_back(std::move(accessor));
  return accessors_.size() - 1;
}

std::size_t GlbBuffer::add_vectors(const std::vector<Eigen::Vector3f>& values, bool bounds, int target) {
  const std::size_t view = add_view(values.data(), values.size() * sizeof(Eigen::Vector3f), target);
  return add_accessor(vectors_accessor(values, view, "VEC3", bounds));
}

std::size_t GlbBuffer::add_vectors(const std::vector<Eigen::Vector2f>& values, int target) {
  const std::size_t view = add_view(values.data(), values.size() * sizeof(Eigen::Vector2f), target);
  return add_accessor(vectors_accessor(values, view, "VEC2", false));
}

Json textured_document(const TexturedMesh& textured, const FileVertices& file, const GlbOptions& options,
                       GlbBuffer& buffer) {
  if (options.jpeg_quality < 0 || options.jpeg_quality > 100)
    throw Error(ErrorCode::invalid_argument, "jpeg_quality: expected 0 (PNG) to 100");
  if (textured.mesh.triangles.empty()) throw Error(ErrorCode::degenerate, "the mesh has no triangles to write");

  Json attributes;
  std::vector<Eigen::Vector3f> values(file.vertex.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = textured.mesh.vertices[file.vertex[i]];
  attributes["POSITION"] = buffer.add_vectors(values, true);
  if (options.normals) {
    const std::vector<Eigen::Vector3f> normals = hull::vertex_normals(textured.mesh);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = normals[file.vertex[i]];
      if (values[i].isZero()) values[i] = {0, 0, 1};  // glTF wants unit length everywhere
    }
    attributes["NORMAL"] = buffer.add_vectors(values, false);
  }
  attributes["TEXCOORD_0"] = buffer.add_vectors(file.uv);

  const bool narrow = file.vertex.size() < 65535;  // 65535 itself is reserved (primitive restart)
  const std::vector<std::uint16_t> narrow_indices(narrow ? file.indices.begin() : file.indices.end(),
                                                  file.indices.end());
  const std::size_t index_view = narrow ? buffer.add_view(narrow_indices.data(), narrow_indices.size() * 2, 34963)
                                        : buffer.add_view(file.indices.data(), file.indices.size() * 4, 34963);
  const std::size_t indices = buffer.add_accessor({{"bufferView", index_view},
                                                   {"componentType", narrow ? kUnsignedShort : kUnsignedInt},
                                                   {"count", file.indices.size()},
                                                   {"type", "SCALAR"}});
  const bool jpeg = options.jpeg_quality > 0;
  const std::string picture = jpeg ? encode_jpeg(textured.texture, options.jpeg_quality) : encode_png(textured.texture);
  const std::size_t image_view = buffer.add_view(picture.data(), picture.size());

  return {{"asset", {{"version", "2.0"}, {"generator", "Lumihull"}}},
          {"extensionsUsed", {"KHR_materials_unlit"}},
          {"scene", 0},
          {"scenes", {{{"nodes", {0}}}}},
          {"nodes", {{{"mesh", 0}}}},
          {"meshes", {{{"primitives", {{{"attributes", attributes}, {"indices", indices}, {"material", 0}}}}}}},
          {"materials",
           {{{"pbrMetallicRoughness",
              {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}},
             {"extensions", {{"KHR_materials_unlit", Json::object()}}}}}},
          {"textures", {{{"source", 0}, {"sampler", 0}}}},
          {"samplers", {{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}}}},
          {"images", {{{"bufferView", image_view}, {"mimeType", jpeg ? "image/jpeg" : "image/png"}}}}};
}

std::string pack_glb(Json document, GlbBuffer& buffer) {
  pad(buffer.bytes_, '\0');
  document["accessors"] = std::move(buffer.accessors_);
  document["bufferViews"] = std::move(buffer.views_);
  document["buffers"] = {{{"byteLength", buffer.bytes_.size()}}};
  std::string json = document.dump();
  pad(json, ' ');

  const std::uint64_t total = 12 + 8 + json.size() + 8 + std::uint64_t(buffer.bytes_.size());
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw Error(ErrorCode::unsupported, "the model is larger than the 4 GB of a GLB file: simplify the mesh");
  std::string glb;
  glb.reserve(total);
  append_u32(glb, kMagic), append_u32(glb, 2), append_u32(glb, total);
  append_u32(glb, json.size()), append_u32(glb, kJsonChunk);
  glb += json;
  append_u32(glb, buffer.bytes_.size()), append_u32(glb, kBinaryChunk);
  glb += buffer.bytes_;
  return glb;
}

}  // namespace lumihull::slf
