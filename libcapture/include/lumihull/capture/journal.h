#pragma once

#include <lumihull/base/api.h>
#include <lumihull/capture/robot.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::capture {

/// What happens in a capture. A line of the journal tells one of these.
enum class EventKind : std::uint8_t {
  begin,     ///< always the first: which plan
  session,   ///< a process takes up the capture: robot, cameras, options, in words
  consent,   ///< the operator was asked, and answered
  moving,    ///< to a stop; written before the robot is told
  arrived,   ///< at the stop
  declared,  ///< the operator, or the robot's own cable lengths, said that the platform is at this stop
  firing,    ///< written before the shutter is asked
  done,      ///< one exposure was made
  refused,   ///< none was made
  unknown,   ///< one or none
  decided,   ///< the operator's word on a shot in doubt: "taken" or "again"
  file,      ///< the photograph's name, size and digest; written before the file is put in its place
  retake,    ///< a stop is to be photographed once more
  fault,     ///< what went wrong, in words
  paused,
  stopped,
  finished,  ///< how a session ended; a killed one has no such line
};

/// One line. Which members count depends on the kind; the others are left as they are here.
struct JournalEvent {
  EventKind kind = EventKind::session;
  std::string time{};               ///< ISO 8601, UTC, milliseconds; set by `append`
  std::string stop{};               ///< moving, arrived, declared, firing, retake
  std::string camera{};             ///< firing
  ShotId shot = 0;                  ///< firing, done, refused, unknown, decided, file
  double settle_s = 0;              ///< firing
  double exposure_s = 0;            ///< firing
  std::vector<double> lengths_m{};  ///< firing: of the cables, as commanded
  std::string file{}, sha256{};     ///< file: its name in photos/
  std::uint64_t size = 0;           ///< file
  std::string answer{};             ///< consent, decided
  std::string text{};               ///< session, consent (the question), refused, unknown, retake, fault, stopped
};

/// What the first line says.
struct JournalHead {
  std::string plan_sha256;    ///< of plan.json in the capture's folder
  std::string name_template;  ///< of photographs' names
  std::vector<std::string> stops, cameras;
  std::set<std::string> passed;  ///< of the stops: those where nothing is photographed
};

/// Where a photograph stands.
enum class ShotStep : std::uint8_t {
  none,     ///< nothing is photographed at this stop
  waiting,  ///< not asked for yet, or to be taken (again)
  firing,   ///< the shutter was asked, no answer yet; of a killed session: in doubt
  refused,  ///< asked for, surely not taken
  unknown,  ///< asked for, perhaps taken
  done,     ///< taken; its file is not here yet
  landed,   ///< its file is in photos/
};

/// One exposure and, once it landed, its file.
struct Take {
  ShotId shot = 0;
  int attempts = 0;  ///< how often the shutter was asked under this number
  std::string time;  ///< of the latest `firing`
  double settle_s = 0, exposure_s = 0;
  std::vector<double> lengths_m;
  bool confirmed = false;  ///< in doubt until the operator said that it was taken
  std::string file, sha256;
  std::uint64_t size = 0;
};

/// One photograph of the plan: a stop and a camera.
struct ShotProgress {
  ShotStep step = ShotStep::waiting;
  Take take{};                 ///< the latest; shot = 0 before the first
  std::vector<Take> landed{};  ///< all whose files landed, oldest first; the newest is the view
  std::string detail{};        ///< why, for refused and unknown
};

/// What all lines together say.
struct LUMIHULL_API JournalState {
  JournalHead head;
  std::vector<ShotProgress> shots;  ///< head.stops.size() x head.cameras.size(), a stop's cameras side by side
  std::map<ShotId, std::size_t> by_id;
  std::set<std::string> files;  ///< every name that was ever given
  ShotId last_id = 0;
  std::optional<std::size_t> at_stop;     ///< where the robot is, or was last sent to
  std::optional<std::size_t> arrived_at;  ///< where it last was for certain
  bool moving = false;                    ///< sent to at_stop, not arrived
  std::size_t sessions = 0, events = 0;
  EventKind last = EventKind::begin;
  std::string last_time;

  std::size_t index(std::size_t stop, std::size_t camera) const { return stop * head.cameras.size() + camera; }
  std::optional<std::size_t> stop_index(std::string_view name) const;
  std::size_t count(ShotStep step) const;
  std::size_t views() const;  ///< photographs of which a file landed (a retake under way does not take it off)
};

/// The journal of a capture: one JSON line an event, only ever appended to, each synchronised to the disk before the
/// next thing happens. A line ends with the first 16 digits of SHA-256 of the line before's and its own text, so that a
/// line that was changed, lost or put elsewhere is seen.
///
/// What a crash leaves of its last line (no end of line, or NUL bytes in it: pages that were never written) is taken
/// off when the journal is opened: `append` had not returned. Any other damage is Error{bad_input} with the line.
class LUMIHULL_API Journal {
 public:
  /// A new journal. Errors: invalid_argument (a file with whole lines is there; names used twice or none), io.
  static Journal create(const std::filesystem::path& file, const JournalHead& head);
  /// Errors: not_found, bad_input (file, line, what was expected), io.
  static Journal open(const std::filesystem::path& file);
  Journal(Journal&& other) noexcept;
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  ~Journal();

  const JournalState& state() const { return state_; }

  /// Writes the event and waits until it is on the disk; then it counts. Errors: io (disk full: the journal is as
  /// before, and may be appended to later); internal for an event that can't follow.
  void append(JournalEvent event);

 private:
  Journal(std::filesystem::path file, int descriptor) : file_(std::move(file)), descriptor_(descriptor) {}
  void write_line(const std::string& line);
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t length_ = 0;
  bool broken_ = false;  // what the disk holds is not known any more
  std::string sum_;
  JournalState state_;
};

/// The state that a journal tells, without touching it. Errors as `open`.
LUMIHULL_API JournalState read_journal(const std::filesystem::path& file);

}  // namespace lumihull::capture
