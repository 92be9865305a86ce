#pragma once

// What the pipeline knows of a stage: one definition a stage, in the file stage_<name>.cpp.

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/slf/pipeline.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace lumihull::slf {

/// Collects everything that a stage's result depends on.
class InputDigest {
 public:
  void add(std::string_view field, std::string_view value);
  /// The file's bytes; a missing file counts as such.
  void add_file(std::string_view field, const std::filesystem::path& file);
  std::string hex() const;

 private:
  std::string text_;
};

struct StageDefinition {
  std::string_view name;
  int version;  ///< goes up when the same inputs give another result
  std::vector<OptionSpec> options;

  /// Whether `run` should do it at all; where not, `why` is what is said.
  bool (*needed)(const Capture& capture, std::string& why);
  /// Adds the inputs besides the options. Photographs' stamps are up to date when it is called.
  void (*inputs)(const Capture& capture, InputDigest& digest);
  /// Whether the result of the last time is still there.
  bool (*present)(const Capture& capture);
  /// Does it and returns what there is to say.
  std::vector<std::string> (*run)(Capture& capture, Job& job);
};

const StageDefinition& calibrate_stage();
const StageDefinition& key_stage();
const StageDefinition& hull_stage();
const StageDefinition& texture_stage();
const StageDefinition& lightfield_stage();
const StageDefinition& evaluate_stage();
const StageDefinition& report_stage();

template <class T>
T effective(const Capture& capture, std::string_view stage, std::string_view name) {
  return std::get<T>(effective_option(capture, stage, name));
}

/// The parts that several stages depend on.
void add_photos(const Capture& capture, InputDigest& digest);  ///< stamps of all photographs
void add_intrinsics(const Capture& capture, InputDigest& digest);
void add_cameras(const Capture& capture, InputDigest& digest);  ///< intrinsics, poses, what is held out
void add_masks(const Capture& capture, InputDigest& digest);    ///< bytes of all masks
/// All that a colouring of the hull's surface is made from: photographs, cameras, masks, the hull.
void add_surface_inputs(const Capture& capture, InputDigest& digest);

/// StageDefinition::needed of a stage that is never left out.
bool always_needed(const Capture& capture, std::string& why);

std::filesystem::path textured_path(const Capture& capture);
std::filesystem::path light_field_path(const Capture& capture);
std::filesystem::path truth_page_path(const Capture& capture);  ///< evaluate/truth.html
std::filesystem::path evaluation_path(const Capture& capture);

/// A mask to judge a photograph by: NAME.png, .jpg, .jpeg, .tif or .tiff; nullopt where there is none.
std::optional<std::filesystem::path> reference_mask_file(const std::filesystem::path& folder, const std::string& name);

/// Whether a result is there; what can't be looked at isn't.
bool file_exists(const std::filesystem::path& file);

}  // namespace lumihull::slf
