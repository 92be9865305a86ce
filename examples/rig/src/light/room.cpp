#include "room.h"

#include <lumihull/base/error.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "objects/noise.h"

namespace lumihull::rig {

using Eigen::Vector3f;

Room::Room(const Enclosure& enclosure) : enclosure_(enclosure) {
  const Enclosure& e = enclosure_;
  const bool finite = std::isfinite(e.radius) && std::isfinite(e.height) && std::isfinite(e.pedestal_radius) &&
                      std::isfinite(e.pedestal_height) && e.color.allFinite();
  if (!finite || e.radius <= 0 || e.height <= 0 || e.panels < 3 || e.panels > 1000 || e.pedestal_radius < 0 ||
      e.pedestal_radius >= e.radius || e.pedestal_height < 0 || e.pedestal_height >= e.height)
    throw Error(ErrorCode::invalid_argument, "the enclosure needs a positive size and 3 to 1000 panels", "enclosure");
  for (int i = 0; i < e.panels; ++i) {
    const float angle = 6.2831853f * (float(i) + .5f) / float(e.panels);
    normals_.emplace_back(-std::cos(angle), -std::sin(angle), 0.f);
  }
  for (int i = 0; i < surfaces(); ++i) {
    const auto random = [&](int k) { return 2 * unit_float(mix(e.seed, std::uint64_t(i * 4 + k))) - 1; };
    const float bright = 1 + .6f * e.unevenness * random(0);
    // Hue wanders less than brightness: different spray cans of one colour.
    shades_.push_back(bright * (Vector3f::Ones() + .35f * e.unevenness * Vector3f(random(1), random(2), random(3))));
  }
}

bool Room::contains(const Vector3f& p) const {
  if (!(p.z() > 0 && p.z() < enclosure_.height)) return false;
  for (const Vector3f& n : normals_)
    if (!(n.dot(p) > -enclosure_.radius)) return false;
  return !(p.z() <= enclosure_.pedestal_height && p.head<2>().norm() <= enclosure_.pedestal_radius);
}

Vector3f Room::moved_inside(Vector3f p, float margin) const {
  const Enclosure& e = enclosure_;
  p.z() = std::clamp(p.z(), margin, std::max(margin, e.height - margin));
  for (const Vector3f& n : normals_) {
    const float inside = e.radius + n.dot(p);
    if (inside < margin) p += (margin - inside) * n;
  }
  const float out = p.head<2>().norm(), wide = e.pedestal_radius + margin;
  if (p.z() <= e.pedestal_height && out < wide) {
    if (out > 0)
      p.head<2>() *= wide / out;
    else
      p.x() = wide;
  }
  return p;
}

bool Room::pedestal_hit(const Vector3f& o, const Vector3f& d, RoomHit& out) const {
  const float r = enclosure_.pedestal_radius, h = enclosure_.pedestal_height;
  if (r <= 0 || h <= 0) return false;
  bool found = false;
  if (d.z() < 0 && o.z() > h) {
    const float t = (h - o.z()) / d.z();
    const Vector3f p = o + t * d;
    if (p.head<2>().squaredNorm() < r * r) out = {kPedestalTop, t, p, Vector3f::UnitZ()}, found = true;
  }
  const float a = d.head<2>().squaredNorm(), b = o.head<2>().dot(d.head<2>()), c = o.head<2>().squaredNorm() - r * r;
  const float discriminant = b * b - a * c;
  if (!found && a > 0 && discriminant > 0 && c > 0) {
    const float t = (-b - std::sqrt(discriminant)) / a;
    const Vector3f p = o + t * d;
    if (t > 0 && p.z() < h && p.z() > 0) out = {kPedestalSide, t, p, Vector3f(p.x() / r, p.y() / r, 0)}, found = true;
  }
  return found;
}

bool Room::pedestal_between(const Vector3f& o, const Vector3f& d) const {
  RoomHit hit;
  return pedestal_hit(o, d, hit) && hit.t < 1;
}

RoomHit Room::hit(const Vector3f& o, const Vector3f& d) const {
  RoomHit out;
  if (pedestal_hit(o, d, out)) return out;
  out.t = INFINITY;
  const auto meet = [&](int surface, float t, const Vector3f& normal) {
    out.surface = surface, out.t = t, out.normal = normal;
  };
  if (d.z() < 0) meet(kFloor, -o.z() / d.z(), Vector3f::UnitZ());
  if (d.z() > 0) meet(kCeiling, (enclosure_.height - o.z()) / d.z(), -Vector3f::UnitZ());
  panel_hit(o, d, out);
  out.point = o + out.t * d;
  return out;
}

RoomHit Room::hit_below_ceiling(const Vector3f& o, const Vector3f& d) const {
  RoomHit out = hit(o, d);
  if (out.surface != kCeiling) return out;
  out.t = INFINITY;
  panel_hit(o, d, out);
  if (out.surface == kCeiling) return hit(o, d);  // straight up: no wall that way
  out.point = o + out.t * d;
  out.point.z() = enclosure_.height;
  return out;
}

void Room::panel_hit(const Vector3f& o, const Vector3f& d, RoomHit& out) const {
  for (int i = 0; i < enclosure_.panels; ++i) {
    const Vector3f& n = normals_[std::size_t(i)];
    const float towards = -n.dot(d);
    if (towards <= 0) continue;
    const float t = (enclosure_.radius + n.dot(o)) / towards;
    if (t < out.t) out.surface = kPanels + i, out.t = t, out.normal = n;
  }
}

float Room::ceiling_share(const Vector3f& o, const Vector3f& d, float blur) const {
  float share = 1;
  for (const Vector3f& n : normals_) {
    // The plane through the eye and the ceiling's edge on this panel; its normal points to the ceiling.
    const Vector3f edge(-n.y(), n.x(), 0), to_edge = Vector3f(0, 0, enclosure_.height) - enclosure_.radius * n - o;
    share *= smoothstep(-blur, blur, d.dot(edge.cross(to_edge).normalized()));
  }
  return share;
}

Vector3f Room::paint(const RoomHit& at) const {
  const Enclosure& e = enclosure_;
  if (at.surface == kCeiling) return Vector3f::Zero();
  const Vector3f q = at.point / e.radius;
  const std::uint64_t seed = mix(e.seed, std::uint64_t(at.surface));
  const float clouds = fractal_noise(q * 2.3f, 2, seed);
  const float grain = value_noise(q * 260, seed + 17);
  float shade = 1 + e.unevenness * (.75f * clouds + .10f * grain);
  if (at.surface >= kPanels) {
    // Narrow shadows where panels meet, and a worn strip above the floor.
    const Vector3f& n = at.normal;
    const float across = std::fabs(-n.y() * at.point.x() + n.x() * at.point.y());
    const float half = e.radius * std::tan(3.1415927f / float(e.panels));
    const float worn = std::min(1.f, e.unevenness / .22f);
    shade *= 1 - .55f * worn * (1 - smoothstep(.001f, .004f, (half - across) / e.radius));
    shade *= 1 - .12f * worn * (1 - smoothstep(0.f, .10f, q.z()));
  }
  // Thin paint lets a little more yellow through.
  const Vector3f hue(1 + .25f * clouds * e.unevenness / .22f, 1.f, 1 - .12f * clouds * e.unevenness / .22f);
  return (e.color.cwiseProduct(shades_[std::size_t(at.surface)]).cwiseProduct(hue) * shade).cwiseMax(0.f).cwiseMin(1.f);
}

Vector3f Room::mean_paint(int surface) const {
  if (surface == kCeiling) return Vector3f::Zero();
  return enclosure_.color.cwiseProduct(shades_[std::size_t(surface)]).cwiseMax(0.f).cwiseMin(1.f);
}

}  // namespace lumihull::rig
