#include "contact_sheet.h"

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/session.h>
#include <lumihull/internal/html.h>
#include <lumihull/internal/json.h>

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <system_error>
#include <vector>

#include "photographs.h"
#include "picture_hints.h"

namespace lumihull::capture {

namespace fs = std::filesystem;

namespace internal {

namespace {

using lumihull::internal::html_escaped;
using lumihull::internal::Json;
using lumihull::internal::JsonReader;

constexpr int kSide = 220;                         ///< of a thumbnail, px
constexpr int kLookedAt = 1200;                    ///< longer side of the picture that is judged, at least, px
constexpr double kClipped = 0.02;                  ///< more of a picture is not right
constexpr double kDark = 90;                       ///< 99 % of the pixels below
constexpr double kBlurred = 1.7, kBlurred_px = 4;  ///< edges so much wider than usual, and at least so wide
constexpr int kReload_s = 5;
constexpr std::size_t kMostNamed = 40;  ///< photographs that are named above the others

constexpr const char* kStyle = R"(
:root{color-scheme:light dark;--line:#8884;--dim:#777}
body{font:15px/1.4 system-ui,sans-serif;margin:0 auto;max-width:96rem;padding:1rem}
h1{margin:.2rem 0;font-size:1.4rem}p{margin:.3rem 0}.dim{color:var(--dim)}
progress{width:100%;height:.8rem}
.grid{display:grid;gap:.5rem;margin-top:.6rem;grid-template-columns:repeat(auto-fill,minmax(9rem,1fr))}
figure{scroll-margin:1rem;margin:0;border:1px solid var(--line);border-top:4px solid var(--c);border-radius:.3rem;overflow:hidden}
:target{outline:3px solid var(--c)}
figure a,figure i{display:flex;align-items:center;justify-content:center;aspect-ratio:3/2;background:#8882;color:var(--dim)}
figure img{max-width:100%;max-height:100%}
figcaption{padding:.15rem .4rem;font-size:.8rem;overflow-wrap:anywhere}
b{color:var(--c);font-weight:600}em{font-style:normal;background:#d90;color:#000;border-radius:.2rem;padding:0 .25rem;margin-right:.2rem}
.done{--c:#2a4}.card{--c:#27c}.wait{--c:#888}.work{--c:#d80}.bad{--c:#d22}
)";

struct Word {
  const char* style;
  const char* text;
};

Word word(const ShotProgress& shot) {
  switch (shot.step) {
    case ShotStep::none:
    case ShotStep::waiting:
      return shot.landed.empty() ? Word{"wait", "waiting"} : Word{"work", "to be taken again"};
    case ShotStep::firing:
      return {"work", "shutter asked"};
    case ShotStep::refused:
      return {"bad", "failed"};
    case ShotStep::unknown:
      return {"bad", "unknown"};
    case ShotStep::done:
      return {"card", "taken, file awaited"};
    case ShotStep::landed:
      return {"done", "done"};
  }
  return {"bad", "?"};
}

std::string url(const std::string& path) {
  std::string out;
  for (const char c : path) {
    const bool plain =
        std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.' || c == '/' || c == '~';
    char code[4];
    std::snprintf(code, sizeof code, "%%%02X", unsigned(static_cast<unsigned char>(c)));
    out += plain ? std::string(1, c) : code;
  }
  return out;
}

std::string duration(double seconds) {
  char text[40];
  const long minutes = long(seconds / 60 + 0.5);
  if (seconds < 90)
    std::snprintf(text, sizeof text, "%.0f s", seconds);
  else if (minutes < 90)
    std::snprintf(text, sizeof text, "%ld min", minutes);
  else
    std::snprintf(text, sizeof text, "%ld h %02ld min", minutes / 60, minutes % 60);
  return text;
}

/// The picture that is judged and made small: decoded at 1/n, no smaller than need be.
Image look_at(const fs::path& file, int& reduction) {
  const ImageInfo info = read_image_info(file);
  reduction = 1;
  while (reduction < 8 && std::max(info.width, info.height) / (2 * reduction) >= kLookedAt) reduction *= 2;
  const Image image = read_image(file, {.apply_orientation = true, .channels = 3, .reduction = reduction});
  return image.type() == PixelType::u8 ? image : converted(image, PixelType::u8, 3);
}

}  // namespace

ContactSheet::ContactSheet(const fs::path& folder) : folder_(folder) { read_cache(); }

/// Only a cache: whatever is wrong with it, it is made anew.
void ContactSheet::read_cache() {
  const fs::path file = folder_ / "thumbs" / "thumbs.json";
  try {
    const Json document = lumihull::internal::read_json(file, std::size_t(64) << 20);
    const JsonReader top(document, file.string());
    lumihull::internal::check_format(top, "lumihull-thumbnails", 1);
    const JsonReader list = top.at("thumbnails");
    for (std::size_t i = 0, n = list.array_size(1'000'000); i < n; ++i) {
      const JsonReader one = list.at(i);
      Thumbnail t;
      t.file = one.at("file").string();
      t.clipped = one.at("clipped").number();
      t.brightest = one.at("brightest").number();
      t.edge_width_px = one.at("edge_width_px").number();
      std::error_code error;
      if (t.file.empty() || fs::exists(folder_ / "thumbs" / t.file, error)) thumbnails_[one.at("sha256").string()] = t;
    }
  } catch (const Error&) {
    thumbnails_.clear();
  }
}

void ContactSheet::write_cache() const {
  Json list = Json::array();
  for (const auto& [sha, t] : thumbnails_)
    list.push_back({{"sha256", sha},
                    {"file", t.file},
                    {"clipped", t.clipped},
                    {"brightest", t.brightest},
                    {"edge_width_px", t.edge_width_px}});
  const fs::path file = folder_ / "thumbs" / "thumbs.json";
  write_file(file,
             lumihull::internal::print_json(
                 {{"format", "lumihull-thumbnails"}, {"version", 1}, {"thumbnails", std::move(list)}}, file.string()));
}

const ContactSheet::Thumbnail& ContactSheet::thumbnail(const Take& take) {
  const auto [entry, is_new] = thumbnails_.try_emplace(take.sha256);
  Thumbnail& t = entry->second;
  if (!is_new) return t;
  changed_ = true;
  try {
    int reduction = 1;
    const Image image = look_at(folder_ / "photos" / take.file, reduction);
    const PictureHints hints = picture_hints(image);
    t.clipped = hints.clipped;
    t.brightest = hints.brightest;
    t.edge_width_px = hints.edge_width * reduction;
    const std::string name = fs::path(take.file).stem().string() + "-" + take.sha256.substr(0, 8) + ".jpg";
    write_jpeg(folder_ / "thumbs" / name, fitted(image, kSide), 80);
    t.file = name;
  } catch (const Error& e) {
    if (e.code() == ErrorCode::io || e.code() == ErrorCode::out_of_memory) {
      thumbnails_.erase(entry);
      throw;
    }
    t.file.clear();  // no picture: the page says so
  }
  return t;
}

std::string ContactSheet::figure(const Plan& plan, const JournalState& state, std::size_t i, double usual_edge_width_px,
                                 std::vector<std::string>& to_look_at) {
  const ShotProgress& shot = state.shots[i];
  const Word state_word = word(shot);
  std::string name = plan.stops[i / plan.cameras.size()].name;
  const std::string id = name + "-" + std::to_string(i % plan.cameras.size());
  if (plan.cameras.size() > 1) name += " · " + plan.cameras[i % plan.cameras.size()];
  std::string out = "<figure id=\"" + html_escaped(id) + "\" class=\"" + state_word.style + "\">";
  std::string hints;
  if (shot.landed.empty()) {
    out += "<i>–</i>";
  } else {
    const Take& take = shot.landed.back();
    const Thumbnail& t = thumbnail(take);
    const std::string photo = url("photos/" + take.file);
    if (t.file.empty()) {
      out += "<a href=\"" + photo + "\">unreadable</a>";
      hints += "<em>unreadable</em>";
    } else {
      out += "<a href=\"" + photo + "\"><img loading=\"lazy\" src=\"" + url("thumbs/" + t.file) + "\" alt=\"\"></a>";
      char text[80];
      if (t.clipped > kClipped) {
        std::snprintf(text, sizeof text, "<em>%.0f %% clipped</em>", 100 * t.clipped);
        hints += text;
      }
      if (t.brightest < kDark) hints += "<em>dark</em>";
      if (t.edge_width_px > std::max(kBlurred_px, kBlurred * usual_edge_width_px)) {
        std::snprintf(text, sizeof text, "<em>blurred? edges of %.0f px</em>", t.edge_width_px);
        hints += text;
      }
    }
    if (take.confirmed) hints += "<em>in doubt, confirmed</em>";
    if (shot.landed.size() > 1) hints += "<em>retaken</em>";
  }
  if (!hints.empty() || state_word.style == std::string_view("bad"))
    to_look_at.push_back("<a href=\"#" + html_escaped(id) + "\">" + html_escaped(name) + "</a>");
  return out + "<figcaption>" + html_escaped(name) + " <b>" + state_word.text + "</b><br>" + hints +
         (shot.detail.empty() ? "" : "<span class=\"dim\">" + html_escaped(shot.detail) + "</span>") +
         "</figcaption></figure>\n";
}

void ContactSheet::write(const Plan& plan, const JournalState& state, const std::string& status, double seconds_left) {
  std::error_code error;
  fs::create_directories(folder_ / "thumbs", error);
  if (error) throw Error(ErrorCode::io, "can't make the folder: " + error.message(), (folder_ / "thumbs").string());
  std::vector<double> widths;
  std::size_t planned = 0;
  for (const ShotProgress& shot : state.shots) {
    planned += shot.step != ShotStep::none;
    if (shot.landed.empty()) continue;
    if (const double width = thumbnail(shot.landed.back()).edge_width_px; width > 0) widths.push_back(width);
  }
  double usual = 0;
  if (!widths.empty()) {
    const auto middle = widths.begin() + std::ptrdiff_t(widths.size() / 2);
    std::nth_element(widths.begin(), middle, widths.end());
    usual = *middle;
  }
  std::string page = "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">";
  if (seconds_left >= 0) page += "<meta http-equiv=\"refresh\" content=\"" + std::to_string(kReload_s) + "\">";
  const std::string title = html_escaped(fs::absolute(folder_).lexically_normal().filename().string());
  page += "<meta name=\"viewport\" content=\"width=device-width\"><title>" + title + "</title><style>" + kStyle +
          "</style></head><body>\n<h1>" + title + "</h1>\n<p>" + html_escaped(status);
  if (seconds_left >= 0) page += ", about " + duration(seconds_left) + " to go";
  page += "</p>\n<progress max=\"" + std::to_string(planned) + "\" value=\"" + std::to_string(state.views()) +
          "\"></progress>\n<p class=\"dim\">" + std::to_string(state.views()) + " of " + std::to_string(planned) +
          " photographs";
  const std::pair<ShotStep, const char*> counted[] = {{ShotStep::done, " on the camera's card"},
                                                      {ShotStep::waiting, " waiting"},
                                                      {ShotStep::refused, " failed"},
                                                      {ShotStep::unknown, " unknown"}};
  for (const auto& [step, text] : counted)
    if (const std::size_t n = state.count(step)) page += "; " + std::to_string(n) + text;
  page += "; last event " + html_escaped(state.last_time) + "</p>\n";
  std::string figures;
  std::vector<std::string> to_look_at;
  for (std::size_t i = 0; i < state.shots.size(); ++i)
    if (state.shots[i].step != ShotStep::none) figures += figure(plan, state, i, usual, to_look_at);
  for (std::size_t k = 0; k < std::min(kMostNamed, to_look_at.size()); ++k)
    page += (k == 0 ? "<p>to look at: " : ", ") + to_look_at[k];
  if (to_look_at.size() > kMostNamed) page += " and " + std::to_string(to_look_at.size() - kMostNamed) + " more";
  page += (to_look_at.empty() ? "" : "</p>\n") + ("<div class=\"grid\">\n" + figures) + "</div></body></html>\n";
  if (changed_) write_cache();
  changed_ = false;
  write_file(folder_ / "contact.html", page);
}

}  // namespace internal

void write_contact_sheet(const fs::path& folder, const Plan& plan, const JournalState& state, const std::string& status,
                         double seconds_left) {
  internal::ContactSheet(folder).write(plan, state, status, seconds_left);
}

}  // namespace lumihull::capture
