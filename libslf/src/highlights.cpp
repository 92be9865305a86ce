#include <lumihull/base/error.h>
#include <lumihull/internal/json.h>
#include <lumihull/slf/highlights.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace lumihull::slf {
namespace {

using internal::Json;
using internal::JsonReader;

constexpr double kSmoothing = 0.01, kReach = 0.08;  // of the shorter side
constexpr double kFound = 0.3;
constexpr double kLeastStrength = 0.05;  // weaker ones are not looked for

struct Gloss {
  int width, height;
  std::vector<float> values;
  float at(int x, int y) const { return values[std::size_t(y) * std::size_t(width) + std::size_t(x)]; }
};

/// Two passes of a running mean over 2 r + 1 values along rows or columns: nearly a Gaussian.
void smooth(Gloss& g, int r) {
  const auto run = [&](int length, int lines, std::size_t step, std::size_t line_step) {
    std::vector<float> sums(std::size_t(length) + 1);
    for (int line = 0; line < lines; ++line)
      for (int pass = 0; pass < 2; ++pass) {
        float* at = &g.values[std::size_t(line) * line_step];
        for (int i = 0; i < length; ++i) sums[std::size_t(i) + 1] = sums[std::size_t(i)] + at[std::size_t(i) * step];
        for (int i = 0; i < length; ++i) {
          const int low = std::max(0, i - r), high = std::min(length, i + r + 1);
          at[std::size_t(i) * step] = (sums[std::size_t(high)] - sums[std::size_t(low)]) / float(high - low);
        }
      }
  };
  run(g.width, g.height, 1, std::size_t(g.width));
  run(g.height, g.width, std::size_t(g.width), 1);
}

float luma(const std::uint8_t* p) { return (0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2]) / 255; }

Gloss gloss_of(const Image& picture, const Image& matt) {
  Gloss g{picture.width(), picture.height(), {}};
  for (int y = 0; y < g.height; ++y) {
    const std::uint8_t *a = picture.row<std::uint8_t>(y), *b = matt.row<std::uint8_t>(y);
    for (int x = 0; x < g.width; ++x)
      g.values.push_back(luma(a + picture.channels() * x) - luma(b + matt.channels() * x));
  }
  smooth(g, std::max(1, int(kSmoothing * std::min(g.width, g.height))));
  return g;
}

struct Peak {
  Eigen::Vector2d pixel;
  float height;
};

/// The highest place near `around`, as the centroid of what is above half of it.
Peak peak_near(const Gloss& g, const Eigen::Vector2d& around) {
  const double reach = kReach * std::min(g.width, g.height);
  const auto for_each = [&](const Eigen::Vector2d& middle, auto&& visit) {
    for (int y = std::max(0, int(middle.y() - reach)); y < std::min(double(g.height), middle.y() + reach); ++y)
      for (int x = std::max(0, int(middle.x() - reach)); x < std::min(double(g.width), middle.x() + reach); ++x)
        if (const Eigen::Vector2d p(x + 0.5, y + 0.5); (p - middle).norm() <= reach) visit(p, g.at(x, y));
  };
  Peak best{around, 0};
  for_each(around, [&](const Eigen::Vector2d& p, float v) {
    if (v > best.height) best = {p, v};
  });
  Eigen::Vector2d sum(0, 0);
  double weight = 0;
  for_each(best.pixel, [&](const Eigen::Vector2d& p, float v) {
    const double w = std::max(0.0f, v - 0.5f * best.height);
    sum += w * p, weight += w;
  });
  if (weight > 0) best.pixel = sum / weight;
  return best;
}

const Highlight* strongest(const ViewHighlights& view, int lamp) {
  const Highlight* best = nullptr;
  for (const Highlight& h : view.highlights)
    if (h.lamp == lamp && h.strength >= kLeastStrength && (!best || h.strength > best->strength)) best = &h;
  return best;
}

