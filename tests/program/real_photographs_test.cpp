// The README's commands on photographs that we did not make.

#include <lumihull/base/capture.h>

#include <nlohmann/json.hpp>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

using test::lumihull;
using test::Outcome;

TEST(RealPhotographs, DinosaurFromMatricesToNewViews) {
  LUMIHULL_NEED_REAL_DATA(data, "dinosaur");
  const test::TemporaryFolder folder;
  const std::string dino = folder / "dino";
  ASSERT_EQ(lumihull({"import", "projections", data / "P.txt", "-o", dino}).status, 0);
  ASSERT_EQ(lumihull({"key", dino, "--background", "auto", "--hold-out", "6", "-q"}).status, 0);
  const Outcome run = lumihull({"run", dino, "--resolution", "256", "--hold-out", "6", "-q"});
  ASSERT_EQ(run.status, 0) << run.err;
  const Outcome evaluate = lumihull({"evaluate", dino, "--reference-masks", data / "masks", "--json", "-q"});
  ASSERT_EQ(evaluate.status, 0) << evaluate.err;
  const auto json = nlohmann::json::parse(evaluate.out);
  EXPECT_EQ(json["photos_used"], 30);
  EXPECT_EQ(json["photos_held_out"], 6);
  EXPECT_GE(json["keyed_iou"], 0.985);
  EXPECT_GE(json["silhouette_iou"], 0.975);
  // What was measured, less what another compiler's rounding may cost.
  EXPECT_GT(json["methods"]["lumigraph"]["psnr_inside"], json["methods"]["mean_texture"]["psnr_inside"]);
}

TEST(RealPhotographs, TempleFromItsParameterFile) {
  LUMIHULL_NEED_REAL_DATA(data, "temple");
  const test::TemporaryFolder folder;
  const std::string temple = folder / "temple";
  ASSERT_EQ(lumihull({"import", "middlebury", data / "templeSR_par.txt", "-o", temple}).status, 0);
  const Outcome run = lumihull({"run", temple, "--resolution", "200", "--hold-out", "6", "-q"});
  ASSERT_EQ(run.status, 0) << run.err;
  const Outcome evaluate = lumihull({"evaluate", temple, "--json", "-q"});
  ASSERT_EQ(evaluate.status, 0) << evaluate.err;
  EXPECT_GE(nlohmann::json::parse(evaluate.out)["silhouette_iou"], 0.93);
}

}  // namespace
}  // namespace lumihull
