// AprilTag's families (Olson 2011; Wang & Olson 2016): which cells are light, from their own library.
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <lumihull/base/error.h>

#include <array>

#include "target_family_impl.h"

namespace lumihull::calib {
namespace {

struct Classic {
  std::string_view name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

/// The families whose cells are all inside of a full black border.
constexpr Classic kClassics[] = {{"36h11", tag36h11_create, tag36h11_destroy},
                                 {"36h10", tag36h10_create, tag36h10_destroy},
                                 {"25h9", tag25h9_create, tag25h9_destroy},
                                 {"16h5", tag16h5_create, tag16h5_destroy}};

constexpr std::array<std::string_view, 5> kUnsupported{"Standard41h12", "Standard52h13", "Circle21h7", "Circle49h12",
                                                       "Custom48h12"};

SquareWords read(const apriltag_family_t& family) {
  const int side = family.width_at_border - 2;
  if (side < 1 || side > 8 || family.reversed_border || family.nbits != std::uint32_t(side * side))
    throw Error(ErrorCode::internal, "the AprilTag library's family is not laid out as expected", family.name);
  SquareWords square{side, {}};
  for (std::uint32_t id = 0; id < family.ncodes; ++id) {
    CellBits cells = 0;
    for (std::uint32_t bit = 0; bit < family.nbits; ++bit) {
      // Places count from the border's top left cell; the code's first bit is its highest.
      const int x = int(family.bit_x[bit]) - 1, y = int(family.bit_y[bit]) - 1;
      if (x < 0 || y < 0 || x >= side || y >= side)
        throw Error(ErrorCode::internal, "the AprilTag library's family is not laid out as expected", family.name);
      if (family.codes[id] >> (family.nbits - 1 - bit) & 1) cells |= CellBits(1) << (y * side + x);
    }
    square.words.push_back(cells);
  }
  return square;
}

}  // namespace

std::optional<SquareWords> apriltag_words(std::string_view name) {
  for (const Classic& classic : kClassics)
    if (classic.name == name) {
      const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family(classic.create(), classic.destroy);
      return read(*family);
    }
  for (const std::string_view other : kUnsupported)
    if (other == name)
      throw Error(ErrorCode::unsupported, "it has cells outside of its border; print apriltag:36h11 instead",
                  "apriltag:" + std::string(name));
  return std::nullopt;
}

std::vector<std::string> apriltag_names() {
  std::vector<std::string> names;
  for (const Classic& classic : kClassics) names.emplace_back(classic.name);
  return names;
}

}  // namespace lumihull::calib
