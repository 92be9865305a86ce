#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>
#include <lumihull/capture/robot.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture {

/// An exposure that the journal tells of, whose picture is on a memory card.
struct ExpectedShot {
  std::string stop, camera;
  std::string name;                   ///< its photograph's file name without extension; empty: see ingest
  std::optional<double> time_unix_s;  ///< of the exposure, by this computer's clock
  ShotState state = ShotState::done;  ///< `unknown`: there may or may not be a picture; `refused` is never matched
};

/// One exposure on a card: a picture, or RAW + JPEG of one stem.
struct CardPicture {
  std::vector<std::filesystem::path> files;  ///< relative to the card; the one whose header was read comes first
  int counter = -1;                          ///< 0 … 9999 where the name is one of DCF ("IMG_0042"), else -1
  /// By the camera's clock, as if that showed UTC; UTC itself where EXIF gives the time zone. Seconds since 1970.
  std::optional<double> clock_s;
  double resolution_s = 1;  ///< of clock_s: 1 s, less where EXIF has fractions
  std::string model;
  std::string fault;  ///< why its header can't be read, or empty
};

struct Card {
  std::vector<CardPicture> pictures;  ///< in the order of folders and counters, over the wrap from 9999 to 0001
  std::vector<std::string> notes;     ///< what was passed over, and why
};

/// Looks for pictures in a folder and those below it. Links, pipes and devices are passed over, a million files are
/// an error. Errors: not_found, bad_input (no folder, more than 50,000 entries, deeper than 16 folders), io,
/// cancelled.
LUMIHULL_API Card read_card(const std::filesystem::path& folder, Job& job);

struct AlignOptions {
  /// The camera's clock less UTC, where it is known to `clock_tolerance_s`; else it is found.
  std::optional<double> clock_offset_s;
  double clock_tolerance_s = 30;
};

struct PictureOfShot {
  std::size_t shot = 0, picture = 0;
  bool by_order = false;  ///< one of the two has no time: it is the only order that is left
  double residual_s = 0;  ///< how far the picture's time is from its shot's, by the clock that was found
};

/// Shots and pictures that belong together in more than one way; none of them is matched.
struct Ambiguity {
  std::vector<std::size_t> shots, pictures;
  std::string why;
};

/// A stretch of pictures over which the camera's clock was not set.
struct ClockSpan {
  std::size_t first_picture = 0;
  double offset_s = 0;  ///< the camera's clock less UTC, at the first shot that has a time
  std::size_t matches = 0;
};

struct Alignment {
  std::vector<PictureOfShot> matches;  ///< by shot
  std::vector<std::size_t> missing;    ///< shots that were done and have no picture
  std::vector<std::size_t> not_made;   ///< shots in doubt: there is no picture, so there was no exposure
  std::vector<std::size_t> extra;      ///< pictures of no shot
  std::vector<Ambiguity> ambiguous;
  std::vector<ClockSpan> clocks;
  double drift_ppm = 0;   ///< of the camera's clock
  double residual_s = 0;  ///< root mean square of the matches' residuals, those by order left out
};

/// Finds which picture is which shot's, by times and order.
///
/// Picture times follow the shots' up to an offset that is not known, may jump (a clock that is set, summer time), and
/// drifts; they are cut to whole seconds. Missing and extra pictures cost what their frequency says; the best
/// alignment is a heaviest increasing chain, and each of its pairs is kept only where no alignment that is at most
/// exp(10) times less likely says otherwise. Where a time is missing, the order decides if it leaves one way only.
/// A picture within about 1.5 s of an exposure's time is that exposure's.
///
/// shots: one camera's, in the order of exposure; pictures: as read_card gives them.
/// Errors: invalid_argument (times that are not finite, options), cancelled.
LUMIHULL_API Alignment align_pictures(std::span<const ExpectedShot> shots, std::span<const CardPicture> pictures,
                                      const AlignOptions& options, Job& job);

struct IngestOptions {
  std::string camera;  ///< whose card it is; empty: the only camera of the shots
  bool dry_run = false;
  AlignOptions align;
};

struct IngestedPhoto {
  std::size_t shot = 0;
  std::vector<std::filesystem::path> from, to;  ///< relative to the card; to the photos' folder
  std::vector<std::string> sha256;              ///< of each file; empty in a dry run
  bool was_there = false;                       ///< copied by an earlier run
  bool by_order = false;
  std::string trouble;  ///< why it was not copied: damaged, its name is taken by another file; then sha256 is empty
};

struct Assignment {
  Card card;
  std::vector<std::size_t> shots;  ///< those of the camera; Alignment counts in them
  Alignment alignment;
  std::vector<IngestedPhoto> photos;  ///< `shot` counts in what was given to ingest
};

/// Copies the pictures of a card to where their shots' photographs belong: PHOTOS/NAME.EXTENSION, with the shot's name,
/// or its stop ("STOP-CAMERA" where the shots are of several cameras). Nothing is ever overwritten: a file of that name
/// with other content stays, and is told. Copies are written aside, synchronised and put in place one by one; a second
/// run finds what the first one did. The card is only read. JPEG and PNG that stop in the middle are not copied.
/// Errors: those of read_card and align_pictures; invalid_argument (camera unknown or not given, names that are no
/// plain file names or come twice); io (the first file that can't be written; what is already there stays).
LUMIHULL_API Assignment ingest(const std::filesystem::path& photos, const std::filesystem::path& card,
                               std::span<const ExpectedShot> shots, const IngestOptions& options, Job& job);

}  // namespace lumihull::capture
