/* Targets in photographs: found, read, measured, drawn. */
#include "check.h"

enum { kGrid = 5, kPitch = 48, kSide = kGrid * kPitch, kFine = 8, kMargin = 30, kSize = kSide + 2 * kMargin };

/* A target seen straight on: each pixel the mean of kFine x kFine samples of ink on paper, in linear light, as sRGB. */
static void photograph(const uint8_t cells[25], uint8_t *grey) {
  const double radius = kPitch / 4.0;
  int x, y, i, j;
  for (y = 0; y < kSize; ++y)
    for (x = 0; x < kSize; ++x) {
      double ink = 0, value;
      for (i = 0; i < kFine; ++i)
        for (j = 0; j < kFine; ++j) {
          const double u = x - kMargin + (j + .5) / kFine, v = y - kMargin + (i + .5) / kFine;
          const int column = (int)floor(u / kPitch), row = (int)floor(v / kPitch);
          double r;
          if (column < 0 || row < 0 || column >= kGrid || row >= kGrid) continue;
          r = hypot(u - (column + .5) * kPitch, v - (row + .5) * kPitch) / radius;
          if (r <= 1 && (!cells[row * kGrid + column] || r >= .55)) ink += 1;
        }
      value = .6 - .57 * ink / (kFine * kFine);
      value = 1.055 * pow(value, 1 / 2.4) - .055;
      /* Noise of about one step, so that contours have one. */
      grey[y * kSize + x] = (uint8_t)(255 * value + (double)((x * 7919 + y * 104729) % 31) / 15);
    }
}

int main(int argc, char **argv) {
  static uint8_t grey[kSize * kSize];
  lh_context *ctx = lh_context_create();
  lh_target_set *set = NULL;
  lh_target_detector *detector = NULL;
  static uint8_t rgb[kSize * kSize * 3];
  lh_image *photo = NULL, *colour = NULL, *drawn = NULL;
  lh_detections *found = NULL, *again = NULL;
  lh_ink_samples *samples = NULL;
  lh_color_key *key = NULL;
  lh_detect_options options;
  lh_detection target;
  lh_refused_target refused;
  uint8_t cells[25];
  int32_t index[25];
  double pixel[50], covariance[75], dual[225], worst = 0;
  size_t i;
  (void)argc, (void)argv;

  MUST(ctx, lh_target_family_cells(ctx, "matrix5x5", 99, cells, 25));
  photograph(cells, grey);
  MUST(ctx, lh_image_from_array(ctx, grey, kSize, kSize, 1, LH_PIXEL_U8, 0, &photo));
  MUST(ctx, lh_target_set_from_word(ctx, "matrix5x5:20mm", &set));

  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.min_circle_px = 1;
  EXPECT(ctx, LH_EINVAL, lh_target_detector_create(ctx, set, &options, &detector));
  CHECK_SAYS(ctx, "smallest circle");
  CHECK(!detector);
  EXPECT(ctx, LH_EINVAL, lh_target_detector_create(ctx, NULL, NULL, &detector));
  MUST(ctx, lh_target_detector_create(ctx, set, NULL, &detector));
  EXPECT(ctx, LH_EINVAL, lh_target_detector_detect(ctx, detector, NULL, &found));
  MUST(ctx, lh_target_detector_detect(ctx, detector, photo, &found));

  CHECK(lh_detections_count(NULL) == 0 && lh_detections_refused_count(NULL) == 0);
  CHECK(lh_detections_count(found) == 1);
  target.struct_size = sizeof target;
  EXPECT(ctx, LH_EINVAL, lh_detections_get(ctx, found, 1, &target));
  MUST(ctx, lh_detections_get(ctx, found, 0, &target));
  CHECK(target.design == 0 && target.id == 99 && target.features == 25 && target.corrected == 0 && target.erased == 0);
  CHECK(target.rms_px < .1);
  EXPECT(ctx, LH_EINVAL, lh_detections_features(ctx, found, 0, index, pixel, NULL, NULL, 24));
  MUST(ctx, lh_detections_features(ctx, found, 0, index, pixel, covariance, dual, 25));
  MUST(ctx, lh_detections_features(ctx, found, 0, NULL, NULL, NULL, NULL, 25));
  for (i = 0; i < 25; ++i) {
    const double x = kMargin + (index[i] % kGrid + .5) * kPitch, y = kMargin + (index[i] / kGrid + .5) * kPitch;
    worst = fmax(worst, hypot(pixel[2 * i] - x, pixel[2 * i + 1] - y));
    CHECK(covariance[3 * i] > 0 && covariance[3 * i + 2] > 0);
    CHECK(fabs(dual[9 * i + 2] - pixel[2 * i]) < 1e-6 && dual[9 * i + 8] == 1);
  }
  CHECK(worst < .05);
  refused.struct_size = sizeof refused;
  EXPECT(ctx, LH_EINVAL, lh_detections_refused(ctx, found, lh_detections_refused_count(found), &refused));

  MUST(ctx, lh_ink_samples_create(ctx, &samples));
  EXPECT(ctx, LH_EDEGENERATE, lh_ink_samples_train(ctx, samples, 0, &key));
  CHECK_SAYS(ctx, "ink");
  EXPECT(ctx, LH_EINVAL, lh_ink_samples_add(ctx, samples, photo, detector, found));
  CHECK_SAYS(ctx, "colour");
  for (i = 0; i < sizeof rgb; ++i) rgb[i] = grey[i / 3];
  MUST(ctx, lh_image_from_array(ctx, rgb, kSize, kSize, 3, LH_PIXEL_U8, 0, &colour));
  MUST(ctx, lh_ink_samples_add(ctx, samples, colour, detector, found));
  MUST(ctx, lh_ink_samples_train(ctx, samples, 0, &key));
  lh_ink_samples_destroy(samples);
  options.min_circle_px = 0;
  options.ink_key = key;
  lh_target_detector_destroy(detector);
  MUST(ctx, lh_target_detector_create(ctx, set, &options, &detector));
  lh_color_key_destroy(key);
  EXPECT(ctx, LH_EINVAL, lh_target_detector_detect(ctx, detector, photo, &again));
  CHECK_SAYS(ctx, "colour");
  MUST(ctx, lh_target_detector_detect(ctx, detector, colour, &again));
  CHECK(lh_detections_count(again) == 1);
  lh_detections_destroy(again);
  lh_image_destroy(colour);

  MUST(ctx, lh_detections_draw(ctx, found, detector, photo, 0, &drawn));
  CHECK(lh_image_width(drawn) == kSize && lh_image_height(drawn) == kSize && lh_image_channels(drawn) == 3);

  lh_image_destroy(drawn);
  lh_detections_destroy(found);
  lh_target_detector_destroy(detector);
  lh_target_set_destroy(set);
  lh_image_destroy(photo);
  lh_context_destroy(ctx);
  return check_result();
}