int main_lamp(std::span<const ViewHighlights> truth) {
  std::map<int, double> sums;
  for (const ViewHighlights& view : truth)
    for (const Highlight& h : view.highlights) sums[h.lamp] += std::min(h.strength, 1.0);
  int best = 0;
  double most = 0;
  for (const auto& [lamp, sum] : sums)
    if (sum > most) best = lamp, most = sum;
  return best;
}

bool fits(const Image& a, const Image& b) {
  const auto good = [](const Image& i) {
    return i.type() == PixelType::u8 && (i.channels() == 3 || i.channels() == 4);
  };
  return good(a) && good(b) && a.width() == b.width() && a.height() == b.height();
}

}  // namespace

std::vector<ViewHighlights> read_highlights(const std::filesystem::path& file) {
  const Json document = internal::read_json(file);
  const JsonReader top(document, file.string());
  if (top.at("format").string() != "lumihull-highlights") top.at("format").fail("\"lumihull-highlights\"");
  if (top.at("version").integer(1, 1'000'000) != 1) top.at("version").fail("version 1");
  std::vector<ViewHighlights> out;
  const JsonReader shots = top.at("shots");
  const std::size_t n = shots.array_size(1'000'000);
  for (std::size_t i = 0; i < n; ++i) {
    const JsonReader shot = shots.at(i), highlights = shot.at("highlights");
    ViewHighlights view{shot.at("name").string(), {}};
    const std::size_t count = highlights.array_size(100'000);
    for (std::size_t k = 0; k < count; ++k) {
      const JsonReader h = highlights.at(k), pixel = h.at("pixel");
      if (pixel.array_size(2) != 2) pixel.fail("two numbers");
      view.highlights.push_back(
          {int(h.at("lamp").integer(0, 1'000'000)),
           {pixel.at(std::size_t(0)).number(-1e6, 1e6), pixel.at(std::size_t(1)).number(-1e6, 1e6)},
           h.at("strength").number(0, 1e9)});
    }
    out.push_back(std::move(view));
  }
  return out;
}

HighlightPath follow_highlight(std::span<const Image> pictures, std::span<const Image> photographs,
                               std::span<const Image> matt, std::span<const ViewHighlights> truth) {
  if (pictures.size() != truth.size() || photographs.size() != truth.size() || matt.size() != truth.size())
    throw Error(ErrorCode::invalid_argument, "expected as many pictures, photographs and matt pictures as views");
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (!fits(pictures[i], matt[i]) || !fits(photographs[i], matt[i]))
      throw Error(ErrorCode::invalid_argument, "expected 8-bit RGB or RGBA pictures of one size", truth[i].name);
  HighlightPath path;
  path.lamp = main_lamp(truth);
  std::vector<std::optional<Eigen::Vector2d>> found(truth.size());
  std::vector<const Highlight*> known(truth.size());
  double squares = 0, followed = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    known[i] = strongest(truth[i], path.lamp);
    if (!known[i]) continue;
    ++path.views;
    const Eigen::Vector2d& place = known[i]->pixel;
    const Peak true_peak = peak_near(gloss_of(photographs[i], matt[i]), place);
    const Peak peak = peak_near(gloss_of(pictures[i], matt[i]), place);
    if (!(true_peak.height > 0) || peak.height < kFound * true_peak.height) continue;
    found[i] = peak.pixel;
    ++path.found;
    squares += (peak.pixel - place).squaredNorm();
  }
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) {
    if (!known[i] || !known[i + 1]) continue;
    const Eigen::Vector2d step = known[i + 1]->pixel - known[i]->pixel;
    const double length = step.norm();
    path.true_length_px += length;
    if (length > 0 && found[i] && found[i + 1])
      followed += std::clamp((*found[i + 1] - *found[i]).dot(step) / length, 0.0, length);
  }
  if (!(path.true_length_px > 0))
    throw Error(ErrorCode::degenerate, "no two views in a row have a highlight of one lamp");
  path.share = followed / path.true_length_px;
  path.rms_px = path.found ? std::sqrt(squares / double(path.found)) : 0;
  return path;
}

}  // namespace lumihull::slf
