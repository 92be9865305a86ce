// Answers of adjust(): the truth, the definitions in its header, one answer whatever the order and the threads.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "kinds.h"

namespace lumihull {
namespace {

using calib::AdjustOptions;
using calib::AdjustResult;
using calib::BodyModel;

AdjustResult adjusted(const calib::Adjustment& start, AdjustOptions options = {}, unsigned threads = 2) {
  Job job({}, threads);
  return calib::adjust(start, options, job);
}

TEST(Adjust, ExactObservationsGiveTheTruth) {
  for (test::Kind kind : test::kinds()) {
    SCOPED_TRACE(kind.name);
    kind.maker.noise = 0;
    const test::Scene scene = test::make_scene(kind.maker, 1);
    const AdjustResult result = adjusted(scene.start, {.bend_sigma = 1e9});
    EXPECT_TRUE(result.converged);
    EXPECT_LT(result.rms_px, 1e-8);
    EXPECT_LT(test::point_rms(result.adjusted, scene.truth, true), 1e-9);
  }
}

/// Whitened squares, robust or not, bars and bends, by their definitions.
double defined_cost(const calib::Adjustment& a, const AdjustOptions& options, double* chi2) {
  double cost = 0;
  *chi2 = 0;
  for (const calib::Observation& o : a.observations) {
    const Eigen::Vector2d off = o.pixel - test::predicted_pixel(a, o);
    const double square = off.dot(o.covariance.inverse() * off);
    const double b2 = options.robust_sigma * options.robust_sigma;
    cost += b2 > 0 ? b2 * std::log(1 + square / b2) : square;
    *chi2 += square;
  }
  double rest = 0;
  for (const calib::ScaleBar& bar : a.bars) {
    const double length = (a.bodies[bar.body_a].point(bar.point_a, a.print_scale) -
                           a.bodies[bar.body_b].point(bar.point_b, a.print_scale))
                              .norm();
    rest += std::pow((length - bar.length_m) / bar.sigma_m, 2);
  }
  for (const calib::AdjustedBody& body : a.bodies)
    if (body.model == BodyModel::bending) rest += body.bend.squaredNorm() / (options.bend_sigma * options.bend_sigma);
  *chi2 += rest;
  return cost + rest;
}

TEST(Adjust, AnswersFollowTheirDefinitions) {
  for (const test::Kind& kind : test::kinds())
    for (const double robust : {0.0, 2.0}) {
      SCOPED_TRACE(kind.name);
      const test::Scene scene = test::make_scene(kind.maker, 2);
      const AdjustOptions options{.robust_sigma = robust, .bend_sigma = 0.5, .covariances = false};
      const AdjustResult result = adjusted(scene.start, options);
      const calib::Adjustment& answer = result.adjusted;
      ASSERT_EQ(result.residuals.size(), answer.observations.size());
      double sum = 0, chi2 = 0;
      for (std::size_t i = 0; i < answer.observations.size(); ++i) {
        const Eigen::Vector2d off =
            answer.observations[i].pixel - test::predicted_pixel(answer, answer.observations[i]);
        EXPECT_LT((result.residuals[i] - off).norm(), 1e-7);
        sum += off.squaredNorm();
      }
      EXPECT_NEAR(result.rms_px, std::sqrt(sum / double(answer.observations.size())), 1e-8);
      EXPECT_NEAR(result.cost, defined_cost(answer, options, &chi2), 1e-7 * result.cost);
      EXPECT_NEAR(result.sigma0, std::sqrt(chi2 / double(result.redundancy)), 1e-7);
      std::int64_t measured = 2 * std::int64_t(answer.observations.size()) + std::int64_t(answer.bars.size());
      std::int64_t unknowns = 6 * std::int64_t(answer.shots.size());
      const bool is_free = kind.maker.model == BodyModel::free;
      for (const calib::AdjustedBody& body : answer.bodies) {
        unknowns += is_free ? 3 * std::int64_t(body.points.size()) : 6;
        if (body.model == BodyModel::bending) measured += 3, unknowns += 3;
      }
      for (const calib::AdjustedCamera& camera : answer.cameras) unknowns += 7 + (camera.on_rig ? 6 : 0);
      if (answer.free_print_scale) unknowns += 2;
      EXPECT_EQ(result.redundancy, measured - unknowns + (is_free && answer.bars.empty() ? 7 : 6));
      EXPECT_LE(result.cost, result.start_cost);
      EXPECT_NEAR(result.start_cost, defined_cost(scene.start, options, &chi2), 1e-7 * result.start_cost);
    }
}

TEST(Adjust, TheAnswerLiesWhereTheStartsPointsWere) {
  for (const BodyModel model : {BodyModel::rigid, BodyModel::free}) {
    const test::Scene scene = test::make_scene({.model = model}, 3);
    const AdjustResult result = adjusted(scene.start);
    // No turn, shift or (free) scale brings its points closer to the start's.
    const double apart = test::point_rms(result.adjusted, scene.start, false);
    if (model == BodyModel::free) {
      EXPECT_NEAR(test::point_rms(result.adjusted, scene.start, true), apart, 1e-9);
      continue;
    }
    for (int i = 0; i < 6; ++i)
      for (const double by : {-1e-5, 1e-5}) {
        calib::Adjustment other = result.adjusted;
        Pose motion;
        if (i < 3)
          motion.translation[i] = by;
        else
          motion.rotation = Eigen::AngleAxisd(by, Eigen::Vector3d::Unit(i - 3));
        for (calib::AdjustedBody& body : other.bodies) body.world_from_body = motion * body.world_from_body;
        EXPECT_GT(test::point_rms(other, scene.start, false), apart);
      }
  }
}

bool same(const Pose& a, const Pose& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

TEST(Adjust, TheSameBytesForAnyNumberOfThreads) {
  for (const test::Kind& kind : test::kinds()) {
    SCOPED_TRACE(kind.name);
    const test::Scene scene = test::make_scene(kind.maker, 4);
    const AdjustResult one = adjusted(scene.start, {}, 1);
    for (const unsigned threads : {2u, 5u}) {
      const AdjustResult many = adjusted(scene.start, {}, threads);
      EXPECT_EQ(one.cost, many.cost);
      EXPECT_EQ(one.iterations, many.iterations);
      EXPECT_EQ(one.residuals, many.residuals);
      EXPECT_EQ(one.sigma0, many.sigma0);
      for (std::size_t s = 0; s < scene.start.shots.size(); ++s) {
        EXPECT_TRUE(same(one.adjusted.shots[s].rig_from_world, many.adjusted.shots[s].rig_from_world));
        EXPECT_EQ(one.shot_covariances[s], many.shot_covariances[s]);
      }
      for (std::size_t b = 0; b < scene.start.bodies.size(); ++b) {
        EXPECT_TRUE(same(one.adjusted.bodies[b].world_from_body, many.adjusted.bodies[b].world_from_body));
        EXPECT_EQ(one.adjusted.bodies[b].free_places, many.adjusted.bodies[b].free_places);
        EXPECT_EQ(one.point_covariances[b], many.point_covariances[b]);
      }
      EXPECT_EQ(one.camera_covariances, many.camera_covariances);
    }
  }
}

TEST(Adjust, OrderChangesNothingBeyondRounding) {
  for (const test::Kind& kind : test::kinds()) {
    SCOPED_TRACE(kind.name);
    const test::Scene scene = test::make_scene(kind.maker, 5);
    calib::Adjustment other = scene.start;
    const std::size_t shots = other.shots.size();
    std::reverse(other.shots.begin(), other.shots.end());
    for (calib::Observation& o : other.observations) o.shot = std::uint32_t(shots - 1 - o.shot);
    std::shuffle(other.observations.begin(), other.observations.end(), std::mt19937(1));
    const AdjustResult a = adjusted(scene.start), b = adjusted(other);
    EXPECT_NEAR(a.cost, b.cost, 1e-9 * a.cost);
    EXPECT_LT(test::point_rms(a.adjusted, b.adjusted, false), 1e-8);
    for (std::size_t s = 0; s < shots; ++s) {
      const auto &p = a.shot_covariances[s], &q = b.shot_covariances[shots - 1 - s];
      EXPECT_LT((p - q).norm(), 1e-4 * p.norm());
    }
  }
}

TEST(Adjust, ARobustLossLeavesWrongObservationsOut) {
  test::Scene scene = test::make_scene({}, 6);
  const AdjustResult clean = adjusted(scene.start);
  for (std::size_t i = 0; i < scene.start.observations.size(); i += 20)
    scene.start.observations[i].pixel += Eigen::Vector2d(20.0 + double(i % 7), -15);
  const AdjustResult plain = adjusted(scene.start);
  const AdjustResult robust = adjusted(plain.adjusted, {.robust_sigma = 2});
  EXPECT_TRUE(robust.converged);
  const double error = test::point_rms(clean.adjusted, scene.truth, true);
  EXPECT_GT(test::point_rms(plain.adjusted, scene.truth, true), 5 * error);
  EXPECT_LT(test::point_rms(robust.adjusted, scene.truth, true), 1.5 * error);
  for (std::size_t i = 0; i < scene.start.observations.size(); ++i)
    EXPECT_EQ(robust.residuals[i].norm() > 5, i % 20 == 0) << i;
}

TEST(Adjust, WhatCanNotBePredictedAtTheStartDoesNotCount) {
  const test::Scene scene = test::make_scene({}, 7);
  const AdjustResult clean = adjusted(scene.start);
  calib::Adjustment start = scene.start;
  // A point of the first target that lies behind the cameras, and is said to be seen.
  start.bodies[0].points.push_back({.place = {0, 0, 50}});
  const Pose& pose = start.bodies[0].world_from_body;
  calib::Observation o = start.observations.front();
  ASSERT_EQ(o.body, 0u);
  o.point = std::uint32_t(start.bodies[0].points.size() - 1);
  ASSERT_LT((start.shots[o.shot].rig_from_world * (pose * Eigen::Vector3d(0, 0, 50))).z(), 0);
  start.observations.push_back(o);
  const AdjustResult result = adjusted(start);
  EXPECT_TRUE(std::isnan(result.residuals.back().x()));
  EXPECT_NEAR(result.rms_px, clean.rms_px, 1e-9);
  EXPECT_EQ(result.redundancy, clean.redundancy);
  EXPECT_NEAR(result.cost, clean.cost, 1e-9 * clean.cost);
}

TEST(Adjust, PointsOfFreeBodiesThatNobodySeesStayWhereTheyAre) {
  test::Scene scene = test::make_scene({.model = BodyModel::free}, 8);
  std::erase_if(scene.start.observations, [](const calib::Observation& o) { return o.body == 2 && o.point == 7; });
  const AdjustResult result = adjusted(scene.start);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.adjusted.bodies[2].free_places[7], scene.start.bodies[2].free_places[7]);
  EXPECT_FALSE(result.point_covariances[2][7].allFinite());
  EXPECT_TRUE(result.point_covariances[2][8].allFinite());
}

TEST(Adjust, NoStepLosesAnObservation) {
  // A lens that ends just beyond the outermost points: steps that move them over its fold are refused.
  test::SceneMaker maker;
  maker.off = 3;
  test::Scene scene = test::make_scene(maker, 9);
  double outermost = 0;
  for (const calib::Observation& o : scene.start.observations)
    outermost = std::max(outermost, scene.truth.cameras[0].camera.distorted_from_pixel(o.pixel).norm());
  for (calib::Adjustment* state : {&scene.truth, &scene.start}) {
    Camera& camera = state->cameras[0].camera;
    camera.k1 = camera.k2 = camera.p1 = camera.p2 = 0;
    camera.f = 3000;
    camera.k1 = -1 / (3 * std::pow(1.06 * outermost, 2));  // d (r + k1 r³) / dr = 0
  }
  for (calib::Observation& o : scene.start.observations) o.pixel = test::predicted_pixel(scene.truth, o);
  std::erase_if(scene.start.observations, [&](const calib::Observation& o) {
    return !o.pixel.allFinite() || !test::predicted_pixel(scene.start, o).allFinite();
  });
  const AdjustResult result = adjusted(scene.start);
  EXPECT_TRUE(result.converged);
  EXPECT_LT(result.rms_px, 1e-6);
  for (const Eigen::Vector2d& residual : result.residuals) EXPECT_TRUE(residual.allFinite());
}

TEST(Adjust, PointsOnARingAreAsGoodAsTheGoal) {
  // 120 photographs of 8 targets, 0.05 px: 6 µm on 1 m.
  const test::Scene scene = test::make_scene({.shots = 120, .bodies = 8, .model = BodyModel::free}, 1);
  const AdjustResult result = adjusted(scene.start, {.covariances = false});
  EXPECT_LT(test::point_rms(result.adjusted, scene.truth, true), 6e-6);
}

}  // namespace
}  // namespace lumihull
