// A key on disk: JSON with the training samples, from which the table is rebuilt.
#include <lumihull/internal/json.h>

#include "color_key_impl.h"

namespace lumihull::calib {
namespace {

using internal::Json;
using internal::JsonReader;

constexpr const char* kFormat = "lumihull-color-key";
constexpr std::int64_t kVersion = 1;

Json to_json(std::span<const ColorCount> samples) {
  Json colors = Json::array(), counts = Json::array();
  for (const ColorCount& s : samples) {
    colors.push_back(std::uint32_t(s.color[0]) << 16 | std::uint32_t(s.color[1]) << 8 | s.color[2]);
    counts.push_back(s.count);
  }
  return Json{{"colors", std::move(colors)}, {"counts", std::move(counts)}};
}

std::vector<ColorCount> from_json(const JsonReader& side) {
  const JsonReader colors = side.at("colors"), counts = side.at("counts");
  const std::size_t n = colors.array_size(std::size_t(1) << 24);
  if (counts.array_size(std::size_t(1) << 24) != n) counts.fail("as many values as colors");
  if (n == 0) colors.fail("at least one colour");
  std::vector<ColorCount> samples(n);
  std::int64_t previous = -1;
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int64_t c = colors.at(i).integer(0, 0xFFFFFF);
    if (c <= previous) colors.at(i).fail("ascending colours");
    previous = c;
    samples[i].color = {std::uint8_t(c >> 16), std::uint8_t(c >> 8), std::uint8_t(c)};
    samples[i].count = std::uint32_t(counts.at(i).integer(1, std::int64_t(kMaxKeySamples)));
    total += samples[i].count;
    if (total > kMaxKeySamples) counts.at(i).fail("at most " + std::to_string(kMaxKeySamples) + " samples together");
  }
  return samples;
}

}  // namespace

void ColorKey::save(const std::filesystem::path& file) const {
  const Json top{{"format", kFormat},
                 {"version", kVersion},
                 {"k", impl_->k},
                 {"background", to_json(impl_->background)},
                 {"foreground", to_json(impl_->foreground)}};
  write_file(file, top.dump() + "\n");
}

ColorKey ColorKey::load(const std::filesystem::path& file, Job& job) {
  const Json json = internal::read_json(file);
  const JsonReader top(json, file.string());
  internal::check_format(top, kFormat, kVersion);
  const int k = int(top.at("k").integer(1, kMaxNeighbours));
  const std::vector<ColorCount> background = from_json(top.at("background")),
                                foreground = from_json(top.at("foreground"));
  std::uint64_t total = 0;
  for (const auto* side : {&background, &foreground})
    for (const ColorCount& c : *side) total += c.count;
  if (total < std::uint64_t(k)) top.at("k").fail("at most as many neighbours as samples");
  return train(background, foreground, k, job);
}

}  // namespace lumihull::calib
