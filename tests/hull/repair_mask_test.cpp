// What the other views contradict is decided anew: paper's colour on the object, sheets behind it, shadows.
#include "key/repair_mask.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "support.h"
#include "synthetic.h"
#include "key/wall_key.h"

namespace lumihull::hull {
namespace {

using Eigen::Vector3d;

constexpr int kStep = 2, kViews = 14, kSheets = 12;
constexpr double kRadius = 0.8, kSheet = 0.42, kPrinted = 0.3;  // half sides of a sheet and of what is printed on it
constexpr std::uint8_t kWall = 0, kInk = 1, kPaper = 2, kBall = 3, kPatch = 4;

/// A brown ball in a green room, seen from a ring. Sheets hang around it, so that its outline crosses some in every
/// view; a patch of the ball has exactly their paper's colour.
struct Scene {
  std::vector<CoarseView> views;       ///< masks as a key gives them that knows walls, paper and ink
  std::vector<Image> whole, photos;    ///< photographs, and the same thinned
  std::vector<Image> kinds, sheet_at;  ///< what they show; sheets' numbers, from 1
  std::vector<calib::CalibratedBody> sheets;
  std::optional<calib::ColorKey> key;  ///< of walls, paper and ink

  Scene() {
    for (int k = 0; k < kSheets; ++k) sheets.push_back(sheet(k));
    for (int i = 0; i < kViews; ++i) {
      const double a = 2 * M_PI * i / kViews;
      CoarseView v;
      v.step = kStep;
      v.view.camera = test::pinhole(640, 480, 750);
      v.view.cam_from_world =
          look_at({4 * std::cos(a), 4 * std::sin(a), 1 + 0.9 * std::sin(3 * a)}, {0, 0, 0}, {0, 0, 1});
      render(v.view, std::uint32_t(i));
      photos.push_back(thinned(whole.back()));
      v.mask = thinned(keyed(std::size_t(i)));
      v.frame = {0, 0, v.mask.width(), v.mask.height()};
      views.push_back(std::move(v));
    }
    std::vector<calib::Rgb> background;
    for (std::size_t i = 0; i < photos.size(); ++i)
      for (int y = 0; y < whole[i].height(); y += 3)
        for (int x = 0; x < whole[i].width(); x += 3) {
          const std::uint8_t* p = whole[i].row<std::uint8_t>(y) + 3 * x;
          if (kinds[i].row<std::uint8_t>(y)[x] < kBall) background.push_back({p[0], p[1], p[2]});
        }
    Job job;
    key = calib::ColorKey::train(background, {.foreground_share = 0.2}, job);
  }

  static const Scene& get() {
    static const Scene scene;
    return scene;
  }

  Image keyed(std::size_t view) const {
    return where(kinds[view], [](int kind) { return kind == kBall; });
  }

  std::optional<MaskRepair> learn(std::span<const CoarseView> from, std::span<const calib::CalibratedBody> solved,
                                  std::vector<std::uint8_t> fixed = {}) const {
    fixed.resize(from.size());
    Job job;
    return MaskRepair::learn({from, std::span(photos).first(from.size()), fixed, solved, &*key, std::nullopt, 0}, job);
  }

  template <class Is>
  static Image where(const Image& kind, Is&& is) {
    Image out(kind.width(), kind.height(), 1);
    for (int y = 0; y < kind.height(); ++y)
      for (int x = 0; x < kind.width(); ++x)
        out.row<std::uint8_t>(y)[x] = is(int(kind.row<std::uint8_t>(y)[x])) ? 255 : 0;
    return out;
  }

  static Image thinned(const Image& image) {
    Image out(image.width() / kStep, image.height() / kStep, image.channels());
    for (int y = 0; y < out.height(); ++y)
      for (int x = 0; x < out.width(); ++x)
        for (int c = 0; c < out.channels(); ++c)
          out.row<std::uint8_t>(y)[out.channels() * x + c] =
              image.row<std::uint8_t>(kStep * y + kStep / 2)[out.channels() * (kStep * x + kStep / 2) + c];
    return out;
  }

