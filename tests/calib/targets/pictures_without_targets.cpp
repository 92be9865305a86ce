#include "pictures_without_targets.h"

#include <cairo.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "target_shot.h"

namespace lumihull::test {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using std::numbers::pi;

/// Roughly normal, variance 1.
double normal(Dice& dice) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += dice.unit();
  return sum;
}

std::uint8_t byte(double v) { return std::uint8_t(std::clamp(v, 0., 255.) + .5); }

Image noise(int size, Dice& dice) {
  Image image(size, size, 3);
  const bool grey = dice.chance(.5);
  const double mean = dice.between(40, 200), sigma = dice.between(2, 90);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const double common = normal(dice);
      for (int c = 0; c < 3; ++c)
        image.row<std::uint8_t>(y)[3 * x + c] = byte(mean + sigma * (grey ? common : normal(dice)));
    }
  return image;
}

/// Octaves of bilinear lattice noise, each half as strong as the one twice as coarse.
Image pink(int size, Dice& dice) {
  const bool grey = dice.chance(.5);
  const double contrast = dice.between(30, 400), steep = dice.chance(.3) ? 8 : 1;  // steep: blots with edges
  std::vector<std::array<double, 3>> sum(std::size_t(size) * std::size_t(size), {0, 0, 0});
  for (int cell = 2; cell < 2 * size; cell *= 2) {
    const int n = size / cell + 2;
    const double weight = double(cell) / size;
    std::vector<std::array<double, 3>> lattice(std::size_t(n) * std::size_t(n));
    for (auto& v : lattice) {
      v[0] = normal(dice);
      v[1] = grey ? v[0] : normal(dice), v[2] = grey ? v[0] : normal(dice);
    }
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) {
        const double u = double(x) / cell, v = double(y) / cell;
        const int i = int(u), j = int(v);
        const auto at = [&](int dx, int dy) { return lattice[std::size_t((j + dy) * n + i + dx)]; };
        const auto a = at(0, 0), b = at(1, 0), c = at(0, 1), d = at(1, 1);
        const double s = u - i, t = v - j;
        for (std::size_t k = 0; k < 3; ++k)
          sum[std::size_t(y * size + x)][k] +=
              weight * ((1 - t) * ((1 - s) * a[k] + s * b[k]) + t * ((1 - s) * c[k] + s * d[k]));
      }
  }
  Image image(size, size, 3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int c = 0; c < 3; ++c)
        image.row<std::uint8_t>(y)[3 * x + c] =
            byte(128 + contrast * steep * .5 * sum[std::size_t(y * size + x)][std::size_t(c)]);
  return image;
}

Image salt(int size, Dice& dice) {
  Image image(size, size, 3);
  const double ground = dice.between(60, 200);
  std::fill_n(image.row<std::uint8_t>(0), image.bytes(), byte(ground));
  const double density = std::pow(10, dice.between(-3.5, -.7));
  const int largest = 1 + dice.below(7);
  for (int n = int(density * size * size); n-- > 0;) {
    const int x = dice.below(size), y = dice.below(size), r = 1 + dice.below(largest);
    const bool light = dice.chance(.5), round = dice.chance(.7);
    for (int dy = -r; dy <= r; ++dy)
      for (int dx = -r; dx <= r; ++dx) {
        const int u = x + dx, v = y + dy;
        if (u < 0 || v < 0 || u >= size || v >= size || (round && dx * dx + dy * dy > (r - .5) * (r - .5))) continue;
        std::fill_n(image.row<std::uint8_t>(v) + 3 * u, 3, std::uint8_t(light ? 255 : 0));
      }
  }
  return image;
}

/// A drawing surface.
class Canvas {
 public:
  explicit Canvas(int size)
      : size_(size),
        surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, size, size)),
        cr_(cairo_create(surface_)) {}
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  ~Canvas() { cairo_destroy(cr_), cairo_surface_destroy(surface_); }
  cairo_t* operator*() { return cr_; }

  Image image() {
    cairo_surface_flush(surface_);
    const unsigned char* data = cairo_image_surface_get_data(surface_);
    const int stride = cairo_image_surface_get_stride(surface_);
    Image result(size_, size_, 3);
    for (int y = 0; y < size_; ++y)
      for (int x = 0; x < size_; ++x)
        for (int c = 0; c < 3; ++c)
          result.row<std::uint8_t>(y)[3 * x + c] = data[std::ptrdiff_t(y) * stride + 4 * x + 2 - c];
    return result;
  }

 private:
  int size_;
  cairo_surface_t* surface_;
  cairo_t* cr_;
};

void paint_ground(cairo_t* cr, Dice& dice, double low, double high) {
  const double g = dice.between(low, high);
  cairo_set_source_rgb(cr, g * dice.between(.7, 1), g, g * dice.between(.7, 1));
  cairo_paint(cr);
}

