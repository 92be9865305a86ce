#pragma once

#include <lumihull/capture/ingest.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::capture {

/// How pictures of a card go to the shots of a capture's journal.
struct LandOptions {
  std::string camera;                    ///< whose card it is, by its name in the plan; empty: the only camera
  std::optional<double> clock_offset_s;  ///< the camera's clock less UTC, known to half a minute; else it is found
  bool again = false;                    ///< shots without a picture are to be photographed again
  bool dry_run = false;                  ///< say what would be done, and do nothing
};

/// An exposure of the journal that belongs on the card.
struct CardShot {
  std::string stop, camera;
  ShotId id = 0;
  bool landed = false;  ///< by an earlier run
};

/// What became of a card. Alignment's shots count in `shots`, its pictures in card.pictures.
struct LandedCard {
  Card card;
  std::vector<CardShot> shots;
  Alignment alignment;
  std::size_t matched = 0;            ///< pictures of shots that had not landed before; in a dry run these would land
  std::size_t landed = 0;             ///< of these, by this call
  std::size_t missing = 0;            ///< shots that were taken, without a picture
  std::vector<std::string> troubles;  ///< pictures that could not be landed, and why
};

/// Finds which picture of a card is which shot's (`align_pictures`), and lands each (`land_photograph`): the journal
/// knows of a file before it is in its place. capture.json and contact.html are brought up to date. The card is only
/// read; nothing is overwritten; a second run finds what the first one did.
///
/// `tell`: takes a line for people for everything that is found, as it is found; may be empty.
/// Errors: not_found, bad_input (no journal, a damaged one), those of `ingest`; io where another process is at work.
LUMIHULL_API LandedCard land_card(const std::filesystem::path& folder, const std::filesystem::path& card,
                                  const LandOptions& options, const std::function<void(const std::string&)>& tell,
                                  Job& job);

/// {"landed": n, "matches": [{"shot": {"stop", "camera", "shot"}, "file", "by_order", "residual_s"}], "missing": […],
///  "not_made": […], "extra": [files], "ambiguous": [{"why", "shots", "files"}], "clocks": […], "drift_ppm", "notes"}
LUMIHULL_API std::string describe_json(const LandedCard& landed);

}  // namespace lumihull::capture
