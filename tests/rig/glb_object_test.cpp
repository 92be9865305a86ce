#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/rig/object.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

using Eigen::Vector3f;
using Json = nlohmann::json;

/// A tetrahedron of two primitives: one red and rough, the other with a texture, on a node that is moved and turned.
struct Tetrahedron {
  std::string binary;
  Json json;

  Tetrahedron() {
    const auto add = [&](const void* data, std::size_t bytes) {
      const std::size_t offset = binary.size();
      binary.append(static_cast<const char*>(data), bytes);
      binary.resize((binary.size() + 3) / 4 * 4);
      json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}});
    };
    const float places[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, uv[] = {0, 0, 1, 0, 0, 1, 1, 1};
    const std::uint16_t red[] = {0, 2, 1, 0, 1, 3}, picture[] = {0, 3, 2, 1, 2, 3};
    add(places, sizeof places), add(uv, sizeof uv), add(red, sizeof red), add(picture, sizeof picture);
    Image image(2, 2, 3);
    for (int i = 0; i < 12; ++i) image.row<std::uint8_t>(i / 6)[i % 6] = std::uint8_t(20 * i);
    const std::string png = encode_png(image);
    add(png.data(), png.size());
    json["asset"] = {{"version", "2.0"}};
    json["buffers"] = {{{"byteLength", binary.size()}}};
    const auto accessor = [](int view, int type, int count, const char* kind) {
      return Json{{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", kind}};
    };
    json["accessors"] = {accessor(0, 5126, 4, "VEC3"), accessor(1, 5126, 4, "VEC2"), accessor(2, 5123, 6, "SCALAR"),
                         accessor(3, 5123, 6, "SCALAR")};
    json["images"] = {{{"bufferView", 4}, {"mimeType", "image/png"}}};
    json["textures"] = {{{"source", 0}}};
    json["materials"] = {{{"pbrMetallicRoughness",
                           {{"baseColorFactor", {.8, .1, .05, 1}}, {"metallicFactor", 0}, {"roughnessFactor", .7}}}},
                         {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 1}}}}};
    json["meshes"] = {{{"primitives",
                        {{{"attributes", {{"POSITION", 0}}}, {"indices", 2}, {"material", 0}},
                         {{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"indices", 3}, {"material", 1}}}}}};
    json["nodes"] = {{{"children", {1}}, {"translation", {5, 6, 7}}}, {{"mesh", 0}, {"scale", {2, 2, 2}}}};
    json["scenes"] = {{{"nodes", {0}}}};
    json["scene"] = 0;
  }

  std::string bytes() const {
    std::string text = json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    const auto word = [&](std::size_t v) {
      const std::uint32_t w = std::uint32_t(v);
      out.append(reinterpret_cast<const char*>(&w), 4);
    };
    word(2), word(28 + text.size() + binary.size()), word(text.size());
    out += "JSON" + text;
    word(binary.size());
    return out + std::string("BIN\0", 4) + binary;
  }
};

class GlbObject : public testing::Test {
 protected:
  std::string refusal(const std::string& bytes) {
    write_file(file_, bytes);
    const Error e = test::expect_error([&] { object_by_name(file_.string(), 1); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_NE(std::string(e.what()).find("tetrahedron.glb"), std::string::npos) << e.what();
    return e.what();
  }
  test::TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "tetrahedron.glb";
};

TEST_F(GlbObject, HasItsMaterialsAndStandsUpright) {
  write_file(file_, Tetrahedron().bytes());
  const Object object = object_by_name(file_.string(), 1);
  EXPECT_EQ(object.mesh.vertices.size(), 4u);  // one place of both primitives is one vertex
  EXPECT_EQ(object.mesh.triangles.size(), 4u);
  EXPECT_GT(hull::enclosed_volume(object.mesh), 0);
  const auto [low, high] = bounding_box(object.mesh);
  EXPECT_NEAR((high - low).maxCoeff(), 1, 1e-6);
  EXPECT_NEAR(low.z(), 0, 1e-6);
  EXPECT_EQ(object.material_of, (std::vector<std::uint16_t>{0, 0, 1, 1}));
  EXPECT_LT((object.material.colors[0] - Vector3f(.8f, .1f, .05f)).norm(), 1e-6);
  EXPECT_NEAR(object.material.roughness, .7, 1e-6);
  EXPECT_NEAR(object.material.reflectance, .04, 1e-6);
  ASSERT_EQ(object.others.size(), 1u);
  EXPECT_NEAR(object.others[0].reflectance, 1, 1e-6);  // white metal
  ASSERT_EQ(object.textures.size(), 2u);
  EXPECT_TRUE(object.textures[0].empty());
  EXPECT_EQ(object.textures[1].width(), 2);
  // It can be photographed.
  Job job;
  const Scene scene = make_scene(object, kGreenPaint, false, 1);
  const Photographer photographer(scene, test::coarse_light(), job);
  const Photo photo = photographer.photograph(test::view_of(scene, default_camera(60), 1), {}, 1, job);
  int covered = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x) covered += photo.mask.row<std::uint8_t>(y)[x] == 255;
  EXPECT_GT(covered, 50);
}

TEST_F(GlbObject, WhatIsWrongIsNamed) {
  const std::string good = Tetrahedron().bytes();
  for (std::size_t n = 0; n < good.size(); n += 7) refusal(good.substr(0, n));
  const auto with = [](const char* at, const Json& value) {
    Tetrahedron t;
    t.json[Json::json_pointer(at)] = value;
    return t.bytes();
  };
  struct Case {
    const char* at;
    Json value;
    const char* named;
  };
  for (const Case& c : {Case{"/accessors/0/count", 5, "/accessors/0/count"},
                        {"/accessors/2/componentType", 5126, "/accessors/2/componentType"},
                        {"/accessors/0/type", "VEC2", "/accessors/0/type"},
                        {"/bufferViews/0/byteOffset", 1'000'000, "/bufferViews/0"},
                        {"/bufferViews/0/byteLength", -1, "/bufferViews/0/byteLength"},
                        {"/meshes/0/primitives/0/material", 9, "/materials/9"},
                        {"/nodes/1/children", Json::array({0}), "/nodes/"},  // a circle
                        {"/nodes/1/mesh", 3, "/meshes/3/primitives"},
                        {"/nodes/0/translation", Json::array({1, "x", 2}), "/nodes/0/translation"},
                        {"/materials/0/pbrMetallicRoughness/roughnessFactor", 7, "roughnessFactor"},
                        {"/scene", "zero", "/scene"},
                        {"/scenes/0/nodes", Json::array({std::uint64_t(-1)}), "/scenes/0/nodes/0"},
                        {"/meshes/0/primitives/0/indices", std::uint64_t(-1), "/primitives/0/indices"}}) {
    SCOPED_TRACE(c.at);
    EXPECT_NE(refusal(with(c.at, c.value)).find(c.named), std::string::npos);
  }
  Tetrahedron wild;
  const std::size_t view = wild.json["bufferViews"][2]["byteOffset"];
  wild.binary[view] = 100;
  EXPECT_NE(refusal(wild.bytes()).find("/meshes/0/primitives/0/indices"), std::string::npos);
}

}  // namespace
}  // namespace lumihull::rig
