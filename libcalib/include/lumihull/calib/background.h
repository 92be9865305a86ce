#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/color_key.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace lumihull::calib {

/// Counts colours exactly over any number of photographs in fixed memory (64 MB). `add` may be called by any number of
/// threads; the counts do not depend on the order.
class LUMIHULL_API ColorHistogram {
 public:
  ColorHistogram();
  ColorHistogram(ColorHistogram&&) noexcept;
  ColorHistogram& operator=(ColorHistogram&&) noexcept;
  ~ColorHistogram();

  void add(Rgb color) noexcept;
  /// Pixels of a picture (8 bits, 3 channels) where `mask` (8 bits, 1 channel, same size) is zero; every pixel without.
  void add_pixels(const Image& photo, const Image* mask = nullptr);

  std::uint64_t total() const noexcept;
  /// All colours with their counts, ascending.
  std::vector<ColorCount> counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Takes at most `at_most` samples of a population, spread evenly: the population stands in Morton order of its
/// colours, and every (total / at_most)-th is taken. Deterministic, and independent of the order in which pixels were
/// seen; each colour's count is its share of the samples to within one.
LUMIHULL_API std::vector<ColorCount> subsample(std::span<const ColorCount> population, std::size_t at_most);

/// A rectangle of one photograph, px: columns x … x + width - 1, rows y … y + height - 1.
struct Region {
  std::string photo;  ///< the shot's name
  int x = 0, y = 0, width = 0, height = 0;
};

/// Parses "NAME:x,y,width,height"; several are separated by ';'. Error{invalid_argument} quoting the part that is
/// wrong.
LUMIHULL_API std::vector<Region> parse_regions(const std::string& text);

/// What is left of a scan within its black frame: rows and columns at the picture's border that are nearly black over
/// their whole length and end in a step do not belong to it. Pixels [x0, x1) x [y0, y1) are picture.
struct Frame {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};
LUMIHULL_API Frame find_frame(const Image& photo);

/// Background colours found in the photographs themselves, without cameras: `read(i)` gives photograph i (8 bits, 3
/// channels; small ones do). See libcalib/README.md for the assumptions.
LUMIHULL_API std::vector<ColorCount> background_of_photos(std::size_t photos,
                                                          const std::function<Image(std::size_t)>& read, Job& job);

}  // namespace lumihull::calib
