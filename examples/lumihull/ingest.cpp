// lumihull ingest FOLDER CARD: pictures that stayed on a memory card, to the shots of a capture's journal.

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/ingest.h>
#include <lumihull/capture/session.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <set>

#include "program.h"

namespace lumihull::program {

namespace {

namespace fs = std::filesystem;
using capture::ShotStep;

struct Arguments {
  std::string folder, card, camera;
  double clock_offset_s = 0;
  CLI::Option* clock_known = nullptr;
  bool dry_run = false, again = false;
};

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
  capture::ExpectedShot shot;
  capture::ShotId id = 0;
  std::size_t index = 0;
  bool landed = false;
};

/// All exposures of a camera, whose pictures may be on its card: those that landed as well, for they are no strangers.
std::vector<Asked> asked_of(const capture::JournalState& state, const std::string& camera) {
  std::vector<Asked> out;
  for (std::size_t i = 0; i < state.shots.size(); ++i) {
    const std::string& own = state.head.cameras[i % state.head.cameras.size()];
    if (!camera.empty() && own != camera) continue;
    const capture::ShotProgress& shot = state.shots[i];
    const auto add = [&](const capture::Take& take, capture::ShotState made, bool landed) {
      Asked a{{}, take.shot, i, landed};
      a.shot.stop = state.head.stops[i / state.head.cameras.size()];
      a.shot.camera = own;
      a.shot.name = "shot-" + std::to_string(take.shot);
      a.shot.time_unix_s = unix_time(take.time);
      a.shot.state = made;
      out.push_back(std::move(a));
    };
    for (const capture::Take& take : shot.landed) add(take, capture::ShotState::done, true);
    if (shot.step == ShotStep::done) add(shot.take, capture::ShotState::done, false);
    if (shot.step == ShotStep::unknown || shot.step == ShotStep::firing)
      add(shot.take, capture::ShotState::unknown, false);
  }
  std::stable_sort(out.begin(), out.end(), [](const Asked& a, const Asked& b) { return a.id < b.id; });
  return out;
}

std::string title(const Asked& a) { return a.shot.stop + " of " + a.shot.camera; }

class Landing {
 public:
  Landing(Program& program, const Arguments& a) : program_(program), a_(a) {}

  void run() {
    const capture::SessionLock lock(a_.folder);
    capture::Journal journal = capture::Journal::open(capture::journal_path(a_.folder));
    const std::vector<Asked> asked = asked_of(journal.state(), a_.camera);
    std::vector<capture::ExpectedShot> shots;
    for (const Asked& one : asked) shots.push_back(one.shot);
    capture::IngestOptions options;
    options.camera = a_.camera;
    options.dry_run = true;  // land_photograph copies, for the journal must know before a file is in its place
    if (a_.clock_known->count() > 0) options.align.clock_offset_s = a_.clock_offset_s;
    const capture::Assignment found =
        capture::ingest(fs::path(a_.folder) / "photos", a_.card, shots, options, program_.job());

    for (const std::string& note : found.card.notes) program_.say("note: " + note);
    say_clocks(found.alignment);
    for (const capture::IngestedPhoto& p : found.photos) {
      if (asked[p.shot].landed) continue;
      ++matched_;
      if (a_.dry_run)
        program_.say(p.from[0].string() + " -> " + title(asked[p.shot]) + (p.by_order ? " (by order)" : ""));
      else
        land(journal, asked[p.shot], p);
    }
    for (const std::size_t s : found.alignment.missing)
      if (!asked[s].landed) without(journal, asked[s], "taken, but its picture is not on the card");
    for (const std::size_t s : found.alignment.not_made) without(journal, asked[s], "it was not taken");
    for (const capture::Ambiguity& g : found.alignment.ambiguous) say_ambiguity(found, g, asked);
    if (landed_ > 0) {
      const capture::Plan plan = capture::read_plan(capture::plan_path(a_.folder));
      capture::update_capture(a_.folder, plan, journal.state());
      capture::write_contact_sheet(a_.folder, plan, journal.state(), "pictures of a card were added", -1);
    }
    program_.say(std::to_string(a_.dry_run ? matched_ : landed_) + " photographs" +
                 (a_.dry_run ? " would land, " : " landed, ") + std::to_string(found.alignment.missing.size()) +
                 " missing, " + std::to_string(found.alignment.extra.size()) + " of no shot, " +
                 std::to_string(found.alignment.ambiguous.size()) + " places that fit in more than one way");
    if (program_.json) print(found, asked);
    if (troubles_ > 0)
      throw Error(ErrorCode::bad_input, std::to_string(troubles_) + " pictures could not be landed", a_.card);
  }

 private:
  void say_clocks(const capture::Alignment& alignment) {
    for (const capture::ClockSpan& c : alignment.clocks) {
      char line[160];
      std::snprintf(line, sizeof line,
                    "the camera's clock less UTC: %.1f s over %zu pictures, drift %.0f ppm, spread %.2f s", c.offset_s,
                    c.matches, alignment.drift_ppm, alignment.residual_s);
      program_.say(line);
    }
  }

