// The firmware alone, in time that a test lets pass: what PROTOCOL.md promises, and that no input breaks it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "fake_machine.h"

namespace lumihull::test {
namespace {

using namespace capture::internal;

Bytes numbers(std::initializer_list<std::uint32_t> values) {
  Bytes bytes;
  for (const auto value : values) append_u32(bytes, value);
  return bytes;
}

Bytes lengths(const std::vector<std::int32_t>& um) {
  Bytes bytes{std::uint8_t(um.size())};
  for (const auto value : um) append_u32(bytes, std::uint32_t(value));
  return bytes;
}

Bytes limits(std::uint8_t winch, std::int32_t min, std::int32_t max, std::int32_t speed, std::int32_t acceleration) {
  Bytes bytes{winch};
  for (const auto value : {min, max, speed, acceleration}) append_u32(bytes, std::uint32_t(value));
  return bytes;
}

Bytes setpoint(std::uint8_t index, std::uint16_t step_ms, const std::vector<std::int32_t>& um) {
  Bytes bytes{index};
  append_u16(bytes, step_ms);
  const Bytes more = lengths(um);
  bytes.insert(bytes.end(), more.begin(), more.end());
  return bytes;
}

bool acked(const Frame& reply) { return reply.type == std::uint8_t(Type::ack); }

/// The code of a NAK; none for an ACK.
NakCode code(const Frame& reply) {
  if (acked(reply)) return NakCode::none;
  EXPECT_EQ(reply.type, std::uint8_t(Type::nak));
  EXPECT_EQ(reply.payload.size(), 6u);
  return NakCode(reply.payload.at(1));
}

std::int32_t detail(const Frame& reply) {
  PayloadReader in(reply.payload);
  in.u16();
  return in.i32();
}

unsigned flags(FakeMachine& machine) {
  const Frame reply = machine.ask(Type::status);
  PayloadReader in(reply.payload);
  in.u8();
  return in.u16();
}

FiredState shot_state(FakeMachine& machine, std::uint32_t shot) {
  const Frame reply = machine.ask(Type::shot_status, numbers({shot}));
  PayloadReader in(reply.payload);
  in.u8();
  in.u32();
  return FiredState(in.u8());
}

/// Time passes, and the host is heard.
void pass_heard(FakeMachine& machine, std::uint32_t ms) {
  for (; ms > 400; ms -= 400) {
    machine.pass(400);
    Frame beat;
    beat.type = std::uint8_t(Type::heartbeat);
    beat.nonce = machine.controller.nonce;
    machine.hear(encode_frame(beat));
  }
  machine.pass(ms);
}

void greet(FakeMachine& machine) { ASSERT_TRUE(acked(machine.ask(Type::hello, numbers({77})))); }

void make_ready(FakeMachine& machine, const std::vector<std::int32_t>& at) {
  greet(machine);
  for (std::uint8_t i = 0; i < at.size(); ++i)
    ASSERT_TRUE(acked(machine.ask(Type::limits, limits(i, 100000, 15000000, 500000, 250000))));
  ASSERT_TRUE(acked(machine.ask(Type::declare, lengths(at))));
}

/// Greatest length change per ms and its change per ms, of any winch.
struct Motion {
  double speed = 0, acceleration = 0;
};
Motion measure(const std::vector<std::vector<std::int32_t>>& steps, const std::vector<std::int32_t>& from) {
  Motion motion;
  // Over 20 ms, so that rounding to a micrometre does not count: 2 µm / (0.02 s)² = 5000 µm/s².
  const std::size_t gap = 20;
  auto at = [&](std::ptrdiff_t k, std::size_t i) {
    if (k < 0) return double(from[i]);
    return double(steps[std::min<std::size_t>(std::size_t(k), steps.size() - 1)][i]);
  };
  for (std::ptrdiff_t k = -40; k < std::ptrdiff_t(steps.size()) + 20; ++k)
    for (std::size_t i = 0; i < from.size(); ++i) {
      const double a = at(k, i), b = at(k + std::ptrdiff_t(gap), i), c = at(k + 2 * std::ptrdiff_t(gap), i);
      motion.speed = std::max(motion.speed, std::abs(b - a) * 1000 / gap);
      motion.acceleration = std::max(motion.acceleration, std::abs(c - 2 * b + a) * 1e6 / (gap * gap));
    }
  return motion;
}

TEST(Firmware, WhatWasSaidTwiceIsDoneOnce) {
  FakeMachine machine;
  greet(machine);
  Frame fire;
  fire.type = std::uint8_t(Type::fire);
  fire.nonce = machine.controller.nonce;
  fire.sequence = ++machine.sequence;
  fire.payload = numbers({5, 20});
  std::vector<Frame> replies;
  for (int i = 0; i < 4; ++i) {
    machine.hear(encode_frame(fire));
    for (const Frame& frame : machine.said()) replies.push_back(frame);
    machine.pass(30);
  }
  EXPECT_EQ(machine.shutter_times, 1u);
  ASSERT_EQ(replies.size(), 5u);  // four ACKs and DONE
  EXPECT_EQ(replies[0], replies[2]);
  EXPECT_EQ(replies[1].type, std::uint8_t(Type::done));
  // The same shot under a new number, an old number, a number too far.
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({5, 20}))), NakCode::shot_known);
  const auto right = machine.sequence;
  machine.sequence = std::uint16_t(right - 2);
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({6, 20}))), NakCode::sequence);
  machine.sequence = std::uint16_t(right + 1);
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({6, 20}))), NakCode::sequence);
  EXPECT_EQ(machine.shutter_times, 1u);
  machine.sequence = right;
  EXPECT_TRUE(acked(machine.ask(Type::fire, numbers({6, 20}))));
  EXPECT_EQ(machine.shutter_times, 2u);
}

