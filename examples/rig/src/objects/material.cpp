#include "material.h"

#include <algorithm>
#include <cmath>

#include "noise.h"

namespace lumihull::rig {

using Eigen::Vector3f;

namespace {

Vector3f lerp(const Vector3f& a, const Vector3f& b, float t) { return a + t * (b - a); }

Vector3f pottery(const Material& m, const Vector3f& q) {
  const float theta = std::atan2(q.y(), q.x()) / 6.2831853f;    // -0.5 … 0.5
  const float z = q.z() + .004f * fractal_noise(q * 9, 2, 11);  // a hand-drawn line is never straight
  const float soft = .0035f;
  const auto band = [&](float from, float to) {
    return smoothstep(from - soft, from + soft, z) * (1 - smoothstep(to - soft, to + soft, z));
  };
  Vector3f color = m.colors[0];
  color = lerp(color, m.colors[2], band(.20f, .56f) * .92f);
  for (const auto& [from, to] : {std::pair{.185f, .205f},
                                 {.215f, .222f},
                                 {.55f, .57f},
                                 {.535f, .542f},
                                 {.655f, .675f},
                                 {.74f, .75f},
                                 {.90f, .915f},
                                 {.05f, .075f}})
    color = lerp(color, m.colors[1], band(from, to));
  // Two zigzags that cross into a row of diamonds, a dot in each.
  const float saw = std::fabs(std::fmod(theta * 9 + 10.f, 1.f) - .5f) * 2;  // 0 … 1
  for (const float s : {saw, 1 - saw}) {
    const float line = .30f + .15f * s;
    color = lerp(color, s == saw ? m.colors[1] : m.colors[0], 1 - smoothstep(.008f, .013f, std::fabs(z - line)));
  }
  const float cell = (std::fmod(theta * 18 + 20.5f, 1.f) - .5f) / 18 * 6.2831853f * .33f;
  color = lerp(color, m.colors[1], 1 - smoothstep(.017f, .021f, std::hypot(cell, z - .375f)));
  color = lerp(color, m.colors[0], 1 - smoothstep(.008f, .012f, std::hypot(cell, z - .375f)));
  // Leaves below the neck.
  const float leaf = std::fabs(std::fmod(theta * 24 + 20.f, 1.f) - .5f) * 2;
  const float tip = .58f + .065f * (1 - leaf * leaf);
  color = lerp(color, m.colors[1], band(.58f, tip) * .9f);
  return color;
}

}  // namespace

Vector3f pattern_color(const Material& m, const Vector3f& q) {
  Vector3f color = m.colors[0];
  switch (m.pattern) {
    case Pattern::plain:
      break;
    case Pattern::checker: {
      // A thousandth off, so that faces at round coordinates do not flicker between two cells.
      const Eigen::Array3f c = ((q.array() + .001f) * 10).floor();
      if (std::fmod(std::fabs(c.sum()), 2.f) > .5f) color = m.colors[1];
      break;
    }
    case Pattern::stripes: {
      const float wave = std::sin(40 * q.z() + 5 * fractal_noise(q * 5, 3, 3));
      color = lerp(m.colors[0], m.colors[1], smoothstep(-.12f, .12f, wave));
      break;
    }
    case Pattern::marble: {
      const float vein = 1 - std::fabs(fractal_noise(q * 4 + Vector3f(3, 1, 7), 5, 5)) * 4;
      const float cloud = .5f + .5f * fractal_noise(q * 7, 4, 6);
      color = lerp(m.colors[0], m.colors[1], std::clamp(.85f * smoothstep(.35f, 1.f, vein) + .3f * cloud, 0.f, 1.f));
      break;
    }
    case Pattern::patches: {
      const float island = fractal_noise(q * 6 + Vector3f(2, 5, 1), 2, 12);
      const float spot = fractal_noise(q * 9 + Vector3f(7, 2, 4), 2, 13);
      color = lerp(m.colors[0], m.colors[1], smoothstep(-.01f, .05f, island));
      color = lerp(color, m.colors[2], smoothstep(.12f, .18f, spot));
      break;
    }
    case Pattern::fur: {
      // Hairs hang down and back: noise that is stretched that way, finer across it.
      const Vector3f along(q.x() * 130, (q.y() + .5f * q.z()) * 70, (q.z() - .4f * q.y()) * 22);
      const float hair = fractal_noise(along, 3, 21), tuft = fractal_noise(q * 14, 3, 22);
      const float below = smoothstep(.0f, .14f, -q.y() - .9f * (q.z() - .30f) + .05f * tuft);
      const float above = smoothstep(.0f, .10f, q.z() - .52f + .25f * q.y() + .05f * tuft);
      color = lerp(lerp(m.colors[0], m.colors[1], .75f * below), m.colors[2], .7f * above);
      color *= std::clamp(1 + .9f * hair + .35f * tuft, .35f, 1.9f);
      break;
    }
    case Pattern::pottery:
      color = pottery(m, q);
      break;
  }
  if (m.grain > 0) color *= 1 + m.grain * (fractal_noise(q * 45, 3, 9) + .5f * fractal_noise(q * 6, 2, 10));
  return color.cwiseMax(0.f).cwiseMin(1.f);
}

float gloss(const Material& m, const Vector3f& n, const Vector3f& l, const Vector3f& v, float spread) {
  const float nl = n.dot(l), nv = n.dot(v);
  if (m.reflectance <= 0 || nl <= 0 || nv <= 0) return 0;
  const Vector3f h = (l + v).normalized();
  const float nh = n.dot(h), vh = v.dot(h);
  const float alpha = m.roughness * m.roughness;
  const float wide = std::min(1.f, alpha + .5f * spread);
  const float a2 = wide * wide;
  const float d = nh * nh * (a2 - 1) + 1;
  const float distribution = a2 / (d * d);  // times pi
  const float k2 = alpha * alpha;
  const float masking =
      .5f / (nl * std::sqrt(nv * nv * (1 - k2) + k2) + nv * std::sqrt(nl * nl * (1 - k2) + k2));  // G / (4 nl nv)
  const float fresnel = m.reflectance + (1 - m.reflectance) * std::pow(1 - vh, 5.f);
  return distribution * masking * fresnel * nl;
}

float mean_mirror(const Material& m) {
  if (m.reflectance <= 0) return 0;
  // Of (1 - cos)^5, weighed with the cosine: 1 / 21.
  return m.reflectance + (std::max(1 - m.roughness, m.reflectance) - m.reflectance) / 21;
}

float mirror(const Material& m, float cos_v) {
  if (m.reflectance <= 0) return 0;
  const float smooth = std::max(1 - m.roughness, m.reflectance);
  return m.reflectance + (smooth - m.reflectance) * std::pow(1 - std::clamp(cos_v, 0.f, 1.f), 5.f);
}

}  // namespace lumihull::rig
