#pragma once

// What the experiments share: sizes, results that are kept, pictures side by side.

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace lumihull::experiments {

using Json = nlohmann::ordered_json;

/// How large everything is. `full`: the paper's numbers and its camera's pictures.
struct Size {
  bool full = false;

  int width() const { return full ? 3072 : 960; }  ///< of photographs, px
  /// Diameter of the targets' circles, px: in small pictures the sheets would not fit into the room otherwise.
  double circle_px() const { return full ? 9 : 6.5; }
  double density() const { return full ? 0.12 : 0.25; }  ///< share of walls and floor under sheets
  int photos(int papers) const { return full ? papers : 48; }
  int visits() const { return full ? 25 : 5; }  ///< of each place, photographed (the robot's own: always 25)
  const char* name() const { return full ? "full" : "reduced"; }
};

/// One experiment: fills its folder and returns its figures.
struct Experiment {
  std::string name, what;
  std::function<Json(const std::filesystem::path& folder, const Size& size, Job& job)> run;
};

/// The paper's Table 1 (section 5.4).
std::vector<Experiment> object_experiments();
/// Sections 5.1 and 5.2.
Json measure_repeatability(const std::filesystem::path& folder, const Size& size, Job& job);
Json measure_stability(const std::filesystem::path& folder, const Size& size, Job& job);
/// Cables that stretch in a room for an object of 12 m, and such an object (section 6).
Json measure_elastic(const std::filesystem::path& folder, const Size& size, Job& job);
Json measure_large(const std::filesystem::path& folder, const Size& size, Job& job);
/// Gloss and colour bleeding.
Json measure_gloss(const std::filesystem::path& folder, const Size& size, Job& job);
Json measure_bleeding(const std::filesystem::path& folder, const Size& size, Job& job);

/// Seconds on the wall and of the processor since it was made.
class Stopwatch {
 public:
  Stopwatch();
  Json seconds() const;  ///< {"wall": …, "cpu": …}

 private:
  double wall_, cpu_;
};

/// Pictures of one height side by side, white between them. 8-bit, 1, 3 or 4 channels (transparent becomes white).
Image side_by_side(const std::vector<Image>& pictures, int height);

}  // namespace lumihull::experiments
