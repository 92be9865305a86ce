#include "journal_lines.h"

#include <lumihull/base/files.h>
#include <lumihull/internal/json.h>

#include <algorithm>
#include <iterator>

namespace lumihull::capture::internal {

using lumihull::internal::Json;
using lumihull::internal::JsonReader;

namespace {

constexpr const char* kKinds[] = {"begin",  "session", "consent", "moving",  "arrived", "declared",
                                  "firing", "done",    "refused", "unknown", "decided", "file",
                                  "retake", "fault",   "paused",  "stopped", "finished"};
constexpr std::size_t kSumDigits = 16;
constexpr std::string_view kSumField = ",\"sum\":\"";
constexpr std::size_t kTail = kSumField.size() + kSumDigits + 2;  // with "}
constexpr std::size_t kMostLine = std::size_t(64) << 20;          // the first one names every stop
constexpr std::size_t kMostText = std::size_t(1) << 16;

struct Fields {
  bool stop = false, camera = false, shot = false, settings = false, file = false, answer = false, text = false;
};

Fields fields_of(EventKind kind) {
  switch (kind) {
    case EventKind::begin:
    case EventKind::paused:
    case EventKind::finished:
      return {};
    case EventKind::session:
    case EventKind::fault:
    case EventKind::stopped:
      return {.text = true};
    case EventKind::consent:
      return {.answer = true, .text = true};
    case EventKind::moving:
    case EventKind::arrived:
    case EventKind::declared:
      return {.stop = true};
    case EventKind::retake:
      return {.stop = true, .text = true};
    case EventKind::firing:
      return {.stop = true, .camera = true, .shot = true, .settings = true};
    case EventKind::done:
      return {.shot = true};
    case EventKind::refused:
    case EventKind::unknown:
      return {.shot = true, .text = true};
    case EventKind::decided:
      return {.shot = true, .answer = true};
    case EventKind::file:
      return {.shot = true, .file = true};
  }
  return {};
}

std::string sum_of(std::string_view before, std::string_view body) {
  return sha256(std::string(before).append(body)).substr(0, kSumDigits);
}

std::vector<std::string> read_names(const JsonReader& json) {
  std::vector<std::string> names;
  const std::size_t n = json.array_size(1'000'000);
  for (std::size_t i = 0; i < n; ++i) names.push_back(json.at(i).string());
  return names;
}

JournalHead read_head(const JsonReader& json) {
  JournalHead head;
  head.plan_sha256 = json.at("plan_sha256").string();
  head.name_template = json.at("names").string();
  head.stops = read_names(json.at("stops"));
  head.cameras = read_names(json.at("cameras"));
  if (json.has("passed"))
    for (const std::string& name : read_names(json.at("passed"))) head.passed.insert(name);
  return head;
}

JournalEvent read_event(const JsonReader& json) {
  JournalEvent e;
  const std::string kind = json.at("event").string();
  const auto found = std::find(std::begin(kKinds), std::end(kKinds), kind);
  if (found == std::end(kKinds)) json.at("event").fail("an event's name");
  e.kind = EventKind(found - std::begin(kKinds));
  e.time = json.at("time").string(40);
  const Fields has = fields_of(e.kind);
  if (has.stop) e.stop = json.at("stop").string();
  if (has.camera) e.camera = json.at("camera").string();
  if (has.shot) e.shot = ShotId(json.at("shot").integer(1, UINT32_MAX));
  if (has.settings) {
    e.settle_s = json.at("settle_s").number(0);
    e.exposure_s = json.at("exposure_s").number(0);
    if (json.has("lengths_m")) {
      const JsonReader lengths = json.at("lengths_m");
      const std::size_t n = lengths.array_size(64);
      for (std::size_t i = 0; i < n; ++i) e.lengths_m.push_back(lengths.at(i).number());
    }
  }
  if (has.file) {
    e.file = json.at("file").string();
    e.size = std::uint64_t(json.at("size").integer(0, INT64_MAX));
    e.sha256 = json.at("sha256").string();
    if (e.sha256.size() != 64 || e.sha256.find_first_not_of("0123456789abcdef") != std::string::npos)
      json.at("sha256").fail("a SHA-256 of 64 hexadecimal digits");
  }
  if (has.answer) e.answer = json.at("answer").string();
  if (has.text) e.text = json.at("text").string(kMostText);
  return e;
}

}  // namespace

std::string print_line(const JournalEvent& e, const JournalHead* head, std::size_t number, std::string& sum) {
  Json json{{"n", number}, {"time", e.time}, {"event", kKinds[std::size_t(e.kind)]}};
  if (head) {
    json["format"] = "lumihull-journal";
    json["version"] = 1;
    json["plan_sha256"] = head->plan_sha256;
    json["names"] = head->name_template;
    json["cameras"] = head->cameras;
    json["stops"] = head->stops;
    if (!head->passed.empty()) json["passed"] = head->passed;
  }
  const Fields has = fields_of(e.kind);
  if (has.stop) json["stop"] = e.stop;
  if (has.camera) json["camera"] = e.camera;
  if (has.shot) json["shot"] = e.shot;
  if (has.settings) {
    json["settle_s"] = e.settle_s;
    json["exposure_s"] = e.exposure_s;
    if (!e.lengths_m.empty()) json["lengths_m"] = e.lengths_m;
  }
  if (has.file) {
    json["file"] = e.file;
    json["size"] = e.size;
    json["sha256"] = e.sha256;
  }
  if (has.answer) json["answer"] = e.answer;
  if (has.text) json["text"] = e.text;
  std::string line = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  line.pop_back();
  sum = sum_of(sum, line);
  line += std::string(kSumField) + sum + "\"}\n";
  return line;
}

ParsedJournal parse_journal(std::string_view text, const std::string& file) {
  ParsedJournal out;
  std::size_t number = 0;
  while (out.length < text.size()) {
    const std::size_t end = text.find('\n', out.length);
    if (end == std::string_view::npos) break;  // torn
    const std::string_view line = text.substr(out.length, end - out.length);
    const bool last = end + 1 == text.size();
    if (last && line.find('\0') != std::string_view::npos) break;  // torn: a page that never reached the disk
    ++number;
    const std::string where = file + " line " + std::to_string(number);
    const std::size_t body = line.size() < kTail ? 0 : line.size() - kTail;
    if (line.size() > kMostLine || body == 0 || line.substr(body, kSumField.size()) != kSumField ||
        line.substr(line.size() - 2) != "\"}")
      throw Error(ErrorCode::bad_input, "damaged: expected an event that ends with its checksum", where);
    const std::string_view sum = line.substr(body + kSumField.size(), kSumDigits);
    if (sum != sum_of(out.sum, line.substr(0, body)))
      throw Error(ErrorCode::bad_input,
                  "damaged: this line or the one before it was changed, lost or moved (its checksum differs)", where);
    const Json document = lumihull::internal::parse_json(line, where);
    const JsonReader top(document, where);
    if (std::size_t(top.at("n").integer(1, INT64_MAX)) != number) top.at("n").fail(std::to_string(number));
    const JournalEvent event = read_event(top);
    if (number == 1) {
      if (event.kind != EventKind::begin) top.at("event").fail("\"begin\"");
      lumihull::internal::check_format(top, "lumihull-journal", 1);
      out.state.head = read_head(top);
      try {
        check(out.state.head);
      } catch (const Error& e) {
        throw Error(ErrorCode::bad_input, e.message(), where);
      }
      out.state.shots = planned_shots(out.state.head);
    }
    apply(out.state, event, where);
    out.sum = sum;
    out.length = end + 1;
  }
  return out;
}

std::vector<ShotProgress> planned_shots(const JournalHead& head) {
  std::vector<ShotProgress> shots;
  shots.reserve(head.stops.size() * head.cameras.size());
  for (const std::string& stop : head.stops)
    for (std::size_t c = 0; c < head.cameras.size(); ++c)
      shots.push_back({.step = head.passed.contains(stop) ? ShotStep::none : ShotStep::waiting});
  return shots;
}

void check(const JournalHead& head) {
  for (const auto* names : {&head.stops, &head.cameras}) {
    const char* what = names == &head.stops ? "stop" : "camera";
    if (names->empty())
      throw Error(ErrorCode::invalid_argument, std::string("expected at least one ") + what, "journal");
    std::set<std::string_view> seen;
    for (const std::string& name : *names)
      if (name.empty() || !seen.insert(name).second)
        throw Error(ErrorCode::invalid_argument,
                    std::string("expected a name that no other ") + what + " has, found \"" + name + "\"", "journal");
  }
  const std::set<std::string_view> stops(head.stops.begin(), head.stops.end());
  for (const std::string& name : head.passed)
    if (!stops.contains(name))
      throw Error(ErrorCode::invalid_argument, "expected a stop's name, found \"" + name + "\"", "journal");
  if (head.stops.size() > 1'000'000 || head.cameras.size() > 64)
    throw Error(ErrorCode::invalid_argument, "expected at most a million stops and 64 cameras", "journal");
}

}  // namespace lumihull::capture::internal
