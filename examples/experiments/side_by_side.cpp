#include <lumihull/slf/metrics.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "experiment.h"

namespace lumihull::experiments {
namespace {

double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double cpu_s() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) sum += double(t.tv_sec) + 1e-6 * double(t.tv_usec);
  }
  return sum;
}

}  // namespace

Stopwatch::Stopwatch() : wall_(wall_s()), cpu_(cpu_s()) {}
Json Stopwatch::seconds() const { return {{"wall", wall_s() - wall_}, {"cpu", cpu_s() - cpu_}}; }

Image side_by_side(const std::vector<Image>& pictures, int height) {
  constexpr int kGap = 4;
  std::vector<Image> small;
  int width = -kGap;
  for (const Image& p : pictures) {
    if (p.empty()) continue;
    const Image rgb = p.channels() == 4 ? slf::composited(p, {255, 255, 255}) : converted(p, PixelType::u8, 3);
    const double scale = double(height) / rgb.height();
    const int w = std::max(1, int(std::lround(scale * rgb.width())));
    Image s(w, height, 3);
    // The mean over each pixel's square of the larger picture.
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < w; ++x) {
        const int x0 = int(x / scale), y0 = int(y / scale);
        const int x1 = std::clamp(int((x + 1) / scale), x0 + 1, rgb.width()),
                  y1 = std::clamp(int((y + 1) / scale), y0 + 1, rgb.height());
        long sum[3] = {};
        for (int v = y0; v < y1; ++v)
          for (int u = x0; u < x1; ++u)
            for (int c = 0; c < 3; ++c) sum[c] += rgb.row<std::uint8_t>(v)[3 * u + c];
        for (int c = 0; c < 3; ++c)
          s.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(sum[c] / std::max(1, (x1 - x0) * (y1 - y0)));
      }
    width += w + kGap;
    small.push_back(std::move(s));
  }
  Image out(std::max(1, width), height, 3);
  std::memset(out.data(), 255, out.bytes());
  int at = 0;
  for (const Image& s : small) {
    for (int y = 0; y < height; ++y)
      std::copy_n(s.row<std::uint8_t>(y), 3 * s.width(), out.row<std::uint8_t>(y) + 3 * at);
    at += s.width() + kGap;
  }
  return out;
}

}  // namespace lumihull::experiments