TEST(Firmware, AHelloGoesForwardOnly) {
  FakeMachine machine;
  greet(machine);
  const auto first = machine.sequence;
  EXPECT_TRUE(acked(machine.ask(Type::fire, numbers({1, 1000}))));
  machine.sequence = std::uint16_t(first - 1);
  EXPECT_EQ(machine.ask(Type::hello, numbers({77})).version, 0);  // an old copy: no answer
  EXPECT_TRUE(machine.shutter);
  machine.sequence = std::uint16_t(first + 100);
  greet(machine);  // the same session, ahead: nothing else changes
  EXPECT_TRUE(machine.shutter);
  // What was sent before it can't be obeyed any more.
  machine.sequence = std::uint16_t(first + 1);
  EXPECT_EQ(code(machine.ask(Type::stop, {7})), NakCode::sequence);
  EXPECT_TRUE(machine.shutter);
  // Another host: all is made safe.
  EXPECT_TRUE(acked(machine.ask(Type::hello, numbers({78}))));
  EXPECT_FALSE(machine.shutter);
  EXPECT_EQ(shot_state(machine, 1), FiredState::cut);
}

TEST(Firmware, NothingIsObeyedWithoutHelloOrForAnotherStart) {
  FakeMachine machine;
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({1, 20}))), NakCode::sequence);
  greet(machine);
  Frame fire;
  fire.type = std::uint8_t(Type::fire);
  fire.sequence = ++machine.sequence;
  fire.payload = numbers({1, 20});
  for (const std::uint32_t nonce : {0u, machine.controller.nonce - 1, ~machine.controller.nonce}) {
    fire.nonce = nonce;
    machine.hear(encode_frame(fire));
    EXPECT_EQ(code(machine.said().at(0)), NakCode::nonce);
  }
  EXPECT_EQ(machine.shutter_times, 0u);
  fire.nonce = machine.controller.nonce;
  machine.hear(encode_frame(fire));
  EXPECT_EQ(machine.shutter_times, 1u);
}

