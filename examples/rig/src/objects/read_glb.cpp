#include "read_glb.h"

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::rig {

namespace {

using Eigen::Matrix4f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using Json = nlohmann::json;
using Pointer = Json::json_pointer;

constexpr int kMostNodes = 100'000, kDeepest = 100;
constexpr std::size_t kMostTriangles = 20'000'000;  ///< nodes may show the same mesh again and again

enum : int { kU8 = 5121, kU16 = 5123, kU32 = 5125, kFloat = 5126, kTriangles = 4 };

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : name_(file.string()), bytes_(read_file(file)) { split(); }

  Object read() {
    Object object;
    const Pointer scene = Pointer("/scenes") / index(Pointer("/scene"), 0);
    const Json& roots = need(scene / "nodes", "a list of nodes");
    if (!roots.is_array()) fail(scene / "nodes", "a list of nodes");
    for (std::size_t i = 0; i < roots.size(); ++i)
      add_node(object, index(scene / "nodes" / i), Matrix4f::Identity(), 0);
    if (object.mesh.triangles.empty()) fail(scene, "a scene with triangles");
    return object;
  }

 private:
  struct Accessor {
    const char* data = nullptr;
    std::size_t count = 0, stride = 0;
    int component = 0;
  };

  [[noreturn]] void fail(const Pointer& at, const std::string& expected) const {
    throw Error(ErrorCode::bad_input, at.to_string() + ": expected " + expected, name_);
  }

  std::uint32_t word(std::size_t at) const {
    std::uint32_t w = 0;
    if (at + 4 > bytes_.size()) throw Error(ErrorCode::bad_input, "the file ends within a chunk's header", name_);
    std::memcpy(&w, bytes_.data() + at, 4);
    return w;
  }

  void split() {
    if (bytes_.size() < 20 || word(0) != 0x46546c67 || word(4) != 2)
      throw Error(ErrorCode::bad_input, "expected a binary glTF 2.0 file", name_);
    const std::size_t length = word(12);
    if (word(16) != 0x4e4f534a || length > bytes_.size() - 20)
      throw Error(ErrorCode::bad_input, "expected a JSON chunk first, within the file", name_);
    json_ = Json::parse(bytes_.begin() + 20, bytes_.begin() + 20 + std::ptrdiff_t(length), nullptr, false);
    if (!json_.is_object()) throw Error(ErrorCode::bad_input, "expected an object in the JSON chunk", name_);
    const std::size_t next = 20 + length;
    if (next == bytes_.size()) return;
    const std::size_t size = word(next);
    if (word(next + 4) != 0x004e4942 || size > bytes_.size() - next - 8)
      throw Error(ErrorCode::bad_input, "expected a binary chunk second, within the file", name_);
    binary_ = std::string_view(bytes_).substr(next + 8, size);
  }

  const Json* find(const Pointer& at) const { return json_.contains(at) ? &json_[at] : nullptr; }
  const Json& need(const Pointer& at, const char* expected) const {
    const Json* json = find(at);
    if (!json) fail(at, expected);
    return *json;
  }
  std::size_t index(const Pointer& at) const {
    const Json& json = need(at, "an index");
    constexpr std::size_t kMost = std::size_t(1) << 40;  // beyond it sums could overflow
    if (!json.is_number_unsigned() || json.get<std::size_t>() > kMost) fail(at, "an index");
    return json.get<std::size_t>();
  }
  std::size_t index(const Pointer& at, std::size_t otherwise) const { return find(at) ? index(at) : otherwise; }
  float number(const Pointer& at, float low, float high, float otherwise) const {
    const Json* json = find(at);
    if (!json) return otherwise;
    const double v = json->is_number() ? json->get<double>() : NAN;
    if (!(v >= low && v <= high)) fail(at, "a number from " + std::to_string(low) + " to " + std::to_string(high));
    return float(v);
  }
  template <int N>
  Eigen::Matrix<float, N, 1> numbers(const Pointer& at, const Eigen::Matrix<float, N, 1>& otherwise) const {
    const Json* json = find(at);
    if (!json) return otherwise;
    Eigen::Matrix<float, N, 1> v;
    const bool list = json->is_array() && json->size() == std::size_t(N);
    for (int i = 0; list && i < N; ++i)
      v[i] = (*json)[std::size_t(i)].is_number() ? (*json)[std::size_t(i)].template get<float>() : NAN;
    if (!list || !v.allFinite()) fail(at, std::to_string(N) + " finite numbers");
    return v;
  }

  std::string_view view(const Pointer& at) const {
    if (index(at / "buffer") != 0 || find(Pointer("/buffers/0/uri"))) fail(at / "buffer", "the file's own buffer");
    const std::size_t offset = index(at / "byteOffset", 0), length = index(at / "byteLength");
    if (offset > binary_.size() || length > binary_.size() - offset) fail(at, "bytes within the binary chunk");
    return binary_.substr(offset, length);
  }

  Accessor accessor(std::size_t i, const char* type, std::size_t values, std::initializer_list<int> components) const {
    const Pointer at = Pointer("/accessors") / i;
    Accessor a;
    a.component = int(index(at / "componentType"));
    if (std::find(components.begin(), components.end(), a.component) == components.end())
      fail(at / "componentType", "another type of numbers");
    if (need(at / "type", type) != type) fail(at / "type", type);
    if (find(at / "sparse")) fail(at / "sparse", "none");
    a.count = index(at / "count");
    const std::size_t one = values * (a.component == kU8 ? 1 : a.component == kU16 ? 2 : 4);
    const Pointer from = Pointer("/bufferViews") / index(at / "bufferView");
    const std::string_view bytes = view(from);
    a.stride = index(from / "byteStride", one);
    const std::size_t offset = index(at / "byteOffset", 0);
    if (a.stride < one || a.stride > 252 + one) fail(from / "byteStride", "at least an element, at most 252");
    if (offset > bytes.size() || a.count > (std::size_t(1) << 31) ||
        (a.count > 0 && (a.count - 1) * a.stride + one > bytes.size() - offset))
      fail(at / "count", "as many elements as the buffer view holds");
    a.data = bytes.data() + offset;
    return a;
  }

  void add_node(Object& object, std::size_t i, const Matrix4f& parent, int depth) {
    const Pointer at = Pointer("/nodes") / i;
    if (!need(at, "a node").is_object()) fail(at, "a node");
    if (depth > kDeepest || ++nodes_ > kMostNodes) fail(at, "a tree of nodes");
    Matrix4f m = parent;
    if (find(at / "matrix")) {
      const Eigen::Matrix<float, 16, 1> v = numbers<16>(at / "matrix", Eigen::Matrix<float, 16, 1>::Zero());
      m = parent * Eigen::Map<const Matrix4f>(v.data());
    } else {
      const Eigen::Vector4f q = numbers<4>(at / "rotation", {0, 0, 0, 1});
      Eigen::Affine3f t = Eigen::Affine3f::Identity();
      t.translate(numbers<3>(at / "translation", {0, 0, 0}))
          .rotate(Eigen::Quaternionf(q[3], q[0], q[1], q[2]).normalized())
          .scale(numbers<3>(at / "scale", {1, 1, 1}));
      m = parent * t.matrix();
    }
    if (find(at / "mesh")) {
      const Pointer primitives = Pointer("/meshes") / index(at / "mesh") / "primitives";
      const std::size_t n = need(primitives, "a list of primitives").size();
      for (std::size_t k = 0; k < n; ++k) add_primitive(object, primitives / k, m);
    }
    const Json* children = find(at / "children");
    for (std::size_t k = 0; children && k < children->size(); ++k)
      add_node(object, index(at / "children" / k), m, depth + 1);
  }

  void add_primitive(Object& object, const Pointer& at, const Matrix4f& m) {
    if (index(at / "mode", kTriangles) != kTriangles) return;  // points and lines have no surface
    const Accessor place = accessor(index(at / "attributes" / "POSITION"), "VEC3", 3, {kFloat});
    std::vector<std::uint32_t> vertex(place.count);
    for (std::size_t i = 0; i < place.count; ++i) {
      std::array<float, 3> p;
      std::memcpy(p.data(), place.data + i * place.stride, sizeof p);
      const Eigen::Vector4f world = m * Eigen::Vector4f(p[0], p[1], p[2], 1);
      if (!world.allFinite()) fail(at / "attributes" / "POSITION", "finite coordinates");
      const auto [it, added] =
          places_.try_emplace(std::array{world.x(), world.y(), world.z()}, std::uint32_t(object.mesh.vertices.size()));
      if (added) object.mesh.vertices.push_back(world.head<3>());
      vertex[i] = it->second;
    }
    const int look = material(object, at);
    std::optional<Accessor> uv, indices;
    if (find(at / "attributes" / "TEXCOORD_0"))
      uv = accessor(index(at / "attributes" / "TEXCOORD_0"), "VEC2", 2, {kFloat});
    if (uv && uv->count < place.count) fail(at / "attributes" / "TEXCOORD_0", "as many as positions");
    if (!uv && !object.textures[std::size_t(look)].empty())
      fail(at / "attributes" / "TEXCOORD_0", "coordinates for the material's texture");
    if (find(at / "indices")) indices = accessor(index(at / "indices"), "SCALAR", 1, {kU8, kU16, kU32});
    const std::size_t corners = indices ? indices->count : place.count;
    if (corners % 3 != 0) fail(at, "three corners a triangle");
    if (object.mesh.triangles.size() + corners / 3 > kMostTriangles || object.mesh.vertices.size() > 3 * kMostTriangles)
      fail(at, "a scene of at most 20 million triangles");
    for (std::size_t c = 0; c < corners; c += 3) {
      std::array<std::uint32_t, 3> t;
      std::array<Vector2f, 3> coordinates;
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t i = std::uint32_t(c + k);
        if (indices) {
          i = 0;
          std::memcpy(&i, indices->data + (c + k) * indices->stride,
                      indices->component == kU8    ? 1
                      : indices->component == kU16 ? 2
                                                   : 4);
        }
        if (i >= place.count) fail(at / "indices", "indices below the number of positions");
        t[k] = vertex[i];
        std::array<float, 2> st{};
        if (uv) std::memcpy(st.data(), uv->data + i * uv->stride, sizeof st);
        if (!std::isfinite(st[0]) || !std::isfinite(st[1])) fail(at / "attributes" / "TEXCOORD_0", "finite numbers");
        coordinates[k] = {st[0], 1 - st[1]};  // glTF's v goes down
      }
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      object.mesh.triangles.push_back(t);
      object.uv.push_back(coordinates);
      object.material_of.push_back(std::uint16_t(look));
    }
  }

  /// The number of a primitive's material among the object's.
  int material(Object& object, const Pointer& primitive) {
    const std::size_t none = std::size_t(-1), i = index(primitive / "material", none);
    if (const auto known = materials_.find(i); known != materials_.end()) return known->second;
    const int number_here = int(materials_.size());
    Material look;
    if (number_here >= 60'000) fail(primitive / "material", "fewer materials");
    Image texture;
    const Pointer at = Pointer("/materials") / (i == none ? 0 : i), pbr = at / "pbrMetallicRoughness";
    Eigen::Vector4f base(1, 1, 1, 1);
    float metallic = 1, rough = 1;
    if (i != none) {
      need(at, "a material");
      base = numbers<4>(pbr / "baseColorFactor", base);
      metallic = number(pbr / "metallicFactor", 0, 1, 1), rough = number(pbr / "roughnessFactor", 0, 1, 1);
      if (find(pbr / "baseColorTexture")) {
        const Pointer source = Pointer("/textures") / index(pbr / "baseColorTexture" / "index") / "source";
        const Pointer image = Pointer("/images") / index(source);
        const std::string_view bytes = view(Pointer("/bufferViews") / index(image / "bufferView"));
        texture =
            converted(decode_image(std::as_bytes(std::span(bytes)), name_ + " " + image.to_string()), PixelType::u8, 3);
      }
    } else {
      metallic = 0;
    }
    const Vector3f color = base.head<3>().cwiseMax(0).cwiseMin(1);
    look.grain = 0;
    look.colors[0] = (1 - metallic) * color;
    look.reflectance = .04f + metallic * (Vector3f(.2126f, .7152f, .0722f).dot(color) - .04f);
    look.roughness = std::max(.05f, rough);
    if (number_here > 0)
      object.others.push_back(look);
    else
      object.material = look;
    object.textures.push_back(std::move(texture));
    materials_.emplace(i, number_here);
    return number_here;
  }

  std::string name_, bytes_;
  std::string_view binary_;
  Json json_;
  std::map<std::array<float, 3>, std::uint32_t> places_;
  std::map<std::size_t, int> materials_;  ///< number by its index in the file
  int nodes_ = 0;
};

}  // namespace

Object read_glb(const std::filesystem::path& file) { return Reader(file).read(); }

}  // namespace lumihull::rig