Image strokes(int size, Dice& dice) {
  Canvas canvas(size);
  cairo_t* cr = *canvas;
  paint_ground(cr, dice, .5, 1);
  const double scale = std::pow(10, dice.between(.6, 2));
  for (int n = int(std::min(4000., 1.5 * size * size / (scale * scale))); n-- > 0;) {
    const double g = dice.between(0, .4), x = dice.between(0, size), y = dice.between(0, size);
    cairo_set_source_rgb(cr, g * dice.unit(), g, g * dice.unit());
    cairo_set_line_width(cr, scale * dice.between(.05, .3));
    const auto spot = [&] { return scale * dice.between(-1, 1); };
    switch (dice.below(4)) {
      case 0:
        cairo_move_to(cr, x, y), cairo_line_to(cr, x + spot(), y + spot()), cairo_line_to(cr, x + spot(), y + spot());
        cairo_stroke(cr);
        break;
      case 1:
        cairo_move_to(cr, x, y);
        cairo_curve_to(cr, x + spot(), y + spot(), x + spot(), y + spot(), x + spot(), y + spot());
        cairo_stroke(cr);
        break;
      case 2:
        cairo_new_path(cr), cairo_arc(cr, x, y, scale * dice.between(.1, .5), 0, 2 * pi * dice.between(.6, 1.2));
        cairo_stroke(cr);
        break;
      default:
        cairo_new_path(cr), cairo_arc(cr, x, y, scale * dice.between(.1, .5), 0, 2 * pi), cairo_fill(cr);
    }
  }
  return canvas.image();
}

Image text(int size, Dice& dice) {
  Canvas canvas(size);
  cairo_t* cr = *canvas;
  const bool negative = dice.chance(.2);
  paint_ground(cr, dice, negative ? 0 : .6, negative ? .3 : 1);
  const double g = negative ? dice.between(.7, 1) : dice.between(0, .3);
  cairo_set_source_rgb(cr, g, g, g);
  cairo_translate(cr, size / 2., size / 2.), cairo_rotate(cr, dice.chance(.5) ? 0 : dice.between(0, 2 * pi));
  cairo_transform(cr, std::array{cairo_matrix_t{1, dice.between(-.3, .3), dice.between(-.3, .3), 1, 0, 0}}.data());
  const std::array fonts{"DejaVu Sans Mono", "DejaVu Sans", "DejaVu Serif", "Liberation Mono", "monospace"};
  cairo_select_font_face(cr, fonts[std::size_t(dice.below(int(fonts.size())))], CAIRO_FONT_SLANT_NORMAL,
                         dice.chance(.4) ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  const double height = std::pow(10, dice.between(.7, 1.9)), leading = height * dice.between(.62, 1.5);
  cairo_set_font_size(cr, height);
  const std::string letters = "etaoinshrdlucmfwypvbgkjqxzETAOINSHRDLU0123456789.,;:-()", round = "oO08@Q.oOo";
  const double all_round = dice.chance(.35) ? 1 : dice.between(0, .3);
  const bool same = dice.chance(.3);  // rows of one sign
  const char sign = round[std::size_t(dice.below(int(round.size())))];
  for (double y = -.75 * size; y < .8 * size; y += leading) {
    std::string line;
    for (int n = int(3.2 * size / height); n-- > 0;) {
      const bool r = dice.chance(all_round);
      const std::string& from = r ? round : letters;
      line += r && same                           ? sign
              : dice.chance(.12) && all_round < 1 ? ' '
                                                  : from[std::size_t(dice.below(int(from.size())))];
    }
    cairo_move_to(cr, -.75 * size, y), cairo_show_text(cr, line.c_str());
  }
  return canvas.image();
}

Image leaves(int size, Dice& dice) {
  Canvas canvas(size);
  cairo_t* cr = *canvas;
  paint_ground(cr, dice, .1, .4);
  const double scale = std::pow(10, dice.between(.7, 1.9));
  const bool pebbles = dice.chance(.4);
  for (int n = int(std::min(6000., 3. * size * size / (scale * scale))); n-- > 0;) {
    cairo_save(cr);
    cairo_translate(cr, dice.between(0, size), dice.between(0, size)), cairo_rotate(cr, dice.between(0, 2 * pi));
    const double length = scale * dice.between(.4, 1), breadth = length * dice.between(.3, pebbles ? 1 : .6);
    const double g = dice.between(.1, .9);
    cairo_set_source_rgb(cr, g * dice.between(.2, .7), g, g * dice.between(.1, .5));
    if (pebbles) {
      cairo_scale(cr, length, breadth), cairo_arc(cr, 0, 0, .5, 0, 2 * pi);
    } else {
      cairo_move_to(cr, -length / 2, 0);
      cairo_curve_to(cr, -length / 6, breadth, length / 6, breadth, length / 2, 0);
      cairo_curve_to(cr, length / 6, -breadth, -length / 6, -breadth, -length / 2, 0);
    }
    cairo_fill(cr);
    cairo_restore(cr);
  }
  return canvas.image();
}

Image halftone(int size, Dice& dice) {
  Canvas canvas(size);
  cairo_t* cr = *canvas;
  cairo_set_source_rgb(cr, 1, 1, 1), cairo_paint(cr);
  const int screens = dice.chance(.3) ? 3 : 1;
  const double pitch = std::pow(10, dice.between(.75, 1.5));
  if (screens > 1) cairo_set_operator(cr, CAIRO_OPERATOR_MULTIPLY);
  for (int k = 0; k < screens; ++k) {
    const double angle = dice.between(0, pi / 2), fx = dice.between(-8, 8), fy = dice.between(-8, 8),
                 mean = dice.between(.2, .5), swing = dice.between(0, .35);
    const double c = std::cos(angle), s = std::sin(angle);
    if (screens > 1)
      cairo_set_source_rgb(cr, k == 0 ? 0 : 1, k == 1 ? 0 : 1, k == 2 ? 0 : 1);
    else
      cairo_set_source_rgb(cr, 0, 0, 0);
    const int n = int(1.5 * size / pitch);
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        const double x = size / 2. + pitch * (i * c - j * s), y = size / 2. + pitch * (i * s + j * c);
        if (x < -pitch || y < -pitch || x > size + pitch || y > size + pitch) continue;
        const double r = pitch * (mean + swing * std::sin((fx * x + fy * y) / size));
        if (r <= 0) continue;
        cairo_new_path(cr), cairo_arc(cr, x, y, r, 0, 2 * pi), cairo_fill(cr);
      }
  }
  return canvas.image();
}

