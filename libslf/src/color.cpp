#include "color.h"

#include <lumihull/base/image.h>

namespace lumihull::slf {
namespace {

constexpr int kCells = 4096;

struct Encoder {
  std::array<float, 256> threshold;        // the smallest linear value that is encoded as i or higher; [0] = 0
  std::array<std::uint8_t, kCells> guess;  // what the lower end of each cell is encoded as

  Encoder() {
    threshold[0] = 0;
    for (int i = 1; i < 256; ++i) threshold[i] = linear_from_srgb((float(i) - 0.5f) / 255.0f);
    int value = 0;
    for (int cell = 0; cell < kCells; ++cell) {
      while (value < 255 && threshold[value + 1] <= float(cell) / kCells) ++value;
      guess[cell] = std::uint8_t(value);
    }
  }
};

}  // namespace

const std::array<float, 256>& linear_of_srgb8() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t;
    for (int i = 0; i < 256; ++i) t[i] = linear_from_srgb(float(i) / 255.0f);
    return t;
  }();
  return table;
}

std::uint8_t srgb8_of_linear(float linear) {
  static const Encoder encoder;
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 255;
  int value = encoder.guess[int(linear * kCells)];
  while (value < 255 && encoder.threshold[value + 1] <= linear) ++value;
  return std::uint8_t(value);
}

}  // namespace lumihull::slf
