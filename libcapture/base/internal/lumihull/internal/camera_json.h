#pragma once

// A camera's fields in JSON, the same wherever Lumihull's own files hold cameras.

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/internal/json.h>

#include <utility>

namespace lumihull::internal {

/// complete: every field must be there; else only width, height and f, and the others default to a principal point in
/// the middle, s = 1, no skew and no lens.
inline Camera read_camera(const JsonReader& json, bool complete) {
  Camera c;
  c.width = int(json.at("width").integer(1, kMaxImageSide));
  c.height = int(json.at("height").integer(1, kMaxImageSide));
  if (std::int64_t(c.width) * c.height > kMaxImagePixels) json.fail("a picture of at most 400 megapixels");
  c.u0 = 0.5 * c.width;
  c.v0 = 0.5 * c.height;
  c.f = json.at("f").positive();
  if (complete || json.has("s")) c.s = json.at("s").positive();
  const std::pair<const char*, double*> fields[] = {{"skew", &c.skew}, {"u0", &c.u0}, {"v0", &c.v0}, {"k1", &c.k1},
                                                    {"k2", &c.k2},     {"k3", &c.k3}, {"p1", &c.p1}, {"p2", &c.p2}};
  for (const auto& [field, value] : fields)
    if (complete || json.has(field)) *value = json.at(field).number();
  return c;
}

inline Json print_camera(const Camera& c) {
  return {{"width", c.width}, {"height", c.height}, {"f", c.f},   {"s", c.s},   {"skew", c.skew}, {"u0", c.u0},
          {"v0", c.v0},       {"k1", c.k1},         {"k2", c.k2}, {"k3", c.k3}, {"p1", c.p1},     {"p2", c.p2}};
}

}  // namespace lumihull::internal
