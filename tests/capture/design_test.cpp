#include <lumihull/capture/design.h>
#include <lumihull/capture/mechanism_figures.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "design/cma_es.h"
#include "design/objective.h"
#include "design/random.h"
#include "support.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;
using test::expect_error;

DesignOptions small(std::uint64_t seed) {
  DesignOptions options;
  options.workspaces[0].azimuths = 8, options.workspaces[0].polar_steps = 4;
  options.object = KeepOut{{0, 0, -1}, 0.4, 1};
  options.seed = seed;
  options.evaluations = 200;
  return options;
}

bool same(const Mechanism& a, const Mechanism& b) {
  for (std::size_t i = 0; i < a.cables.size(); ++i)
    if (a.cables[i].departure != b.cables[i].departure || a.cables[i].attachment != b.cables[i].attachment)
      return false;
  return true;
}

TEST(CmaEs, FindsKnownMinima) {
  Job job;
  design::CmaOptions options;
  options.dimensions = 6;
  options.evaluations = 60000;
  options.target = 1e-9;
  const auto rosenbrock = [](const Eigen::VectorXd& x) {
    double sum = 0;
    for (Eigen::Index i = 0; i + 1 < x.size(); ++i)
      sum += 100 * std::pow(x[i + 1] - x[i] * x[i], 2) + std::pow(1 - x[i], 2);
    return sum;
  };
  // Many local minima, a condition of 1e6, and a valley that bends; each at another place than the start's cube.
  const auto rastrigin = [](const Eigen::VectorXd& x) {
    double sum = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      sum += 10 + std::pow(3 * (x[i] - 1.5), 2) - 10 * std::cos(6 * std::numbers::pi * (x[i] - 1.5));
    return sum;
  };
  const auto ellipsoid = [](const Eigen::VectorXd& x) {
    double sum = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const double turned = x[i] + x[(i + 1) % x.size()] * 0.5 - 2;
      sum += std::pow(1e6, double(i) / double(x.size() - 1)) * turned * turned;
    }
    return sum;
  };
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    options.seed = seed;
    EXPECT_LE(design::cma_es(options, rosenbrock, job, "test").value, 1e-9);
    EXPECT_LE(design::cma_es(options, ellipsoid, job, "test").value, 1e-9);
    EXPECT_LE(design::cma_es(options, rastrigin, job, "test").value, 1e-9);
  }
}

TEST(CmaEs, SurvivesWhatFunctionsReturn) {
  Job job;
  design::CmaOptions options;
  options.dimensions = 3;
  options.evaluations = 500;
  const auto flat = design::cma_es(
      options, [](const Eigen::VectorXd&) { return 7.0; }, job, "test");
  EXPECT_EQ(flat.value, 7);
  EXPECT_GE(flat.restarts, 1);
  EXPECT_GE(flat.evaluations, 500u);
  EXPECT_EQ(flat.x.size(), 3);
  const auto holes = design::cma_es(
      options, [](const Eigen::VectorXd& x) { return x[0] < 0 ? std::nan("") : x.squaredNorm(); }, job, "test");
  EXPECT_LT(holes.value, 0.05);
  EXPECT_TRUE(holes.x.allFinite());
  const auto never = design::cma_es(
      options, [](const Eigen::VectorXd&) { return std::nan(""); }, job, "test");
  EXPECT_EQ(never.x.size(), 3);
}

