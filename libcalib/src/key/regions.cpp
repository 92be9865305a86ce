// Places in photographs: named rectangles, and the black frame that a scanner leaves.
#include <lumihull/base/error.h>
#include <lumihull/calib/background.h>

#include <algorithm>
#include <array>
#include <charconv>

namespace lumihull::calib {

std::vector<Region> parse_regions(const std::string& text) {
  std::vector<Region> regions;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    begin = end + 1;
    if (part.empty()) continue;
    Region region;
    const std::size_t colon = part.rfind(':');
    bool good = colon != std::string::npos && colon > 0;
    if (good) {
      region.photo = part.substr(0, colon);
      const char *at = part.data() + colon + 1, *last = part.data() + part.size();
      int* const fields[] = {&region.x, &region.y, &region.width, &region.height};
      for (std::size_t i = 0; i < 4 && good; ++i) {
        if (i > 0) good = at < last && *at++ == ',';
        if (!good) break;
        const auto [next, error] = std::from_chars(at, last, *fields[i]);
        good = error == std::errc() && *fields[i] >= (i < 2 ? 0 : 1);
        at = next;
      }
      good = good && at == last;
    }
    if (!good)
      throw Error(ErrorCode::invalid_argument, "expected NAME:x,y,width,height in pixels, not \"" + part + "\"",
                  "regions");
    regions.push_back(std::move(region));
  }
  if (regions.empty()) throw Error(ErrorCode::invalid_argument, "expected NAME:x,y,width,height", "regions");
  return regions;
}

Frame find_frame(const Image& photo) {
  assert(photo.type() == PixelType::u8 && photo.channels() == 3);
  Frame frame{0, 0, photo.width(), photo.height()};
  // Brightest channel at a share of a line's pixels, lines counted from one of the four sides.
  const auto level = [&](int side, int line, double share) {
    std::array<int, 256> histogram{};
    const bool column = side < 2;
    const int from = column ? frame.y0 : frame.x0, to = column ? frame.y1 : frame.x1;
    for (int i = from; i < to; ++i) {
      const int x = column ? (side == 0 ? line : photo.width() - 1 - line) : i;
      const int y = column ? i : (side == 2 ? line : photo.height() - 1 - line);
      const std::uint8_t* p = photo.row<std::uint8_t>(y) + 3 * x;
      ++histogram[std::size_t(std::max({p[0], p[1], p[2]}))];
    }
    int left = int(share * (to - from)), v = 0;
    while (v < 255 && (left -= histogram[std::size_t(v)]) >= 0) ++v;
    return v;
  };
  constexpr int kBlack = 44, kStep = 30;
  constexpr double kNearlyAll = 0.985;
  for (int side = 0; side < 4; ++side) {
    const int length = side < 2 ? photo.width() : photo.height(), most = length / 8;
    int lines = 0, darkest = 0;
    while (lines < most) {
      const int v = level(side, lines, kNearlyAll);
      if (v > kBlack) break;
      darkest = std::max(darkest, v), ++lines;
    }
    // A frame ends in a step; a dark enclosure goes on.
    if (lines == 0 || lines == most || lines + 3 >= length || level(side, lines + 3, 0.5) < darkest + kStep) continue;
    lines += 2;  // half-covered lines, and the scan's overshoot
    if (side == 0) frame.x0 = lines;
    if (side == 1) frame.x1 = photo.width() - lines;
    if (side == 2) frame.y0 = lines;
    if (side == 3) frame.y1 = photo.height() - lines;
  }
  return frame;
}

}  // namespace lumihull::calib
