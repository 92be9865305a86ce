#include <libdeflate.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/slf/light_field_glb.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "glb_read.h"
#include "glb_write.h"

namespace lumihull::slf {
namespace {

using internal::Json;
using internal::JsonReader;

constexpr const char* kExtension = "LUMIHULL_surface_light_field";
// What readers of earlier ones would not notice: a reflection; its strength at each vertex, and how far it is.
constexpr int kVersion = 1, kVersionWithReflection = 3, kWithoutStrength = 2;
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125;
constexpr std::uint64_t kMostMapBytes = std::uint64_t(1) << 32;  // of all terms' maps, unpacked
constexpr std::size_t kMostInflation = 1032;  // deflate's: a run of 258 bytes takes two bits (RFC 1951, 3.2.5)

bool has_extension(const JsonReader& primitive) {
  return primitive.has("extensions") && primitive.at("extensions").has(kExtension);
}

/// zlib format (RFC 1950), which browsers can inflate themselves.
std::string deflated(const std::vector<std::uint8_t>& bytes) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(12), libdeflate_free_compressor);
  if (!compressor) throw Error(ErrorCode::out_of_memory, "no memory to compress the view maps");
  std::string out(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  out.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size()));
  return out;
}

/// Of terms that have so many surface maps each.
std::uint64_t map_bytes(const LightField& field, std::size_t vertices, std::size_t terms, std::size_t maps) {
  return std::uint64_t(terms) * (std::uint64_t(vertices) * field.nodes.size() + maps * field.base.texture.bytes());
}

/// No where the bytes are damaged or not exactly as many.
bool inflate(std::string_view from, std::vector<std::uint8_t>& to) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!decompressor) throw Error(ErrorCode::out_of_memory, "no memory to unpack the view maps");
  return libdeflate_zlib_decompress(decompressor.get(), from.data(), from.size(), to.data(), to.size(), nullptr) ==
         LIBDEFLATE_SUCCESS;
}

/// Differences from the vertex before, for each node.
void to_differences(std::vector<std::uint8_t>& rows, std::size_t length) {
  for (std::size_t row = 0; row < rows.size(); row += length)
    for (std::size_t i = length; i-- > 1;) rows[row + i] = std::uint8_t(rows[row + i] - rows[row + i - 1]);
}
void from_differences(std::vector<std::uint8_t>& rows, std::size_t length) {
  for (std::size_t row = 0; row < rows.size(); row += length)
    for (std::size_t i = 1; i < length; ++i) rows[row + i] = std::uint8_t(rows[row + i] + rows[row + i - 1]);
}

Json scale_json(const ByteScale& s) { return {{"scale", s.scale}, {"offset", s.offset}}; }

ByteScale scale_of(const JsonReader& json) {
  constexpr double kMost = 1e6;
  return {float(json.at("scale").number(-kMost, kMost)), float(json.at("offset").number(-kMost, kMost))};
}

/// Vertices that triangles use, in their order: only such are in the file.
std::vector<std::uint32_t> used_vertices(const hull::Mesh& mesh) {
  std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) used[v] = 1;
  std::vector<std::uint32_t> out;
  for (std::uint32_t v = 0; v < used.size(); ++v)
    if (used[v]) out.push_back(v);
  return out;
}

