#include <cairo-pdf.h>
#include <lumihull/base/error.h>

#include <cmath>
#include <exception>
#include <numbers>

#include "sheet_canvas.h"

namespace lumihull::calib {
namespace {

constexpr double kPointsPerMm = 72 / 25.4;

class PdfCanvas final : public SheetCanvas {
 public:
  PdfCanvas(double width_mm, double height_mm, const std::string& title, Sink sink) : sink_(std::move(sink)) {
    surface_.reset(cairo_pdf_surface_create_for_stream(&PdfCanvas::write, this, width_mm * kPointsPerMm,
                                                       height_mm * kPointsPerMm));
    check(cairo_surface_status(surface_.get()));
    cairo_pdf_surface_set_metadata(surface_.get(), CAIRO_PDF_METADATA_TITLE, title.c_str());
    cairo_pdf_surface_set_metadata(surface_.get(), CAIRO_PDF_METADATA_CREATOR, "Lumihull");
    // The same sheets are the same bytes, whenever they are written.
    cairo_pdf_surface_set_metadata(surface_.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
    cairo_.reset(cairo_create(surface_.get()));
    check(cairo_status(cairo_.get()));
    cairo_scale(cairo_.get(), kPointsPerMm, kPointsPerMm);
    cairo_set_fill_rule(cairo_.get(), CAIRO_FILL_RULE_EVEN_ODD);
    // The library's built-in font: there on every machine, and the same. Letters stand where the font wants them, not
    // at whole pixels.
    cairo_select_font_face(cairo_.get(), "@cairo:", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    const std::unique_ptr<cairo_font_options_t, void (*)(cairo_font_options_t*)> options(cairo_font_options_create(),
                                                                                         cairo_font_options_destroy);
    cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
    cairo_set_font_options(cairo_.get(), options.get());
  }

  void add_circle(double x, double y, double radius) override {
    // Eight cubic arcs: off the circle by 4e-6 of its radius at most. (The library's own arcs are as coarse as its
    // tolerance for pixels allows.)
    constexpr int kArcs = 8;
    const double step = 2 * std::numbers::pi / kArcs, handle = 4. / 3 * std::tan(step / 4) * radius;
    cairo_move_to(cairo_.get(), x + radius, y);
    for (int i = 0; i < kArcs; ++i) {
      const double c0 = radius * std::cos(i * step), s0 = radius * std::sin(i * step);
      const double c1 = radius * std::cos((i + 1) * step), s1 = radius * std::sin((i + 1) * step);
      cairo_curve_to(cairo_.get(), x + c0 - handle / radius * s0, y + s0 + handle / radius * c0,
                     x + c1 + handle / radius * s1, y + s1 - handle / radius * c1, x + c1, y + s1);
    }
    cairo_close_path(cairo_.get());
  }

  void add_polygon(std::span<const Eigen::Vector2d> corners) override {
    for (const Eigen::Vector2d& corner : corners) cairo_line_to(cairo_.get(), corner.x(), corner.y());
    cairo_close_path(cairo_.get());
    cairo_new_sub_path(cairo_.get());
  }

  void fill(const Rgb& color) override {
    set_color(color);
    cairo_fill(cairo_.get());
  }

  void text(double x, double y, double height, std::string_view line, const Rgb& color, Anchor anchor) override {
    const std::string terminated(line);
    cairo_set_font_size(cairo_.get(), height);
    if (anchor == Anchor::middle) {
      cairo_text_extents_t extents;
      cairo_text_extents(cairo_.get(), terminated.c_str(), &extents);
      x -= 0.5 * extents.x_advance;
    }
    set_color(color);
    cairo_move_to(cairo_.get(), x, y);
    cairo_show_text(cairo_.get(), terminated.c_str());
    cairo_new_path(cairo_.get());
  }

  void end_page() override {
    cairo_show_page(cairo_.get());
    check(cairo_status(cairo_.get()));
  }

  void finish() override {
    cairo_surface_finish(surface_.get());
    check(cairo_surface_status(surface_.get()));
  }

 private:
  /// C code can't be thrown through: the exception waits for the next check.
  static cairo_status_t write(void* self, const unsigned char* bytes, unsigned length) noexcept {
    auto& canvas = *static_cast<PdfCanvas*>(self);
    if (canvas.failed_) return CAIRO_STATUS_WRITE_ERROR;
    try {
      canvas.sink_({reinterpret_cast<const char*>(bytes), length});
    } catch (...) {
      canvas.failed_ = std::current_exception();
      return CAIRO_STATUS_WRITE_ERROR;
    }
    return CAIRO_STATUS_SUCCESS;
  }

  void check(cairo_status_t status) const {
    if (failed_) std::rethrow_exception(failed_);
    if (status == CAIRO_STATUS_SUCCESS) return;
    if (status == CAIRO_STATUS_NO_MEMORY) throw Error(ErrorCode::out_of_memory, "out of memory while drawing a sheet");
    throw Error(ErrorCode::internal, std::string("a sheet could not be drawn: ") + cairo_status_to_string(status));
  }

  void set_color(const Rgb& c) { cairo_set_source_rgb(cairo_.get(), c[0] / 255., c[1] / 255., c[2] / 255.); }

  Sink sink_;
  std::exception_ptr failed_;
  struct Release {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* cairo) const { cairo_destroy(cairo); }
  };
  std::unique_ptr<cairo_surface_t, Release> surface_;
  std::unique_ptr<cairo_t, Release> cairo_;
};

}  // namespace

std::unique_ptr<SheetCanvas> make_pdf_canvas(double width_mm, double height_mm, const std::string& title,
                                             SheetCanvas::Sink sink) {
  return std::make_unique<PdfCanvas>(width_mm, height_mm, title, std::move(sink));
}

}  // namespace lumihull::calib