 private:
  static calib::CalibratedBody sheet(int k) {
    const double a = 2 * M_PI * k / kSheets;
    const Vector3d out(std::cos(a), std::sin(a), 0), center = 2.4 * out + Vector3d(0, 0, k % 2 ? -0.75 : -0.35);
    calib::CalibratedBody body;
    body.design = 0, body.id = k, body.placed = true;
    Eigen::Matrix3d axes;
    axes << Vector3d::UnitZ().cross(out), Vector3d::UnitZ(), Vector3d::UnitZ().cross(out).cross(Vector3d::UnitZ());
    body.body.world_from_body = {Eigen::Quaterniond(axes), center};
    for (int i = 0; i < 9; ++i) {
      body.features.push_back({0, k, i});
      body.points.push_back(center + kPrinted * ((i % 3 - 1) * axes.col(0) + (i / 3 - 1) * axes.col(1)));
    }
    return body;
  }

  void render(const View& v, std::uint32_t seed) {
    Image photo(v.camera.width, v.camera.height, 3), kind(v.camera.width, v.camera.height, 1), number = kind;
    std::mt19937 random(seed);
    const Vector3d eye = v.center(), patch = Vector3d(0.5, -0.8, 0.35).normalized();
    for (int y = 0; y < photo.height(); ++y)
      for (int x = 0; x < photo.width(); ++x) {
        const Vector3d d = v.cam_from_world.rotation.conjugate() * v.camera.ray({x + 0.5, y + 0.5})->normalized();
        const double light = 0.9 + 0.1 * std::sin(0.01 * x + 0.02 * y + eye.x());
        Vector3d color = light * Vector3d(40, 120, 56);
        int is = kWall, at_sheet = 0;
        for (int k = 0; k < kSheets; ++k) {
          const Pose& at = sheets[std::size_t(k)].body.world_from_body;
          const Vector3d o = at.rotation.conjugate() * (eye - at.translation), w = at.rotation.conjugate() * d;
          if (o.z() * w.z() >= 0 || eye.dot(at.translation) > 0)
            continue;  // those on the camera's side are out of sight
          const Vector3d p = o - o.z() / w.z() * w;
          if (std::max(std::abs(p.x()), std::abs(p.y())) > kSheet) continue;
          const bool printed = std::max(std::abs(p.x()), std::abs(p.y())) < kPrinted &&
                               std::sin(40 * p.x()) * std::sin(40 * p.y()) > 0.5;
          is = printed ? kInk : kPaper, at_sheet = k + 1;
          color = printed ? Vector3d(28, 34, 30) : Vector3d(176, 190, 172);
        }
        const double b = eye.dot(d), disc = b * b - eye.squaredNorm() + kRadius * kRadius;
        if (disc > 0) {
          const Vector3d p = (eye - (b + std::sqrt(disc)) * d) / kRadius;
          is = p.dot(patch) > std::cos(0.7) ? kPatch : kBall, at_sheet = 0;
          const double shade = 0.6 + 0.4 * std::clamp(p.dot(Vector3d(0.3, 0.5, 0.8)), 0.0, 1.0);
          color = is == kPatch ? Vector3d(176, 190, 172) : Vector3d(shade * Vector3d(190, 110, 70));
        }
        kind.row<std::uint8_t>(y)[x] = std::uint8_t(is), number.row<std::uint8_t>(y)[x] = std::uint8_t(at_sheet);
        for (int c = 0; c < 3; ++c)
          photo.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(color[c] + double(random() % 5) - 2);
      }
    whole.push_back(std::move(photo)), kinds.push_back(std::move(kind)), sheet_at.push_back(std::move(number));
  }
};

/// Pixels of mended masks that are wrong farther than 1.5 px from the object's outline.
struct Wrong {
  int ball = 0, wall = 0;        ///< missing in the ball beside its patch; extra on walls
  int patch = 0, hole = 0;       ///< pixels of the patch, and missing ones
  int inner = 0, deep_hole = 0;  ///< the same in views where the patch lies well within the outline
  int sheets = 0, extra = 0;     ///< pixels of sheets near the ball, and those that are object
};

Wrong mend(const Scene& scene, const MaskRepair& repair, std::span<const Image> keyed) {
  Wrong w;
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    Image mask = keyed[i];
    repair.mend(mask, scene.whole[i], scene.views[i]);
    const Image truth = Scene::where(scene.kinds[i], [](int k) { return k == kBall || k == kPatch; });
    const Image most = grown(truth, 1), least = shrunk(truth, 1), well = shrunk(truth, 10), near = grown(truth, 60);
    int patch = 0, hole = 0;
    bool within = true;
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x) {
        const int kind = scene.kinds[i].row<std::uint8_t>(y)[x];
        const bool missing = mask.row<std::uint8_t>(y)[x] < 128 && least.row<std::uint8_t>(y)[x];
        const bool extra = mask.row<std::uint8_t>(y)[x] >= 128 && !most.row<std::uint8_t>(y)[x];
        patch += kind == kPatch, hole += missing && kind == kPatch, w.ball += missing && kind == kBall;
        within = within && (kind != kPatch || well.row<std::uint8_t>(y)[x]);
        w.wall += extra && kind == kWall, w.extra += extra && kind != kWall;
        w.sheets += near.row<std::uint8_t>(y)[x] && (kind == kInk || kind == kPaper);
      }
    w.patch += patch, w.hole += hole;
    if (within) w.inner += patch, w.deep_hole += hole;
  }
  return w;
}

