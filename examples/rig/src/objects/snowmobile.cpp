// A snowmobile, about as long as the paper's: 2.8 x 1.0 x 1.3. The formula's unit is the metre; its front looks to -x.

#include "noise.h"
#include "solids.h"

namespace lumihull::rig {

namespace {

using Eigen::Vector3f;

enum Group : int { kPaint, kPlastic, kRubber, kScreen, kMetal, kGlass, kGroups, kWhite = kGroups, kTailLamp };
using Distances = std::array<float, kGroups>;

/// Distance in the plane y = 0 from a loop of three wheels.
float loop(const Vector3f& p, float shrink) {
  const Vector3f q(p.x(), 0, p.z());
  return blend(capsule(q, {.02f, 0, .36f}, {.34f, 0, .165f}, .10f - shrink, .155f - shrink),
               capsule(q, {.34f, 0, .165f}, {1.17f, 0, .175f}, .155f - shrink, .165f - shrink), .05f);
}

Distances groups(const Vector3f& p) {
  const Vector3f q(p.x(), std::fabs(p.y()), p.z());  // both halves are alike
  Distances d;

  // Lacquered: hood with its nose, cowl, sides, tunnel over the track, belly.
  float hood = ellipsoid(q, {-.52f, 0, .50f}, {.78f, .36f, .23f});
  hood = blend(hood, ellipsoid(q, {-.86f, 0, .43f}, {.38f, .24f, .15f}), .12f);
  hood = blend(hood, ellipsoid(q, {-.34f, 0, .70f}, {.42f, .25f, .19f}), .12f);
  hood = blend(hood, capsule(q, {-.75f, .26f, .50f}, {.05f, .33f, .58f}, .10f, .085f), .07f);
  hood = blend(hood, rounded_box(q, {-.35f, 0, .36f}, {.45f, .29f, .12f}, .08f), .08f);
  // Vents behind the lamps, a crease along the hood.
  hood = cut(hood, -rounded_box(q, {-.52f, .355f, .56f}, {.13f, .06f, .028f}, .02f), .015f);
  hood +=
      .010f * std::exp(-std::pow((q.y() - .16f - .12f * (q.x() + .9f)) / .018f, 2.f)) * smoothstep(.52f, .60f, q.z());
  float tunnel = rounded_box(q, {.66f, 0, .42f}, {.72f, .215f, .095f}, .03f);
  tunnel = blend(tunnel, rounded_box(q, {1.33f, 0, .475f}, {.07f, .22f, .035f}, .03f), .03f);
  d[kPaint] = blend(hood, tunnel, .05f);

  // Plastic: seat, footboards, bumper, handlebar's pad and grips, dashboard.
  float seat = rounded_box(q, {.62f, 0, .60f}, {.52f, .175f, .12f}, .09f);
  seat = blend(seat, ellipsoid(q, {.98f, 0, .70f}, {.22f, .17f, .12f}), .10f);
  seat = blend(seat, ellipsoid(q, {.16f, 0, .67f}, {.18f, .13f, .10f}), .08f);
  seat += .004f * std::cos(2 * 3.14159f * (q.x() - .1f) / .16f) * smoothstep(.66f, .70f, q.z());
  float black = seat;
  black = std::fmin(black, rounded_box(q, {.36f, .33f, .285f}, {.56f, .125f, .026f}, .02f));
  black = std::fmin(black, capsule(q, {-1.02f, 0, .30f}, {-.86f, .24f, .29f}, .035f, .035f));
  black = std::fmin(black, ellipsoid(q, {-.10f, 0, .83f}, {.15f, .19f, .08f}));
  black = std::fmin(black, capsule(q, {.05f, .27f, 1.00f}, {.10f, .41f, .985f}, .029f, .029f));
  black = std::fmin(black, rounded_box(q, {.03f, 0, 1.0f}, {.045f, .085f, .04f}, .03f));
  d[kPlastic] = black;

  // The track: a loop with lugs, its wheels in the open sides.
  const float along = p.z() < .2f ? p.x() : -p.x();
  const float lugs = .011f * smoothstep(-.3f, .3f, std::cos(2 * 3.14159f * along / .115f)) *
                     (.6f + .4f * std::cos(2 * 3.14159f * q.y() / .13f));
  float track = std::fmax(loop(p, .012f) - lugs, q.y() - .19f);
  track = cut(track, -std::fmax(loop(p, .055f), .055f - q.y()), .01f);
  for (const auto& [x, z, r] :
       {std::array{.345f, .165f, .085f}, std::array{.75f, .135f, .07f}, std::array{1.17f, .175f, .10f}})
    track = std::fmin(track, std::fmax(std::hypot(p.x() - x, p.z() - z) - r, std::fabs(q.y() - .10f) - .060f));
  d[kRubber] = track;

  // The windscreen: a bent shell that leans back, thinner than it looks.
  const Vector3f s(q.x() - .36f * (q.z() - .80f) - .12f, q.y(), q.z());
  const float shell = std::fabs(Eigen::Vector2f(s.x(), .92f * s.y()).norm() - .36f) - .021f;
  float screen = std::fmax(shell, std::fmax(.74f - q.z(), s.x() + .06f));
  screen = cut(screen, q.z() - 1.28f + 1.9f * q.y() * q.y(), .03f);
  d[kScreen] = .9f * screen;

  // Skis and their legs, steering column, bumper at the back.
  float skis = rounded_box(q, {-.74f, .43f, .035f}, {.42f, .062f, .026f}, .02f);
  skis = blend(skis, rounded_box(q, {-.74f, .43f, .06f}, {.36f, .022f, .045f}, .02f), .03f);
  float tip = INFINITY;  // flat, bent up
  constexpr float kBend[][2] = {{-1.10f, .035f}, {-1.22f, .06f}, {-1.31f, .13f}, {-1.365f, .23f}};
  for (int i = 0; i < 3; ++i) {
    const Vector3f flat(q.x(), std::fmax(std::fabs(q.y() - .43f) - .038f, 0.f), q.z());
    tip = blend(tip, capsule(flat, {kBend[i][0], 0, kBend[i][1]}, {kBend[i + 1][0], 0, kBend[i + 1][1]}, .026f, .026f),
                i ? .02f : 1e-3f);
  }
  skis = blend(skis, tip, .02f);
  float metal = capsule(q, {-.66f, .43f, .09f}, {-.60f, .36f, .36f}, .036f, .032f);
  metal = std::fmin(metal, capsule(q, {-.62f, .41f, .16f}, {-.40f, .20f, .28f}, .024f, .024f));
  metal = std::fmin(metal, capsule(q, {-.12f, 0, .80f}, {.03f, 0, 1.0f}, .028f, .028f));
  metal = std::fmin(metal, capsule(q, {.03f, 0, 1.0f}, {.06f, .29f, 1.0f}, .022f, .022f));
  metal = std::fmin(metal, capsule(q, {1.34f, 0, .56f}, {1.36f, .16f, .55f}, .024f, .024f));
  metal = std::fmin(metal, capsule(q, {1.36f, .16f, .55f}, {1.22f, .19f, .47f}, .024f, .024f));
  d[kMetal] = std::fmin(metal, skis);

  d[kGlass] = std::fmin(ellipsoid(q, {-1.215f, .130f, .540f}, {.080f, .075f, .050f}),
                        rounded_box(q, {1.195f, 0, .69f}, {.055f, .10f, .04f}, .02f));
  return d;
}

int material(const Vector3f& p) {
  const Distances d = groups(p);
  const int nearest = int(std::min_element(d.begin(), d.end()) - d.begin());
  if (nearest == kGlass && p.x() > 0) return kTailLamp;
  if (nearest != kPaint) return nearest;
  // A white flash along the sides, black below.
  const float edge = .40f + .16f * (p.x() + .95f);
  if (p.x() < .05f && p.z() > edge && p.z() < edge + .075f - .05f * (p.x() + .4f)) return kWhite;
  return p.z() < .33f ? kPlastic : kPaint;
}

}  // namespace

Object make_snowmobile(double size, int detail) {
  const auto formula = [](const Vector3f& p) {
    const Distances d = groups(p);
    float all = d[kPaint];
    for (int i = 1; i < kGroups; ++i) all = blend(all, d[std::size_t(i)], .008f);
    return cut(all, -p.z(), .004f);
  };
  Object object =
      from_formula("snowmobile", formula, {-1.46f, -.58f, -.04f}, {1.46f, .58f, 1.36f}, size, detail, 2.8f, material);
  object.material = {Pattern::plain, {{{.50f, .020f, .012f}, {}, {}}}, .03f, .06f, .07f};
  object.others = {
      {Pattern::plain, {{{.018f, .018f, .019f}, {}, {}}}, .2f, .04f, .35f},  // plastic
      {Pattern::plain, {{{.016f, .015f, .014f}, {}, {}}}, .4f, .02f, .70f},  // rubber
      {Pattern::plain, {{{.006f, .006f, .008f}, {}, {}}}, 0, .07f, .06f},    // windscreen
      {Pattern::plain, {{{.16f, .16f, .17f}, {}, {}}}, .1f, .45f, .30f},     // metal
      {Pattern::plain, {{{.62f, .62f, .60f}, {}, {}}}, 0, .08f, .05f},       // lamps
      {Pattern::plain, {{{.75f, .74f, .72f}, {}, {}}}, .02f, .06f, .07f},    // white lacquer
      {Pattern::plain, {{{.45f, .008f, .006f}, {}, {}}}, 0, .08f, .06f},     // tail lamp
  };
  return object;
}

}  // namespace lumihull::rig
