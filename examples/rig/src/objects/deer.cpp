// The head of a stag on its neck, as a trophy: 0.6 x 0.8 x 1.0. The formula's unit is its height; it looks towards -y.

#include "noise.h"
#include "solids.h"

namespace lumihull::rig {

namespace {

using Eigen::Vector3f;

enum Group : int { kFur, kNose, kEye, kAntler, kGroups };
using Distances = std::array<float, kGroups>;

/// A flat leaf from a to b: an ear.
float leaf(const Vector3f& p, const Vector3f& a, const Vector3f& b, const Vector3f& across, float width, float thick) {
  const Vector3f axis = (b - a).normalized(), side = (across - across.dot(axis) * axis).normalized();
  const Vector3f normal = axis.cross(side), from = p - .5f * (a + b);
  const Vector3f q(from.dot(axis), from.dot(side), from.dot(normal));
  return ellipsoid(q, Vector3f::Zero(), {.5f * (b - a).norm(), width, thick});
}

Distances groups(const Vector3f& p) {
  const Vector3f q(std::fabs(p.x()), p.y(), p.z());
  Distances d;

  float fur = ellipsoid(q, {0, .20f, .02f}, {.215f, .20f, .20f});                           // shoulders
  fur = blend(fur, capsule(q, {0, .17f, .06f}, {0, .035f, .40f}, .165f, .095f), .10f);      // neck
  fur = blend(fur, capsule(q, {0, .02f, .10f}, {0, -.05f, .30f}, .105f, .062f), .09f);      // throat
  fur = blend(fur, ellipsoid(q, {0, -.045f, .475f}, {.082f, .115f, .088f}), .05f);          // skull
  fur = blend(fur, capsule(q, {0, -.10f, .450f}, {0, -.315f, .362f}, .068f, .043f), .05f);  // muzzle
  fur = blend(fur, capsule(q, {0, -.06f, .405f}, {0, -.265f, .332f}, .045f, .027f), .03f);  // jaw
  fur = blend(fur, ellipsoid(q, {.034f, -.075f, .545f}, {.032f, .04f, .035f}), .03f);       // where antlers grow
  fur = blend(fur, capsule(q, {.055f, -.145f, .495f}, {.082f, -.09f, .502f}, .022f, .024f), .02f);  // brows
  fur = blend(fur, ellipsoid(q, {.055f, -.15f, .43f}, {.025f, .06f, .03f}), .03f);                  // cheeks
  fur = cut(fur, -ellipsoid(q, {.084f, -.130f, .472f}, {.022f, .026f, .020f}), .012f);              // eye sockets
  fur = cut(fur, -capsule(q, {0, -.36f, .335f}, {.045f, -.24f, .345f}, .006f, .005f), .010f);       // mouth
  float ear = leaf(q, {.075f, .005f, .505f}, {.265f, .045f, .575f}, {0, -.55f, 1}, .052f, .026f);
  ear = cut(ear, -leaf(q, {.105f, -.022f, .512f}, {.255f, .014f, .572f}, {0, -.55f, 1}, .036f, .022f), .01f);
  fur = blend(fur, ear, .02f);
  // Hair stands in tufts that hang down and back; longer on the neck.
  const float length = (.30f + .70f * (1 - smoothstep(.25f, .45f, q.z()))) * smoothstep(-.33f, -.18f, q.y());
  if (std::fabs(fur) < .05f) {
    const Vector3f tuft(p.x() * 46, (p.y() + .5f * p.z()) * 30, (p.z() - .4f * p.y()) * 11);
    fur += length * (.016f * fractal_noise(tuft, 2, 31) + .006f * fractal_noise(tuft * 2.7f, 1, 33));
  }
  d[kFur] = .8f * fur;

  float nose = ellipsoid(q, {0, -.352f, .366f}, {.036f, .026f, .029f});
  nose = cut(nose, -ellipsoid(q, {.020f, -.377f, .366f}, {.009f, .010f, .011f}), .006f);
  d[kNose] = nose;
  d[kEye] = ellipsoid(q, {.071f, -.124f, .473f}, {.019f, .022f, .019f});

  // Beams bend out, up and forward again; points grow from them. Bark of small ridges.
  struct Piece {
    Vector3f a, b;
    float ra, rb;
  };
  static const Piece kPieces[] = {{{.036f, -.070f, .550f}, {.085f, .000f, .640f}, .026f, .022f},
                                  {{.085f, .000f, .640f}, {.180f, .045f, .730f}, .022f, .020f},
                                  {{.180f, .045f, .730f}, {.262f, .030f, .830f}, .020f, .018f},
                                  {{.262f, .030f, .830f}, {.285f, -.045f, .925f}, .018f, .015f},
                                  {{.285f, -.045f, .925f}, {.258f, -.120f, .985f}, .015f, .009f},
                                  {{.060f, -.035f, .590f}, {.085f, -.150f, .655f}, .017f, .014f},
                                  {{.085f, -.150f, .655f}, {.088f, -.195f, .730f}, .014f, .008f},
                                  {{.150f, .030f, .702f}, {.155f, -.060f, .785f}, .016f, .013f},
                                  {{.155f, -.060f, .785f}, {.150f, -.085f, .865f}, .013f, .008f},
                                  {{.255f, .032f, .820f}, {.215f, -.010f, .920f}, .015f, .008f},
                                  {{.272f, .010f, .855f}, {.292f, .085f, .950f}, .015f, .008f}};
  float antler = INFINITY;
  for (const Piece& k : kPieces) {
    const float piece = capsule(q, k.a, k.b, k.ra, k.rb);
    antler = antler < INFINITY ? blend(antler, piece, .012f) : piece;
  }
  if (antler < .03f) antler += .0022f * fractal_noise(Vector3f(p.x() * 90, p.y() * 90, p.z() * 30), 2, 35);
  d[kAntler] = antler;
  return d;
}

int material(const Vector3f& p) {
  const Distances d = groups(p);
  return int(std::min_element(d.begin(), d.end()) - d.begin());
}

}  // namespace

Object make_deer(double size, int detail) {
  const auto formula = [](const Vector3f& p) {
    const Distances d = groups(p);
    float all = d[kFur];
    for (int i = 1; i < kGroups; ++i) all = blend(all, d[std::size_t(i)], .006f);
    return cut(all, -p.z(), .006f);
  };
  Object object = from_formula("deer", formula, {-.36f, -.44f, -.05f}, {.36f, .46f, 1.06f}, size, detail, 1, material);
  object.material = {Pattern::fur, {{{.21f, .115f, .055f}, {.48f, .38f, .27f}, {.12f, .062f, .030f}}}, .25f, 0, 1};
  object.others = {
      {Pattern::plain, {{{.022f, .018f, .017f}, {}, {}}}, .3f, .04f, .40f},                  // nose
      {Pattern::plain, {{{.020f, .010f, .006f}, {}, {}}}, 0, .05f, .10f},                    // eyes
      {Pattern::marble, {{{.36f, .26f, .16f}, {.13f, .080f, .045f}, {}}}, .3f, .03f, .50f},  // antlers
  };
  return object;
}

}  // namespace lumihull::rig