/// From all views and sheets.
const MaskRepair& learned() {
  static const auto repair = Scene::get().learn(Scene::get().views, Scene::get().sheets);
  if (!repair) throw Error(ErrorCode::degenerate, "the scene must have a hull");
  return *repair;
}

std::vector<Image> all_keyed(const Scene& scene) {
  std::vector<Image> keyed;
  for (std::size_t i = 0; i < scene.views.size(); ++i) keyed.push_back(scene.keyed(i));
  return keyed;
}

TEST(RepairMask, PaperIsObjectOnTheObjectAndBackgroundOnSheets) {
  const Scene& scene = Scene::get();
  const Wrong w = mend(scene, learned(), all_keyed(scene));
  ASSERT_GT(w.inner, 20000);
  EXPECT_EQ(w.deep_hole, 0);
  // Notches are left where the patch is at the outline before a sheet.
  EXPECT_LT(w.hole, 0.1 * w.patch);
  ASSERT_GT(w.sheets, 50000);
  EXPECT_LT(w.extra, 0.002 * w.sheets);
  EXPECT_EQ(w.ball, 0);
  EXPECT_EQ(w.wall, 0);
}

TEST(RepairMask, SheetsThatWereNotSolvedAreBackgroundWhereTheOtherViewsSeeNoObject) {
  const Scene& scene = Scene::get();
  std::vector<calib::CalibratedBody> solved = scene.sheets;
  solved[4].placed = false;  // a third of the views show it as object, too
  solved.erase(solved.begin() + 9);
  std::vector<CoarseView> views = scene.views;
  std::vector<Image> keyed = all_keyed(scene);
  int taken = 0;
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    for (int y = 0; y < keyed[i].height(); ++y)
      for (int x = 0; x < keyed[i].width(); ++x) {
        if (i % 3 == 0 && scene.sheet_at[i].row<std::uint8_t>(y)[x] == 5)
          keyed[i].row<std::uint8_t>(y)[x] = 255, ++taken;
      }
    views[i].mask = Scene::thinned(keyed[i]);
  }
  ASSERT_GT(taken, 5000);
  const auto repair = scene.learn(views, solved);
  ASSERT_TRUE(repair);
  const Wrong w = mend(scene, *repair, keyed);
  // Some of a sheet that nobody knows of is object where it meets the outline.
  EXPECT_LT(w.extra, 0.01 * w.sheets);
  EXPECT_EQ(w.wall, 0);
  EXPECT_EQ(w.deep_hole, 0);
}

TEST(RepairMask, WithoutSolvedSheetsPaperIsBackgroundEverywhere) {
  const Scene& scene = Scene::get();
  const auto repair = scene.learn(scene.views, {});
  ASSERT_TRUE(repair);
  const Wrong w = mend(scene, *repair, all_keyed(scene));
  EXPECT_GT(w.hole, 0.9 * w.patch) << "the scene must be one that needs the sheets' places";
  EXPECT_EQ(w.extra, 0);
  EXPECT_EQ(w.ball, 0);
}

TEST(RepairMask, DrawnMasksVoteAsTheyAre) {
  // Somebody took the upper part of the ball away, in two views from its sides: with it goes what is deep below the
  // patch, so that a third view's hole there stays.
  const Scene& scene = Scene::get();
  std::vector<CoarseView> views = scene.views;
  std::vector<std::uint8_t> fixed(views.size(), 0);
  for (const std::size_t i : {2u, 9u}) {
    for (int y = 0; y < 150; ++y)
      std::fill_n(views[i].mask.row<std::uint8_t>(y), views[i].mask.width(), std::uint8_t(0));
    fixed[i] = 1;
  }
  const auto hole = [&](const MaskRepair& repair) {
    Image mask = scene.keyed(12);
    repair.mend(mask, scene.whole[12], scene.views[12]);
    int missing = 0;
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x)
        missing += scene.kinds[12].row<std::uint8_t>(y)[x] == kPatch && mask.row<std::uint8_t>(y)[x] < 128;
    return missing;
  };
  const auto drawn = scene.learn(views, scene.sheets, fixed);
  ASSERT_TRUE(drawn);
  EXPECT_GT(hole(*drawn), 5000);
  EXPECT_EQ(hole(learned()), 0);
}