  void land(capture::Journal& journal, const Asked& asked, const capture::IngestedPhoto& p) {
    try {
      const ShotStep step = journal.state().shots[asked.index].step;
      if (step == ShotStep::firing)
        journal.append({.kind = capture::EventKind::unknown, .shot = asked.id, .text = "stopped while it was taken"});
      if (step != ShotStep::done)
        journal.append({.kind = capture::EventKind::decided, .shot = asked.id, .answer = "taken"});
      const std::string name = capture::land_photograph(journal, a_.folder, asked.id, fs::path(a_.card) / p.from[0]);
      for (std::size_t i = 1; i < p.from.size(); ++i) {  // the RAW file of a JPEG
        const fs::path to =
            fs::path(a_.folder) / "photos" / (fs::path(name).stem().string() + p.from[i].extension().string());
        AtomicFile out(to);
        out.write(read_file(fs::path(a_.card) / p.from[i]));
        if (!out.commit_new() && sha256_of_file(to) != sha256_of_file(fs::path(a_.card) / p.from[i]))
          throw Error(ErrorCode::io, "another file of this name is there, and stays", to.string());
      }
      ++landed_;
    } catch (const Error& e) {
      if (e.code() == ErrorCode::cancelled) throw;
      ++troubles_;
      program_.say("problem: " + title(asked) + ": " + e.what());
    }
  }

  void without(capture::Journal& journal, const Asked& asked, const std::string& why) {
    program_.say(title(asked) + ": " + why);
    if (!a_.again || a_.dry_run) return;
    if (journal.state().shots[asked.index].step == ShotStep::firing)
      journal.append({.kind = capture::EventKind::unknown, .shot = asked.id, .text = "stopped while it was taken"});
    journal.append({.kind = capture::EventKind::decided, .shot = asked.id, .answer = "again"});
  }

  void say_ambiguity(const capture::Assignment& found, const capture::Ambiguity& g, const std::vector<Asked>& asked) {
    constexpr std::size_t kMost = 4;
    std::string line = "left out, " + g.why + ":";
    for (std::size_t i = 0; i < std::min(kMost, g.shots.size()); ++i) line += " " + title(asked[g.shots[i]]) + ",";
    if (g.shots.size() > kMost) line += " … (" + std::to_string(g.shots.size()) + "),";
    for (std::size_t i = 0; i < std::min(kMost, g.pictures.size()); ++i)
      line += " " + found.card.pictures[g.pictures[i]].files[0].filename().string();
    if (g.pictures.size() > kMost) line += " … (" + std::to_string(g.pictures.size()) + ")";
    program_.say(line);
  }

  void print(const capture::Assignment& found, const std::vector<Asked>& asked) const {
    const auto list = [](const auto& items, const auto& text) {
      std::string out;
      for (const auto& item : items) out += (out.empty() ? "" : ", ") + text(item);
      return "[" + out + "]";
    };
    // Names of strangers may be no UTF-8: as an error's text has them.
    const auto file = [&](std::size_t p) {
      return json_text(Error(ErrorCode::bad_input, found.card.pictures[p].files[0].string()).message());
    };
    const auto shot = [&](std::size_t s) {
      return "{\"stop\": " + json_text(asked[s].shot.stop) + ", \"camera\": " + json_text(asked[s].shot.camera) +
             ", \"shot\": " + std::to_string(asked[s].id) + "}";
    };
    const capture::Alignment& al = found.alignment;
    std::cout << "{\"landed\": " << landed_ << ", \"matches\": "
              << list(al.matches,
                      [&](const capture::PictureOfShot& m) {
                        return "{\"shot\": " + shot(m.shot) + ", \"file\": " + file(m.picture) +
                               ", \"by_order\": " + (m.by_order ? "true" : "false") +
                               ", \"residual_s\": " + std::to_string(m.residual_s) + "}";
                      })
              << ",\n\"missing\": " << list(al.missing, shot) << ", \"not_made\": " << list(al.not_made, shot)
              << ", \"extra\": " << list(al.extra, file) << ",\n\"ambiguous\": "
              << list(al.ambiguous,
                      [&](const capture::Ambiguity& g) {
                        return "{\"why\": " + json_text(g.why) + ", \"shots\": " + list(g.shots, shot) +
                               ", \"files\": " + list(g.pictures, file) + "}";
                      })
              << ",\n\"clocks\": "
              << list(al.clocks,
                      [&](const capture::ClockSpan& c) {
                        return "{\"first\": " + file(c.first_picture) +
                               ", \"offset_s\": " + std::to_string(c.offset_s) +
                               ", \"matches\": " + std::to_string(c.matches) + "}";
                      })
              << ", \"drift_ppm\": " << al.drift_ppm << ", \"notes\": " << list(found.card.notes, json_text) << "}\n";
  }

  Program& program_;
  const Arguments& a_;
  std::size_t matched_ = 0, landed_ = 0, troubles_ = 0;
};

}  // namespace

void add_ingest(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.verb("ingest", "copy pictures of a memory card to the shots of a capture",
                                [&program, a] { Landing(program, *a).run(); });
  verb->add_option("capture", a->folder, "folder of a capture that was begun")->required();
  verb->add_option("card", a->card, "folder of the pictures: the card, or a copy of it")->required();
  verb->add_option("--camera", a->camera, "whose card it is, by its name in the plan; needed where there are several");
  a->clock_known = verb->add_option("--clock-offset", a->clock_offset_s,
                                    "the camera's clock less UTC in seconds, known to half a minute; else it is found");
  verb->add_flag("--again", a->again, "shots without a picture are to be photographed again");
  verb->add_flag("--dry-run", a->dry_run, "say what would be done, and do nothing");
}

}  // namespace lumihull::program
