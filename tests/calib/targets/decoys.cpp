#include "decoys.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace lumihull::test {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) { return low + (high - low) * double(engine_() >> 11) * 0x1p-53; }
  int below(int n) { return int(engine_() % std::uint64_t(n)); }
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform(0, 1);
    return sum;
  }

 private:
  std::mt19937_64 engine_;
};

// A picture of one value a pixel, painted with soft edges.
struct Canvas {
  int width, height;
  std::vector<float> values;

  Canvas(int w, int h, float value) : width(w), height(h), values(std::size_t(w) * std::size_t(h), value) {}

  void blend(int x, int y, float value, double share) {
    float& v = values[std::size_t(y) * std::size_t(width) + std::size_t(x)];
    v += float(std::clamp(share, 0.0, 1.0)) * (value - v);
  }
  // |x|^power + |y|^power < 1 in the frame of `axes` (columns, px): 2 is an ellipse, large is a rectangle.
  void shape(const Vector2d& c, const Matrix2d& axes, double power, float value) {
    if (!(std::abs(axes.determinant()) > 0.05)) return;
    const Matrix2d inverse = axes.inverse();
    const double size = std::sqrt(std::abs(axes.determinant()));
    const Vector2d reach = axes.cwiseAbs().rowwise().sum();
    for (int y = std::max(0, int(c.y() - reach.y() - 1)); y <= std::min(height - 1, int(c.y() + reach.y() + 1)); ++y)
      for (int x = std::max(0, int(c.x() - reach.x() - 1)); x <= std::min(width - 1, int(c.x() + reach.x() + 1)); ++x) {
        const Vector2d p = inverse * (Vector2d(x + .5, y + .5) - c);
        const double r = std::pow(std::pow(std::abs(p.x()), power) + std::pow(std::abs(p.y()), power), 1 / power);
        blend(x, y, value, 0.5 + (1 - r) * size);
      }
  }
  void blur(double sigma) {
    if (sigma < 0.2) return;
    const int reach = int(std::ceil(3 * sigma));
    std::vector<float> kernel;
    float sum = 0;
    for (int i = -reach; i <= reach; ++i)
      kernel.push_back(float(std::exp(-0.5 * i * i / (sigma * sigma)))), sum += kernel.back();
    std::vector<float> out(values.size());
    for (int pass = 0; pass < 2; ++pass) {
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          float v = 0;
          for (int i = -reach; i <= reach; ++i) {
            const int px = pass ? x : std::clamp(x + i, 0, width - 1), py = pass ? std::clamp(y + i, 0, height - 1) : y;
            v += kernel[std::size_t(i + reach)] * values[std::size_t(py) * std::size_t(width) + std::size_t(px)];
          }
          out[std::size_t(y) * std::size_t(width) + std::size_t(x)] = v / sum;
        }
      std::swap(out, values);
    }
  }
};

Matrix2d turned(double angle, double a, double b) {
  return Eigen::Rotation2Dd(angle).toRotationMatrix() * Vector2d(a, b).asDiagonal();
}

// A grid in perspective: places, and the local frame of one pitch.
struct Perspective {
  Vector2d middle;
  Matrix2d axes;
  Vector2d pull;  // of the denominator
  Vector2d at(double u, double v) const { return middle + axes * Vector2d(u, v) / (1 + pull.dot(Vector2d(u, v))); }
  Matrix2d frame(double u, double v) const {
    Matrix2d m;
    m.col(0) = (at(u + .01, v) - at(u - .01, v)) / .02;
    m.col(1) = (at(u, v + .01) - at(u, v - .01)) / .02;
    return m;
  }
};

Perspective some_perspective(Random& random, const Canvas& canvas, double pitch) {
  Perspective p;
  p.middle = {canvas.width * random.uniform(.15, .85), canvas.height * random.uniform(.15, .85)};
  const double tilt = random.uniform(0, 1.1);
  p.axes = pitch * turned(random.uniform(0, 6.3), 1, std::cos(tilt)) *
           Eigen::Rotation2Dd(random.uniform(0, 6.3)).toRotationMatrix();
  p.pull = Vector2d(random.uniform(-1, 1), random.uniform(-1, 1)) * 0.03 * std::sin(tilt);
  return p;
}

// Rows of marks such as letters are made of.
void text(Canvas& canvas, Random& random, float ink) {
  const double size = random.uniform(6, 26), angle = random.uniform(-.3, .3);
  const Eigen::Rotation2Dd turn(angle);
  for (double y = -canvas.height; y < 2 * canvas.height; y += 1.6 * size)
    for (double x = -canvas.width; x < 2 * canvas.width; x += size * random.uniform(.6, .9)) {
      if (random.uniform(0, 1) < .15) continue;
      const Vector2d p = turn * Vector2d(x, y);
      if (p.x() < -size || p.y() < -size || p.x() > canvas.width + size || p.y() > canvas.height + size) continue;
      const int strokes = 1 + random.below(3);
      for (int s = 0; s < strokes; ++s) {
        const Vector2d q = p + turn * Vector2d(random.uniform(-.2, .2) * size, random.uniform(-.3, .3) * size);
        const double thick = 0.07 * size;
        if (random.below(3) == 0) {  // a bowl: o, e, d, …
          const Matrix2d axes = turned(angle, .25 * size, .3 * size);
          canvas.shape(q, axes, 2, ink);
          canvas.shape(q, axes * 0.6, 2, canvas.values[0]);
        } else {
          canvas.shape(q, turned(angle + (random.below(2) ? 0 : 1.57) + random.uniform(-.3, .3), .4 * size, thick), 8,
                       ink);
        }
      }
      if (random.below(6) == 0)
        canvas.shape(p + turn * Vector2d(.3 * size, .45 * size), turned(0, .08 * size, .08 * size), 2, ink);
    }
}

}  // namespace