TEST(Firmware, RemembersThirtyTwoShotsAndRefusesOlderNumbers) {
  FakeMachine machine;
  greet(machine);
  for (std::uint32_t shot = 1; shot <= 40; ++shot) {
    EXPECT_TRUE(acked(machine.ask(Type::fire, numbers({shot, 2}))));
    machine.pass(3);
  }
  EXPECT_EQ(shot_state(machine, 8), FiredState::forgotten);
  EXPECT_EQ(shot_state(machine, 9), FiredState::done);
  EXPECT_EQ(shot_state(machine, 41), FiredState::none);
  for (std::uint32_t shot = 0; shot <= 40; ++shot)
    EXPECT_EQ(code(machine.ask(Type::fire, numbers({shot, 2}))), shot <= 8 ? NakCode::shot_old : NakCode::shot_known);
  EXPECT_EQ(machine.shutter_times, 40u);
}

TEST(Firmware, ExposuresAndTheSolenoidEndByThemselvesAndWithinLimits) {
  FakeMachine machine(2, 1, 0xffffff00u);  // the clock wraps around meanwhile
  greet(machine);
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({1, 0}))), NakCode::limit);
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({1, 10001}))), NakCode::limit);
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({1, 0xffffffff}))), NakCode::limit);
  EXPECT_EQ(code(machine.ask(Type::solenoid, numbers({2001}))), NakCode::limit);
  EXPECT_TRUE(acked(machine.ask(Type::solenoid, numbers({1200}))));
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({1, 20}))), NakCode::busy);
  pass_heard(machine, 1199);
  EXPECT_TRUE(machine.solenoid);
  machine.pass(1);
  EXPECT_FALSE(machine.solenoid);
  // It rests as long as its longest time.
  pass_heard(machine, 1990);
  EXPECT_EQ(code(machine.ask(Type::solenoid, numbers({10}))), NakCode::busy);
  pass_heard(machine, 10);
  EXPECT_TRUE(acked(machine.ask(Type::solenoid, numbers({10}))));
  EXPECT_TRUE(acked(machine.ask(Type::solenoid, numbers({0}))));
  EXPECT_FALSE(machine.solenoid);

  EXPECT_TRUE(acked(machine.ask(Type::fire, numbers({1, 10000}))));
  pass_heard(machine, 9999);
  EXPECT_TRUE(machine.shutter);
  machine.pass(1);
  EXPECT_FALSE(machine.shutter);
  EXPECT_EQ(shot_state(machine, 1), FiredState::done);
}

TEST(Firmware, AFloodOfNoiseDoesNotHoldUpTheOutputs) {
  FakeMachine machine;
  greet(machine);
  ASSERT_TRUE(acked(machine.ask(Type::solenoid, numbers({1200}))));
  std::mt19937 random(8);
  while (machine.incoming.size() < 2'000'000) machine.incoming.push_back(std::uint8_t(random()));
  machine.pass(1199);
  EXPECT_TRUE(machine.solenoid);
  machine.pass(1);
  EXPECT_FALSE(machine.solenoid);
  EXPECT_FALSE(machine.incoming.empty());
  machine.incoming.clear();
  machine.ask(Type::stop, {7});  // may end the noise's last stretch
  EXPECT_TRUE(acked(machine.ask(Type::hello, numbers({77}))));
}

TEST(Firmware, AfterThreeMissedHeartbeatsEverythingIsSafe) {
  for (const bool moving : {false, true}) {
    FakeMachine machine;
    make_ready(machine, {2000000, 3000000});
    if (moving)
      ASSERT_TRUE(acked(machine.ask(Type::move, lengths({3000000, 3000000}))));
    else
      ASSERT_TRUE(acked(machine.ask(Type::fire, numbers({1, 9000}))));
    machine.pass(1499);
    EXPECT_EQ(machine.shutter, !moving);
    machine.pass(1);
    EXPECT_FALSE(machine.shutter);
    machine.pass(2100);
    EXPECT_EQ(machine.controller.motion.path, FW_REST);
    const unsigned now = flags(machine);
    EXPECT_TRUE(now & flag::host_lost);
    EXPECT_TRUE(now & flag::position_known);
    EXPECT_EQ(bool(now & flag::broken_off), moving);
    if (moving) {
      EXPECT_LT(machine.lengths.back()[0], 3000000);
      EXPECT_LE(measure(machine.lengths, {2000000, 3000000}).acceleration, 2 * 250000 + 10000);
    } else {
      EXPECT_EQ(shot_state(machine, 1), FiredState::cut);
    }
    EXPECT_TRUE(acked(machine.ask(Type::hello, numbers({77}))));
    EXPECT_FALSE(flags(machine) & flag::host_lost);
  }
}