TEST(Design, AnyNumbersAreAMechanismOfTheConstraints) {
  design::Random random(9);
  const Mechanism base = paper_mechanism();
  for (const bool paired : {true, false}) {
    DesignOptions options = small(1);
    options.paired = paired;
    options.lowest_departure_m = 2;
    EXPECT_EQ(design::unknowns(base, options), paired ? 16 : 19);
    for (int k = 0; k < 300; ++k) {
      Eigen::VectorXd x(design::unknowns(base, options));
      for (double& v : x) v = (k % 3 ? 1 : 1e4) * random.normal();
      const Mechanism m = design::decoded(base, options, x);
      EXPECT_NO_THROW(check(m));
      for (std::size_t i = 0; i < 6; ++i) {
        const Vector3d &a = m.cables[i].departure, &b = m.cables[i].attachment;
        EXPECT_TRUE(std::abs(a.x()) == 5 || std::abs(a.y()) == 6) << a.transpose();
        EXPECT_GE(a.z(), base.room.min().z() + 2);
        EXPECT_LE(b.norm(), 0.25 + 1e-4);
        EXPECT_EQ(b.z(), 0);
        EXPECT_NEAR(b.norm(), m.cables[0].attachment.norm(), 2e-4);  // one circle, rounded
        for (const double v : {a.x(), a.y(), a.z(), b.x(), b.y()}) EXPECT_NEAR(v * 1e4, std::round(v * 1e4), 1e-6);
        if (paired && i % 2) {
          EXPECT_EQ(b, m.cables[i - 1].attachment);
        }
      }
    }
  }
}

TEST(Design, ObjectiveTellsBalancedFromUnbalanced) {
  DesignOptions options = small(1);
  Mechanism m = paper_mechanism();
  const double good = design::objective(m, options);
  EXPECT_GE(good, 0);
  EXPECT_LT(good, 0.1);
  for (Cable& c : m.cables) c.departure.z() = -0.9;  // all pull downwards
  EXPECT_GE(design::objective(m, options), 1);
  options.goals.reset();
  EXPECT_EQ(design::objective(paper_mechanism(), options), paper_objective(paper_mechanism(), options.workspaces[0]));
}

TEST(Design, DependsOnTheSeedAlone) {
  Job one({}, 1), three({}, 3);
  for (const bool practical : {true, false}) {
    DesignOptions options = small(4);
    if (!practical) options.goals.reset();
    const MechanismDesign a = design_mechanism(paper_mechanism(), options, one),
                          b = design_mechanism(paper_mechanism(), options, three);
    EXPECT_TRUE(same(a.mechanism, b.mechanism));
    EXPECT_EQ(a.objective, b.objective);
    EXPECT_EQ(a.evaluations, b.evaluations);
    EXPECT_EQ(a.objective, design::objective(a.mechanism, options));
    options.seed = 5;
    EXPECT_FALSE(same(a.mechanism, design_mechanism(paper_mechanism(), options, one).mechanism));
  }
}

TEST(Design, ReachesTheIdealOfThePapersObjective) {
  Job job;
  DesignOptions options = small(2);
  options.goals.reset();
  options.paired = false;
  options.evaluations = 6000;
  const MechanismDesign found = design_mechanism(paper_mechanism(), options, job);
  EXPECT_EQ(found.objective, -32);
  EXPECT_EQ(examine(found.mechanism, options.workspaces[0], nullptr, job).paper_objective(), -32);
}

TEST(Design, ThePapersMechanismServesTheHemisphereWithRoomToSpare) {
  Job job;
  const KeepOut object{{0, 0, paper_mechanism().room.min().z()}, 0.4, -paper_mechanism().room.min().z()};
  const WorkspaceReport report = examine(paper_mechanism(), Workspace{}, &object, job);
  EXPECT_EQ(report.paper_objective(), -240);
  EXPECT_DOUBLE_EQ(report.coverage(1, 0.05), 1);
}

TEST(Design, CanBeCancelledAndCounts) {
  std::uint64_t total = 0, done = 0;
  {
    Job job([&](const Progress& p) { total = p.total, done = p.done; }, 2);
    design_mechanism(paper_mechanism(), small(1), job);
    EXPECT_EQ(total, 200u);
    EXPECT_EQ(done, total);
  }
  Job cancelled;
  cancelled.cancel();
  EXPECT_EQ(expect_error([&] { design_mechanism(paper_mechanism(), small(1), cancelled); }).code(),
            ErrorCode::cancelled);
}

