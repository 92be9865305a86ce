#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/report.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;

/// A capture of a painted sphere, every fourth photograph held out, with masks, hull and textured model. Glossy: a
/// broad white highlight on top of the paint.
Capture painted_sphere(const fs::path& folder, bool glossy = false) {
  const hull::Mesh mesh = test::sphere(30);
  Capture capture = Capture::create(folder);
  const std::vector<View> views = test::around(8, 2, 4, test::camera(96, 80, 90));
  capture.cameras = {views[0].camera};
  fs::create_directories(folder / "photos");
  fs::create_directories(folder / "masks");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto paint = [&, bands = test::bands(),
                        eye = views[i].center().cast<float>().eval()](const Eigen::Vector3f& p) -> Eigen::Vector3f {
      if (!glossy) return bands(p);
      const Eigen::Vector3f n = p.normalized(), way = (eye - p).normalized();
      const float c = (2 * n.dot(way) * n - way).dot(Eigen::Vector3f(1, 0.5f, 0.6f).normalized());
      return 0.5f * bands(p) + Eigen::Vector3f::Constant(120 * std::pow(std::max(0.0f, c), 6.0f));
    };
    const slf::Photo photo = test::photograph(mesh, paint, views[i]);
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

std::string decoded(std::string_view base64) {
  std::string out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : base64) {
    const std::size_t digit =
        std::string_view("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/").find(c);
    if (digit == std::string_view::npos) break;
    bits = bits << 6 | std::uint32_t(digit);
    if ((count += 6) >= 8) out += char(bits >> (count -= 8) & 255);
  }
  return out;
}

/// Captions and pictures of a page.
std::vector<std::pair<std::string, Image>> figures_of(const std::string& page) {
  const auto between = [&](std::size_t at, std::string_view before, std::string_view after) {
    const std::size_t from = page.find(before, at) + before.size();
    return std::string_view(page).substr(from, page.find(after, from) - from);
  };
  std::vector<std::pair<std::string, Image>> out;
  for (std::size_t at = page.find("<img"); at != std::string::npos; at = page.find("<img", at + 1)) {
    const std::string jpeg = decoded(between(at, "src=\"data:image/jpeg;base64,", "\""));
    out.emplace_back(between(at, "<figcaption>", "</figcaption>"),
                     decode_image(std::as_bytes(std::span(jpeg)), "figure"));
  }
  return out;
}

Image figure_of(const std::string& page, const std::string& caption) {
  for (auto& [name, picture] : figures_of(page))
    if (name == caption) return picture;
  ADD_FAILURE() << "no figure " << caption;
  return Image(1, 1, 3);
}

/// How much the mean value changes over the pictures of a row.
double range_over(const Image& row, int count) {
  double low = 255, high = 0;
  for (int i = 0; i < count; ++i) {
    double sum = 0;
    const int from = row.width() * i / count, to = row.width() * (i + 1) / count;
    for (int y = 0; y < row.height(); ++y)
      for (int x = 3 * from; x < 3 * to; ++x) sum += row.row<std::uint8_t>(y)[x];
    sum /= 3.0 * (to - from) * row.height();
    low = std::min(low, sum), high = std::max(high, sum);
  }
  return high - low;
}

void fit_and_write_light_field(const Capture& capture, slf::Factorization method = slf::Factorization::joint) {
  Job job;
  slf::LightFieldOptions options;
  options.method = method;
  options.terms = 2;
  options.texel_px = 2;
  slf::write_light_field(capture.folder() / "light_field.glb",
                         slf::fit_light_field(hull::read_mesh(capture.hull_path()),
                                              slf::photos_of(capture, slf::training_shots(capture)), options, job));
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
  EXPECT_THAT(page, HasSubstr("mean texture"));
  EXPECT_THAT(page, Not(HasSubstr("light field")));         // there is none
  EXPECT_EQ(figures_of(page).size(), 3u + 4 + 4 * 3 + 16);  // turntable, hull, comparisons, photographs
}

TEST(Report, ShowsTheLightField) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture", true);
  fit_and_write_light_field(capture);
  slf::set_option(capture, "evaluate", "rays", std::int64_t(1));
  Job job;
  slf::run_stage(capture, "evaluate", job);
  slf::run_stage(capture, "report", job);
  const std::string page = read_file(folder / "capture" / "report.html");
  using testing::HasSubstr;
  // Gloss of one material is what all places mirror alike.
  EXPECT_THAT(page, HasSubstr(" triangles, 0 terms beyond the mean colour and what all places mirror alike, "));
  char size[40];
  std::snprintf(size, sizeof size, "%.1f MB", double(fs::file_size(folder / "capture" / "light_field.glb")) / 1e6);
  EXPECT_THAT(page, HasSubstr("<tr><td>light field</td><td>" + std::string(size) + "</td>"));
  // Two turntables, two strips, hull, comparisons by three methods, photographs.
  EXPECT_EQ(figures_of(page).size(), 8u + 8 + 2 + 4 + 4 * 4 + 16);
  const double moves = range_over(figure_of(page, "light field"), 7),
               rests = range_over(figure_of(page, "its mean colour alone"), 7);
  EXPECT_GT(moves, 8);
  EXPECT_GT(moves, 1.5 * rests);

  fs::remove(folder / "capture" / "light_field.glb");
  EXPECT_FALSE(slf::run_stage(capture, "report", job).skipped);
  EXPECT_THAT(read_file(folder / "capture" / "report.html"), testing::Not(HasSubstr("Surface light field")));
}