TEST(RepairMask, NothingIsSaidByLessThanFiveViews) {
  const Scene& scene = Scene::get();
  const std::span views = scene.views;
  EXPECT_FALSE(scene.learn(views.first(4), scene.sheets));
  EXPECT_TRUE(scene.learn(views.first(5), scene.sheets));
}

std::vector<Sheet> sheets_around() { return sheets_of(Scene::get().sheets, Vector3d(0, 0, 1)); }

/// The ball, carved from its true masks.
const CoarseHull& ball() {
  static const auto hull = [] {
    const Scene& scene = Scene::get();
    std::vector<CoarseView> views = scene.views;
    for (std::size_t i = 0; i < views.size(); ++i)
      views[i].mask = Scene::thinned(Scene::where(scene.kinds[i], [](int k) { return k >= kBall; }));
    Job job;
    return CoarseHull::carve(views, 48, 0.1, job);
  }();
  if (!hull) throw Error(ErrorCode::degenerate, "the scene must have a hull");
  return *hull;
}

TEST(Sheets, PaperIsMeasuredWhereItEnds) {
  const Scene& scene = Scene::get();
  std::vector<Sheet> sheets = sheets_around();
  ASSERT_EQ(sheets.size(), std::size_t(kSheets));
  Job job;
  const auto paper = PaperColors::learn(sheets, scene.views, scene.photos, ball(), job);
  ASSERT_TRUE(paper);
  measure_paper(sheets, scene.views, scene.photos, ball(), *paper, job);
  int measured = 0;
  for (const Sheet& s : sheets)
    for (const double reach : s.reach) {
      EXPECT_GT(reach, kSheet / kPrinted - 0.01);
      measured += reach < kSheet / kPrinted + 0.2;
    }
  EXPECT_GT(measured, 0.75 * 4 * kSheets) << "the ball hides some sides in nearly all views";
}

TEST(Sheets, WithoutViewsThatTellPaperMayReachFar) {
  const Scene& scene = Scene::get();
  std::vector<Sheet> sheets = sheets_around();
  Job job;
  const auto paper = PaperColors::learn(sheets, scene.views, scene.photos, ball(), job);
  ASSERT_TRUE(paper);
  measure_paper(sheets, {}, {}, ball(), *paper, job);
  for (const Sheet& s : sheets)
    for (const double reach : s.reach) EXPECT_EQ(reach, Sheet::kFarthest);
}

TEST(WallKey, KnowsNoPaperBesideSheets) {
  const Scene& scene = Scene::get();
  std::vector<Sheet> sheets = sheets_around();
  for (Sheet& s : sheets) s.reach.fill(kSheet / kPrinted + 0.05);
  Job job;
  const auto key = key_beside_sheets(*scene.key, sheets, scene.views, scene.photos, ball(), job);
  ASSERT_TRUE(key);
  for (const calib::Rgb& sheet : {calib::Rgb{176, 190, 172}, calib::Rgb{28, 34, 30}, calib::Rgb{102, 112, 101}}) {
    EXPECT_TRUE(key->is_object(sheet)) << int(sheet[0]);
    if (sheet[0] != 102) {
      EXPECT_FALSE(scene.key->is_object(sheet)) << int(sheet[0]);
    }
  }
  for (const double light : {0.82, 0.9, 0.98}) {
    const calib::Rgb wall{std::uint8_t(40 * light), std::uint8_t(120 * light), std::uint8_t(56 * light)};
    EXPECT_FALSE(key->is_object(wall)) << light;
  }

  // On a picture of paper, half of it at a sheet's place: object is the other half; without edges, what is wide.
  Image mask(24, 12, 1), photo(24, 12, 3), parts(12, 6, 1);
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 24; ++x) {
      const calib::Rgb c = x < 20    ? calib::Rgb{176, 190, 172}
                           : x == 22 ? calib::Rgb{176, 190, 172}
                                     : calib::Rgb{36, 108, 50};
      std::copy(c.begin(), c.end(), photo.row<std::uint8_t>(y) + 3 * x);
      if (x < 12) parts.row<std::uint8_t>(y / 2)[x / 2] = kPaperRim;
    }
  for (const bool edges : {true, false}) {
    Image out = mask;
    key_places(out, photo, parts, *key, edges);
    for (int x = 0; x < 24; ++x)
      EXPECT_EQ(out.row<std::uint8_t>(6)[x], (x >= 12 && x < 20) || (x == 22 && edges) ? 255 : 0) << x << ' ' << edges;
  }
}