rig::FlatShape disc(const Vector2d& center, double radius, const Vector3f& color) {
  rig::FlatShape s;
  s.center = center, s.radius = radius, s.color = color;
  return s;
}

Image perforated(int size, Dice& dice) {
  const int columns = 3 + dice.below(14), rows = 3 + dice.below(14);
  const double radius = dice.between(.15, .45), inner = radius * dice.between(.35, .75);
  const int kind = dice.below(6);  // discs, rings, light discs, some lack, hexagonal, alternating by row
  const double lack = kind == 3 ? dice.between(.02, .4) : 0;
  const float dark = float(dice.between(.02, .15)), light = float(dice.between(.4, .9));
  Vector3f ink(dark, dark, dark), paper(light, light, light);
  if (kind == 2) std::swap(ink, paper);
  rig::FlatPrint print;
  print.paper = paper;
  print.low = {-1, -1}, print.high = {double(columns), double(rows)};
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      if (dice.chance(lack)) continue;
      const Vector2d at(x + (kind == 4 && y % 2 ? .5 : 0), kind == 4 ? y * .866 : y);
      print.shapes.push_back(disc(at, radius, ink));
      if (kind == 1 || (kind == 5 && y % 2)) print.shapes.push_back(disc(at, inner, paper));
    }
  View view;
  view.camera.width = view.camera.height = size;
  view.camera.f = size * dice.between(.8, 4);
  view.camera.u0 = view.camera.v0 = size / 2.;
  const double pitch_px = dice.between(8, size / 6.);
  const double axis = dice.between(0, 2 * pi);
  print.world_from_print.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(dice.between(0, 1.2), Vector3d(std::cos(axis), std::sin(axis), 0)) *
                         Eigen::AngleAxisd(dice.between(0, 2 * pi), Vector3d::UnitZ()));
  print.world_from_print.translation =
      Vector3d(0, 0, view.camera.f / pitch_px) -
      print.world_from_print.rotation * Vector3d((columns - 1) / 2., (rows - 1) / 2., 0);
  rig::PrintPhotoOptions options;
  options.blur_px = dice.between(0, 2), options.noise_read = dice.between(0, .02);
  const float ground = float(dice.between(.02, .9));
  return rig::photograph_prints(view, std::vector{print}, {ground, ground, ground}, options, dice.next());
}