TEST(Firmware, NothingMovesBeforeThePositionIsDeclared) {
  FakeMachine machine;
  greet(machine);
  EXPECT_EQ(code(machine.ask(Type::move, lengths({2000000, 3000000}))), NakCode::position);
  EXPECT_EQ(code(machine.ask(Type::declare, lengths({2000000, 3000000}))), NakCode::no_limits);
  EXPECT_TRUE(acked(machine.ask(Type::limits, limits(0, 100000, 15000000, 500000, 250000))));
  const Frame reply = machine.ask(Type::declare, lengths({2000000, 3000000}));
  EXPECT_EQ(code(reply), NakCode::no_limits);
  EXPECT_EQ(detail(reply), 1);
  EXPECT_TRUE(acked(machine.ask(Type::limits, limits(1, 100000, 15000000, 500000, 250000))));
  EXPECT_EQ(code(machine.ask(Type::move, lengths({2000000, 3000000}))), NakCode::position);
  EXPECT_EQ(code(machine.ask(Type::setpoint, setpoint(0, 100, {2000000, 3000000}))), NakCode::position);
  EXPECT_EQ(code(machine.ask(Type::start, {0})), NakCode::position);
  EXPECT_TRUE(acked(machine.ask(Type::declare, lengths({2000000, 3000000}))));
  machine.pass(1000);
  EXPECT_TRUE(machine.lengths.empty());
  EXPECT_TRUE(acked(machine.ask(Type::move, lengths({2000001, 3000000}))));
  machine.pass(100);
  EXPECT_EQ(machine.lengths.back(), (std::vector<std::int32_t>{2000001, 3000000}));
}

TEST(Firmware, LimitsAreCheckedBeforeAnythingMoves) {
  FakeMachine machine;
  greet(machine);
  // Wider than built in, empty, not positive.
  for (const Bytes& bad :
       {limits(0, 49999, 15000000, 1, 1), limits(0, 50000, 20000001, 1, 1), limits(0, 50000, 15000000, 800001, 1),
        limits(0, 50000, 15000000, 1, 600001), limits(0, 90000, 90000, 1, 1), limits(0, 50000, 60000, 0, 1),
        limits(0, 50000, 60000, 1, -1), limits(0, INT32_MIN, INT32_MAX, 1, 1)})
    EXPECT_EQ(code(machine.ask(Type::limits, bad)), NakCode::limit);
  EXPECT_EQ(code(machine.ask(Type::limits, limits(2, 100000, 200000, 1, 1))), NakCode::payload);
  make_ready(machine, {2000000, 3000000});
  EXPECT_EQ(code(machine.ask(Type::limits, limits(1, 100000, 2999999, 500000, 250000))), NakCode::limit);
  for (const auto& bad : std::vector<std::vector<std::int32_t>>{
           {99999, 3000000}, {15000001, 3000000}, {2000000, INT32_MAX}, {INT32_MIN, 3000000}}) {
    const Frame reply = machine.ask(Type::move, lengths(bad));
    EXPECT_EQ(code(reply), NakCode::limit);
    EXPECT_EQ(detail(reply), bad[0] == 2000000 ? 1 : 0);
    EXPECT_EQ(code(machine.ask(Type::setpoint, setpoint(0, 60000, bad))), NakCode::limit);
    EXPECT_EQ(code(machine.ask(Type::declare, lengths(bad))), NakCode::limit);
  }
  EXPECT_EQ(code(machine.ask(Type::move, lengths({2000000}))), NakCode::payload);
  EXPECT_EQ(code(machine.ask(Type::move, lengths({2000000, 3000000, 1}))), NakCode::payload);
  machine.pass(500);
  EXPECT_TRUE(machine.lengths.empty());
}

