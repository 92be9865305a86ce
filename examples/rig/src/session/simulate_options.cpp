#include "simulate_options.h"

#include <lumihull/internal/json.h>

namespace lumihull::rig {

using internal::Json;

std::string options_json(const SimulateOptions& o) {
  Json json{{"format", "lumihull-simulate"}, {"version", 1}};
  json["object"] = o.object, json["size_m"] = o.size_m, json["matt"] = o.matt, json["uniform"] = o.uniform;
  if (o.unlit) json["unlit"] = *o.unlit;
  json["blue"] = o.blue, json["room_radius_m"] = o.room_radius_m, json["sheets"] = o.sheets;
  json["density"] = o.density, json["circle_px"] = o.circle_px, json["least_targets"] = o.least_targets;
  json["photos"] = o.photos, json["carrier"] = int(o.carrier), json["radius_m"] = o.radius_m;
  json["phi_rad"] = {o.phi_from_rad, o.phi_to_rad};
  const RobotErrors& e = o.errors;
  json["errors"] = {e.departure_m, e.attachment_m, e.offset_m,    e.gain,           e.winch_m,      e.common_m,
                    e.mount_m,     e.mount_rad,    e.bearing_rad, e.table_m,        e.table_rad,    e.hand_m,
                    e.hand_rad,    e.swing_m,      e.swing_rad,   e.swing_period_s, e.swing_decay_s};
  json["width"] = o.width, json["focal_mm"] = o.focal_mm, json["distortion"] = o.distortion;
  json["jpeg_quality"] = o.jpeg_quality, json["cables"] = o.cables;
  const LightOptions& l = o.light;
  json["light"] = {l.ambient_rays, l.lamp_rays, l.bounces, l.floor_texels, l.vertex_spacing};
  const PhotoOptions& p = o.photo;
  json["photo"] = {{"rays", p.rays},           {"edge_rays", p.edge_rays},   {"blur_px", p.blur_px},
                   {"f_number", p.f_number},   {"focus_m", p.focus_m},       {"exposure", p.exposure},
                   {"full_well", p.full_well}, {"read_noise", p.read_noise}, {"bayer", p.bayer},
                   {"reduce", p.reduce}};
  json["empty_photos"] = o.empty_photos, json["lens_photos"] = o.lens_photos;
  json["known_cameras"] = o.known_cameras, json["depth"] = o.depth, json["test_views"] = o.test_views;
  json["seed"] = o.seed;
  return internal::print_json(json, "simulate.json");
}

}  // namespace lumihull::rig
