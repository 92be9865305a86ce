#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/report.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;

/// A capture of a painted sphere, every fourth photograph held out, with masks, hull and textured model.
Capture painted_sphere(const fs::path& folder) {
  const hull::Mesh mesh = test::sphere(30);
  Capture capture = Capture::create(folder);
  const std::vector<View> views = test::around(8, 2, 4, test::camera(96, 80, 90));
  capture.cameras = {views[0].camera};
  fs::create_directories(folder / "photos");
  fs::create_directories(folder / "masks");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const slf::Photo photo = test::photograph(mesh, test::bands(), views[i]);
    Shot shot;
    shot.name = "shot" + std::to_string(i);
    shot.file = "photos/" + shot.name + ".png";
    shot.cam_from_world = views[i].cam_from_world;
    write_png(folder / shot.file, photo.rgb);
    shot.stamp = Capture::stamp(folder / shot.file);
    capture.shots.push_back(shot);
    capture.write_mask(i, photo.alpha, MaskSource::imported);
  }
  capture.background_rgb = {{200, 210, 220}};
  capture.set_hold_out(4);
  capture.stages["hull"] = {std::string(64, '0'), 1.5, 123456, "2026-01-01T00:00:00Z"};
  capture.notes = {"<script>alert('no')</script>"};
  capture.save();
  hull::write_mesh(capture.hull_path(), mesh);
  Job job;
  slf::write_glb(folder / "textured.glb",
                 slf::mean_texture(mesh, slf::photos_of(capture, slf::training_shots(capture)), {}, job));
  return Capture::open(folder);
}

TEST(Evaluate, JudgesWhatWasHeldOut) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture");
  Job job;
  const slf::Evaluation e = slf::evaluate_capture(capture, {}, job);
  EXPECT_EQ(e.photos_used, 12u);
  EXPECT_EQ(e.photos_held_out, 4u);
  ASSERT_EQ(e.views.size(), 4u);
  EXPECT_EQ(e.views[1].name, "shot4");
  EXPECT_GT(e.mean.silhouette_iou, 0.995);
  EXPECT_TRUE(std::isnan(e.mean.keyed_iou));
  for (const char* method : {"mean_texture", "lumigraph"}) {
    const slf::PictureQuality& q = e.mean.methods.at(method);
    EXPECT_GT(q.psnr, 32) << method;
    EXPECT_GT(q.psnr_inside, 30) << method;
    EXPECT_LT(q.psnr_inside, 60) << method;
    EXPECT_GT(q.ssim, 0.97) << method;
    double sum = 0;
    for (const auto& view : e.views) sum += view.methods.at(method).psnr_inside;
    EXPECT_NEAR(q.psnr_inside, sum / 4, 1e-12);
    const Image picture = read_image(folder / "capture" / "evaluate" / (std::string("shot8.") + method + ".png"));
    EXPECT_EQ(picture.width(), 3 * 96);
    EXPECT_EQ(picture.row<std::uint8_t>(0)[0], 200);  // the background that was asked for
  }
  const auto json = nlohmann::json::parse(e.to_json());
  EXPECT_EQ(json["photos_used"], 12);
  EXPECT_EQ(json["triangles"], test::sphere(30).triangles.size());
  EXPECT_EQ(json["model_bytes"], fs::file_size(folder / "capture" / "textured.glb"));
  EXPECT_EQ(json["methods"]["lumigraph"]["psnr"], e.mean.methods.at("lumigraph").psnr);
  EXPECT_EQ(json["stages"]["hull"]["peak_bytes"], 123456);
  EXPECT_FALSE(json.contains("keyed_iou"));
}

TEST(Evaluate, HeldOutPhotographsAreUsedForTheJudgementAlone) {
  const test::TemporaryFolder folder;
  Job job;
  std::string model[2], hull[2];
  std::vector<Image> renderings[2];
  for (const std::size_t spoiled : {0u, 1u}) {
    const fs::path where = folder / (spoiled ? "spoiled" : "good");
    Capture capture = painted_sphere(where);
    if (spoiled)
      for (const std::size_t i : slf::held_out_shots(capture)) {
        Image red(96, 80, 3), corner(96, 80, 1);
        for (int y = 0; y < 80; ++y)
          for (int x = 0; x < 96; ++x) red.row<std::uint8_t>(y)[3 * x] = 255;
        std::fill_n(corner.row<std::uint8_t>(0), 20, std::uint8_t(255));
        write_png(capture.photo_path(capture.shots[i]), red);
        capture.write_mask(i, corner, MaskSource::imported);
      }
    slf::set_option(capture, "hull", "resolution", std::int64_t(32));
    slf::set_option(capture, "texture", "max_side", std::int64_t(256));
    slf::set_option(capture, "evaluate", "rays", std::int64_t(1));
    for (const char* stage : {"hull", "texture", "evaluate"}) slf::run_stage(capture, stage, job);
    hull[spoiled] = read_file(where / "hull.ply");
    model[spoiled] = read_file(where / "textured.glb");
    for (const std::size_t i : slf::held_out_shots(capture))
      for (const char* method : {"lumigraph", "mean_texture"})
        renderings[spoiled].push_back(read_image(where / "evaluate" / (capture.shots[i].name + "." + method + ".png")));
  }
  EXPECT_TRUE(hull[0] == hull[1]);
  EXPECT_TRUE(model[0] == model[1]);
  ASSERT_EQ(renderings[0].size(), 8u);
  for (std::size_t i = 0; i < 8; ++i)
    for (int y = 0; y < 80; ++y) {  // reference | rendering | difference
      const std::uint8_t *a = renderings[0][i].row<std::uint8_t>(y), *b = renderings[1][i].row<std::uint8_t>(y);
      ASSERT_TRUE(std::equal(a + 3 * 96, a + 6 * 96, b + 3 * 96)) << i << ", row " << y;
      if (y == 40) {
        EXPECT_FALSE(std::equal(a, a + 3 * 96, b));
      }
    }
}

