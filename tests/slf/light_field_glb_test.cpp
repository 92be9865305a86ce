#include <lumihull/base/files.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "LUMIHULL_surface_light_field";

/// A small light field of made-up numbers; every triangle with texture coordinates of its own.
slf::LightField made_up(bool slots) {
  slf::LightField field;
  field.base.mesh = test::sphere(5);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  for (std::size_t i = 0; i < field.base.mesh.triangles.size(); ++i)
    field.base.uv.push_back({Eigen::Vector2f(unit(random), unit(random)), Eigen::Vector2f(unit(random), unit(random)),
                             Eigen::Vector2f(unit(random), unit(random))});
  const auto picture = [&] {
    Image image(20, 12, 3);
    for (std::size_t i = 0; i < image.bytes(); ++i) image.data()[i] = std::byte(random() % 256);
    return image;
  };
  field.base.texture = picture();
  field.up = Eigen::Vector3f(0, 0.6f, 0.8f);
  field.nodes = {{1, 2, 3}, {-4, 5, 6}, {7, -8, 9}};
  if (!slots) {
    auto& r = field.reflection.emplace();
    for (const auto& v : field.base.mesh.vertices) {
      r.normals.push_back(v.normalized());
      r.strength.push_back(std::uint8_t(random() % 256));
    }
    r.center = {0.25f, -0.5f, 0.125f}, r.inverse_radius = 0.0625f, r.strength_scale = {3, 0.5f};
    r.light = r.grazing = Image(5, 5, 3);
    for (std::size_t i = 0; i < r.light.bytes(); ++i)
      r.light.data()[i] = std::byte(random() % 256), r.grazing.data()[i] = std::byte(random() % 256);
    r.light_scale = {0.75f, -0.125f}, r.grazing_scale = {2, -1};
  }
  std::size_t maps = 1;
  if (slots) {  // every vertex apart from its neighbours
    field.adds_base = false;
    field.slot.assign(field.base.mesh.vertices.size(), 0xFF);
    for (std::size_t v = 0; v < field.slot.size(); ++v) {
      std::uint8_t slot = 0;
      for (bool taken = true; taken; ++slot) {
        taken = false;
        for (const auto& t : field.base.mesh.triangles)
          for (int j = 0; j < 3; ++j)
            if (t[j] == v) taken |= field.slot[t[(j + 1) % 3]] == slot || field.slot[t[(j + 2) % 3]] == slot;
      }
      field.slot[v] = std::uint8_t(slot - 1);
    }
    maps = std::size_t(*std::max_element(field.slot.begin(), field.slot.end())) + 1;
  }
  for (int k = 0; k < 2; ++k) {
    slf::LightFieldTerm term;
    for (std::size_t i = 0; i < maps; ++i) term.surface.push_back(picture());
    term.surface_scale = {0.5f + float(k), -0.25f};
    term.view_scale = {6, -3};
    for (std::size_t i = 0; i < field.nodes.size() * field.base.mesh.vertices.size(); ++i)
      term.view.push_back(std::uint8_t(random() % 256));
    field.terms.push_back(std::move(term));
  }
  return field;
}

void expect_equal(const Image& a, const Image& b) {
  ASSERT_EQ(a.width(), b.width());
  ASSERT_EQ(a.height(), b.height());
  ASSERT_EQ(a.bytes(), b.bytes());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.bytes()), 0);
}

struct Parts {
  json document;
  std::string binary;
};

Parts parts_of(const std::string& glb) {
  std::uint32_t length;
  std::memcpy(&length, glb.data() + 12, 4);
  return {json::parse(glb.substr(20, length)), glb.substr(28 + length)};
}

std::string joined(const Parts& parts) {
  std::string text = parts.document.dump(), glb = "glTF";
  text.append((4 - text.size() % 4) % 4, ' ');
  const auto u32 = [&](std::size_t value) {
    const auto v = std::uint32_t(value);
    glb.append(reinterpret_cast<const char*>(&v), 4);
  };
  u32(2), u32(28 + text.size() + parts.binary.size()), u32(text.size());
  glb += "JSON" + text;
  u32(parts.binary.size());
  return glb + std::string("BIN\0", 4) + parts.binary;
}

json& extension_of(json& document) { return document["meshes"][0]["primitives"][0]["extensions"][kExtension]; }

