// What is on a memory card.

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>
#include <lumihull/base/parallel.h>
#include <lumihull/capture/ingest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <system_error>
#include <tuple>

#include "picture_end.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostEntries = 50'000;
constexpr int kMostFolders = 16;

/// One line without control characters, as errors have it.
std::string printable(const std::string& text) { return Error(ErrorCode::bad_input, text).message(); }

int digits(const std::string& text, std::size_t from, std::size_t count) {
  if (from + count > text.size()) return -1;
  int value = 0;
  for (std::size_t i = from; i < from + count; ++i) {
    if (text[i] < '0' || text[i] > '9') return -1;
    value = value * 10 + text[i] - '0';
  }
  return value;
}

/// The counter of a DCF file name, "IMG_0042" (CIPA DC-009, 3.2): four letters, digits or '_', then four digits.
int counter_of(const std::string& stem) {
  if (stem.size() != 8) return -1;
  for (std::size_t i = 0; i < 4; ++i) {
    const char c = stem[i];
    if (!(c >= 'A' && c <= 'Z') && !(c >= 'a' && c <= 'z') && !(c >= '0' && c <= '9') && c != '_') return -1;
  }
  return digits(stem, 4, 4);
}

/// The number of a DCF folder, "100CANON"; others come behind.
int folder_number(const fs::path& folder) {
  const std::string name = folder.filename().string();
  const int number = digits(name, 0, 3);
  return name.size() == 8 && number >= 100 ? number : 1000;
}

/// Names such as "shot9" before "shot10".
bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    std::size_t m = i, n = j;
    while (m < a.size() && digit(a[m])) ++m;
    while (n < b.size() && digit(b[n])) ++n;
    const auto number = [](const std::string& t, std::size_t from, std::size_t to) {
      while (from + 1 < to && t[from] == '0') ++from;
      return t.substr(from, to - from);
    };
    const std::string u = number(a, i, m), v = number(b, j, n);
    if (u != v) return u.size() != v.size() ? u.size() < v.size() : u < v;
    i = m, j = n;
  }
  return std::tuple(a.size() - i, a) < std::tuple(b.size() - j, b);
}

struct Walk {
  std::vector<fs::path> files;
  std::size_t entries = 0, links = 0, others = 0;
  std::string first_link, first_other;
  std::vector<std::string> notes;
};

void walk(const fs::path& root, const fs::path& below, int depth, Walk& out, Job& job) {
  std::error_code error;
  fs::directory_iterator entries(root / below, error);
  if (error) {
    if (depth == 0) throw Error(ErrorCode::io, "can't be read: " + error.message(), root.string());
    out.notes.push_back(printable(below.string() + ": can't be read: " + error.message()));
    return;
  }
  for (; entries != fs::directory_iterator(); entries.increment(error)) {
    if (error) throw Error(ErrorCode::io, "can't be read: " + error.message(), (root / below).string());
    job.check();
    if (++out.entries > kMostEntries)
      throw Error(ErrorCode::bad_input, "more than " + std::to_string(kMostEntries) + " files: is this a memory card?",
                  root.string());
    const fs::path name = below / entries->path().filename();
    if (name.filename().string()[0] == '.') continue;  // wastebaskets, and the "._IMG_0001.JPG" of other systems
    const fs::file_status status = entries->symlink_status(error);
    if (fs::is_directory(status)) {
      if (depth + 1 > kMostFolders)
        throw Error(ErrorCode::bad_input, "folders nested deeper than " + std::to_string(kMostFolders), name.string());
      walk(root, name, depth + 1, out, job);
    } else if (fs::is_regular_file(status)) {
      if (is_picture_name(name)) out.files.push_back(name);
    } else if (fs::is_symlink(status)) {
      if (out.links++ == 0) out.first_link = name.string();
    } else {
      if (out.others++ == 0) out.first_other = name.string();
    }
  }
}

/// Seconds since 1970 of "YYYY-MM-DDThh:mm:ss"; nullopt where the calendar has no such day.
std::optional<double> seconds_of(const std::string& t) {
  using namespace std::chrono;
  if (t.size() != 19) return std::nullopt;
  const year_month_day day(year(digits(t, 0, 4)), month(unsigned(digits(t, 5, 2))),
                           std::chrono::day(unsigned(digits(t, 8, 2))));
  if (!day.ok() || digits(t, 0, 4) < 1970) return std::nullopt;
  const auto s = sys_days(day) + hours(digits(t, 11, 2)) + minutes(digits(t, 14, 2)) + seconds(digits(t, 17, 2));
  return double(s.time_since_epoch().count());
}

/// Files of one folder and stem are one exposure, unless two have the same extension.
std::vector<CardPicture> pair_up(std::vector<fs::path> files) {
  std::sort(files.begin(), files.end());
  std::map<std::tuple<fs::path, std::string, int>, std::map<std::string, fs::path>> groups;
  for (const fs::path& f : files) {
    std::string stem = f.stem().string();
    for (char& c : stem)
      if (c >= 'A' && c <= 'Z') c = char(c + 32);
    for (int copy = 0;; ++copy)
      if (groups[{f.parent_path(), stem, copy}].emplace(small_extension(f), f).second) break;
  }
  std::vector<CardPicture> out;
  for (const auto& [key, group] : groups) {
    CardPicture p;
    for (const auto& [extension, file] : group)
      if (!is_raw_name(file)) p.files.push_back(file);
    for (const auto& [extension, file] : group)
      if (is_raw_name(file)) p.files.push_back(file);
    p.counter = counter_of(p.files[0].stem().string());
    out.push_back(std::move(p));
  }
  return out;
}

