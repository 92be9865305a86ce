// SVG as people would write it: millimetres, true circles, text that stays text.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "sheet_canvas.h"

namespace lumihull::calib {
namespace {

/// A length in mm, without needless zeros; locales do not matter to it.
std::string number(double mm) {
  const long long units = std::llround(mm * 1e4);
  char text[40];
  std::snprintf(text, sizeof text, "%s%lld.%04lld", units < 0 ? "-" : "", std::llabs(units) / 10000,
                std::llabs(units) % 10000);
  std::string short_text(text);
  short_text.erase(short_text.find_last_not_of('0') + 1);
  if (short_text.back() == '.') short_text.pop_back();
  return short_text;
}

std::string hex(const Rgb& color) {
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", color[0], color[1], color[2]);
  return text;
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  return out;
}

class SvgCanvas final : public SheetCanvas {
 public:
  SvgCanvas(double width_mm, double height_mm, const std::string& title, Sink sink) : sink_(std::move(sink)) {
    const std::string width = number(width_mm), height = number(height_mm);
    sink_(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" "
        "width=\"" +
        width + "mm\" height=\"" + height + "mm\" viewBox=\"0 0 " + width + " " + height + "\">\n<title>" +
        escaped(title) + "</title>\n");
  }

  void add_circle(double x, double y, double radius) override {
    const std::string left = number(x - radius), right = number(x + radius), height = number(y), r = number(radius);
    const std::string arc = "A" + r + " " + r + " 0 0 1 ";
    path_ += "M" + right + " " + height + arc + left + " " + height + arc + right + " " + height + "Z\n";
  }

  void add_polygon(std::span<const Eigen::Vector2d> corners) override {
    for (std::size_t i = 0; i < corners.size(); ++i)
      path_ += (i ? "L" : "M") + number(corners[i].x()) + " " + number(corners[i].y());
    path_ += "Z\n";
  }

  void fill(const Rgb& color) override {
    if (!path_.empty()) sink_("<path fill=\"" + hex(color) + "\" fill-rule=\"evenodd\" d=\"" + path_ + "\"/>\n");
    path_.clear();
  }

  void text(double x, double y, double height, std::string_view line, const Rgb& color, Anchor anchor) override {
    sink_("<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" font-family=\"sans-serif\" font-size=\"" +
          number(height) + "\" fill=\"" + hex(color) + (anchor == Anchor::middle ? "\" text-anchor=\"middle" : "") +
          "\">" + escaped(line) + "</text>\n");
  }

  void end_page() override {}
  void finish() override { sink_("</svg>\n"); }

 private:
  Sink sink_;
  std::string path_;
};

}  // namespace

std::unique_ptr<SheetCanvas> make_svg_canvas(double width_mm, double height_mm, const std::string& title,
                                             SheetCanvas::Sink sink) {
  return std::make_unique<SvgCanvas>(width_mm, height_mm, title, std::move(sink));
}

}  // namespace lumihull::calib