TEST(LightFieldGlb, ComesBackAsItWas) {
  const test::TemporaryFolder folder;
  for (const bool slots : {false, true}) {
    const slf::LightField field = made_up(slots);
    const auto bytes = slf::write_light_field(folder / "a.glb", field, {.texture_quality = 0, .map_quality = 0});
    EXPECT_EQ(bytes, std::filesystem::file_size(folder / "a.glb"));
    const slf::LightField back = slf::read_light_field(folder / "a.glb");
    EXPECT_EQ(back.base.mesh.vertices, field.base.mesh.vertices);
    EXPECT_EQ(back.base.mesh.triangles, field.base.mesh.triangles);
    EXPECT_EQ(back.base.uv, field.base.uv);
    expect_equal(back.base.texture, field.base.texture);
    EXPECT_EQ(back.nodes, field.nodes);
    EXPECT_EQ(back.up, field.up);
    EXPECT_EQ(back.slot, field.slot);
    EXPECT_EQ(back.adds_base, field.adds_base);
    ASSERT_EQ(back.terms.size(), 2u);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(back.terms[k].view, field.terms[k].view);
      EXPECT_EQ(back.terms[k].surface_scale.scale, field.terms[k].surface_scale.scale);
      EXPECT_EQ(back.terms[k].view_scale.offset, field.terms[k].view_scale.offset);
      ASSERT_EQ(back.terms[k].surface.size(), field.terms[k].surface.size());
      for (std::size_t i = 0; i < back.terms[k].surface.size(); ++i)
        expect_equal(back.terms[k].surface[i], field.terms[k].surface[i]);
    }
    ASSERT_EQ(back.reflection.has_value(), !slots);
    if (!slots) {
      expect_equal(back.reflection->light, field.reflection->light);
      expect_equal(back.reflection->grazing, field.reflection->grazing);
      EXPECT_EQ(back.reflection->strength, field.reflection->strength);
      EXPECT_EQ(back.reflection->strength_scale.scale, field.reflection->strength_scale.scale);
      EXPECT_EQ(back.reflection->center, field.reflection->center);
      EXPECT_EQ(back.reflection->inverse_radius, field.reflection->inverse_radius);
      EXPECT_EQ(back.reflection->light_scale.offset, field.reflection->light_scale.offset);
      EXPECT_EQ(back.reflection->grazing_scale.scale, field.reflection->grazing_scale.scale);
      for (std::size_t v = 0; v < back.reflection->normals.size(); ++v)  // three bytes each
        EXPECT_LT((back.reflection->normals[v] - field.reflection->normals[v]).norm(), 0.01f);
    }
    EXPECT_EQ(slf::encode_light_field(back, {.texture_quality = 0, .map_quality = 0}),
              slf::encode_light_field(field, {.texture_quality = 0, .map_quality = 0}));
  }
}

TEST(LightFieldGlb, IsAPlainModelForWhoKnowsNoLightField) {
  const test::TemporaryFolder folder;
  const slf::LightField field = made_up(false);
  slf::write_light_field(folder / "a.glb", field, {.texture_quality = 0});
  const slf::TexturedMesh plain = slf::read_glb(folder / "a.glb");
  EXPECT_EQ(plain.mesh.triangles.size(), field.base.mesh.triangles.size());
  expect_equal(plain.texture, field.base.texture);
  const Parts parts = parts_of(read_file(folder / "a.glb"));
  EXPECT_FALSE(parts.document.contains("extensionsRequired"));
  EXPECT_THAT(parts.document["extensionsUsed"].get<std::vector<std::string>>(),
              testing::UnorderedElementsAre("KHR_materials_unlit", kExtension));
  EXPECT_EQ(parts.document["materials"].size(), 1u);
}

