#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/ray_scene.h>
#include <support.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>

namespace lumihull {
namespace {

using namespace hull;

Mesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(Mesh, ReadsWhatItWrites) {
  const test::TemporaryFolder folder;
  Mesh mesh = tetrahedron();
  mesh.vertices[1].x() = 0.1f + 1e-7f;
  mesh.vertices[2].y() = -1.17549435e-38f;
  for (const char* name : {"a.ply", "a.obj"}) {
    write_mesh(folder / name, mesh);
    const Mesh back = read_mesh(folder / name);
    EXPECT_EQ(back.vertices, mesh.vertices) << name;
    EXPECT_EQ(back.triangles, mesh.triangles) << name;
  }
  EXPECT_EQ(test::expect_error([&] { write_mesh(folder / "a.stl", mesh); }).code(), ErrorCode::invalid_argument);
}

TEST(Mesh, ReadsTheKindsOfPlyAndObj) {
  const test::TemporaryFolder folder;
  write_file(folder / "ascii.ply",
             "ply\r\nformat ascii 1.0\r\ncomment x\r\nelement vertex 4\r\nproperty double x\r\nproperty float nx\r\n"
             "property double y\r\nproperty double z\r\nelement face 1\r\nproperty list uchar int vertex_index\r\n"
             "property uchar red\r\nend_header\r\n0 9 0 0\r\n1 9 0 0\r\n1 9 1 0\r\n0 9 1e0 0\r\n4 0 1 2 3 255\r\n");
  const Mesh ascii = read_mesh(folder / "ascii.ply");
  ASSERT_EQ(ascii.triangles.size(), 2u);
  EXPECT_EQ(ascii.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(ascii.vertices[2], Eigen::Vector3f(1, 1, 0));

  std::string big =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar ushort vertex_indices\nend_header\n";
  for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 2.5f, 0.f}) {
    char raw[4];
    std::memcpy(raw, &value, 4);
    for (int i = 3; i >= 0; --i) big += raw[i];
  }
  big += std::string("\3\0\0\0\1\0\2", 7);
  write_file(folder / "big.ply", big);
  EXPECT_EQ(read_mesh(folder / "big.ply").vertices[2], Eigen::Vector3f(0, 2.5f, 0));
  EXPECT_EQ(read_mesh(folder / "big.ply").triangles.size(), 1u);