LightField light_field_of(const GlbFile& file) {
  const JsonReader primitive = file.primitive();
  if (!has_extension(primitive))
    throw Error(ErrorCode::bad_input, std::string("the model has no light field: expected the extension ") + kExtension,
                file.name());
  const JsonReader extension = primitive.at("extensions").at(kExtension);
  const auto version = extension.at("version").integer(1, 1'000'000);
  if (version > kVersionWithReflection)
    throw Error(ErrorCode::unsupported,
                "light field of version " + std::to_string(version) + ", expected at most " +
                    std::to_string(kVersionWithReflection),
                file.name());

  LightField field;
  TexturedMesh split = file.textured_mesh();
  // Vertices that were doubled for the texture's sake become one again.
  const JsonReader vertex_of_json = extension.at("vertexOf");
  const std::vector<std::uint32_t> vertex_of = file.integers(glb_index(vertex_of_json));
  const auto vertices = std::size_t(extension.at("vertices").integer(1, std::int64_t(split.mesh.vertices.size())));
  if (vertex_of.size() != split.mesh.vertices.size()) vertex_of_json.fail("one number for each vertex of the file");
  field.base.mesh.vertices.resize(vertices);
  std::vector<std::uint8_t> known(vertices, 0);
  for (std::size_t i = 0; i < vertex_of.size(); ++i) {
    if (vertex_of[i] >= vertices) vertex_of_json.fail("numbers below " + std::to_string(vertices));
    field.base.mesh.vertices[vertex_of[i]] = split.mesh.vertices[i];
    known[vertex_of[i]] = 1;
  }
  if (std::find(known.begin(), known.end(), 0) != known.end())
    vertex_of_json.fail("each of " + std::to_string(vertices) + " vertices");
  field.base.mesh.triangles = std::move(split.mesh.triangles);
  for (auto& t : field.base.mesh.triangles)
    for (std::uint32_t& v : t) v = vertex_of[v];
  field.base.uv = std::move(split.uv);
  field.base.texture = std::move(split.texture);

  field.adds_base = extension.at("addsBase").boolean();
  const JsonReader up = extension.at("up");
  if (up.array_size(3) != 3) up.fail("three numbers");
  for (std::size_t i = 0; i < 3; ++i) field.up[std::ptrdiff_t(i)] = float(up.at(i).number(-1.001, 1.001));
  field.nodes = file.vectors3(glb_index(extension.at("nodes")));
  if (field.nodes.size() > std::size_t(kMaxNodes)) extension.at("nodes").fail("at most 255 nodes");
  if (extension.has("slots")) {
    const std::string_view slots = file.view(glb_index(extension.at("slots")));
    if (slots.size() != vertices) extension.at("slots").fail("a byte for each vertex");
    field.slot.assign(slots.begin(), slots.end());
  }
  if (extension.has("reflection")) {
    const JsonReader json = extension.at("reflection");
    LightFieldReflection& r = field.reflection.emplace();
    const std::string_view normals = file.view(glb_index(json.at("normals")));
    if (normals.size() != 3 * vertices) json.at("normals").fail("three bytes for each vertex");
    for (std::size_t v = 0; v < vertices; ++v) {
      const auto part = [&](std::size_t c) { return float(std::int8_t(normals[3 * v + c])); };
      const Eigen::Vector3f n(part(0), part(1), part(2));
      if (n.isZero()) json.at("normals").fail("normals that are not zero");
      r.normals.push_back(n.normalized());
    }
    if (version <= kWithoutStrength) {
      r.strength.assign(vertices, 255);
    } else {
      const std::string_view strength = file.view(glb_index(json.at("strength")));
      if (strength.size() != vertices) json.at("strength").fail("a byte for each vertex");
      r.strength.assign(strength.begin(), strength.end());
      r.strength_scale = scale_of(json.at("strengthScale"));
      const JsonReader center = json.at("center");
      if (center.array_size(3) != 3) center.fail("three numbers");
      for (std::size_t i = 0; i < 3; ++i) r.center[std::ptrdiff_t(i)] = float(center.at(i).number(-1e30, 1e30));
      r.inverse_radius = float(json.at("inverseRadius").number(0, 1e30));
    }
    r.light = file.texture(glb_index(json.at("light")));
    r.grazing = file.texture_like(r.light, glb_index(json.at("grazing")));
    r.light_scale = scale_of(json.at("lightScale"));
    r.grazing_scale = scale_of(json.at("grazingScale"));
  }
  const JsonReader terms = extension.at("terms");
  const std::size_t count = terms.array_size(std::size_t(kMaxTerms));
  for (std::size_t k = 0; k < count; ++k) {
    const JsonReader json = terms.at(k);
    LightFieldTerm term;
    const JsonReader surface = json.at("surface");
    const std::size_t maps = surface.array_size(std::size_t(kMaxSlots));
    if (map_bytes(field, vertices, count, maps) > kMostMapBytes) terms.fail("maps of at most 4 GB when unpacked");
    for (std::size_t i = 0; i < maps; ++i)
      term.surface.push_back(file.texture_like(field.base.texture, glb_index(surface.at(i))));
    term.surface_scale = scale_of(json.at("surfaceScale"));
    term.view_scale = scale_of(json.at("viewScale"));
    const std::string_view packed = file.view(glb_index(json.at("view")));
    const std::size_t size = vertices * field.nodes.size();
    if (size / kMostInflation <= packed.size()) term.view.resize(size);
    if (term.view.empty() || !inflate(packed, term.view))
      json.at("view").fail("zlib data of " + std::to_string(size) + " bytes, undamaged");
    from_differences(term.view, vertices);
    field.terms.push_back(std::move(term));
  }
  validate(field, file.name());
  return field;
}

}  // namespace