TEST(LightFieldGlb, WhatTheFormatAsksOfAFileHoldsForWhatTheExtensionAdds) {
  for (const bool slots : {false, true})
    for (const int quality : {0, 60}) {
      const Parts parts = parts_of(slf::encode_light_field(made_up(slots), {.map_quality = quality}));
      const json& d = parts.document;
      for (const json& view : d["bufferViews"]) {
        EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);  // all components fit into it
        EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), parts.binary.size());
      }
      for (const json& accessor : d["accessors"]) {
        const std::size_t component = accessor["componentType"] == 5123 ? 2 : 4;
        const std::size_t components = accessor["type"] == "VEC3" ? 3 : accessor["type"] == "VEC2" ? 2 : 1;
        EXPECT_EQ(d["bufferViews"].at(accessor["bufferView"].get<std::size_t>())["byteLength"],
                  accessor["count"].get<std::size_t>() * component * components);
      }
      EXPECT_EQ(d["textures"].size(), d["images"].size());
      for (const json& texture : d["textures"]) {
        EXPECT_LT(texture["sampler"].get<std::size_t>(), d["samplers"].size());
        const json& image = d["images"].at(texture["source"].get<std::size_t>());
        const json& view = d["bufferViews"].at(image["bufferView"].get<std::size_t>());
        const bool png = parts.binary.substr(view["byteOffset"].get<std::size_t>(), 4) == "\x89PNG";
        EXPECT_EQ(image["mimeType"], png ? "image/png" : "image/jpeg");
        const std::size_t i = std::size_t(&texture - &d["textures"][0]);
        // The texture itself is a JPEG here; what is mirrored never is.
        EXPECT_EQ(png, i > 0 && (quality == 0 || (!slots && i < 3)));
      }
    }
}

TEST(LightFieldGlb, LeavesOutVerticesThatNobodyUsesAndTheirMaps) {
  for (const bool slots : {false, true}) {
    slf::LightField field = made_up(slots);
    const std::size_t n = field.base.mesh.vertices.size(), nodes = field.nodes.size();
    const slf::LightField before = field;
    field.base.mesh.vertices.push_back({9, 9, 9});
    if (slots) field.slot.push_back(std::uint8_t(field.terms[0].surface.size()));
    if (field.reflection) field.reflection->normals.push_back({0, 0, 1}), field.reflection->strength.push_back(0);
    for (auto& term : field.terms) {
      if (slots) term.surface.push_back(term.surface[0]);
      std::vector<std::uint8_t> longer;
      for (std::size_t i = 0; i < nodes; ++i) {
        longer.insert(longer.end(), term.view.begin() + std::ptrdiff_t(i * n),
                      term.view.begin() + std::ptrdiff_t((i + 1) * n));
        longer.push_back(77);
      }
      term.view = longer;
    }
    EXPECT_EQ(slf::encode_light_field(field), slf::encode_light_field(before)) << slots;
  }
}

