#include <lumihull/slf/light_field_glb.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "html.h"
#include "light_fan.h"
#include "report_sections.h"

namespace lumihull::slf {
namespace {

constexpr int kFanSide = 150, kGap = 4;  // px
constexpr RenderOptions kFine{3, false, true};

/// Pictures of one size in a row, nothing between them.
Image side_by_side(const std::vector<Image>& pictures) {
  const int w = pictures[0].width(), h = pictures[0].height(), n = pictures[0].channels();
  Image out(int(pictures.size()) * (w + kGap) - kGap, h, n);
  for (int y = 0; y < h; ++y)
    for (std::size_t i = 0; i < pictures.size(); ++i)
      std::copy_n(pictures[i].row<std::uint8_t>(y), w * n, out.row<std::uint8_t>(y) + int(i) * (w + kGap) * n);
  return out;
}

std::string counted(std::size_t n, const char* what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

std::string in_words(const LightField& field, std::uint64_t bytes) {
  std::string text = counted(field.base.mesh.triangles.size(), "triangle") + ", " +
                     counted(field.terms.size(), "term") + (field.adds_base ? " beyond the mean colour" : "") +
                     (field.reflection ? " and what all places mirror alike" : "");
  if (!field.terms.empty()) {
    const std::size_t slots = field.terms[0].surface.size();
    text += ", maps of " + std::to_string(field.base.texture.width()) + " × " +
            std::to_string(field.base.texture.height()) + (slots > 1 ? ", " + std::to_string(slots) + " a term" : "");
  }
  return text + ", " + counted(field.nodes.size(), "node") + ", " + megabytes(bytes);
}

}  // namespace

void add_light_field(std::string& page, const std::filesystem::path& file, std::span<const View> photographs,
                     const TurntableOptions& turn, Job& job) {
  const LightField field = read_light_field(file);
  const LightFieldRenderer renderer(field);
  Job quiet({}, job.threads());
  page += "<h2>Surface light field</h2>\n<p>" + in_words(field, std::filesystem::file_size(file)) +
          "</p>\n<div class=\"grid wide\">\n";
  int frame = 0;
  for (const PathView& v : turntable(renderer.mesh(), photographs, turn)) {
    job.check();
    page += figure(renderer.render(v.view, kFine, quiet).rgba, formatted("%.0f°", 360.0 * frame++ / turn.frames));
    job.advance();
  }
  page += "</div>\n";

  const std::vector<View> fan = light_fan(field, renderer.scene(), kFanPictures, kFanSide);
  if (fan.empty()) return;
  const auto strip = [&](const std::string& caption, const std::function<Rendering(const View&)>& render) {
    std::vector<Image> pictures;
    for (const View& view : fan) {
      job.check();
      pictures.push_back(render(view).rgba);
      job.advance();
    }
    page += figure(side_by_side(pictures), caption);
  };
  page += "<h3>One place from a fan of directions</h3>\n<p class=\"dim\">" + formatted("−%.0f°", kFanDegrees) + " to " +
          formatted("%.0f°", kFanDegrees) +
          ", where lightness changes most with the direction: gloss moves, paint stays.</p>\n<div class=\"strips\">\n";
  strip("light field", [&](const View& view) { return renderer.render(view, kFine, quiet); });
  strip("its mean colour alone",
        [&](const View& view) { return render_texture(field.base, renderer.scene(), view, kFine, quiet); });
  page += "</div>\n";
}

}  // namespace lumihull::slf
