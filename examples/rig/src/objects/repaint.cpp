// An object without its gloss, its pattern or its light.
#include "repaint.h"

namespace lumihull::rig {

Object repainted(Object object, const Repaint& how) {
  Material& m = object.material;
  if (how.unlit || how.uniform) object.material_at = nullptr, object.material_of.clear(), object.others.clear();
  if (how.matt) {
    m.reflectance = 0;
    for (Material& other : object.others) other.reflectance = 0;
  }
  if (how.unlit) {
    for (int c = 0; c < 3; ++c)
      m.colors[0][c] = linear_from_srgb(float((*how.unlit)[std::size_t(c)]) / 255) / float(how.exposure);
    m.unlit = true;
  }
  if (how.uniform) {
    m.pattern = Pattern::plain;
    m.grain = 0;
    object.texture = Image();
    object.uv.clear();
  }
  return object;
}

}  // namespace lumihull::rig
