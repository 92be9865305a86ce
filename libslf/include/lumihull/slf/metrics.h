#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>

#include <array>
#include <cstdint>

namespace lumihull::slf {

/// How close a picture is to a reference. All on 8-bit sRGB values.
struct PictureQuality {
  double psnr = 0;         ///< dB, whole picture
  double ssim = 0;         ///< whole picture
  double psnr_inside = 0;  ///< dB, where the mask is >= 128; NaN where it is nowhere
  double ssim_inside = 0;  ///< NaN likewise
};

/// PSNR as reported for identical pictures, whose PSNR is infinite: JSON has no infinity, and a mean needs a number.
inline constexpr double kPsnrIdentical = 100;

/// 10 log10(255² / MSE), MSE over all pixels and the three channels; at most kPsnrIdentical.
/// With a mask (8-bit, 1 channel, same size): over the pixels where it is >= 128; NaN where there is none.
/// Both pictures 8-bit RGB of one size, else Error{invalid_argument}.
LUMIHULL_API double psnr(const Image& picture, const Image& reference, const Image* mask = nullptr);

/// Structural similarity (Wang, Bovik, Sheikh & Simoncelli 2004, eq. 13): Gaussian window of 11 x 11 pixels with
/// sigma 1.5, K1 = 0.01, K2 = 0.03, range 255, population variances; for each channel of RGB by itself, then their
/// mean. Averaged over the pixels whose window lies wholly inside the picture, as in the authors' program; with a mask:
/// over those of them where it is >= 128 (the window may reach outside the mask), NaN where there is none. At least 11
/// x 11 pixels, else Error{invalid_argument}.
LUMIHULL_API double ssim(const Image& picture, const Image& reference, const Image* mask = nullptr);

/// All four at once; the two SSIMs share their map.
LUMIHULL_API PictureQuality compare_pictures(const Image& picture, const Image& reference, const Image& mask);

/// Intersection over union of the pixels >= 128 of two 8-bit masks of one channel; 1 where both are empty.
LUMIHULL_API double silhouette_iou(const Image& a, const Image& b);

/// An 8-bit picture on a background: round(alpha photo + (1 - alpha) background), on sRGB values as they are stored
/// (what image editors and the NeRF data sets do). `alpha`: 8-bit, 1 channel, the photograph's size.
LUMIHULL_API Image composited(const Image& rgb, const Image& alpha, const std::array<std::uint8_t, 3>& background);
/// The same for a picture that carries its alpha (4 channels, straight).
LUMIHULL_API Image composited(const Image& rgba, const std::array<std::uint8_t, 3>& background);

}  // namespace lumihull::slf
