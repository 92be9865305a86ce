#include <lumihull/rig/object.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <set>
#include <unordered_set>
#include <vector>

#include "objects/repaint.h"
#include "support.h"

namespace lumihull::rig {
namespace {

/// 2 - 2 genus for a closed, oriented 2-manifold in one piece; fails the test where an edge has not exactly two sides.
int euler_characteristic(const hull::Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : sides) {
    if (count != 1 || !sides.contains({edge.second, edge.first})) {
      ADD_FAILURE() << "edge " << edge.first << " " << edge.second
                    << " is not shared by two triangles of one orientation";
      break;
    }
  }
  return int(mesh.vertices.size()) - int(sides.size() / 2) + int(mesh.triangles.size());
}

TEST(Shapes, AreClosedOrientedAndOfTheSizeAsked) {
  struct Case {
    Object object;
    int genus;
  };
  const Case cases[] = {{make_vase(.6, 60), 1}, {make_bust(.6, 60), 0}, {make_statue(.6, 80), 3},
                        {make_gate(.6, 80), 4}, {make_box(.6), 0},      {make_sphere(.6, 3), 0},
                        {make_pebble(.6, 4), 0}};
  for (const auto& [object, genus] : cases) {
    SCOPED_TRACE(object.name);
    EXPECT_EQ(euler_characteristic(object.mesh), 2 - 2 * genus);
    EXPECT_GT(hull::enclosed_volume(object.mesh), .001);
    const auto [low, high] = bounding_box(object.mesh);
    EXPECT_NEAR((high - low).maxCoeff(), .6, 1e-5);
    EXPECT_NEAR(low.z(), 0, 1e-6);
  }
}

TEST(Shapes, StandInsAreOnePieceOfTheTablesSize) {
  struct Case {
    Object object;
    double width, depth, height;  ///< of the paper's table 1, m
  };
  for (const auto& [object, width, depth, height] :
       {Case{make_snowmobile(2.8), 2.8, 1.0, 1.3}, Case{make_deer(1.0), .6, .8, 1.0}}) {
    SCOPED_TRACE(object.name);
    const auto [low, high] = bounding_box(object.mesh);
    EXPECT_NEAR((high - low).x() / width, 1, .04);
    EXPECT_NEAR((high - low).y() / depth, 1, .04);
    EXPECT_NEAR((high - low).z() / height, 1, .04);
    EXPECT_GT(object.mesh.triangles.size(), 100'000u);
    EXPECT_LT(object.mesh.triangles.size(), 300'000u);
    // Closed: each side of a triangle has one that goes the other way.
    std::unordered_set<std::uint64_t> sides;
    for (const auto& t : object.mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(sides.insert(std::uint64_t(t[k]) << 32 | t[(k + 1) % 3]).second);
    for (const std::uint64_t side : sides) ASSERT_TRUE(sides.contains(side << 32 | side >> 32));
    // In one piece: from any vertex to the first.
    std::vector<std::uint32_t> parent(object.mesh.vertices.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t v) {
      while (parent[v] != v) v = parent[v] = parent[parent[v]];
      return v;
    };
    for (const auto& t : object.mesh.triangles) parent[root(t[0])] = root(t[1]), parent[root(t[1])] = root(t[2]);
    std::size_t pieces = 0;
    for (std::uint32_t v = 0; v < parent.size(); ++v) pieces += parent[v] == v;
    EXPECT_EQ(pieces, 1u);
    // Its materials are all to be seen.
    std::set<int> seen;
    for (std::size_t i = 0; i < object.mesh.vertices.size(); i += 7)
      seen.insert(object.material_at(object.mesh.vertices[i] / (high - low).maxCoeff()));
    EXPECT_EQ(*seen.begin(), 0);
    EXPECT_EQ(seen.size(), object.others.size() + 1);
    EXPECT_EQ(*seen.rbegin(), int(object.others.size()));
  }
}

TEST(Shapes, FormulasGiveNormalsThatPointOutwards) {
  const Object vase = make_vase(.6, 60);
  const auto by_area = hull::vertex_normals(vase.mesh);
  ASSERT_EQ(vase.normals.size(), vase.mesh.vertices.size());
  double sum = 0;
  for (std::size_t i = 0; i < by_area.size(); ++i) sum += by_area[i].dot(vase.normals[i]);
  EXPECT_GT(sum / double(by_area.size()), .98);
}

TEST(Shapes, SphereIsOne) {
  const Object sphere = make_sphere(.5, 5);
  EXPECT_EQ(sphere.mesh.triangles.size(), 20u << 10);
  for (const auto& v : sphere.mesh.vertices) ASSERT_NEAR((v - Eigen::Vector3f(0, 0, .25f)).norm(), .25, 1e-6);
  // Inscribed: smaller, by no more than a layer of the flattest triangle's sagitta (edge .018, e² / (8 r) times the
  // area).
  const double ball = 4. / 3 * M_PI * .25 * .25 * .25, volume = hull::enclosed_volume(sphere.mesh);
  EXPECT_LT(volume, ball);
  EXPECT_GT(volume, ball * (1 - 1e-3));
}

TEST(Shapes, PebbleIsItsFormula) {
  using Eigen::Vector3d;
  const double size = .6;
  const Object pebble = make_pebble(size, 5);
  EXPECT_EQ(pebble.mesh.triangles.size(), 20u << 10);
  const auto by_area = hull::vertex_normals(pebble.mesh);
  ASSERT_EQ(pebble.normals.size(), pebble.mesh.vertices.size());
  std::size_t on_the_hump = 0;
  for (std::size_t i = 0; i < pebble.normals.size(); ++i) {
    const Vector3d p = pebble.mesh.vertices[i].cast<double>() / size, n = pebble.normals[i].cast<double>();
    Vector3d gradient, differences;
    ASSERT_NEAR(pebble_function(p, &gradient), 0, 5e-6);  // floats hold a place to 6e-8, the gradient is up to 8
    for (int k = 0; k < 3; ++k) {
      const Vector3d h = 1e-5 * Vector3d::Unit(k);
      differences[k] = (pebble_function(p + h) - pebble_function(p - h)) / 2e-5;
    }
    ASSERT_LT((gradient - differences).norm(), 1e-6 * gradient.norm());
    ASSERT_LT((n - differences.normalized()).norm(), 1e-5);
    ASSERT_GT(n.dot(by_area[i].cast<double>()), .999);
    // Off the ellipsoid that it is elsewhere.
    on_the_hump += p.cwiseQuotient(Vector3d(.5, .4, .33)).squaredNorm() - 2 * p.z() / .33 > 1e-3;
  }
  EXPECT_GT(on_the_hump, pebble.normals.size() / 20);
  EXPECT_LT(on_the_hump, pebble.normals.size() / 2);
  // Convex: a chord's middle lies inside. Points in steps that meet all sides.
  const std::size_t n = pebble.normals.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d a = pebble.mesh.vertices[i].cast<double>(), b = pebble.mesh.vertices[i * 7919 % n].cast<double>();
    if (i != i * 7919 % n) {
      ASSERT_LT(pebble_function((a + b) / (2 * size)), 1e-6);
    }
  }
  EXPECT_EQ(test::expect_error([] { make_pebble(1, 0); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([] { make_pebble(1, 9); }).code(), ErrorCode::invalid_argument);
}

class MeshFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    const auto file = folder_ / "object.obj";
    std::ofstream(file, std::ios::binary) << text;
    Image picture(4, 4, 3);
    write_png(folder_ / "object.png", picture);
    return file;
  }
  Object read(const std::string& text) { return read_object(write(text), folder_ / "object.png", 1, true); }

  test::TemporaryFolder folder_;
  const std::string vertices_ = "v 0 0 0\nv 2 0 0\nv 2 0 2\nv 0 1 2\n";
};

TEST_F(MeshFile, TextureCoordinatesRunBesideTheTriangles) {
  const Object o = read(vertices_ + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2/7 3/3 -1/-1\nf 1/4 3/3 2/2\n");
  ASSERT_EQ(o.mesh.triangles.size(), 3u);
  ASSERT_EQ(o.uv.size(), 3u);
  EXPECT_EQ(o.uv[1][0], Eigen::Vector2f(0, 0));
  EXPECT_EQ(o.uv[1][1], Eigen::Vector2f(1, 1));
  EXPECT_EQ(o.uv[1][2], Eigen::Vector2f(0, 1));
  EXPECT_EQ(o.uv[2][0], Eigen::Vector2f(0, 1));
  // y up becomes z up, standing at 0, one metre long.
  const auto [low, high] = bounding_box(o.mesh);
  EXPECT_NEAR(high.z(), .5, 1e-6);
  EXPECT_EQ(low.z(), 0);
}

TEST_F(MeshFile, HostileOnesAreErrorsThatNameTheFile) {
  const std::string uv = "vt 0 0\nvt 1 0\nvt 1 1\n";
  for (const std::string& bad : {
           vertices_ + uv + "f 1 2 3\n",         // no coordinates
           vertices_ + uv + "f 1/1 2/2 3/4\n",   // beyond the list
           vertices_ + uv + "f 1/1 2/2 3/-4\n",  // before it
           vertices_ + uv + "f 1/0 2/2 3/3\n",   // counted from 1
           vertices_ + uv + "f 1/1 2/2 3/99999999999999999999999\n",
           vertices_ + uv + "f 1/1 2/2 3/x\n",
           vertices_ + uv + "f 1//1 2//2 3//3\n",
           vertices_ + uv + "f 1/1 2/2 3/\n",
           vertices_ + "vt nan 0\nvt 0 0\nf 1/1 2/1 3/1\n",
           vertices_ + "vt 1e30 0\nvt 0 0\nf 1/1 2/1 3/1\n",
           vertices_ + "vt 0\nf 1/1 2/1 3/1\n",
           vertices_ + uv + "f 1/1 2/2 9/3\n",                                           // a vertex that is not there
           std::string("v 1 1 1\nv 1 1 1\nv 1 1 1\n") + uv + "f 1/1 2/2 3/3\n",          // no extent
           std::string("v 0 0 0\nv 1e-42 0 0\nv 0 1e-42 0\n") + uv + "f 1/1 2/2 3/3\n",  // one that can't be enlarged
           vertices_ + uv,                                                               // no face
           std::string(),
       }) {
    SCOPED_TRACE(bad);
    const Error error = test::expect_error([&] { read(bad); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_NE(error.subject().find("object.obj"), std::string::npos) << error.what();
  }
}

TEST_F(MeshFile, NamesAreCheckedFirst) {
  EXPECT_EQ(test::expect_error([] { object_by_name("teapot", 1); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([] { object_by_name("vase", -1); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { object_by_name((folder_ / "absent.obj").string(), 1); }).code(),
            ErrorCode::not_found);
}

TEST(Shapes, ARealTexturedMeshIsRead) {
  LUMIHULL_NEED_REAL_DATA(spot, "spot");
  const Object object = object_by_name((spot / "spot.obj").string(), .5);
  EXPECT_EQ(object.uv.size(), object.mesh.triangles.size());
  EXPECT_EQ(object.texture.channels(), 3);
  EXPECT_EQ(euler_characteristic(object.mesh), 2);
}

// What a session is told of an object's looks holds for each of its materials.
TEST(Shapes, RepaintedAllOver) {
  Object object = make_box(1);
  object.others = {object.material, object.material};
  object.material.reflectance = .04f, object.others[0].reflectance = .5f, object.others[1].reflectance = .9f;
  const Object matt = repainted(object, {.matt = true});
  ASSERT_EQ(matt.others.size(), 2u);
  EXPECT_EQ(matt.material.reflectance + matt.others[0].reflectance + matt.others[1].reflectance, 0);
  const Object unlit = repainted(object, {.unlit = std::array<std::uint8_t, 3>{255, 0, 0}, .exposure = 2});
  EXPECT_TRUE(unlit.others.empty() && unlit.material.unlit);
  EXPECT_FLOAT_EQ(unlit.material.colors[0][0], .5f);
  const Object uniform = repainted(object, {.uniform = true});
  EXPECT_TRUE(uniform.others.empty() && uniform.material.pattern == Pattern::plain);
}

}  // namespace
}  // namespace lumihull::rig
