#include <lumihull/base/files.h>
#include <lumihull/slf/glb.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using nlohmann::json;

/// A sphere whose triangles have texture coordinates of their own.
slf::TexturedMesh textured_sphere(int steps) {
  slf::TexturedMesh t;
  t.mesh = test::sphere(steps);
  for (const auto& corners : t.mesh.triangles) {
    std::array<Eigen::Vector2f, 3> uv;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3f& v = t.mesh.vertices[corners[i]];
      uv[i] = {0.5f + 0.4f * v.x(), v.y() > 0 ? 0.1f : 0.9f};
    }
    t.uv.push_back(uv);
  }
  t.texture = Image(32, 16, 3);
  for (std::size_t i = 0; i < t.texture.bytes(); ++i) t.texture.data()[i] = std::byte(i * 7 % 251);
  return t;
}

std::uint32_t u32(const std::string& bytes, std::size_t at) {
  std::uint32_t v;
  std::memcpy(&v, bytes.data() + at, 4);
  return v;
}

struct Parsed {
  json document;
  std::string binary;
};

/// Checks the container (glTF 2.0, 4.4) and takes it apart, without the library's own reader.
Parsed parsed(const std::string& glb) {
  Parsed p;
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(u32(glb, 4), 2u);
  EXPECT_EQ(u32(glb, 8), glb.size());
  const std::uint32_t json_length = u32(glb, 12);
  EXPECT_EQ(glb.substr(16, 4), "JSON");
  EXPECT_EQ(json_length % 4, 0u);
  p.document = json::parse(glb.substr(20, json_length));
  const std::size_t at = 20 + json_length;
  EXPECT_EQ(u32(glb, at) % 4, 0u);
  EXPECT_EQ(glb.substr(at + 4, 4), std::string("BIN\0", 4));
  p.binary = glb.substr(at + 8);
  EXPECT_EQ(p.binary.size(), u32(glb, at));
  return p;
}

void check_structure(const Parsed& p, std::size_t triangles) {
  const json& d = p.document;
  EXPECT_EQ(d["asset"]["version"], "2.0");
  EXPECT_EQ(d["extensionsUsed"], json({"KHR_materials_unlit"}));
  EXPECT_FALSE(d.contains("extensionsRequired"));
  EXPECT_EQ(d["buffers"][0]["byteLength"], p.binary.size());
  for (const json& view : d["bufferViews"]) {
    EXPECT_EQ(std::size_t(view["byteOffset"]) % 4, 0u);
    EXPECT_LE(std::size_t(view["byteOffset"]) + std::size_t(view["byteLength"]), p.binary.size());
  }
  const json& primitive = d["meshes"][0]["primitives"][0];
  const json& positions = d["accessors"][int(primitive["attributes"]["POSITION"])];
  const json& indices = d["accessors"][int(primitive["indices"])];
  EXPECT_EQ(indices["count"], 3 * triangles);
  EXPECT_EQ(d["accessors"][int(primitive["attributes"]["TEXCOORD_0"])]["count"], positions["count"]);

  const char* at = p.binary.data() + std::size_t(d["bufferViews"][int(positions["bufferView"])]["byteOffset"]);
  Eigen::Vector3f low(9, 9, 9), high(-9, -9, -9);
  for (std::size_t i = 0; i < positions["count"]; ++i) {
    Eigen::Vector3f v;
    std::memcpy(v.data(), at + 12 * i, 12);
    low = low.cwiseMin(v), high = high.cwiseMax(v);
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(float(positions["min"][i]), low[i]);
    EXPECT_EQ(float(positions["max"][i]), high[i]);
  }
  const json& index_view = d["bufferViews"][int(indices["bufferView"])];
  const std::size_t size = indices["componentType"] == 5123 ? 2 : 4;
  EXPECT_EQ(index_view["byteLength"], 3 * triangles * size);
  std::uint32_t largest = 0;
  for (std::size_t i = 0; i < 3 * triangles; ++i) {
    std::uint32_t index = 0;
    std::memcpy(&index, p.binary.data() + std::size_t(index_view["byteOffset"]) + size * i, size);
    largest = std::max(largest, index);
  }
  EXPECT_EQ(largest + 1, positions["count"]);
}

