// Measured distances between points of targets, from words to the adjustment's bodies.
#include <lumihull/base/error.h>
#include <lumihull/calib/target_bar.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

namespace lumihull::calib {
namespace {

constexpr std::size_t kShown = 120;  // of a text that is refused
constexpr std::size_t kMostBars = 10'000;

[[noreturn]] void refuse(std::string_view bar, const std::string& message) {
  throw Error(ErrorCode::invalid_argument, message + ", found \"" + std::string(bar.substr(0, kShown)) + "\"", "bar");
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = std::min(text.find(at), text.size());
    parts.push_back(trimmed(text.substr(0, end)));
    if (end == text.size()) return parts;
    text.remove_prefix(end + 1);
  }
}

TargetBar::End read_end(std::string_view text, std::string_view bar) {
  TargetBar::End end;
  const std::size_t dot = text.rfind('.'), colon = text.rfind(':');
  const std::size_t id_at = colon == text.npos ? 0 : colon + 1;
  if (colon != text.npos) end.family = text.substr(0, colon);
  const auto whole = [](std::string_view digits, int& number) {
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return error == std::errc() && rest == digits.data() + digits.size() && number >= 0;
  };
  if (dot == text.npos || dot < id_at || !whole(text.substr(id_at, dot - id_at), end.id) ||
      !whole(text.substr(dot + 1), end.point))
    refuse(bar, "expected ends as ID.POINT, a target's number and that of a circle or corner on it");
  return end;
}

double read_length(std::string_view text, std::string_view bar) {
  static constexpr std::pair<std::string_view, double> kUnits[] = {{"", 1}, {"m", 1}, {"cm", 100}, {"mm", 1000}};
  double number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc() && std::isfinite(number) && number > 0)
    for (const auto& [unit, per_metre] : kUnits)
      if (trimmed({rest, std::size_t(text.data() + text.size() - rest)}) == unit) return number / per_metre;
  refuse(bar, "expected lengths above 0, in metres or with mm, cm or m behind");
}

struct Place {
  std::uint32_t body = 0, point = 0;
};

Place place_of(const TargetBar::End& end, const TargetBar& bar, const TargetSet& set,
               std::span<const CalibratedBody> bodies) {
  const std::string target = "target " + end.family + (end.family.empty() ? "" : " ") + std::to_string(end.id);
  std::vector<Place> places;
  bool has_target = false;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    for (std::size_t k = 0; k < bodies[b].features.size(); ++k) {
      const CalibratedBody::PointName& name = bodies[b].features[k];
      if (name.id != end.id ||
          (!end.family.empty() && set.designs.at(std::size_t(name.design)).family.name() != end.family))
        continue;
      has_target = true;
      if (name.feature == end.point) places.push_back({std::uint32_t(b), std::uint32_t(k)});
    }
  if (!has_target) refuse(bar.text, "no photograph shows " + target + ", and no board has it");
  if (places.empty()) refuse(bar.text, target + " has no point " + std::to_string(end.point));
  if (places.size() > 1)
    refuse(bar.text, "there are several of " + target +
                         (end.family.empty() ? ": say which by FAMILY:ID.POINT" : ": which one can't be told"));
  return places.front();
}

}  // namespace

std::vector<TargetBar> bars_from_text(std::string_view text) {
  std::vector<TargetBar> bars;
  for (const std::string_view one : split(text, ';')) {
    if (one.empty()) continue;
    const std::vector<std::string_view> parts = split(one, ',');
    if (parts.size() != 3 && parts.size() != 4)
      refuse(one, "expected ID.POINT,ID.POINT,LENGTH or ID.POINT,ID.POINT,LENGTH,SIGMA");
    if (bars.size() == kMostBars) refuse(one, "expected at most " + std::to_string(kMostBars) + " bars");
    TargetBar& bar = bars.emplace_back();
    bar.text = one;
    bar.a = read_end(parts[0], one);
    bar.b = read_end(parts[1], one);
    bar.length_m = read_length(parts[2], one);
    if (parts.size() == 4) bar.sigma_m = read_length(parts[3], one);
  }
  return bars;
}

ScaleBar bar_between(const TargetBar& bar, const TargetSet& set, std::span<const CalibratedBody> bodies) {
  const Place a = place_of(bar.a, bar, set, bodies), b = place_of(bar.b, bar, set, bodies);
  if (a.body == b.body && a.point == b.point) refuse(bar.text, "expected two points");
  return {bar.text, a.body, a.point, b.body, b.point, bar.length_m, bar.sigma_m};
}

}  // namespace lumihull::calib
