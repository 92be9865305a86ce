// Pictures that stayed on a memory card, to the shots of a capture's journal.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/land_card.h>
#include <lumihull/capture/session.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace lumihull::capture {

namespace {

namespace fs = std::filesystem;

/// Seconds since 1970 of the journal's "YYYY-MM-DDThh:mm:ss.mmmZ".
std::optional<double> unix_time(const std::string& text) {
  using namespace std::chrono;
  int y = 0, h = 0, m = 0;
  unsigned month_number = 0, d = 0;
  double s = 0;
  if (std::sscanf(text.c_str(), "%d-%u-%uT%d:%d:%lfZ", &y, &month_number, &d, &h, &m, &s) != 6) return std::nullopt;
  const year_month_day date{year{y}, month{month_number}, day{d}};
  if (!date.ok()) return std::nullopt;
  return double(duration_cast<seconds>(sys_days(date).time_since_epoch()).count()) + h * 3600 + m * 60 + s;
}

/// An exposure of the journal, and where it is in it.
struct Asked {
  CardShot shot;
  std::string time;
  ShotState made = ShotState::done;
  std::size_t index = 0;
};

/// All exposures of a camera, whose pictures may be on its card: those that landed as well, for they are no strangers.
std::vector<Asked> asked_of(const JournalState& state, const std::string& camera) {
  std::vector<Asked> out;
  for (std::size_t i = 0; i < state.shots.size(); ++i) {
    const std::string& own = state.head.cameras[i % state.head.cameras.size()];
    if (!camera.empty() && own != camera) continue;
    const ShotProgress& shot = state.shots[i];
    const std::string& stop = state.head.stops[i / state.head.cameras.size()];
    const auto add = [&](const Take& take, ShotState made, bool landed) {
      out.push_back({{stop, own, take.shot, landed}, take.time, made, i});
    };
    for (const Take& take : shot.landed) add(take, ShotState::done, true);
    if (shot.step == ShotStep::done) add(shot.take, ShotState::done, false);
    if (shot.step == ShotStep::unknown || shot.step == ShotStep::firing) add(shot.take, ShotState::unknown, false);
  }
  std::stable_sort(out.begin(), out.end(), [](const Asked& a, const Asked& b) { return a.shot.id < b.shot.id; });
  return out;
}

std::string title(const CardShot& shot) { return shot.stop + " of " + shot.camera; }

class Landing {
 public:
  Landing(const fs::path& folder, const fs::path& card, const LandOptions& options,
          const std::function<void(const std::string&)>& tell)
      : folder_(folder),
        card_(card),
        options_(options),
        tell_(tell),
        lock_(folder),
        journal_(Journal::open(journal_path(folder))),
        asked_(asked_of(journal_.state(), options.camera)) {}

  LandedCard run(Job& job) {
    align(job);
    for (const std::string& note : out_.card.notes) say("note: " + note);
    say_clocks();
    for (const IngestedPhoto& p : photos_) {
      if (asked_[p.shot].shot.landed) {
        if (!options_.dry_run) land_others(asked_[p.shot], p);
        continue;
      }
      ++out_.matched;
      if (options_.dry_run)
        say(p.from[0].string() + " -> " + title(asked_[p.shot].shot) + (p.by_order ? " (by order)" : ""));
      else
        land(asked_[p.shot], p);
    }
    for (const std::size_t s : out_.alignment.missing)
      if (!asked_[s].shot.landed) {
        ++out_.missing;
        without(asked_[s], "taken, but its picture is not on the card");
      }
    for (const std::size_t s : out_.alignment.not_made) without(asked_[s], "it was not taken");
    for (const Ambiguity& g : out_.alignment.ambiguous) say_ambiguity(g);
    if (!options_.dry_run && journal_.state().views() > 0) {  // an earlier run may not have come so far
      const Plan plan = read_plan(plan_path(folder_));
      update_capture(folder_, plan, journal_.state());
      write_contact_sheet(folder_, plan, journal_.state(),
                          out_.landed > 0 ? "pictures of a card were added" : "a card was read; nothing was new", -1);
    }
    return std::move(out_);
  }

 private:
  void say(const std::string& line) const {
    if (tell_) tell_(line);
  }

  void align(Job& job) {
    std::vector<ExpectedShot> shots;
    for (const Asked& a : asked_) {
      ExpectedShot shot;
      shot.stop = a.shot.stop, shot.camera = a.shot.camera;
      shot.name = "shot-" + std::to_string(a.shot.id);
      shot.time_unix_s = unix_time(a.time);
      shot.state = a.made;
      shots.push_back(std::move(shot));
      out_.shots.push_back(a.shot);
    }
    IngestOptions options;
    options.camera = options_.camera;
    options.dry_run = true;  // land_photograph copies, for the journal must know before a file is in its place
    options.align.clock_offset_s = options_.clock_offset_s;
    Assignment found = ingest(folder_ / "photos", card_, shots, options, job);
    out_.card = std::move(found.card);
    out_.alignment = std::move(found.alignment);
    photos_ = std::move(found.photos);
  }

  void say_clocks() const {
    for (const ClockSpan& c : out_.alignment.clocks) {
      char line[160];
      std::snprintf(line, sizeof line,
                    "the camera's clock less UTC: %.1f s over %zu pictures, drift %.0f ppm, spread %.2f s", c.offset_s,
                    c.matches, out_.alignment.drift_ppm, out_.alignment.residual_s);
      say(line);
    }
  }