TEST(LightFieldGlb, WrongCountsAndSizesAreNamed) {
  const test::TemporaryFolder folder;
  const std::string good = slf::encode_light_field(made_up(true), {.texture_quality = 0, .map_quality = 0});
  const auto expect_refused = [&](const std::string& what, const std::function<void(json&)>& spoil) {
    Parts parts = parts_of(good);
    spoil(parts.document);
    write_file(folder / "bad.glb", joined(parts));
    const Error e = test::expect_error([&] { slf::read_light_field(folder / "bad.glb"); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input) << what;
    EXPECT_THAT(std::string(e.what()), testing::HasSubstr("bad.glb")) << what;
  };
  const auto in_extension = [&](const std::string& what, const std::function<void(json&)>& spoil) {
    expect_refused(what, [&](json& d) { spoil(extension_of(d)); });
  };
  in_extension("more vertices than there are", [](json& e) { e["vertices"] = 1000; });
  in_extension("fewer vertices", [](json& e) { e["vertices"] = e["vertices"].get<int>() - 1; });
  in_extension("no vertices", [](json& e) { e["vertices"] = 0; });
  in_extension("a negative count", [](json& e) { e["vertices"] = -5; });
  in_extension("another accessor", [](json& e) { e["vertexOf"] = e["nodes"]; });
  in_extension("no such accessor", [](json& e) { e["vertexOf"] = 4000; });
  in_extension("nodes of another type", [](json& e) { e["nodes"] = e["vertexOf"]; });
  in_extension("no nodes", [](json& e) { e.erase("nodes"); });
  in_extension("up of two numbers", [](json& e) { e["up"] = {0, 1}; });
  in_extension("up without length", [](json& e) { e["up"] = {0, 0, 0}; });
  in_extension("addsBase is no truth value", [](json& e) { e["addsBase"] = 1; });
  in_extension("slots elsewhere", [](json& e) { e["slots"] = 0; });
  in_extension("slots left out", [](json& e) { e.erase("slots"); });
  in_extension("terms are no array", [](json& e) { e["terms"] = 3; });
  in_extension("too many terms", [](json& e) { e["terms"] = std::vector<json>(13, e["terms"][0]); });
  in_extension("a map too few", [](json& e) { e["terms"][0]["surface"].erase(0); });
  in_extension("no such texture", [](json& e) { e["terms"][0]["surface"][0] = 99; });
  in_extension("view maps elsewhere", [](json& e) { e["terms"][1]["view"] = 0; });
  in_extension("scale is a text", [](json& e) { e["terms"][1]["viewScale"]["scale"] = "big"; });
  in_extension("scale without end", [](json& e) { e["terms"][1]["surfaceScale"]["scale"] = 1e300; });
  expect_refused("no extension", [](json& d) { d["meshes"][0]["primitives"][0].erase("extensions"); });
  Parts newer = parts_of(good);
  extension_of(newer.document)["version"] = 4;
  write_file(folder / "newer.glb", joined(newer));
  EXPECT_EQ(test::expect_error([&] { slf::read_light_field(folder / "newer.glb"); }).code(), ErrorCode::unsupported);
}

TEST(LightFieldGlb, SmallFilesOfLargeMapsAreRefusedBeforeTheyAreUnpacked) {
  const slf::LightField field = made_up(false);
  const std::string good = slf::encode_light_field(field, {.texture_quality = 0, .map_quality = 0});
  const auto refusal = [&](const std::function<void(Parts&)>& spoil) {
    Parts parts = parts_of(good);
    spoil(parts);
    const Error e = test::expect_error([&] { slf::decode_light_field(joined(parts), "in memory"); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_THAT(e.subject(), testing::HasSubstr("in memory"));
    return e.message();
  };
  // Three bytes of zlib for a view map of 3 nodes x 5000 vertices.
  EXPECT_THAT(refusal([](Parts& p) {
                json& e = extension_of(p.document);
                json& d = p.document;
                const auto add = [&](std::size_t bytes, std::size_t count, int component, const char* type) {
                  d["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", p.binary.size()}, {"byteLength", bytes}});
                  d["accessors"].push_back({{"bufferView", d["bufferViews"].size() - 1},
                                            {"componentType", component},
                                            {"count", count},
                                            {"type", type}});
                  p.binary.append(bytes, '\0');
                  return d["accessors"].size() - 1;
                };
                e.erase("reflection");
                json& primitive = d["meshes"][0]["primitives"][0];
                primitive["attributes"]["POSITION"] = add(60000, 5000, 5126, "VEC3");
                primitive["attributes"]["TEXCOORD_0"] = add(40000, 5000, 5126, "VEC2");
                e["vertexOf"] = add(20000, 5000, 5125, "SCALAR");
                for (std::uint32_t i = 0; i < 5000; ++i) std::memcpy(&p.binary[p.binary.size() - 20000 + 4 * i], &i, 4);
                e["vertices"] = 5000;
                d["bufferViews"][e["terms"][0]["view"].get<std::size_t>()]["byteLength"] = 3;
              }),
              testing::HasSubstr("zlib data of 15000 bytes"));
  // A surface map that says that it is larger than the texture.
  EXPECT_THAT(refusal([&](Parts& p) {
                const std::string large = encode_png(Image(3000, 2000, 3));
                p.document["bufferViews"].push_back(
                    {{"buffer", 0}, {"byteOffset", p.binary.size()}, {"byteLength", large.size()}});
                p.document["images"][3]["bufferView"] = p.document["bufferViews"].size() - 1;
                p.binary += large + std::string((4 - large.size() % 4) % 4, '\0');
              }),
              testing::HasSubstr("expected 20 x 12 pixels, found 3000 x 2000"));
  // 12 x 16 surface maps of 24 MB: the file needs to hold but one.
  EXPECT_THAT(refusal([&](Parts& p) {
                const std::string large = encode_png(Image(4000, 2000, 3));
                p.document["bufferViews"].push_back(
                    {{"buffer", 0}, {"byteOffset", p.binary.size()}, {"byteLength", large.size()}});
                p.document["images"][0]["bufferView"] = p.document["bufferViews"].size() - 1;
                p.binary += large + std::string((4 - large.size() % 4) % 4, '\0');
                json term = extension_of(p.document)["terms"][0];
                term["surface"] = std::vector<int>(16, 0);
                extension_of(p.document)["terms"] = std::vector<json>(12, term);
              }),
              testing::HasSubstr("maps of at most 4 GB"));
}

TEST(LightFieldGlb, DamagedFilesAreRefusedOrRead) {
  const test::TemporaryFolder folder;
  const std::string good = slf::encode_light_field(made_up(false), {.texture_quality = 0, .map_quality = 0});
  std::mt19937 random(3);
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string bad = good;
    if (i % 4 == 0)
      bad.resize(random() % good.size());
    else
      for (int k = 0; k < 1 + i % 5; ++k) bad[random() % bad.size()] = char(random() % 256);
    write_file(folder / "bad.glb", bad);
    try {
      slf::validate(slf::read_light_field(folder / "bad.glb"), "read");
    } catch (const Error& e) {
      ++refused;
      EXPECT_NE(e.code(), ErrorCode::out_of_memory);
    }
  }
  EXPECT_GT(refused, 150);
}