TEST(Report, ShowsLightFieldsWithoutAMeanColour) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture", true);
  hull::write_mesh(capture.hull_path(), test::sphere(8));
  fit_and_write_light_field(capture, slf::Factorization::nmf);
  Job job;
  slf::write_report(capture, {}, job);
  const std::string page = read_file(folder / "capture" / "report.html");
  EXPECT_THAT(page, testing::HasSubstr(" a term, "));
  EXPECT_THAT(page, testing::Not(testing::HasSubstr("beyond the mean colour")));
  EXPECT_GT(range_over(figure_of(page, "light field"), 7),
            1.5 * range_over(figure_of(page, "its mean colour alone"), 7));
}

TEST(Report, NamesADamagedLightField) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture");
  fit_and_write_light_field(capture);
  Job job;
  slf::write_report(capture, {}, job);
  const std::string page = read_file(folder / "capture" / "report.html");
  const fs::path file = folder / "capture" / "light_field.glb";
  const std::string good = read_file(file);
  for (const std::string& bad : {std::string(), std::string("glTF"), good.substr(0, good.size() / 2)}) {
    write_file(file, bad);
    const Error error = test::expect_error([&] { slf::write_report(capture, {}, job); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_THAT(error.subject(), testing::HasSubstr("light_field.glb"));
  }
  EXPECT_EQ(read_file(folder / "capture" / "report.html"), page);  // the old one stays
}

TEST(Report, ShowsSomeComparisonsAndOnlyTheCapturesOwn) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture");
  Job job;
  slf::Evaluation e = slf::evaluate_capture(capture, {}, job);
  slf::ReportOptions options;
  options.turntable_frames = 0;
  options.evaluation = &e;
  const std::size_t others = 4 + 16;  // hull, photographs
  const auto pictures = [&] {
    slf::write_report(capture, options, job);
    return figures_of(read_file(folder / "capture" / "report.html")).size() - others;
  };
  EXPECT_EQ(pictures(), 4u * 3);
  const slf::ViewEvaluation first = e.views[0];
  e.views.resize(30, first);
  EXPECT_EQ(pictures(), 12u * 3);

  e.views = {first};
  fs::copy_file(folder / "capture" / "evaluate" / (first.name + ".lumigraph.png"),
                folder / "capture" / "elsewhere.lumigraph.png");
  e.views[0].name = "../elsewhere";
  EXPECT_EQ(pictures(), 0u);

  e.views = {first};
  write_png(folder / "capture" / "evaluate" / (first.name + ".lumigraph.png"), Image(31, 10, 3));
  const Error error = test::expect_error([&] { slf::write_report(capture, options, job); });
  EXPECT_EQ(error.code(), ErrorCode::bad_input);
  EXPECT_THAT(error.subject(), testing::HasSubstr(first.name + ".lumigraph.png"));
}

TEST(Report, TellsHowHighlightsMove) {
  const test::TemporaryFolder folder;
  Capture capture = painted_sphere(folder / "capture");
  slf::Evaluation e;
  e.mean.methods["light_field"] = {30, 0.9, 20, 0.8};
  e.test_views.views = 24;
  e.test_views.methods["light_field"] = {31.25, 0.9, 21.75, 0.8};
  e.test_views.highlights["light_field"] = {2, 23, 19, 400, 0.81, 12.25};
  e.test_views.highlights["photograph"] = {2, 23, 23, 400, 0.97, 2};
  fs::create_directories(folder / "capture" / "evaluate");
  write_file(folder / "capture" / "evaluate" / "evaluation.json", e.to_json());
  Job job;
  slf::run_stage(capture, "report", job);
  const std::string page = read_file(folder / "capture" / "report.html");
  EXPECT_THAT(page, testing::HasSubstr("<td>light field</td><td>31.25</td><td>21.75</td><td>19 of 23</td>"
                                       "<td>81 %</td><td>12.2 px</td>"));
  EXPECT_THAT(page, testing::HasSubstr("<td>photograph</td><td></td><td></td><td>23 of 23</td>"));

  write_file(folder / "capture" / "evaluate" / "evaluation.json", [text = e.to_json()]() mutable {
    return text.replace(text.find("\"found\": 19"), 11, "\"found\": -1");
  }());
  const Error error = test::expect_error([&] { slf::run_stage(capture, "report", job); });
  EXPECT_EQ(error.code(), ErrorCode::bad_input);
  EXPECT_THAT(error.what(), testing::HasSubstr("/test_views/highlights/light_field/found"));
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