Image decoy(std::uint64_t seed, int width, int height) {
  Random random(seed * 0x9e3779b97f4a7c15u + 1);
  const int kind = int(seed % kDecoyKinds);
  const float paper = float(random.uniform(.3, .9)), ink = paper * float(random.uniform(.02, .6));
  Canvas canvas(width, height, paper);
  double noise = random.uniform(0, .03);
  if (kind == 0) {  // noise of some grain
    for (float& v : canvas.values) v = float(std::clamp(.5 + .3 * random.normal(), 0., 1.));
    const double sigma = random.uniform(0, 6);
    canvas.blur(sigma);
    for (float& v : canvas.values) v = float(std::clamp(.5 + (v - .5) * (1 + 2.5 * sigma), 0., 1.));
  } else if (kind == 1 || kind == 2) {  // blotches; foliage in layers
    const int n = kind == 1 ? 400 : 3000;
    const double size = random.uniform(3, kind == 1 ? 14 : 9);
    for (int i = 0; i < n; ++i) {
      const double a = size * random.uniform(.5, 1.5), b = a * random.uniform(kind == 1 ? .5 : .2, 1);
      const float value = kind == 1 ? ink : float(random.uniform(.02, .8));
      canvas.shape({random.uniform(0, width), random.uniform(0, height)}, turned(random.uniform(0, 6.3), a, b), 2,
                   value);
    }
  } else if (kind == 3) {
    text(canvas, random, ink);
  } else if (kind == 4) {  // halftone: dots whose size is the picture
    const double pitch = random.uniform(7, 20);
    const Perspective grid = some_perspective(random, canvas, pitch);
    const int reach = int(width / pitch);
    const double fu = random.uniform(0, .4), fv = random.uniform(0, .4);
    for (int u = -reach; u <= reach; ++u)
      for (int v = -reach; v <= reach; ++v) {
        if (1 + grid.pull.dot(Vector2d(u, v)) < .3) continue;
        const double r = .12 + .33 * (.5 + .5 * std::sin(fu * u) * std::cos(fv * v));
        canvas.shape(grid.at(u, v), r * grid.frame(u, v), 2, ink);
      }
  } else if (kind == 5) {  // perforated sheets, connectors, dice
    for (int block = 0; block < 3; ++block) {
      const Perspective grid = some_perspective(random, canvas, random.uniform(8, 26));
      const int columns = block == 0 ? 4 + random.below(3) : 3 + random.below(10);
      const int rows = block == 0 ? columns : 3 + random.below(10);
      const double r = random.uniform(.2, .3), missing = random.below(3) == 0 ? .1 : 0,
                   ring = random.below(4) == 0 ? .55 : 0;
      for (int u = 0; u < columns; ++u)
        for (int v = 0; v < rows; ++v) {
          if (random.uniform(0, 1) < missing) continue;
          const double cu = u - .5 * columns, cv = v - .5 * rows;
          canvas.shape(grid.at(cu, cv), r * grid.frame(cu, cv), 2, ink);
          if (ring > 0) canvas.shape(grid.at(cu, cv), ring * r * grid.frame(cu, cv), 2, paper);
        }
    }
  } else if (kind == 6) {  // a keyboard: caps with letters, rows shifted or not
    const Perspective grid = some_perspective(random, canvas, random.uniform(12, 36));
    const double shift = random.below(2) ? 0 : .25, power = random.uniform(2, 8), cap = random.uniform(.24, .45);
    for (int v = -4; v <= 4; ++v)
      for (int u = -8; u <= 8; ++u) {
        const double cu = u + shift * v;
        if (1 + grid.pull.dot(Vector2d(cu, v)) < .3) continue;
        canvas.shape(grid.at(cu, v), cap * grid.frame(cu, v), power, ink);
        const int marks = random.below(3);
        for (int m = 0; m < marks; ++m)
          canvas.shape(
              grid.at(cu + random.uniform(-.1, .1), v + random.uniform(-.1, .1)),
              grid.frame(cu, v) * turned(random.uniform(0, 3), random.uniform(.03, .18), random.uniform(.03, .1)), 3,
              paper);
      }
  } else {  // nested shapes: rings, eyes, washers
    for (int i = 0; i < 60; ++i) {
      const Vector2d c(random.uniform(0, width), random.uniform(0, height));
      Matrix2d axes = turned(random.uniform(0, 6.3), random.uniform(3, 30), random.uniform(3, 30));
      for (int k = 0; k < 1 + random.below(4); ++k, axes *= random.uniform(.4, .9))
        canvas.shape(c, axes, random.below(2) ? 2 : 6, k % 2 ? paper : ink);
    }
  }
  if (kind != 0) canvas.blur(random.uniform(0, 1.8));
  Image out(width, height, 3);
  const float tint[3] = {float(random.uniform(.7, 1)), float(random.uniform(.7, 1)), float(random.uniform(.7, 1))};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) {
        const float v = tint[c] * canvas.values[std::size_t(y) * std::size_t(width) + std::size_t(x)] +
                        float(noise * random.normal());
        out.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(255 * srgb_from_linear(std::clamp(v, 0.f, 1.f)) + .5f);
      }
  return out;
}

}  // namespace lumihull::test