TEST(Glb, HasTheStructureThatTheFormatAsksFor) {
  const slf::TexturedMesh small = textured_sphere(20);
  Parsed p = parsed(slf::encode_glb(small));
  check_structure(p, small.mesh.triangles.size());
  EXPECT_EQ(p.document["accessors"][int(p.document["meshes"][0]["primitives"][0]["indices"])]["componentType"], 5123);
  EXPECT_EQ(p.document["images"][0]["mimeType"], "image/jpeg");

  const slf::TexturedMesh large = textured_sphere(190);
  p = parsed(slf::encode_glb(large, {.jpeg_quality = 0, .normals = true}));
  check_structure(p, large.mesh.triangles.size());
  EXPECT_EQ(p.document["accessors"][int(p.document["meshes"][0]["primitives"][0]["indices"])]["componentType"], 5125);
  EXPECT_EQ(p.document["images"][0]["mimeType"], "image/png");
}

TEST(Glb, ReadsWhatItWrote) {
  const test::TemporaryFolder folder;
  const slf::TexturedMesh t = textured_sphere(20);
  for (const bool normals : {false, true}) {
    const auto bytes = slf::write_glb(folder / "a.glb", t, {.jpeg_quality = 0, .normals = normals});
    EXPECT_EQ(bytes, std::filesystem::file_size(folder / "a.glb"));
    const slf::TexturedMesh back = slf::read_glb(folder / "a.glb");
    EXPECT_EQ(std::memcmp(back.texture.data(), t.texture.data(), t.texture.bytes()), 0);
    ASSERT_EQ(back.mesh.triangles.size(), t.mesh.triangles.size());
    for (std::size_t i = 0; i < t.uv.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(back.uv[i][k], t.uv[i][k]);
        ASSERT_EQ(back.mesh.vertices[back.mesh.triangles[i][k]], t.mesh.vertices[t.mesh.triangles[i][k]]);
      }
  }
}

TEST(Glb, ATruncatedOrAlteredFileIsAnErrorThatNamesIt) {
  const test::TemporaryFolder folder;
  const std::string good = slf::encode_glb(textured_sphere(4), {.jpeg_quality = 0});
  const auto file = folder / "bad.glb";
  for (std::size_t length = 0; length < good.size(); length += 1 + length / 16) {
    write_file(file, good.substr(0, length));
    const Error e = test::expect_error([&] { slf::read_glb(file); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input) << length;
    EXPECT_NE(std::string(e.what()).find("bad.glb"), std::string::npos) << e.what();
  }
  // Any one number of the JSON replaced by a huge or negative one: an error, or a file that is still valid; never a
  // crash.
  const std::size_t json_length = u32(good, 12);
  for (std::size_t i = 20; i < 20 + json_length; ++i) {
    if (!std::isdigit(good[i]) || std::isdigit(good[i - 1])) continue;
    for (const char* number : {"-1", "4294967295", "1e300", "\"x\""}) {
      std::size_t end = i;
      while (std::isdigit(good[end])) ++end;
      std::string bad = good.substr(0, i) + number + good.substr(end);
      while ((bad.size() - good.size() + json_length) % 4) bad.insert(bad.rfind('}', 20 + json_length) + 1, " ");
      const auto total = std::uint32_t(bad.size()), length = std::uint32_t(json_length + bad.size() - good.size());
      std::memcpy(bad.data() + 8, &total, 4);
      std::memcpy(bad.data() + 12, &length, 4);
      write_file(file, bad);
      try {
        slf::read_glb(file);
      } catch (const Error& e) {
        EXPECT_NE(e.code(), ErrorCode::internal) << e.what();
      }
    }
  }
}

TEST(Glb, Faults) {
  slf::TexturedMesh t = textured_sphere(4);
  EXPECT_EQ(test::expect_error([&] { slf::encode_glb(t, {.jpeg_quality = 101}); }).code(), ErrorCode::invalid_argument);
  t.uv.pop_back();
  EXPECT_EQ(test::expect_error([&] { slf::encode_glb(t); }).code(), ErrorCode::bad_input);
  for (const int axis : {0, 1})
    for (const float outside : {std::nanf(""), -0.01f, 1.01f}) {
      t = textured_sphere(4);
      t.uv[5][1][axis] = outside;
      EXPECT_EQ(test::expect_error([&] { slf::encode_glb(t); }).code(), ErrorCode::bad_input) << axis << outside;
    }
  t = textured_sphere(4);
  t.mesh.triangles.clear(), t.uv.clear();
  EXPECT_EQ(test::expect_error([&] { slf::encode_glb(t); }).code(), ErrorCode::degenerate);
  EXPECT_EQ(test::expect_error([&] { slf::read_glb("/nowhere/at/all.glb"); }).code(), ErrorCode::not_found);
}

}  // namespace
}  // namespace lumihull