std::string encode_light_field(const LightField& field, const LightFieldFileOptions& options) {
  validate(field, "light field");
  if (options.texture_quality < 0 || options.texture_quality > 100 || options.map_quality < 0 ||
      options.map_quality > 100)
    throw Error(ErrorCode::invalid_argument, "texture_quality, map_quality: expected 0 (PNG) to 100");
  if (!field.terms.empty() && map_bytes(field, field.base.mesh.vertices.size(), field.terms.size(),
                                        field.terms[0].surface.size()) > kMostMapBytes)
    throw Error(ErrorCode::unsupported, "a light field with maps of more than 4 GB");
  GlbBuffer buffer;
  const FileVertices file = split_vertices(field.base);
  Json document = textured_document(field.base, file, {.jpeg_quality = options.texture_quality}, buffer);

  const std::vector<std::uint32_t> used = used_vertices(field.base.mesh);
  std::vector<std::uint32_t> renumbered(field.base.mesh.vertices.size(), 0), vertex_of;
  for (std::uint32_t i = 0; i < used.size(); ++i) renumbered[used[i]] = i;
  for (const std::uint32_t v : file.vertex) vertex_of.push_back(renumbered[v]);
  const bool narrow = used.size() <= 65535;
  const std::vector<std::uint16_t> narrow_of(narrow ? vertex_of.begin() : vertex_of.end(), vertex_of.end());
  const std::size_t of_view = narrow ? buffer.add_view(narrow_of.data(), narrow_of.size() * 2)
                                     : buffer.add_view(vertex_of.data(), vertex_of.size() * 4);
  Json extension = {{"version", field.reflection ? kVersionWithReflection : kVersion},
                    {"vertices", used.size()},
                    {"vertexOf", buffer.add_accessor({{"bufferView", of_view},
                                                      {"componentType", narrow ? kUnsignedShort : kUnsignedInt},
                                                      {"count", vertex_of.size()},
                                                      {"type", "SCALAR"}})},
                    {"addsBase", field.adds_base},
                    {"up", {field.up.x(), field.up.y(), field.up.z()}},
                    {"nodes", buffer.add_vectors(field.nodes, false, 0)}};
  std::size_t maps = 1;  // without those of slots that only vertices without triangles are in
  if (!field.slot.empty()) {
    std::vector<std::uint8_t> slots;
    for (const std::uint32_t v : used) slots.push_back(field.slot[v]);
    extension["slots"] = buffer.add_view(slots.data(), slots.size());
    maps = std::size_t(*std::max_element(slots.begin(), slots.end())) + 1;
  }
  const auto add_picture = [&](const std::string& picture, bool jpeg) {
    document["images"].push_back({{"bufferView", buffer.add_view(picture.data(), picture.size())},
                                  {"mimeType", jpeg ? "image/jpeg" : "image/png"}});
    document["textures"].push_back({{"source", document["images"].size() - 1}, {"sampler", 0}});
    return document["textures"].size() - 1;
  };
  if (field.reflection) {
    std::vector<std::int8_t> normals;
    for (const std::uint32_t v : used)
      for (int c = 0; c < 3; ++c) normals.push_back(std::int8_t(std::lround(127 * field.reflection->normals[v][c])));
    const LightFieldReflection& r = *field.reflection;
    std::vector<std::uint8_t> strength;
    for (const std::uint32_t v : used) strength.push_back(r.strength[v]);
    extension["reflection"] = {{"normals", buffer.add_view(normals.data(), normals.size())},
                               {"strength", buffer.add_view(strength.data(), strength.size())},
                               {"strengthScale", scale_json(r.strength_scale)},
                               {"center", {r.center.x(), r.center.y(), r.center.z()}},
                               {"inverseRadius", r.inverse_radius},
                               {"light", add_picture(encode_png(field.reflection->light), false)},
                               {"lightScale", scale_json(field.reflection->light_scale)},
                               {"grazing", add_picture(encode_png(field.reflection->grazing), false)},
                               {"grazingScale", scale_json(field.reflection->grazing_scale)}};
  }
  extension["terms"] = Json::array();
  for (const LightFieldTerm& term : field.terms) {
    Json surface = Json::array();
    for (const Image& map : std::span(term.surface).first(maps)) {
      const bool jpeg = options.map_quality > 0;
      surface.push_back(add_picture(jpeg ? encode_jpeg(map, options.map_quality) : encode_png(map), jpeg));
    }
    std::vector<std::uint8_t> view;
    view.reserve(used.size() * field.nodes.size());
    for (std::size_t i = 0; i < field.nodes.size(); ++i)
      for (const std::uint32_t v : used) view.push_back(term.view[i * field.base.mesh.vertices.size() + v]);
    to_differences(view, used.size());
    const std::string packed = deflated(view);
    extension["terms"].push_back({{"surface", surface},
                                  {"surfaceScale", scale_json(term.surface_scale)},
                                  {"view", buffer.add_view(packed.data(), packed.size())},
                                  {"viewScale", scale_json(term.view_scale)}});
  }
  document["extensionsUsed"].push_back(kExtension);
  document["meshes"][0]["primitives"][0]["extensions"] = {{kExtension, std::move(extension)}};
  return pack_glb(std::move(document), buffer);
}

std::uint64_t write_light_field(const std::filesystem::path& file, const LightField& field,
                                const LightFieldFileOptions& options) {
  const std::string bytes = encode_light_field(field, options);
  write_file(file, bytes);
  return bytes.size();
}

bool has_light_field(const std::filesystem::path& path) { return has_extension(GlbFile(path).primitive()); }

LightField read_light_field(const std::filesystem::path& path) { return light_field_of(GlbFile(path)); }

LightField decode_light_field(std::string bytes, const std::string& name) {
  return light_field_of(GlbFile(std::move(bytes), name));
}

}  // namespace lumihull::slf