TEST(LightFieldGlb, FieldsThatDoNotFitTogetherAreNotWritten) {
  slf::LightField field = made_up(false);
  field.terms[1].view.pop_back();
  const Error e = test::expect_error([&] { slf::encode_light_field(field); });
  EXPECT_EQ(e.code(), ErrorCode::bad_input);
  EXPECT_THAT(e.message(), testing::HasSubstr("term 1"));
  EXPECT_EQ(test::expect_error([&] { slf::encode_light_field(made_up(false), {.map_quality = 101}); }).code(),
            ErrorCode::invalid_argument);
}

TEST(LightFieldGlb, WrongReflectionsAreNamed) {
  const std::string good = slf::encode_light_field(made_up(false), {.texture_quality = 0, .map_quality = 0});
  const auto expect_refused = [&](const std::string& place, const std::function<void(json&)>& spoil) {
    Parts parts = parts_of(good);
    spoil(extension_of(parts.document)["reflection"]);
    const Error e = test::expect_error([&] { slf::decode_light_field(joined(parts), "bad.glb"); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input) << place;
    EXPECT_THAT(std::string(e.what()), testing::HasSubstr("bad.glb")) << place;
    EXPECT_THAT(std::string(e.what()), testing::HasSubstr(place));
  };
  expect_refused("reflection/normals", [](json& r) { r["normals"] = 0; });
  expect_refused("bufferViews", [](json& r) { r["normals"] = 100000; });
  expect_refused("square", [](json& r) { r["light"] = 0, r["grazing"] = 0; });
  expect_refused("expected 5 x 5", [](json& r) { r["grazing"] = 0; });
  expect_refused("\"light\"", [](json& r) { r.erase("light"); });
  expect_refused("reflection/strength", [](json& r) { r["strength"] = 0; });
  expect_refused("reflection/center", [](json& r) { r["center"] = {1, 2}; });
  expect_refused("inverseRadius", [](json& r) { r["inverseRadius"] = -1; });
  expect_refused("does not hold all vertices", [](json& r) { r["inverseRadius"] = 1000; });
  expect_refused("grazingScale/scale", [](json& r) { r["grazingScale"]["scale"] = 1e9; });

  // Version 2 knew one strength and lamps far away only.
  Parts old = parts_of(good);
  json& extension = extension_of(old.document);
  ASSERT_EQ(extension["version"], 3);
  extension["version"] = 2;
  for (const char* key : {"strength", "strengthScale", "center", "inverseRadius"}) extension["reflection"].erase(key);
  const slf::LightField before = slf::decode_light_field(joined(old), "old.glb");
  EXPECT_EQ(before.reflection->inverse_radius, 0);
  for (const std::uint8_t s : before.reflection->strength)
    EXPECT_EQ(before.reflection->strength_scale.scale * float(s) / 255 + before.reflection->strength_scale.offset, 1);

  slf::LightField field = made_up(false);
  field.reflection->normals[3] *= 2;
  EXPECT_THAT(test::expect_error([&] { slf::encode_light_field(field); }).message(), testing::HasSubstr("unit length"));
  field.reflection->normals.pop_back();
  EXPECT_THAT(test::expect_error([&] { slf::encode_light_field(field); }).message(), testing::HasSubstr("each vertex"));
}

}  // namespace
}  // namespace lumihull
