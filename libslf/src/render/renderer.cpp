#include <lumihull/slf/renderer.h>

#include <algorithm>
#include <cmath>

#include "color.h"
#include "render_with.h"

namespace lumihull::slf {
namespace {

/// Bilinear; (u, v) in texels, the first one's centre at (0.5, 0.5).
BlendColor sample_texture(const Image& texture, float u, float v) {
  const int w = texture.width(), h = texture.height();
  const float x = std::clamp(u - 0.5f, 0.0f, float(w - 1)), y = std::clamp(v - 0.5f, 0.0f, float(h - 1));
  const int x0 = std::min(int(x), w - 1), y0 = std::min(int(y), h - 1);
  const int x1 = std::min(x0 + 1, w - 1), y1 = std::min(y0 + 1, h - 1);
  const float fx = x - float(x0), fy = y - float(y0);
  const std::uint8_t *top = texture.row<std::uint8_t>(y0), *bottom = texture.row<std::uint8_t>(y1);
  float c[3];
  for (int i = 0; i < 3; ++i) {
    const float a = unit_of_srgb8(top[3 * x0 + i]) * (1 - fx) + unit_of_srgb8(top[3 * x1 + i]) * fx;
    const float b = unit_of_srgb8(bottom[3 * x0 + i]) * (1 - fx) + unit_of_srgb8(bottom[3 * x1 + i]) * fx;
    c[i] = a * (1 - fy) + b * fy;
  }
  return {c[0], c[1], c[2], 1};
}

}  // namespace

Rendering render_texture(const TexturedMesh& textured, const hull::RayScene& scene, const View& view,
                         const RenderOptions& options, Job& job) {
  validate(textured, "textured mesh");
  const float w = float(textured.texture.width()), h = float(textured.texture.height());
  return render_with(view, options, scene, textured.mesh, job, [&](const SurfaceSample& s) {
    const auto& uv = textured.uv[s.hit.triangle];
    const Eigen::Vector2f at = uv[0] + s.hit.b1 * (uv[1] - uv[0]) + s.hit.b2 * (uv[2] - uv[0]);
    return sample_texture(textured.texture, at.x() * w, at.y() * h);
  });
}

Rendering render_shaded(const hull::Mesh& mesh, const hull::RayScene& scene, const View& view,
                        const RenderOptions& options, Job& job) {
  const std::vector<Eigen::Vector3f> normals = hull::vertex_normals(mesh);
  const Eigen::Vector3f eye = view.center().cast<float>();
  return render_with(view, options, scene, mesh, job, [&](const SurfaceSample& s) {
    const auto& t = mesh.triangles[s.hit.triangle];
    const Eigen::Vector3f n =
        (normals[t[0]] + s.hit.b1 * (normals[t[1]] - normals[t[0]]) + s.hit.b2 * (normals[t[2]] - normals[t[0]]))
            .normalized();
    const float lit = std::abs(n.dot((eye - s.point).normalized()));
    const float grey = 0.25f + 0.6f * lit;
    return BlendColor{grey, grey, grey, 1};
  });
}

}  // namespace lumihull::slf
