#include <lumihull/internal/json.h>

#include "stage.h"

namespace lumihull::slf {

std::string describe_json(const Capture& capture) {
  using internal::Json;
  std::size_t positioned = 0, masks = 0, held_out = 0;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    positioned += capture.positioned(i);
    held_out += capture.held_out(i);
    masks += capture.mask_state(capture.shots[i]) != MaskSource::none;
  }
  Json json{{"folder", capture.folder().string()},
            {"unit", capture.unit == Unit::metres ? "m" : "unknown"},
            {"photos", capture.shots.size()},
            {"photos_positioned", positioned},
            {"photos_held_out", held_out},
            {"masks", masks},
            {"enclosure_photos", capture.enclosure.size()},
            {"cameras", Json::array()},
            {"notes", capture.notes},
            {"stages", Json::object()}};
  for (const Camera& c : capture.cameras)
    json["cameras"].push_back({{"width", c.width},
                               {"height", c.height},
                               {"f", c.f},
                               {"s", c.s},
                               {"skew", c.skew},
                               {"u0", c.u0},
                               {"v0", c.v0},
                               {"distorted", c.has_distortion()}});
  for (const auto& [name, record] : capture.stages)
    json["stages"][name] = {
        {"seconds", record.seconds}, {"peak_bytes", record.peak_bytes}, {"finished", record.finished}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lumihull::slf