/// Whether a pixel that was keyed as object still is.
bool stays(const calib::Rgb& color, const calib::Rgb& background) {
  Image mask(1, 1, 1), photo(1, 1, 3);
  mask.row<std::uint8_t>(0)[0] = 255;
  std::copy(color.begin(), color.end(), photo.row<std::uint8_t>(0));
  Shadows(background).take(mask, photo);
  return mask.row<std::uint8_t>(0)[0] == 255;
}

TEST(Shadows, TakesWhatIsDarkerAndMoreSaturatedThanTheEnclosure) {
  const calib::Rgb green{40, 120, 56}, blue{30, 50, 130};
  EXPECT_FALSE(stays({10, 60, 18}, green));
  EXPECT_FALSE(stays({2, 30, 4}, green));
  EXPECT_FALSE(stays({4, 8, 50}, blue));
  EXPECT_TRUE(stays({30, 30, 30}, green)) << "dark grey";
  EXPECT_TRUE(stays({20, 60, 28}, green)) << "as saturated as the enclosure";
  EXPECT_TRUE(stays({40, 70, 45}, green)) << "less saturated";
  EXPECT_TRUE(stays({20, 200, 40}, green)) << "brighter than the enclosure";
  EXPECT_TRUE(stays({80, 10, 20}, green)) << "another hue";
  EXPECT_TRUE(stays({4, 8, 50}, green)) << "another hue";
  EXPECT_TRUE(stays({0, 0, 0}, green)) << "black";
  EXPECT_TRUE(stays({1, 18, 2}, green)) << "too dark to have a hue";
}

TEST(Shadows, AreSureWhereTheyAreAsSaturatedAsTheBackgroundThatIsSoDark) {
  // A green ground that gets darker and more saturated to the right; nothing is darker than a light of 50.
  const Scene& scene = Scene::get();
  std::vector<CoarseView> views(scene.views.begin(), scene.views.begin() + 2);
  std::vector<Image> photos;
  const auto ground = [](double light) {
    const double green = 0.95 - 0.4 * light / 216;
    return calib::Rgb{std::uint8_t((1 - green) * 0.4 * light), std::uint8_t(green * light),
                      std::uint8_t((1 - green) * 0.6 * light)};
  };
  for (const CoarseView& v : views) {
    Image photo(v.mask.width(), v.mask.height(), 3);
    for (int y = 0; y < photo.height(); ++y)
      for (int x = 0; x < photo.width(); ++x) {
        const calib::Rgb c = ground(50 + 166.0 * x / photo.width());
        std::copy(c.begin(), c.end(), photo.row<std::uint8_t>(y) + 3 * x);
      }
    photos.push_back(std::move(photo));
  }
  Shadows shadows({40, 120, 56});
  const calib::Rgb deep = ground(60), deeper{0, 19, 1}, brown{8, 31, 11}, black{4, 12, 4};
  EXPECT_FALSE(shadows.is_sure(deep.data())) << "before anything was seen";
  EXPECT_FALSE(shadows.may_be(deeper.data())) << "too dark to be taken unseen";
  Job job;
  shadows.learn(views, photos, ball(), job);
  EXPECT_TRUE(shadows.is_sure(deep.data()));
  EXPECT_TRUE(shadows.is_sure(deeper.data())) << "darker than all that was seen, and as saturated";
  EXPECT_TRUE(shadows.may_be(deeper.data()));
  EXPECT_TRUE(shadows.may_be(brown.data())) << "more saturated than the enclosure";
  EXPECT_FALSE(shadows.is_sure(brown.data())) << "but less than what is so dark";
  EXPECT_FALSE(shadows.may_be(black.data()));
}

TEST(Shadows, NothingBeforeAGreyOrBlackEnclosure) {
  for (const calib::Rgb& background : {calib::Rgb{120, 120, 120}, calib::Rgb{118, 126, 116}, calib::Rgb{0, 0, 0}})
    for (const calib::Rgb& color : {calib::Rgb{10, 60, 18}, calib::Rgb{0, 90, 0}, calib::Rgb{30, 30, 30}})
      EXPECT_TRUE(stays(color, background));
}

}  // namespace
}  // namespace lumihull::hull