Image tiles(int size, Dice& dice) {
  Canvas canvas(size);
  cairo_t* cr = *canvas;
  paint_ground(cr, dice, .5, 1);
  cairo_translate(cr, size / 2., size / 2.), cairo_rotate(cr, dice.between(0, 2 * pi));
  cairo_transform(cr, std::array{cairo_matrix_t{1, dice.between(-.3, .3), dice.between(-.3, .3), 1, 0, 0}}.data());
  const double g = dice.between(0, .25), p = std::pow(10, dice.between(.8, 1.7));
  cairo_set_source_rgb(cr, g, g, g);
  const int n = int(1.2 * size / p), kind = dice.below(5);
  const auto box = [&](double x, double y, double w, double h) { cairo_rectangle(cr, x, y, w, h), cairo_fill(cr); };
  for (int j = -n; j < n; ++j)
    for (int i = -n; i < n; ++i) {
      const double x = i * p, y = j * p;
      if (kind == 0 && (i + j) % 2 == 0) box(x, y, p, p);                            // chessboard
      if (kind == 1) box(x + .1 * p, y + .1 * p, .8 * p, .8 * p);                    // windows
      if (kind == 2 && j == -n) box(x, -size, p * dice.between(.1, .9), 2. * size);  // barcode
      if (kind == 3 && dice.chance(.5)) box(x, y, p + .5, p + .5);                   // random modules
      if (kind == 4 && i % 4 == 0 && j % 4 == 0) {                                   // squares in squares
        box(x, y, 3 * p, 3 * p);
        cairo_set_source_rgb(cr, .9, .9, .9), box(x + .5 * p, y + .5 * p, 2 * p, 2 * p),
            cairo_set_source_rgb(cr, g, g, g);
        if (dice.chance(.7)) box(x + p, y + p, p, p);
      }
    }
  return canvas.image();
}

Image crop(int size, Dice& dice, std::span<const Image> photographs) {
  const Image& from = photographs[std::size_t(dice.below(int(photographs.size())))];
  const double scale = dice.between(.5, 1.5), turn = dice.chance(.5) ? 0 : dice.between(0, 2 * pi);
  const bool mirrored = dice.chance(.5), inverted = dice.chance(.1);
  const double gain = dice.between(.6, 1.6), blur = dice.chance(.5) ? 0 : dice.between(0, 3);
  const Vector2d middle(dice.between(.2, .8) * from.width(), dice.between(.2, .8) * from.height());
  Image image(size, size, 3);
  const double c = std::cos(turn) / scale, s = std::sin(turn) / scale;
  const int taps = blur > 0 ? 3 : 1;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      std::array<double, 3> sum{};
      for (int j = 0; j < taps; ++j)
        for (int i = 0; i < taps; ++i) {
          const double u = (mirrored ? -1 : 1) * (x - size / 2.) + blur * (i - (taps - 1) / 2),
                       v = y - size / 2. + blur * (j - (taps - 1) / 2);
          const double px = std::clamp(middle.x() + c * u - s * v, 0., from.width() - 1.001),
                       py = std::clamp(middle.y() + s * u + c * v, 0., from.height() - 1.001);
          const int k = int(px), l = int(py);
          const double a = px - k, b = py - l;
          const std::uint8_t *r0 = from.row<std::uint8_t>(l) + 3 * k, *r1 = from.row<std::uint8_t>(l + 1) + 3 * k;
          for (int m = 0; m < 3; ++m)
            sum[std::size_t(m)] +=
                ((1 - b) * ((1 - a) * r0[m] + a * r0[m + 3]) + b * ((1 - a) * r1[m] + a * r1[m + 3])) / (taps * taps);
        }
      for (int m = 0; m < 3; ++m)
        image.row<std::uint8_t>(y)[3 * x + m] =
            byte(128 + gain * ((inverted ? 255 - sum[std::size_t(m)] : sum[std::size_t(m)]) - 128));
    }
  return image;
}

}  // namespace

std::string clutter_name(Clutter kind) {
  static const std::array<std::string, kClutterKinds> names{"white noise", "pink noise", "salt",     "strokes",
                                                            "text",        "leaves",     "halftone", "perforated",
                                                            "tiles",       "photographs"};
  return names[std::size_t(kind)];
}

Image clutter(Clutter kind, int size, std::uint64_t seed, std::span<const Image> photographs) {
  Dice dice(seed * std::uint64_t(kClutterKinds) + std::uint64_t(kind));
  switch (kind) {
    case Clutter::white_noise:
      return noise(size, dice);
    case Clutter::pink_noise:
      return pink(size, dice);
    case Clutter::salt:
      return salt(size, dice);
    case Clutter::strokes:
      return strokes(size, dice);
    case Clutter::text:
      return text(size, dice);
    case Clutter::leaves:
      return leaves(size, dice);
    case Clutter::halftone:
      return halftone(size, dice);
    case Clutter::perforated:
      return perforated(size, dice);
    case Clutter::tiles:
      return tiles(size, dice);
    case Clutter::photographs:
      return crop(size, dice, photographs);
  }
  return {};
}

}  // namespace lumihull::test
