#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/light_field.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/renderer.h>
#include <lumihull/slf/textured_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using test::around;
using test::box;
using test::camera;
using test::merged;
using test::sphere;

Camera bent(int width, int height, double f) {
  Camera c = camera(width, height, f);
  c.s = 1.1, c.skew = 2, c.k1 = 0.12, c.k2 = -0.05, c.p1 = 0.004, c.p2 = -0.003;
  return c;
}

struct Scene {
  std::string name;
  hull::Mesh mesh;
  View view;
};

/// Whatever outlines may do: hide one another, pierce one another, end at holes, be thinner than a pixel or smaller,
/// leave the picture, be bent by a lens, lie behind the camera.
std::vector<Scene> scenes() {
  const auto from = [](const Camera& c, const Eigen::Vector3d& eye) {
    return View{c, look_at(eye, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ())};
  };
  const hull::Mesh ball = sphere(24);
  const hull::Mesh pierced = merged(ball, box({-0.2f, -0.2f, 0.5f}, {0.2f, 0.2f, 1.6f}));
  const hull::Mesh needles = merged(merged(box({-1.3f, -1.5f, -1}, {-1.299f, -1.499f, 1}), ball),
                                    box({-1, 1.4f, 1.2f}, {1, 1.4001f, 1.2001f}));
  hull::Mesh torn = ball;
  for (std::size_t i = 0; i < torn.triangles.size(); i += 7) {
    torn.triangles[i] = torn.triangles.back();
    torn.triangles.pop_back();
  }
  return {
      {"ball", ball, from(camera(150, 110, 120), {3, 1, 1})},
      {"pierced", pierced, from(camera(150, 110, 110), {2.4, 2, 1.1})},
      {"needles", needles, from(camera(160, 120, 120), {4, 0.4, 0.3})},
      {"needles through a lens", needles, from(bent(160, 120, 120), {4, 0.4, 0.3})},
      {"torn", torn, from(camera(150, 110, 120), {3, 1, 1})},
      {"close through a lens", pierced, from(bent(150, 110, 120), {1.5, 1, 0.4})},
      {"far", sphere(60), from(camera(90, 90, 120), {14, 3, 1})},
      {"far through a lens", sphere(60), from(bent(90, 90, 120), {14, 3, 1})},
      {"from within", merged(sphere(12), box({-3, 1.5f, -3}, {3, 2, 3})), from(camera(90, 70, 60), {0.1, -0.2, 0.1})}};
}

slf::Rendering shaded(const Scene& s, const slf::RenderOptions& options, unsigned threads = 0) {
  Job job({}, threads);
  return slf::render_shaded(s.mesh, hull::RayScene(s.mesh), s.view, options, job);
}

bool same(const Image& a, const Image& b) {
  return a.bytes() == b.bytes() && std::memcmp(a.data(), b.data(), a.bytes()) == 0;
}

Image flat(const slf::Rendering& r) { return slf::composited(r.rgba, {255, 0, 255}); }

TEST(Rays, ManyFromOnePointAreTheSameAsEachByItself) {
  const hull::Mesh mesh = merged(sphere(20), box({-0.2f, -0.2f, 0.5f}, {0.2f, 0.2f, 1.6f}));
  const hull::RayScene scene(mesh);
  const Eigen::Vector3f origin(3, 0.5f, 0.2f);
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0, 0.4f);
  std::vector<float> x, y, z;
  for (int i = 0; i < 1003; ++i) x.push_back(-1), y.push_back(normal(random)), z.push_back(normal(random));
  x[5] = std::numeric_limits<float>::quiet_NaN(), y[700] = std::numeric_limits<float>::infinity();
  for (const std::size_t count : {0u, 1u, 15u, 16u, 17u, 1003u}) {
    std::vector<hull::Hit> hits(count);
    scene.hit(origin, {{x.data(), count}, {y.data(), count}, {z.data(), count}}, hits);
    std::size_t met = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const hull::Hit one = i == 5 || i == 700 ? hull::Hit{} : scene.hit({origin, {x[i], y[i], z[i]}});
      ASSERT_EQ(bool(one), bool(hits[i])) << i;
      if (!one) continue;
      ++met;
      EXPECT_NEAR(one.t, hits[i].t, 1e-5f);
      if (one.triangle != hits[i].triangle) continue;  // on an edge, either is right
      EXPECT_NEAR(one.b1, hits[i].b1, 1e-3f);
      EXPECT_NEAR(one.b2, hits[i].b2, 1e-3f);
    }
    EXPECT_GE(met, count / 10);
  }
}