TEST(Evaluate, IsDoneAgainWhereAReferenceMaskChanged) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture");
  fs::create_directories(folder / "masks");
  const auto write = [&](std::size_t i, const Image& mask) {
    write_file(folder / "masks" / (capture.shots[i].name + ".jpg"), encode_jpeg(mask));
  };
  for (const std::size_t i : slf::held_out_shots(capture)) write(i, capture.read_mask(i));
  slf::set_option(capture, "evaluate", "reference_masks", (folder / "masks").string());
  slf::set_option(capture, "evaluate", "rays", std::int64_t(1));
  Job job;
  EXPECT_FALSE(slf::run_stage(capture, "evaluate", job).skipped);
  EXPECT_TRUE(slf::run_stage(capture, "evaluate", job).skipped);
  write(8, Image(96, 80, 1));
  EXPECT_FALSE(slf::run_stage(capture, "evaluate", job).skipped);
}

TEST(Evaluate, ReferenceMasksWinAndAreCompared) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture");
  fs::create_directories(folder / "masks");
  for (const std::size_t i : slf::held_out_shots(capture)) {
    Image mask = capture.read_mask(i);
    for (int y = 0; y < mask.height() / 2; ++y) std::fill_n(mask.row<std::uint8_t>(y), mask.width(), std::uint8_t(0));
    write_png(folder / "masks" / (capture.shots[i].name + ".png"), mask);
  }
  Job job;
  slf::EvaluateOptions options;
  options.reference_masks = folder / "masks";
  options.pictures = false;
  const slf::Evaluation e = slf::evaluate_capture(capture, options, job);
  EXPECT_NEAR(e.mean.keyed_iou, 0.5, 0.03);
  EXPECT_NEAR(e.mean.silhouette_iou, 0.5, 0.03);
  EXPECT_FALSE(fs::exists(folder / "capture" / "evaluate"));
  EXPECT_TRUE(nlohmann::json::parse(e.to_json()).contains("keyed_iou"));

  fs::remove(folder / "masks" / "shot8.png");
  Error missing = test::expect_error([&] { slf::evaluate_capture(capture, options, job); });
  EXPECT_EQ(missing.code(), ErrorCode::not_found);
  EXPECT_NE(missing.subject().find("shot8"), std::string::npos);
  write_png(folder / "masks" / "shot8.png", Image(5, 5, 1));
  EXPECT_EQ(test::expect_error([&] { slf::evaluate_capture(capture, options, job); }).code(), ErrorCode::bad_input);
}

TEST(Evaluate, Faults) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture");
  Job job;
  write_file(folder / "capture" / "textured.glb", "glTF");
  EXPECT_EQ(test::expect_error([&] { slf::evaluate_capture(capture, {}, job); }).code(), ErrorCode::bad_input);
  fs::remove(folder / "capture" / "textured.glb");
  EXPECT_EQ(test::expect_error([&] { slf::evaluate_capture(capture, {}, job); }).code(), ErrorCode::not_found);
  capture.set_hold_out(0);
  EXPECT_EQ(test::expect_error([&] { slf::evaluate_capture(capture, {}, job); }).code(), ErrorCode::degenerate);
}

TEST(Report, IsOneSelfContainedPage) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "a<b&c");
  Job job;
  const slf::Evaluation e = slf::evaluate_capture(capture, {}, job);
  slf::ReportOptions options;
  options.turntable_frames = 3;
  options.evaluation = &e;
  slf::write_report(capture, options, job);
  const std::string page = read_file(folder / "a<b&c" / "report.html");
  using testing::HasSubstr;
  using testing::Not;
  EXPECT_THAT(page, HasSubstr("<title>a&lt;b&amp;c</title>"));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, HasSubstr("shot4, held out"));
  EXPECT_THAT(page, HasSubstr("mean_texture"));
  std::size_t pictures = 0;
  for (std::size_t at = page.find("<img"); at != std::string::npos; at = page.find("<img", at + 1)) ++pictures;
  EXPECT_EQ(pictures, 3u + 4 + 8 + 16);  // turntable, hull, comparisons, photographs
  std::size_t embedded = 0;
  for (std::size_t at = page.find("src=\"data:image/"); at != std::string::npos;
       at = page.find("src=\"data:image/", at + 1))
    ++embedded;
  EXPECT_EQ(embedded, pictures);
}

TEST(Report, LeavesOutWhatIsNotThere) {
  const test::TemporaryFolder folder;
  Capture capture = Capture::create(folder / "empty");
  capture.save();
  Job job;
  slf::ReportOptions options;
  options.file = folder / "r.html";
  slf::write_report(capture, options, job);
  EXPECT_THAT(read_file(folder / "r.html"), testing::HasSubstr("0 photographs"));
}

}  // namespace
}  // namespace lumihull
