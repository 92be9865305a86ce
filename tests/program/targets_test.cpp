// The verb `targets`: what people see of it, and what it refuses.

#include <lumihull/base/files.h>
#include <lumihull/calib/target_set.h>

#include <nlohmann/json.hpp>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

using calib::TargetSet;
using test::lumihull;
using testing::ElementsAre;
using testing::HasSubstr;

struct TargetsVerb : testing::Test {
  test::TemporaryFolder folder;
  std::string stem(const std::string& name = "t") const { return (folder / name).string(); }
};

TEST_F(TargetsVerb, WritesSheetsAndWhatIsOnThem) {
  const auto run = lumihull({"targets", "--ids", "0-4,100", "--per-sheet", "4", "--paper", "a4", "--format", "pdf,svg",
                             "--json", "-o", stem()});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json["files"].size(), 4u);
  for (const auto& file : json["files"]) EXPECT_TRUE(std::filesystem::exists(file.get<std::string>()));
  EXPECT_EQ(json["sheets"], 2);
  EXPECT_EQ(json["size_m"], 0.018);
  EXPECT_EQ(json["word"], "matrix5x5:18mm");
  EXPECT_THAT(run.err, HasSubstr("Print at 100 %"));
  EXPECT_THAT(run.err, HasSubstr("measure the bar"));
  const TargetSet set = TargetSet::load(json["targets"].get<std::string>());
  std::vector<int> ids;
  for (const auto& board : set.boards)
    for (const auto& target : board.targets) ids.push_back(target.id);
  EXPECT_THAT(ids, ElementsAre(0, 1, 2, 3, 4, 100));
  EXPECT_EQ(TargetSet::from_word(json["word"].get<std::string>()).designs[0].size_m, 0.018);
}

TEST_F(TargetsVerb, RangesTakeWhatTheFamilyHas) {
  ASSERT_EQ(lumihull({"targets", "--family", "paper4x4", "--ids", "0-9", "-o", stem()}).status, 0);
  std::vector<int> ids;
  for (const auto& board : TargetSet::load(stem() + ".json").boards) ids.push_back(board.targets[0].id);
  const auto all = calib::TargetFamily::by_name("paper4x4").ids();
  EXPECT_FALSE(ids.empty());
  for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_EQ(ids[i], all[i]);
  EXPECT_GT(all[ids.size()], 9);
}

TEST_F(TargetsVerb, ColoursSizesAndTheMeasuredBar) {
  ASSERT_EQ(lumihull({"targets", "--ids", "7", "--size", "30mm", "--ink", "#001080", "--paper-color", "200,210,255",
                      "--paint-paper", "--bar", "148.5mm", "-o", stem() + ".pdf"})
                .status,
            0);
  const TargetSet set = TargetSet::load(stem() + ".json");
  EXPECT_EQ(set.designs[0].ink, (calib::Rgb{0, 16, 128}));
  EXPECT_EQ(set.designs[0].paper, (calib::Rgb{200, 210, 255}));
  EXPECT_EQ(set.designs[0].size_m, 0.03);
  EXPECT_NEAR(set.designs[0].scale_x, 0.99, 1e-12);
  EXPECT_NEAR(set.designs[0].feature(24).x(), 0.99 * 0.06, 1e-12);
}

TEST_F(TargetsVerb, Boards) {
  ASSERT_EQ(lumihull({"targets", "--board", "chessboard:9x6:25mm", "-o", stem("chess")}).status, 0);
  EXPECT_EQ(TargetSet::load(stem("chess.json")).grids[0].spacing_m, 0.025);
  ASSERT_EQ(lumihull({"targets", "--board", "circles:11x8", "--bar", "15cm", "-o", stem("dots")}).status, 0);
  EXPECT_GT(TargetSet::load(stem("dots.json")).grids[0].spacing_m, 0.02);
}

TEST_F(TargetsVerb, ReplacesNothingUnasked) {
  write_file(folder / "t.json", "mine");
  const auto run = lumihull({"targets", "--ids", "1", "-o", stem()});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.err, HasSubstr("--overwrite"));
  EXPECT_EQ(read_file(folder / "t.json"), "mine");
  EXPECT_FALSE(std::filesystem::exists(folder / "t.pdf"));
  EXPECT_EQ(lumihull({"targets", "--ids", "1", "--overwrite", "-o", stem()}).status, 0);
}

TEST_F(TargetsVerb, ListsTheFamilies) {
  const auto run = lumihull({"targets", "--list", "--json"});
  ASSERT_EQ(run.status, 0);
  const auto families = nlohmann::json::parse(run.out)["families"];
  EXPECT_EQ(families["paper4x4"], 400);
  EXPECT_EQ(families["matrix6x6"], 4096);
  EXPECT_EQ(families["apriltag:36h11"], 587);
}

TEST_F(TargetsVerb, RefusesInOneLineWhatItCantDo) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> faults{
      {{"--ids", "256"}, "no id 256"},
      {{"--ids", "1,1"}, "twice"},
      {{"--ids", "300-310"}, "no ids 300-310"},
      {{"--ids", "a"}, "--ids"},
      {{"--ids", "-3"}, "--ids"},
      {{"--family", "matrix7x7"}, "matrix6x6"},
      {{"--size", "18"}, "--size"},
      {{"--size", "90mm"}, "largest pitch"},
      {{"--ink", "green"}, "--ink"},
      {{"--ink", "0,0,256"}, "--ink"},
      {{"--ink", "#00zz00"}, "--ink"},
      {{"--ink", "255,255,255"}, "ink"},
      {{"--format", "png"}, "--format"},
      {{"--solid-light"}, "solid_light"},
      {{"--board", "matrix5x5:18mm"}, "--board"},
      {{"--board", "chessboard:9x6:60mm"}, "largest spacing"},
      {{"--bar", "long"}, "--bar"},
      {{"--bar", "1m"}, "scale"},
      {{"--per-sheet", "3"}, "--per-sheet"}};
  for (const auto& [flags, names] : faults) {
    std::vector<std::string> arguments{"targets", "-o", stem()};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    const auto run = lumihull(arguments);
    EXPECT_EQ(run.status, 2) << flags.back();
    EXPECT_THAT(run.err, HasSubstr(names)) << flags.back();
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << flags.back();
  }
  EXPECT_EQ(lumihull({"targets"}).status, 2);
  EXPECT_EQ(lumihull({"targets", "-o", stem(), "--family", "apriltag:Circle21h7"}).status, 1);
  EXPECT_EQ(lumihull({"targets", "-o", (folder.path() / "absent" / "t").string()}).status, 1);
}

}  // namespace
}  // namespace lumihull