TEST(Rays, EveryRayIsTheCamerasOwn) {
  for (const Scene& s : scenes()) {
    SCOPED_TRACE(s.name);
    const hull::RayScene scene(s.mesh);
    for (const int n : {1, 2, 3}) {
      const slf::Rendering r = shaded(s, {n, true});
      const Eigen::Matrix3d rotation = s.view.cam_from_world.rotation.conjugate().toRotationMatrix();
      int different = 0;
      for (int y = 0; y < r.rgba.height(); ++y)
        for (int x = 0; x < r.rgba.width(); ++x) {
          int hits = 0;
          float depth = std::numeric_limits<float>::infinity();
          for (int k = 0; k < n * n; ++k) {
            const auto ray = s.view.camera.ray({x + (k % n + 0.5) / n, y + (k / n + 0.5) / n});
            const hull::Hit hit = scene.hit({s.view.center().cast<float>(), (rotation * *ray).cast<float>()});
            if (hit) ++hits, depth = std::min(depth, hit.t);
          }
          const int alpha = r.rgba.row<std::uint8_t>(y)[4 * x + 3];
          if (alpha != (hits * 255 + n * n / 2) / (n * n)) {
            ++different;
          } else if (hits) {
            EXPECT_NEAR(r.depth.row<float>(y)[x], depth, 1e-4f * depth);
          }
        }
      EXPECT_LE(different, 1) << n;  // a ray that grazes an edge, by the last bit
    }
  }
}

TEST(AdaptiveRays, AlphaIsThatOfAllRays) {
  for (const Scene& s : scenes())
    for (const int n : {1, 2, 3, 5}) {
      SCOPED_TRACE(s.name + ", " + std::to_string(n));
      const slf::Rendering all = shaded(s, {n, true}), some = shaded(s, {n, true, true});
      int different = 0, partial = 0;
      for (int y = 0; y < all.rgba.height(); ++y)
        for (int x = 0; x < all.rgba.width(); ++x) {
          const int a = all.rgba.row<std::uint8_t>(y)[4 * x + 3];
          different += a != some.rgba.row<std::uint8_t>(y)[4 * x + 3];
          partial += a > 0 && a < 255;
          if (a == 0) continue;
          const float depth = all.depth.row<float>(y)[x];
          EXPECT_NEAR(some.depth.row<float>(y)[x], depth, 0.05f * depth);
        }
      EXPECT_EQ(different, 0);
      EXPECT_TRUE(n == 1 || s.name == "from within" || partial > 25) << partial;
    }
}

TEST(AdaptiveRays, ColoursAreNearlyThoseOfAllRays) {
  for (const Scene& s : scenes()) {
    SCOPED_TRACE(s.name);
    const Image reference = flat(shaded(s, {4, false}));
    const double db = slf::psnr(flat(shaded(s, {4, false, true})), reference);
    EXPECT_GT(db, 45);
    RecordProperty(s.name, std::to_string(db));
  }
}

TEST(AdaptiveRays, NoNumberOfThreadsChangesAByte) {
  for (const Scene& s : scenes())
    for (const bool adaptive : {false, true}) {
      const slf::Rendering one = shaded(s, {3, true, adaptive}, 1);
      for (const unsigned threads : {2u, 5u}) {
        const slf::Rendering r = shaded(s, {3, true, adaptive}, threads);
        EXPECT_TRUE(same(one.rgba, r.rgba)) << s.name;
        EXPECT_TRUE(same(one.depth, r.depth)) << s.name;
      }
    }
}

/// A textured ball, and a light field of made-up factors on it.
class LightFieldRendering : public testing::Test {
 protected:
  LightFieldRendering() {
    const hull::Mesh mesh = sphere(20);
    slf::TextureOptions options;
    options.texel_px = 1;
    Job job;
    textured_ = slf::mean_texture(mesh, test::photographs(mesh, test::bands(), around(6, 3, 4, camera(120, 90, 130))),
                                  options, job);
  }

  slf::LightField field(int terms, bool adds_base) const {
    slf::LightField f;
    f.base = textured_, f.adds_base = adds_base;
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (int i = 0; i < 21; ++i)
      f.nodes.push_back(4 * Eigen::Vector3f(uniform(random), uniform(random), uniform(random)).normalized());
    for (int k = 0; k < terms; ++k) {
      slf::LightFieldTerm term;
      term.surface_scale = {0.5f, -0.2f}, term.view_scale = {1.5f, -0.7f};
      Image map = textured_.texture;
      for (int y = 0; y < map.height(); ++y)
        for (int x = 0; x < 3 * map.width(); ++x)
          map.row<std::uint8_t>(y)[x] =
              std::uint8_t(127.5f + 100 * std::sin(0.11f * float(x + 3 * k) - 0.3f * float(y)));
      term.surface.push_back(std::move(map));
      for (std::size_t i = 0; i < f.nodes.size() * f.base.mesh.vertices.size(); ++i)
        term.view.push_back(std::uint8_t(127.5f + 100 * std::sin(0.01f * float(i) + float(k))));
      f.terms.push_back(std::move(term));
    }
    return f;
  }

  slf::TexturedMesh textured_;
};