TEST(Firmware, MovesAreSynchronisedAndWithinSpeedAndAcceleration) {
  std::mt19937 random(6);
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    FakeMachine machine(3);
    const std::vector<std::int32_t> from{5000000, 6000000, 7000000};
    make_ready(machine, from);
    const double reach = std::pow(10.0, 1 + i % 6);  // 10 µm … 1 m
    std::vector<std::int32_t> to;
    for (const auto um : from)
      to.push_back(um + std::int32_t(reach * (double(random()) / double(random.max()) * 2 - 1)));
    const Frame reply = machine.ask(Type::move, lengths(to));
    ASSERT_TRUE(acked(reply));
    PayloadReader in(reply.payload);
    in.u8();
    const std::uint32_t duration = in.u32();
    // The least time for a trapezoid with these limits, of the cable that needs longest.
    double least = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double d = std::abs(to[k] - from[k]), v = 500000, a = 250000;
      least = std::max(least, d * a > v * v ? d / v + v / a : 2 * std::sqrt(d / a));
    }
    EXPECT_LE(duration, least * 1e3 + 4);
    EXPECT_GE(duration, least * 1e3 - 1e-6);
    pass_heard(machine, duration);
    ASSERT_EQ(machine.controller.motion.path, FW_REST);
    EXPECT_EQ(machine.lengths.back(), to);
    const Motion motion = measure(machine.lengths, from);
    EXPECT_LE(motion.speed, 500000 * 1.001 + 100);
    EXPECT_LE(motion.acceleration, 250000 * 1.001 + 5000);
    for (const auto& step : machine.lengths)
      for (std::size_t k = 1; k < 3; ++k) {
        const double s0 = double(step[0] - from[0]) * (to[k] - from[k]),
                     sk = double(step[k] - from[k]) * (to[0] - from[0]);
        EXPECT_LE(std::abs(s0 - sk), 1.01 * (std::abs(to[0] - from[0]) + std::abs(to[k] - from[k])) + 1);  // a µm each
      }
  }
}

/// 1 - cos, sampled: a smooth motion that ends at rest.
std::vector<std::int32_t> wave(double t, const std::vector<std::int32_t>& from, double amplitude) {
  std::vector<std::int32_t> at;
  for (std::size_t i = 0; i < from.size(); ++i)
    at.push_back(from[i] + std::int32_t(std::lround(amplitude / double(i + 1) * (1 - std::cos(M_PI * t)) / 2)));
  return at;
}

TEST(Firmware, SetpointsAreFollowedWithinLimitsOrRefusedAsAWhole) {
  const std::vector<std::int32_t> from{5000000, 6000000};
  // Of an amplitude A in 3 s: greatest speed A π / 6 s, greatest acceleration A π² / 18 s²; the limits are 0.5 and
  // 0.25.
  for (const double amplitude : {400000.0, 440000.0, 480000.0, 900000.0}) {
    SCOPED_TRACE(amplitude);
    FakeMachine machine;
    make_ready(machine, from);
    for (int k = 0; k < 30; ++k)
      ASSERT_TRUE(
          acked(machine.ask(Type::setpoint, setpoint(std::uint8_t(k), 100, wave((k + 1) / 30.0, from, amplitude)))));
    EXPECT_EQ(code(machine.ask(Type::start, {29})), NakCode::queue);
    const Frame reply = machine.ask(Type::start, {30});
    const bool within = amplitude * M_PI * M_PI / 18 < 250000;
    ASSERT_EQ(code(reply), within ? NakCode::none : NakCode::limit);
    if (!within) {
      EXPECT_EQ(detail(reply), 0);
      machine.pass(100);
      EXPECT_TRUE(machine.lengths.empty());
      continue;
    }
    pass_heard(machine, 3000);
    ASSERT_EQ(machine.controller.motion.path, FW_REST);
    ASSERT_EQ(machine.lengths.size(), 3000u);
    for (int ms = 1; ms <= 3000; ++ms)
      for (std::size_t i = 0; i < 2; ++i)
        EXPECT_NEAR(machine.lengths[std::size_t(ms - 1)][i], wave(ms / 3000.0, from, amplitude)[i], ms % 100 ? 150 : 1);
    EXPECT_LE(measure(machine.lengths, from).acceleration, 250000 * 1.001 + 5000);
  }
}