/// By folder and counter. Where a folder holds the wrap from 9999 to 0001, its pictures start behind the widest hole.
void put_in_order(std::vector<CardPicture>& pictures) {
  const auto folder = [](const CardPicture& p) { return p.files[0].parent_path(); };
  std::stable_sort(pictures.begin(), pictures.end(), [&](const CardPicture& a, const CardPicture& b) {
    const fs::path fa = folder(a), fb = folder(b);
    const int na = folder_number(fa), nb = folder_number(fb);
    if (na != nb) return na < nb;
    if (fa != fb) return fa < fb;
    if ((a.counter < 0) != (b.counter < 0)) return b.counter < 0;
    if (a.counter != b.counter) return a.counter < b.counter;
    return natural_less(a.files[0].string(), b.files[0].string());
  });
  for (auto first = pictures.begin(), end = first; first != pictures.end(); first = end) {
    end = std::find_if(first, pictures.end(),
                       [&](const CardPicture& p) { return folder(p) != folder(*first) || p.counter < 0; });
    if (end == first) {
      ++end;
      continue;
    }
    constexpr int kHigh = 9000, kLow = 1000;
    if ((end - 1)->counter < kHigh || first->counter > kLow) continue;
    auto start = first;
    int widest = 0;
    for (auto p = first + 1; p != end; ++p)
      if (const int hole = p->counter - (p - 1)->counter; hole > widest) {
        widest = hole;
        start = p;
      }
    if (widest > kLow) std::rotate(first, start, end);
  }
}

struct Header {
  std::string time, model, fault;
  std::optional<double> fraction_s;
  std::optional<int> offset_min;
};

/// Times as CardPicture has them, from those of all headers together.
void set_times(const std::vector<Header>& headers, Card& card) {
  std::size_t timed = 0, zones = 0, stamps = 0;
  bool fractions = false;
  std::set<std::string> different;
  for (const Header& h : headers) {
    if (h.time.empty()) continue;
    ++timed;
    zones += h.offset_min.has_value();
    stamps += h.fraction_s.has_value();
    fractions = fractions || h.fraction_s.value_or(0) > 0;
    different.insert(h.time);
  }
  constexpr std::size_t kFew = 3;
  if (timed >= kFew && different.size() * kFew < timed) {
    card.notes.push_back("the camera's clock stood still: its times are not used");
    return;
  }
  fractions = fractions && stamps == timed;  // some cameras write "00" always
  const bool zone = zones == timed;          // of some alone it would tear the times apart
  std::size_t bad = 0;
  for (std::size_t i = 0; i < headers.size(); ++i) {
    CardPicture& p = card.pictures[i];
    p.clock_s = seconds_of(headers[i].time);
    if (!p.clock_s) {
      ++bad;
      continue;
    }
    if (zone) *p.clock_s -= *headers[i].offset_min * 60;
    if (!fractions) continue;
    *p.clock_s += *headers[i].fraction_s;
    p.resolution_s = 0.01;
  }
  if (bad > 0) card.notes.push_back(std::to_string(bad) + " pictures tell no time");
}

}  // namespace

Card read_card(const fs::path& folder, Job& job) {
  std::error_code error;
  if (!fs::exists(folder, error)) throw Error(ErrorCode::not_found, "no such folder", folder.string());
  if (!fs::is_directory(folder, error)) throw Error(ErrorCode::bad_input, "expected a folder", folder.string());
  Walk found;
  walk(folder, {}, 0, found, job);
  Card card;
  card.notes = std::move(found.notes);
  if (found.links > 0)
    card.notes.push_back(printable(std::to_string(found.links) + " links were passed over: " + found.first_link));
  if (found.others > 0)
    card.notes.push_back(
        printable(std::to_string(found.others) + " pipes or devices were passed over: " + found.first_other));
  card.pictures = pair_up(std::move(found.files));
  put_in_order(card.pictures);

  std::vector<Header> headers(card.pictures.size());
  job.begin("reading headers", headers.size());
  parallel_for(job, headers.size(), [&](std::size_t i) {
    try {
      const ImageInfo info = read_image_info(folder / card.pictures[i].files[0]);
      headers[i] = {info.time, info.model, {}, info.time_fraction_s, info.time_offset_min};
    } catch (const Error& e) {
      if (e.code() == ErrorCode::cancelled || e.code() == ErrorCode::out_of_memory) throw;
      headers[i].fault = e.message();
    }
  });
  job.end();
  std::map<std::string, std::size_t> models;
  for (std::size_t i = 0; i < headers.size(); ++i) {
    card.pictures[i].model = headers[i].model;
    card.pictures[i].fault = headers[i].fault;
    if (!headers[i].fault.empty())
      card.notes.push_back(printable(card.pictures[i].files[0].string() + ": " + headers[i].fault));
    else if (!headers[i].model.empty())
      ++models[headers[i].model];
  }
  set_times(headers, card);
  if (models.size() > 1) {
    std::string line = "pictures by several cameras:";
    for (const auto& [model, count] : models) line += " " + model + " (" + std::to_string(count) + ")";
    card.notes.push_back(line);
  }
  return card;
}

}  // namespace lumihull::capture
