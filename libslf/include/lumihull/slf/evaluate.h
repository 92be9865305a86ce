#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/slf/highlights.h>
#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/metrics.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace lumihull::slf {

struct EvaluateOptions {
  std::filesystem::path reference_masks;  ///< folder of masks named like the shots; empty: the capture's own masks
  std::filesystem::path model;            ///< textured mesh; empty: textured.glb in the capture
  std::filesystem::path light_field;      ///< empty: light_field.glb in the capture, where there is one
  /// Folder of views that are no photographs of the capture, as the virtual rig's truth/ has: test_views.json
  /// (cameras), test_views/NAME.png, test_views/masks/NAME.png; for highlights' ways test_views/without_highlights/NAME.png,
  /// test_views/highlights/NAME.png and mesh.ply, in the views' world (see HighlightJudge).
  /// Empty: none.
  std::filesystem::path test_views;
  RenderOptions render{3, false};
  LumigraphOptions lumigraph;
  bool pictures = true;  ///< write reference | rendering | difference to evaluate/ in the capture
};

/// One held-out photograph, or the mean over all of them of the values that are known (NaN: nowhere known).
struct ViewEvaluation {
  std::string name;
  double silhouette_iou =
      std::numeric_limits<double>::quiet_NaN();                 ///< rendered hull, coverage >= 0.5, and reference mask
  double keyed_iou = std::numeric_limits<double>::quiet_NaN();  ///< the capture's mask and the reference mask, where a
                                                                ///< folder was given
  std::map<std::string, PictureQuality> methods;                ///< "light_field", "lumigraph", "mean_texture"
};

/// What pictures of views besides the photographs are like.
struct TestViewEvaluation {
  std::size_t views = 0;
  std::map<std::string, PictureQuality> methods;    ///< means
  std::map<std::string, HighlightPath> highlights;  ///< of the methods, and of "photograph": the measure's own limit
};

struct Evaluation {
  std::size_t photos_used = 0, photos_held_out = 0;
  std::size_t triangles = 0;
  std::uint64_t model_bytes = 0;        ///< of textured.glb
  std::uint64_t light_field_bytes = 0;  ///< of light_field.glb; 0: there is none
  ViewEvaluation mean;
  std::vector<ViewEvaluation> views;
  TestViewEvaluation test_views;
  std::map<std::string, StageRecord, std::less<>> stages;

  /// One JSON object: "photos_used", "photos_held_out", "silhouette_iou", "keyed_iou" (where reference masks were
  /// given), "triangles", "model_bytes", "light_field_bytes" (where there is one), "methods", "stages", and "views"
  /// with the values per photograph. NaN becomes null.
  LUMIHULL_API std::string to_json() const;
};

/// Judges the model by the photographs that were held out.
///
/// Reference: the photograph composited with its soft mask over the capture's background_rgb (black where it has none);
/// the rendering is composited over the same with its own coverage. The mask is the one of the given folder, else the
/// capture's, else wholly opaque. 'Inside' is where the reference mask is >= 128. The texture's quality is that of the
/// model's file, JPEG losses included, and so is the light field's, on its own mesh; the lumigraph blends the
/// photographs that are not held out, on the same mesh. Writes evaluate/NAME.METHOD.png with `pictures`. Errors:
/// degenerate (nothing held out), not_found (the model, a mask), bad_input.
LUMIHULL_API Evaluation evaluate_capture(const Capture& capture, const EvaluateOptions& options, Job& job);

}  // namespace lumihull::slf