TEST(Firmware, ASplineMayNotLeaveTheLimitsBetweenItsSetpoints) {
  FakeMachine machine;
  make_ready(machine, {110000, 3000000});
  // All setpoints are within, but the curve would swing below 100 mm on its way up.
  ASSERT_TRUE(acked(machine.ask(Type::setpoint, setpoint(0, 1000, {100000, 3000000}))));
  ASSERT_TRUE(acked(machine.ask(Type::setpoint, setpoint(1, 2000, {100000, 3000000}))));
  ASSERT_TRUE(acked(machine.ask(Type::setpoint, setpoint(2, 2000, {300000, 3000000}))));
  EXPECT_EQ(code(machine.ask(Type::start, {3})), NakCode::limit);
  // Out of order, too many.
  EXPECT_EQ(code(machine.ask(Type::setpoint, setpoint(4, 100, {110000, 3000000}))), NakCode::queue);
  for (int k = 0; k < FW_QUEUE; ++k)
    ASSERT_TRUE(acked(machine.ask(Type::setpoint, setpoint(std::uint8_t(k), 100, {110000, 3000000}))));
  EXPECT_EQ(code(machine.ask(Type::setpoint, setpoint(FW_QUEUE, 100, {110000, 3000000}))), NakCode::queue);
  EXPECT_EQ(code(machine.ask(Type::setpoint, setpoint(0, 0, {110000, 3000000}))), NakCode::payload);
}

TEST(Firmware, StopEndsAMoveGentlyAndThePositionStaysKnown) {
  for (const std::uint32_t when : {0u, 1u, 300u, 1400u, 2500u}) {
    SCOPED_TRACE(when);
    FakeMachine machine;
    const std::vector<std::int32_t> from{2000000, 3000000};
    make_ready(machine, from);
    ASSERT_TRUE(acked(machine.ask(Type::move, lengths({3000000, 2500000}))));
    pass_heard(machine, when);
    const Frame reply = machine.ask(Type::stop, {1});
    PayloadReader in(reply.payload);
    in.u8();
    const std::uint32_t time = in.u32();
    EXPECT_LE(time, 2010u);  // speed / acceleration
    pass_heard(machine, time);
    EXPECT_EQ(machine.controller.motion.path, FW_REST);
    const unsigned now = flags(machine);
    EXPECT_TRUE(now & flag::position_known);
    EXPECT_TRUE(now & flag::broken_off);
    if (!machine.lengths.empty()) {
      EXPECT_LE(measure(machine.lengths, from).acceleration, 2 * 250000 + 10000);
    }
    EXPECT_TRUE(acked(machine.ask(Type::move, lengths(from))));
  }
}

