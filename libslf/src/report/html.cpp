#include "html.h"

#include <lumihull/slf/metrics.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace lumihull::slf {
namespace {

constexpr std::array<std::uint8_t, 3> kBehind{102, 102, 119};  // in light and in dark surroundings
constexpr int kJpegQuality = 85;

constexpr const char* kStyle = R"(
:root{color-scheme:light dark;--line:#8884;--dim:#777}
body{font:16px/1.5 system-ui,sans-serif;margin:0 auto;max-width:72rem;padding:1rem}
h1{margin:.5rem 0}h2{margin:2rem 0 .5rem;border-bottom:1px solid var(--line)}h3{margin:1.2rem 0 .3rem;font-size:1rem}
p{margin:.4rem 0}.dim{color:var(--dim);font-size:.875rem}
.grid{display:grid;gap:.6rem;grid-template-columns:repeat(auto-fill,minmax(9rem,1fr))}
.wide{grid-template-columns:repeat(auto-fill,minmax(14rem,1fr))}
.compared{grid-template-columns:repeat(auto-fit,minmax(10rem,1fr));align-items:start}
.strips{display:grid;gap:.6rem}
figure{margin:0;border:1px solid var(--line);border-radius:.4rem;overflow:hidden}
figure img{display:block;width:100%;height:auto}figcaption{padding:.15rem .4rem;font-size:.8rem;overflow-wrap:anywhere}
.scroll{overflow-x:auto}table{border-collapse:collapse}
td,th{padding:.2rem .7rem;border-bottom:1px solid var(--line);text-align:right;white-space:nowrap}
td:first-child,th:first-child{text-align:left}summary{cursor:pointer;margin:.4rem 0}
)";

}  // namespace

std::string page_style() { return kStyle; }

std::string figure(const Image& picture, const std::string& caption) {
  const std::string jpeg = encode_jpeg(picture.channels() == 4 ? composited(picture, kBehind) : picture, kJpegQuality);
  return "<figure><img loading=\"lazy\" width=\"" + std::to_string(picture.width()) + "\" height=\"" +
         std::to_string(picture.height()) + "\" alt=\"" + html_escaped(caption) + "\" src=\"data:image/jpeg;base64," +
         lumihull::internal::base64(jpeg) + "\"><figcaption>" + html_escaped(caption) + "</figcaption></figure>\n";
}

std::string formatted(const char* format, double value) {
  if (!std::isfinite(value)) return "–";
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string megabytes(std::uint64_t bytes) { return formatted("%.1f MB", double(bytes) / 1e6); }

}  // namespace lumihull::slf