  void land(const Asked& asked, const IngestedPhoto& p) {
    const ShotId id = asked.shot.id;
    try {
      const ShotStep step = journal_.state().shots[asked.index].step;
      if (step == ShotStep::firing)
        journal_.append({.kind = EventKind::unknown, .shot = id, .text = "stopped while it was taken"});
      if (step != ShotStep::done) journal_.append({.kind = EventKind::decided, .shot = id, .answer = "taken"});
      land_photograph(journal_, folder_, id, card_ / p.from[0]);
      ++out_.landed;
    } catch (const Error& e) {
      trouble(asked, e);
      return;
    }
    land_others(asked, p);
  }

  /// The RAW file of a JPEG that has landed, where it is not there yet.
  void land_others(const Asked& asked, const IngestedPhoto& p) {
    const Take& take = journal_.state().shots[asked.index].landed.back();
    if (take.shot != asked.shot.id) return;  // retaken meanwhile
    try {
      for (std::size_t i = 1; i < p.from.size(); ++i) {
        const fs::path to = folder_ / "photos" / (fs::path(take.file).stem().string() + p.from[i].extension().string());
        if (fs::exists(to) && sha256_of_file(to) == sha256_of_file(card_ / p.from[i])) continue;
        AtomicFile out(to);
        out.write(read_file(card_ / p.from[i]));
        if (!out.commit_new())
          throw Error(ErrorCode::bad_input, "another file of this name is there, and stays", to.string());
      }
    } catch (const Error& e) {
      trouble(asked, e);
    }
  }

  /// One picture's trouble is not the next one's; but for a capture that can't be written to, as on a full disk.
  void trouble(const Asked& asked, const Error& e) {
    if (e.code() == ErrorCode::cancelled || (e.code() == ErrorCode::io && e.subject().starts_with(folder_.string())))
      throw e;
    out_.troubles.push_back(title(asked.shot) + ": " + e.what());
    say("problem: " + out_.troubles.back());
  }

  void without(const Asked& asked, const std::string& why) {
    say(title(asked.shot) + ": " + why);
    if (!options_.again || options_.dry_run) return;
    if (journal_.state().shots[asked.index].step == ShotStep::firing)
      journal_.append({.kind = EventKind::unknown, .shot = asked.shot.id, .text = "stopped while it was taken"});
    journal_.append({.kind = EventKind::decided, .shot = asked.shot.id, .answer = "again"});
  }

  void say_ambiguity(const Ambiguity& g) const {
    constexpr std::size_t kMost = 4;
    std::string line = "left out, " + g.why + ":";
    for (std::size_t i = 0; i < std::min(kMost, g.shots.size()); ++i)
      line += " " + title(asked_[g.shots[i]].shot) + ",";
    if (g.shots.size() > kMost) line += " … (" + std::to_string(g.shots.size()) + "),";
    for (std::size_t i = 0; i < std::min(kMost, g.pictures.size()); ++i)
      line += " " + out_.card.pictures[g.pictures[i]].files[0].filename().string();
    if (g.pictures.size() > kMost) line += " … (" + std::to_string(g.pictures.size()) + ")";
    say(line);
  }

  const fs::path &folder_, &card_;
  const LandOptions& options_;
  const std::function<void(const std::string&)>& tell_;
  SessionLock lock_;
  Journal journal_;
  std::vector<Asked> asked_;
  std::vector<IngestedPhoto> photos_;
  LandedCard out_;
};

}  // namespace

LandedCard land_card(const fs::path& folder, const fs::path& card, const LandOptions& options,
                     const std::function<void(const std::string&)>& tell, Job& job) {
  return Landing(folder, card, options, tell).run(job);
}

std::string describe_json(const LandedCard& landed) {
  using Json = nlohmann::ordered_json;
  // Names of strangers may be no UTF-8: as an error's text has them.
  const auto file = [&](std::size_t p) {
    return Error(ErrorCode::bad_input, landed.card.pictures[p].files[0].string()).message();
  };
  const auto shot = [&](std::size_t s) {
    const CardShot& one = landed.shots[s];
    return Json{{"stop", one.stop}, {"camera", one.camera}, {"shot", one.id}};
  };
  const auto list = [](const auto& items, const auto& value) {
    Json out = Json::array();
    for (const auto& item : items) out.push_back(value(item));
    return out;
  };
  const Alignment& al = landed.alignment;
  Json json;
  json["landed"] = landed.landed;
  json["matches"] = list(al.matches, [&](const PictureOfShot& m) {
    return Json{
        {"shot", shot(m.shot)}, {"file", file(m.picture)}, {"by_order", m.by_order}, {"residual_s", m.residual_s}};
  });
  json["missing"] = list(al.missing, shot);
  json["not_made"] = list(al.not_made, shot);
  json["extra"] = list(al.extra, file);
  json["ambiguous"] = list(al.ambiguous, [&](const Ambiguity& g) {
    return Json{{"why", g.why}, {"shots", list(g.shots, shot)}, {"files", list(g.pictures, file)}};
  });
  json["clocks"] = list(al.clocks, [&](const ClockSpan& c) {
    return Json{{"first", file(c.first_picture)}, {"offset_s", c.offset_s}, {"matches", c.matches}};
  });
  json["drift_ppm"] = al.drift_ppm;
  json["notes"] = landed.card.notes;
  json["troubles"] = landed.troubles;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lumihull::capture