  write_file(folder / "a.obj", "# c\no x\nv 0 0 0 1\nv 1 0 0\r\nvn 0 0 1\nv 1 1 0\nv 0 1 0\nf 1/1/1 2//1 -2 4/7\n");
  EXPECT_EQ(read_mesh(folder / "a.obj").triangles.size(), 2u);
  EXPECT_EQ(read_mesh(folder / "a.obj").triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
}

TEST(Mesh, RefusesHostileFiles) {
  const test::TemporaryFolder folder;
  const std::string head = "ply\nformat binary_little_endian 1.0\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string faces = "property list uchar int vertex_indices\n";
  const std::string bad[] = {
      "",
      "ply",
      "plx\n",
      "ply\nend_header\n",
      head + "element vertex 18446744073709551615\n" + xyz + "end_header\n",
      head + "element vertex 1000000000\n" + xyz + "end_header\n0123456789ab",
      head + "element vertex -1\n" + xyz + "end_header\n",
      head + "element vertex 5\nend_header\n",
      head + "element junk 4000000000\nproperty list uint char a\nend_header\n\1\2\3\4",
      head + "element vertex 1\n" + xyz + "element face 1\n" + faces + "end_header\n" + std::string(12, '\0') +
          "\3\0\0",
      head + "element vertex 1\n" + xyz + "element face 1\n" + faces + "end_header\n" + std::string(12, '\0') +
          std::string("\3\0\0\0\0\0\0\0\0\7\0\0\0", 13),
      head + "element vertex 1\n" + xyz + "element face 1\n" + faces + "end_header\n" + std::string(12, '\0') +
          std::string("\3\0\0\0\0\0\0\0\0\377\377\377\377", 13),
      head + "element face 1\nproperty list int int vertex_indices\nend_header\n\377\377\377\377",
      "ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + "end_header\n0 nan 0\n",
      "ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "end_header\n0 0 0 1 1\n",
      "ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + "element face 1\n" + faces + "end_header\n0 0 0 2 0 0\n"};
  for (const std::string& text : bad) {
    write_file(folder / "bad.ply", text);
    const Error error = test::expect_error([&] { read_mesh(folder / "bad.ply"); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input) << text;
    EXPECT_EQ(error.subject(), (folder / "bad.ply").string());
  }
  for (const char* text : {"v 0 0\n", "v 0 0 x\n", "v 0 0 0\nf 1 1\n", "v 0 0 0\nf 1 1 2\n", "v 0 0 0\nf 0 1 1\n",
                           "v 0 0 0\nf -2 1 1\n", "v 0 0 0\nf 1 1 99999999999999999999\n", "v inf 0 0\n"}) {
    write_file(folder / "bad.obj", text);
    EXPECT_EQ(test::expect_error([&] { read_mesh(folder / "bad.obj"); }).code(), ErrorCode::bad_input) << text;
  }
  EXPECT_EQ(test::expect_error([&] { read_mesh(folder / "none.ply"); }).code(), ErrorCode::not_found);
}

TEST(Mesh, NormalsAndVolume) {
  const Mesh mesh = tetrahedron();
  EXPECT_NEAR(enclosed_volume(mesh), 1.0 / 6, 1e-7);
  const auto normals = vertex_normals(mesh);
  // At the corner: the three faces' areas are the same, their normals the negative axes.
  EXPECT_TRUE(normals[0].isApprox(Eigen::Vector3f::Constant(-std::sqrt(1 / 3.f)), 1e-6f));
  Mesh far = mesh;
  for (auto& v : far.vertices) v += Eigen::Vector3f(4096, -4096, 1024);
  EXPECT_NEAR(enclosed_volume(far), 1.0 / 6, 1e-6);
}

TEST(MeshCheck, TellsWhatIsWrong) {
  EXPECT_TRUE(check_mesh(tetrahedron()).good());
  EXPECT_EQ(check_mesh(tetrahedron()).euler, 2);
  Mesh open = tetrahedron();
  open.triangles.pop_back();
  EXPECT_FALSE(check_mesh(open).closed);
  Mesh flipped = tetrahedron();
  std::swap(flipped.triangles[0][0], flipped.triangles[0][1]);
  EXPECT_TRUE(check_mesh(flipped).closed);
  EXPECT_FALSE(check_mesh(flipped).oriented);
  // Two tetrahedra that share a vertex only: every edge is fine, the vertex is not.
  Mesh pinched = tetrahedron();
  for (const Eigen::Vector3f& v : {Eigen::Vector3f(-1, 0, 0), Eigen::Vector3f(0, -1, 0), Eigen::Vector3f(0, 0, -1)})
    pinched.vertices.push_back(v);
  for (const auto& t : {std::array<std::uint32_t, 3>{0, 4, 5}, {0, 6, 4}, {0, 5, 6}, {4, 6, 5}})
    pinched.triangles.push_back(t);
  EXPECT_TRUE(check_mesh(pinched).closed);
  EXPECT_FALSE(check_mesh(pinched).manifold);
  Mesh flat = tetrahedron();
  flat.vertices[3] = {0.5f, 0.5f, 0};
  EXPECT_GT(check_mesh(flat, false).degenerate_triangles, 0u);
  // Two tetrahedra through each other.
  Mesh crossing = tetrahedron();
  const Mesh other = tetrahedron();
  for (const auto& v : other.vertices) crossing.vertices.push_back(v + Eigen::Vector3f(0.1f, 0.12f, 0.15f));
  for (auto t : other.triangles) crossing.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  const MeshCheck check = check_mesh(crossing);
  EXPECT_TRUE(check.good());
  EXPECT_EQ(check.parts, 2u);
  if (check.self_intersections) {
    EXPECT_GT(*check.self_intersections, 0u);
  }
  EXPECT_FALSE(check_mesh({}).closed);
}

/// Every triangle, one by one (Möller & Trumbore 1997), in double.
Hit brute_force(const Mesh& mesh, const Ray& ray) {
  Hit best;
  double nearest = ray.t_far;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), e1 = mesh.vertices[t[1]].cast<double>() - a,
                          e2 = mesh.vertices[t[2]].cast<double>() - a, d = ray.direction.cast<double>();
    const Eigen::Vector3d p = d.cross(e2), s = ray.origin.cast<double>() - a, q = s.cross(e1);
    const double det = e1.dot(p), u = s.dot(p) / det, v = d.dot(q) / det, at = e2.dot(q) / det;
    if (u < 0 || v < 0 || u + v > 1 || at < ray.t_near || at > nearest) continue;
    nearest = at;
    best = {i, float(at), float(u), float(v)};
  }
  return best;
}

TEST(RayScene, AgreesWithBruteForce) {
  std::mt19937_64 random(5);
  std::normal_distribution<float> normal;
  const auto point = [&] { return Eigen::Vector3f(normal(random), normal(random), normal(random)); };
  Mesh soup;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const Eigen::Vector3f c = point();
    for (int k = 0; k < 3; ++k) soup.vertices.push_back(c + 0.3f * point());
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const RayScene scene(soup);
  std::vector<Ray> rays;
  for (int i = 0; i < 1003; ++i) rays.push_back({point(), point(), 0.1f * float(i % 3), i % 5 ? 1e30f : 1.0f});
  std::vector<Hit> hits(rays.size());
  std::vector<std::uint8_t> dark(rays.size());
  scene.hit(rays, hits);
  scene.occluded(rays, dark);
  int found = 0, differing = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit truth = brute_force(soup, rays[i]), single = scene.hit(rays[i]);
    if (bool(truth) != bool(hits[i]) || truth.triangle != hits[i].triangle) {
      ++differing;  // a ray through an edge
      continue;
    }
    EXPECT_EQ(single.triangle, hits[i].triangle);
    EXPECT_EQ(bool(dark[i]), bool(truth));
    EXPECT_EQ(scene.occluded(rays[i]), bool(truth));
    if (!truth) continue;
    ++found;
    EXPECT_NEAR(hits[i].t, truth.t, 1e-4f * (1 + truth.t));
    EXPECT_NEAR(hits[i].b1, truth.b1, 2e-3f);
    EXPECT_NEAR(hits[i].b2, truth.b2, 2e-3f);
  }
  EXPECT_GT(found, 300);
  EXPECT_LE(differing, 2);
  EXPECT_FALSE(RayScene(Mesh{}).hit(rays[0]));
  Mesh bad = soup;
  bad.triangles[7][1] = 600;
  EXPECT_EQ(test::expect_error([&] { RayScene{bad}; }).code(), ErrorCode::bad_input);
}

}  // namespace
}  // namespace lumihull