TEST(Design, Faults) {
  Job job;
  const auto failing = [&](auto change) {
    DesignOptions options = small(1);
    Mechanism base = paper_mechanism();
    change(options, base);
    return expect_error([&] { design_mechanism(base, options, job); });
  };
  using O = DesignOptions;
  using M = Mechanism;
  EXPECT_EQ(failing([](O& o, M&) { o.workspaces.clear(); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O& o, M&) { o.workspaces[0].radius_m = -1; }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O& o, M&) { o.evaluations = 0; }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O& o, M&) { o.largest_attachment_radius_m = 0; }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O& o, M&) { o.lowest_departure_m = 6; }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O& o, M&) { o.goals->least_tension_N = 0; }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O& o, M&) { o.goals->clearance_m = std::nan(""); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O& o, M&) { o.object->radius_m = std::nan(""); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O&, M& m) { m.cables.pop_back(); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(failing([](O&, M& m) { m.mass_kg = std::nan(""); }).code(), ErrorCode::bad_input);
}

TEST(MechanismFigures, AreSvgWithWhatTheyShow) {
  Job job;
  Mechanism m = paper_mechanism();
  m.cables[2].name = "<three>";
  Workspace w;
  w.azimuths = 6, w.polar_steps = 4, w.radius_m = 2.6;  // parts of it are not balanced
  const KeepOut object{{0, 0, -1}, 0.4, 1};
  const WorkspaceReport report = examine(m, w, &object, job);
  const auto count = [](const std::string& text, const std::string& what) {
    int n = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
    return n;
  };
  const std::string room = draw_mechanism(m, w, &object, 1, 2);
  EXPECT_EQ(count(room, "&lt;three&gt;"), 2);
  EXPECT_EQ(count(room, "<three>"), 0);
  EXPECT_EQ(count(room, "<svg"), count(room, "</svg>"));
  for (const WorkspaceValue value : {WorkspaceValue::balance, WorkspaceValue::least_tension, WorkspaceValue::clearance,
                                     WorkspaceValue::sight, WorkspaceValue::rotation_sensitivity}) {
    const std::string map = draw_map(report, value);
    EXPECT_EQ(count(map, "<rect"), 24 + 1);  // a cell a pose, and the ground
    EXPECT_EQ(count(map, "nan"), 0);
    EXPECT_EQ(count(map, "<svg"), 1);
  }
  EXPECT_EQ(count(draw_tensions(report, m, 0), "nan"), 0);
  EXPECT_EQ(count(draw_tilt_ranges(m, w, 0, job), "nan"), 0);
  EXPECT_EQ(expect_error([&] { draw_mechanism(m, w, nullptr, 6, 0); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(expect_error([&] { draw_tensions(report, m, -1); }).code(), ErrorCode::invalid_argument);
}

TEST(LargeMechanism, ServesTheLargestRadiusOfThePaper) {
  Job job;
  const Mechanism m = large_mechanism();
  EXPECT_NO_THROW(check(m));
  const KeepOut snowmobile{{0, 0, -1}, 1.5, 0.35};
  for (const double radius : {2.0, 2.7}) {
    Workspace w;
    w.radius_m = radius;
    ASSERT_EQ(w.size(), 240u);
    KeepOut object = snowmobile;
    object.radius_m *= radius / 2.7;
    const WorkspaceReport report = examine(m, w, &object, job);
    EXPECT_EQ(report.coverage(1, 0.04), 1) << radius;
    EXPECT_EQ(report.paper_objective(), -240) << radius;
    for (const PoseReport& p : report.poses) {
      EXPECT_LT(p.tensions.tension_N.maxCoeff(), 30);
      EXPECT_GT(p.clearance.cable_object, 0.15);
    }
  }
}

}  // namespace
}  // namespace lumihull::capture
