#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::slf {

/// The stages in the order in which `run` does them. The verbs, the C API and Python share this list: they only parse
/// and print.
///
///     calibrate   photographs of targets -> cameras.json, targets.json, calibration.html   (left out where no targets
///                 are named, and where poses were imported: then it is done only when asked for by its name)
///     key         photographs -> masks/                (left out where every mask was imported or drawn)
///     hull        masks, cameras -> hull.ply
///     texture     hull.ply, photographs -> textured.glb
///     lightfield  hull.ply, photographs -> light_field.glb
///     evaluate    held-out photographs -> evaluate/    (left out where none is held out)
///     report      everything -> report.html
LUMIHULL_API std::span<const std::string_view> stage_names();

/// One option of a stage: where its name, type, range, default and help are written down, once for all doors.
struct OptionSpec {
  std::string name;      ///< as in capture.json; at the command line '_' becomes '-'
  std::string help;      ///< one line
  OptionValue fallback;  ///< the default; its type is the option's type
  double low = -std::numeric_limits<double>::max(), high = std::numeric_limits<double>::max();  ///< numbers' range
  std::vector<std::string> choices = {};  ///< of a string; empty: any
  bool path = false;  ///< of a string that is none of `choices`: a file or folder; set_option makes it absolute
  bool word = false;  ///< of a path: a text that is no file and does not end with ".json" is a word, kept as it is
  bool several = false;  ///< of a string: parts separated by semicolons; at the command line the flag may be repeated
};

/// Errors: invalid_argument (no such stage).
LUMIHULL_API std::span<const OptionSpec> stage_options(std::string_view stage);

/// Stores an option in the capture after checking its name, type and range (an integer is taken where a real number is
/// expected). Errors: invalid_argument, saying what was expected.
LUMIHULL_API void set_option(Capture& capture, std::string_view stage, std::string_view name, OptionValue value);
/// The same from text: "150", "0.2", "true", "auto", "-1,2,3.5" (a list); "default" takes the stored
/// value out again.
LUMIHULL_API void set_option_text(Capture& capture, std::string_view stage, std::string_view name,
                                  std::string_view text);
/// What set_option_text reads.
LUMIHULL_API std::string option_text(const OptionValue& value);
/// What counts for a stage: the stored value, else the default. Errors: invalid_argument, bad_input.
LUMIHULL_API OptionValue effective_option(const Capture& capture, std::string_view stage, std::string_view name);

struct StageResult {
  std::string stage;
  bool skipped = false;  ///< its inputs and options were those of the last time
  StageRecord record;
  std::vector<std::string> said;  ///< a line each: what was done, and warnings that name the photograph
};

/// Does one stage, unless it was done with the same inputs and options before and its results are still there (or
/// force). Reads the capture's folder, adds to it, and saves the capture. A stage that is stopped leaves its old
/// result in place. Errors: those of the stage; not_found where an earlier stage's result is missing.
LUMIHULL_API StageResult run_stage(Capture& capture, std::string_view stage, Job& job, bool force = false);

/// All the stages that exist and are needed, in order. `ended` is called after each, on the caller's thread, so that
/// what came of the first ones is known even where a later one fails.
LUMIHULL_API std::vector<StageResult> run(Capture& capture, Job& job, bool force = false,
                                          const std::function<void(const StageResult&)>& ended = {});

/// What is in a capture as one JSON object: photographs, cameras, unit, masks, stages, notes.
LUMIHULL_API std::string describe_json(const Capture& capture);

}  // namespace lumihull::slf
