#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/hull/mesh.h>

#include <cstddef>
#include <map>
#include <memory>
#include <string>

namespace lumihull::slf {

/// How well pictures' highlights move like the true ones.
struct HighlightPath {
  std::size_t tracks = 0;  ///< highlights that were followed from view to view
  std::size_t places = 0;  ///< of these, in all views
  std::size_t found = 0;  ///< places where the pictures show a highlight, at least 30 % as strong as the photographs do
  double true_length_px = 0;  ///< of the true ways over the surface
  double share = 0;           ///< of that length which the pictures' highlights go along with, weighted by strength
  double rms_px = 0;          ///< distance from the true place, over the places where one was found
};

/// Judges how highlights move from view to view, each by itself. All pictures are 8-bit RGB or RGBA, sRGB; what a
/// picture shows more than the object has without highlights, in linear luminance, is its gloss, smoothed by 0.4 % of
/// the picture's shorter side. Spots are its local maxima of at least 2 % of white that stand out by a third of their
/// height, and their place the centroid of what is above half of that.
///
/// True highlights are spots of the gloss as it truly is (as much of it as is below white) that the photographs show,
/// too, at least half as strong, and which a picture that misplaces the rest of the object by a pixel could not fake or
/// hide: 30 % of their height, what is asked of a picture's, is at least what the picture without highlights changes
/// there when it is shifted by a pixel. Those of two neighbouring views are one where each is the other's nearest on
/// the surface, by less than two thirds of the distance of the next one; what cannot be told apart is not followed. A
/// highlight's way is what it moves over the surface: the place in a later view less the place in that view of the
/// surface's point where it was before. So what is painted on the surface goes no way at all. Steps are at least 1 % of
/// the shorter side: a shorter one is joined with the next. A picture's highlight is the spot nearest to the true
/// place, within 5 % of the shorter side; its step counts by its part along the true step, from 0 to the true step's
/// length. Steps from or to where it is not found count 0, and so do those after which the picture shows a spot, at
/// least half as bright, nearer to where it was: then that one stayed, and another was found. Each weighs as much as
/// the true highlight is strong (the weaker of both ends).
class LUMIHULL_API HighlightJudge {
 public:
  /// `surface`: the true one, in the views' world. Errors: bad_input (its indices).
  explicit HighlightJudge(const hull::Mesh& surface);
  HighlightJudge(HighlightJudge&&) noexcept;
  ~HighlightJudge();

  /// The next view: the object as it looks there without highlights, highlights alone, and the photograph. Errors:
  /// invalid_argument (types, sizes).
  void add_view(const View& view, const Image& without, const Image& alone, const Image& photograph);
  /// What a method makes of the view that was added last; each method once a view. Errors: invalid_argument.
  void add_picture(const std::string& method, const Image& picture);

  /// Of each method that has pictures of all views, and of "photograph": the measure's own limit. Empty: no highlight
  /// that can be told from the paint is seen in two views in a row.
  std::map<std::string, HighlightPath> paths() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumihull::slf