TEST(Firmware, TheEmergencyStopIsMirrored) {
  FakeMachine machine;
  make_ready(machine, {2000000, 3000000});
  ASSERT_TRUE(acked(machine.ask(Type::move, lengths({3000000, 3000000}))));
  pass_heard(machine, 700);
  machine.stop = true;
  const auto steps = machine.lengths.size();
  machine.pass(2);
  EXPECT_EQ(machine.lengths.size(), steps);  // at once
  const unsigned now = flags(machine);
  EXPECT_TRUE(now & flag::emergency_stop);
  EXPECT_FALSE(now & (flag::position_known | flag::moving));
  for (const Frame& reply : {machine.ask(Type::fire, numbers({1, 20})), machine.ask(Type::solenoid, numbers({20})),
                             machine.ask(Type::move, lengths({3000000, 3000000})),
                             machine.ask(Type::declare, lengths({3000000, 3000000})), machine.ask(Type::start, {1})})
    EXPECT_EQ(code(reply), NakCode::stopped);
  EXPECT_TRUE(acked(machine.ask(Type::solenoid, numbers({0}))));
  machine.stop = false;
  machine.pass(1);
  EXPECT_FALSE(flags(machine) & flag::emergency_stop);
  EXPECT_EQ(code(machine.ask(Type::move, lengths({3000000, 3000000}))), NakCode::position);

  ASSERT_TRUE(acked(machine.ask(Type::fire, numbers({1, 5000}))));
  machine.stop = true;
  machine.pass(1);
  EXPECT_FALSE(machine.shutter);
  EXPECT_EQ(shot_state(machine, 1), FiredState::cut);
}

TEST(Firmware, MovesAndExposuresExcludeEachOther) {
  FakeMachine machine;
  make_ready(machine, {2000000, 3000000});
  ASSERT_TRUE(acked(machine.ask(Type::fire, numbers({1, 500}))));
  EXPECT_EQ(code(machine.ask(Type::move, lengths({3000000, 3000000}))), NakCode::busy);
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({2, 500}))), NakCode::busy);
  EXPECT_EQ(code(machine.ask(Type::solenoid, numbers({20}))), NakCode::busy);
  machine.pass(500);
  ASSERT_TRUE(acked(machine.ask(Type::move, lengths({3000000, 3000000}))));
  EXPECT_EQ(code(machine.ask(Type::move, lengths({2000000, 3000000}))), NakCode::busy);
  EXPECT_EQ(code(machine.ask(Type::limits, limits(0, 100000, 15000000, 500000, 250000))), NakCode::busy);
  EXPECT_EQ(code(machine.ask(Type::declare, lengths({2000000, 3000000}))), NakCode::busy);
  EXPECT_EQ(code(machine.ask(Type::fire, numbers({2, 500}))), NakCode::busy);
  EXPECT_EQ(shot_state(machine, 2), FiredState::none);
}

TEST(Firmware, ACameraWithoutWinches) {
  FakeMachine machine(0);
  greet(machine);
  EXPECT_EQ(code(machine.ask(Type::move, {0})), NakCode::type);
  EXPECT_EQ(code(machine.ask(Type::declare, {0})), NakCode::type);
  EXPECT_TRUE(acked(machine.ask(Type::stop, {7})));
  EXPECT_TRUE(acked(machine.ask(Type::fire, numbers({1, 20}))));
}

TEST(Firmware, PayloadsOfAnyOtherLengthAreRefused) {
  FakeMachine machine;
  make_ready(machine, {2000000, 3000000});
  for (int type = 0; type < 0x80; ++type)
    for (std::size_t n = 0; n <= kMaxPayload; ++n) {
      const auto t = Type(type);
      if (t == Type::hello || t == Type::heartbeat) continue;
      const Frame reply = machine.ask(t, Bytes(n, 0xff));
      const bool known = t == Type::status || t == Type::shot_status || t == Type::fire || t == Type::solenoid ||
                         (type >= 0x20 && type <= 0x25);
      if (!known) {
        EXPECT_EQ(code(reply), NakCode::type);
      }
      EXPECT_EQ(acked(reply), (t == Type::status && n == 0) || (t == Type::shot_status && n == 4)) << type << " " << n;
    }
  EXPECT_EQ(machine.shutter_times, 0u);
  EXPECT_TRUE(machine.lengths.empty());
}

}  // namespace
}  // namespace lumihull::test