/// Values of all terms of a vertex for an eye, by the definition (Buehler et al. 2001, 4.1, over three nodes).
std::vector<double> view_values(const slf::LightField& f, std::size_t vertex, const Eigen::Vector3d& eye) {
  const Eigen::Vector3d p = f.base.mesh.vertices[vertex].cast<double>();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < f.nodes.size(); ++i) {
    const Eigen::Vector3d a = (f.nodes[i].cast<double>() - p).normalized(), b = (eye - p).normalized();
    order.push_back({2 * std::asin(0.5 * (a - b).norm()), i});
  }
  std::sort(order.begin(), order.end());
  std::vector<double> out(f.terms.size(), 0);
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += (1 - order[i].first / order[3].first) / std::max(order[i].first, 1e-5);
  for (int i = 0; i < 3; ++i) {
    const double w = (1 - order[i].first / order[3].first) / std::max(order[i].first, 1e-5) / sum;
    for (std::size_t k = 0; k < out.size(); ++k) {
      const slf::ByteScale& scale = f.terms[k].view_scale;
      out[k] += w * (scale.scale * f.terms[k].view[order[i].second * f.base.mesh.vertices.size() + vertex] / 255.0 +
                     scale.offset);
    }
  }
  return out;
}

TEST_F(LightFieldRendering, IsItsFormula) {
  const View view{camera(100, 80, 90), look_at({2.2, 1.9, 1.2}, {0, 0, 0}, {0, 0, 1})};
  const Eigen::Vector3d eye = view.center();
  const Eigen::Matrix3d rotation = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  const hull::RayScene scene(textured_.mesh);
  Job job;
  const int w = textured_.texture.width(), h = textured_.texture.height();
  for (const int terms : {0, 1, 3, 6, 12})
    for (const bool adds_base : {true, false}) {
      SCOPED_TRACE(terms);
      const slf::LightField f = field(terms, adds_base);
      const slf::Rendering r = slf::LightFieldRenderer(f).render(view, {1, false}, job);
      int compared = 0;
      for (int y = 0; y < 80; ++y)
        for (int x = 0; x < 100; ++x) {
          const hull::Hit hit =
              scene.hit({eye.cast<float>(), (rotation * *view.camera.ray({x + 0.5, y + 0.5})).cast<float>()});
          if (!hit) continue;
          const auto& t = textured_.mesh.triangles[hit.triangle];
          const auto& uv = textured_.uv[hit.triangle];
          const double b[3] = {1.0 - hit.b1 - hit.b2, hit.b1, hit.b2};
          double u = 0, v = 0;
          std::vector<double> values(std::size_t(terms), 0);
          for (std::size_t j = 0; j < 3; ++j) {
            u += b[j] * uv[j].x() * w, v += b[j] * uv[j].y() * h;
            const auto of_vertex = view_values(f, t[j], eye);
            for (std::size_t k = 0; k < values.size(); ++k) values[k] += b[j] * of_vertex[k];
          }
          u = std::clamp(u - 0.5, 0.0, w - 1.001), v = std::clamp(v - 0.5, 0.0, h - 1.001);
          const auto sample = [&](const Image& map, int c) {
            const int x0 = int(u), y0 = int(v);
            const auto at = [&](int i, int j) { return double(map.row<std::uint8_t>(y0 + j)[3 * (x0 + i) + c]); };
            return (at(0, 0) * (1 - u + x0) + at(1, 0) * (u - x0)) * (1 - v + y0) +
                   (at(0, 1) * (1 - u + x0) + at(1, 1) * (u - x0)) * (v - y0);
          };
          for (int c = 0; c < 3; ++c) {
            double color = adds_base ? sample(textured_.texture, c) / 255 : 0;
            for (std::size_t k = 0; k < values.size(); ++k) {
              const slf::ByteScale& scale = f.terms[k].surface_scale;
              color += values[k] * (scale.scale * sample(f.terms[k].surface[0], c) / 255 + scale.offset);
            }
            ASSERT_NEAR(r.rgba.row<std::uint8_t>(y)[4 * x + c], 255 * std::clamp(color, 0.0, 1.0), 0.6);
          }
          ++compared;
        }
      EXPECT_GT(compared, 2000);
    }
}

TEST_F(LightFieldRendering, AdaptiveIsCloseToAllRays) {
  const slf::LightFieldRenderer renderer(field(6, true));
  const hull::RayScene scene(textured_.mesh);
  Job job;
  for (const Camera& c : {camera(200, 160, 200), bent(200, 160, 200), camera(80, 60, 60)}) {
    const View view{c, look_at({2.2, 1.9, 1.2}, {0, 0, 0}, {0, 0, 1})};
    const slf::Rendering all = renderer.render(view, {4, false}, job);
    const slf::Rendering some = renderer.render(view, {4, false, true}, job);
    // The smallest picture's pixels hold several texels of jumping colours: 2 x 2 samples see less of them than 4 x 4.
    EXPECT_GT(slf::psnr(flat(some), flat(all)), c.width < 100 ? 43 : 45) << c.width;
    EXPECT_FALSE(same(some.rgba, all.rgba));  // or nothing was saved
    const auto textured = [&](bool adaptive) {
      return flat(slf::render_texture(textured_, scene, view, {4, false, adaptive}, job));
    };
    EXPECT_GT(slf::psnr(textured(true), textured(false)), 45) << c.width;
  }
}

}  // namespace
}  // namespace lumihull
