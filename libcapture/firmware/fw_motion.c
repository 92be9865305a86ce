#include "fw_motion.h"

#include <string.h>

#include "fw_protocol.h"

static int64_t magnitude(int64_t value) { return value < 0 ? -value : value; }

static uint64_t divide_up(uint64_t a, uint64_t b) { return (a + b - 1) / b; }

/* The least r with r * r >= value. */
static uint32_t root_up(uint64_t value) {
  uint64_t low = 0, high = (uint64_t)1 << 31;
  while (low < high) {
    const uint64_t middle = (low + high) / 2;
    if (middle * middle >= value)
      high = middle;
    else
      low = middle + 1;
  }
  return (uint32_t)low;
}

static uint8_t refuse(uint8_t code, int32_t why, int32_t *detail) {
  *detail = why;
  return code;
}

void fw_motion_init(fw_motion *m, uint8_t winches, const fw_limits *built_in) {
  memset(m, 0, sizeof *m);
  m->winches = winches;
  memcpy(m->built_in, built_in, winches * sizeof *built_in);
}

bool fw_motion_limits_set(const fw_motion *m) { return m->limits_set == (1u << m->winches) - 1; }

uint8_t fw_motion_limits(fw_motion *m, uint8_t winch, const fw_limits *limits, int32_t *detail) {
  const fw_limits *widest;
  if (winch >= m->winches) return refuse(FW_BAD_PAYLOAD, 0, detail);
  if (m->path != FW_REST) return refuse(FW_BUSY, 0, detail);
  widest = &m->built_in[winch];
  if (limits->min_um < widest->min_um || limits->max_um > widest->max_um || limits->min_um >= limits->max_um ||
      limits->speed_um_s <= 0 || limits->speed_um_s > widest->speed_um_s || limits->acceleration_um_s2 <= 0 ||
      limits->acceleration_um_s2 > widest->acceleration_um_s2)
    return refuse(FW_LIMIT, winch, detail);
  if (m->position_known && (m->length_um[winch] < limits->min_um || m->length_um[winch] > limits->max_um))
    return refuse(FW_LIMIT, winch, detail);
  m->limits[winch] = *limits;
  m->limits_set |= (uint16_t)(1u << winch);
  m->count = 0; /* setpoints were meant for other limits */
  return 0;
}

static uint8_t need_limits(const fw_motion *m, int32_t *detail) {
  uint8_t i;
  for (i = 0; i < m->winches; ++i)
    if (!(m->limits_set & 1u << i)) return refuse(FW_NO_LIMITS, i, detail);
  return 0;
}

static uint8_t need_within(const fw_motion *m, const int32_t *length_um, int32_t *detail) {
  uint8_t i;
  for (i = 0; i < m->winches; ++i)
    if (length_um[i] < m->limits[i].min_um || length_um[i] > m->limits[i].max_um) return refuse(FW_LIMIT, i, detail);
  return 0;
}

static uint8_t need_ready(const fw_motion *m, int32_t *detail) {
  if (m->path != FW_REST) return refuse(FW_BUSY, 0, detail);
  if (!m->position_known) return refuse(FW_NO_POSITION, 0, detail);
  return need_limits(m, detail);
}

uint8_t fw_motion_declare(fw_motion *m, const int32_t *length_um, int32_t *detail) {
  uint8_t code;
  if (m->path != FW_REST) return refuse(FW_BUSY, 0, detail);
  code = need_limits(m, detail);
  if (!code) code = need_within(m, length_um, detail);
  if (code) return code;
  memcpy(m->length_um, length_um, m->winches * sizeof *length_um);
  m->position_known = true;
  m->broken_off = false;
  m->count = 0;
  return 0;
}

static void begin(fw_motion *m, fw_path path, uint32_t duration_ms) {
  memcpy(m->from_um, m->length_um, sizeof m->from_um);
  m->path = path;
  m->duration_ms = duration_ms;
  m->at = 0;
  m->rate = 65536;
  m->slower = 0;
  m->piece = 0;
  m->piece_start_ms = 0;
  m->fastest_ms = 0;
  m->broken_off = false;
}

uint8_t fw_motion_line(fw_motion *m, const int32_t *to_um, int32_t *detail) {
  uint64_t r = 1, q = 1; /* ms, ms^2; at least 1, so that a move to where it is takes a moment, too */
  int32_t slowest = 0;
  uint64_t x, acceleration;
  uint8_t i, code = need_ready(m, detail);
  if (!code) code = need_within(m, to_um, detail);
  if (code) return code;
  for (i = 0; i < m->winches; ++i) {
    const uint64_t d = (uint64_t)magnitude((int64_t)to_um[i] - m->length_um[i]);
    const uint64_t r_i = divide_up(d * 1000, (uint64_t)m->limits[i].speed_um_s);
    const uint64_t q_i = divide_up(d * 1000000, (uint64_t)m->limits[i].acceleration_um_s2);
    if (r_i > r || q_i > q) slowest = i;
    if (r_i > r) r = r_i;
    if (q_i > q) q = q_i;
  }
  x = root_up(q);
  if (x < r) x = r;
  acceleration = divide_up(q, x);
  if (x + acceleration > FW_MAX_DURATION_MS) return refuse(FW_LIMIT, slowest, detail);
  m->x_ms = (uint32_t)x;
  m->acceleration_ms = (uint32_t)acceleration;
  memcpy(m->to_um, to_um, m->winches * sizeof *to_um);
  m->count = 0;
  begin(m, FW_LINE, (uint32_t)(x + acceleration));
  return 0;
}

uint8_t fw_motion_setpoint(fw_motion *m, uint8_t index, uint16_t step_ms, const int32_t *to_um, int32_t *detail) {
  uint8_t code;
  if (step_ms < 1 || step_ms > 60000) return refuse(FW_BAD_PAYLOAD, 0, detail);
  code = need_ready(m, detail);
  if (code) return code;
  if (index >= FW_QUEUE || (index != 0 && index != m->count)) return refuse(FW_BAD_QUEUE, m->count, detail);
  code = need_within(m, to_um, detail);
  if (code) return code;
  m->step_ms[index] = step_ms;
  memcpy(m->setpoint_um[index], to_um, m->winches * sizeof *to_um);
  m->count = (uint8_t)(index + 1);
  return 0;
}

/* Knot k of the path of winch i: 0 is where it starts, k the setpoint k - 1. */
static int64_t knot(const fw_motion *m, const int32_t *from_um, uint8_t k, uint8_t i) {
  return k == 0 ? from_um[i] : m->setpoint_um[k - 1][i];
}

typedef struct {
  int64_t start, delta, m0, m1; /* um: the piece's start, its length, its duration times the speeds at its ends */
} fw_piece;

/* Piece k runs from knot k to knot k + 1. */
static fw_piece piece_of(const fw_motion *m, const int32_t *from_um, uint8_t k, uint8_t i) {
  const int64_t step = m->step_ms[k];
  fw_piece p;
  p.start = knot(m, from_um, k, i);
  p.delta = knot(m, from_um, (uint8_t)(k + 1), i) - p.start;
  p.m0 = p.m1 = 0;
  if (k > 0) p.m0 = step * (p.start + p.delta - knot(m, from_um, (uint8_t)(k - 1), i)) / (step + m->step_ms[k - 1]);
  if (k + 1 < m->count) p.m1 = step * (knot(m, from_um, (uint8_t)(k + 2), i) - p.start) / (step + m->step_ms[k + 1]);
  return p;
}

static bool piece_within(const fw_piece *p, const fw_limits *limits, int64_t step) {
  const int64_t one = p->start + p->m0 / 3, two = p->start + p->delta - p->m1 / 3;
  const int64_t speed = limits->speed_um_s * step, acceleration = limits->acceleration_um_s2 * step * step;
  return one >= limits->min_um && one <= limits->max_um && two >= limits->min_um && two <= limits->max_um &&
         magnitude(p->m0) * 1000 <= speed && magnitude(3 * p->delta - p->m0 - p->m1) * 1000 <= speed &&
         magnitude(p->m1) * 1000 <= speed &&
         magnitude(6 * p->delta - 4 * p->m0 - 2 * p->m1) * 1000000 <= acceleration &&
         magnitude(6 * p->delta - 2 * p->m0 - 4 * p->m1) * 1000000 <= acceleration;
}

uint8_t fw_motion_start(fw_motion *m, uint8_t count, int32_t *detail) {
  uint32_t duration = 0;
  uint8_t i, k, code = need_ready(m, detail);
  if (code) return code;
  if (count == 0 || count != m->count) return refuse(FW_BAD_QUEUE, m->count, detail);
  for (k = 0; k < count; ++k) {
    duration += m->step_ms[k];
    for (i = 0; i < m->winches; ++i) {
      const fw_piece p = piece_of(m, m->length_um, k, i);
      if (!piece_within(&p, &m->limits[i], m->step_ms[k])) return refuse(FW_LIMIT, i, detail);
    }
  }
  if (duration > FW_MAX_DURATION_MS) return refuse(FW_LIMIT, 0, detail);
  memcpy(m->to_um, m->setpoint_um[count - 1], sizeof m->to_um);
  begin(m, FW_SPLINE, duration);
  return 0;
}

/* The first half of a line: s of the time `at`, 32 bits behind the point. */
static uint64_t line_fraction(const fw_motion *m, uint64_t at) {
  const uint64_t x = (uint64_t)m->x_ms << 8, acceleration = (uint64_t)m->acceleration_ms << 8;
  if (at >= acceleration) return ((at - acceleration / 2) << 32) / x;
  return ((at << 28) / x) * ((at << 28) / (2 * acceleration)) >> 24;
}

static void line_lengths(fw_motion *m) {
  const uint64_t end = (uint64_t)m->duration_ms << 8, one = (uint64_t)1 << 32;
  const bool second = m->at > end / 2;
  const uint64_t s = second ? one - line_fraction(m, end - m->at) : line_fraction(m, m->at);
  uint8_t i;
  for (i = 0; i < m->winches; ++i)
    m->length_um[i] = (int32_t)(m->from_um[i] + ((int64_t)m->to_um[i] - m->from_um[i]) * (int64_t)s / (int64_t)one);
}

static void spline_lengths(fw_motion *m) {
  const int64_t one = 1 << 20;
  int64_t u;
  uint8_t i;
  while (m->piece + 1 < m->count && m->at >= (uint64_t)(m->piece_start_ms + m->step_ms[m->piece]) << 8)
    m->piece_start_ms += m->step_ms[m->piece++];
  u = (int64_t)(((m->at - ((uint64_t)m->piece_start_ms << 8)) << 12) / m->step_ms[m->piece]);
  for (i = 0; i < m->winches; ++i) {
    const fw_piece p = piece_of(m, m->from_um, m->piece, i);
    const int64_t c2 = 3 * p.delta - 2 * p.m0 - p.m1, c3 = p.m0 + p.m1 - 2 * p.delta;
    m->length_um[i] = (int32_t)(p.start + ((c3 * u / one + c2) * u / one + p.m0) * u / one);
  }
}

/* The longest time that a winch needs at its limit of acceleration to lose the speed of the last millisecond. */
static uint32_t time_to_rest(const fw_motion *m, const int32_t *before_um) {
  uint64_t longest = 1;
  uint8_t i;
  for (i = 0; i < m->winches; ++i) {
    const uint64_t step = (uint64_t)magnitude((int64_t)m->length_um[i] - before_um[i]);
    const uint64_t ms = divide_up(step * 1000000, (uint64_t)m->limits[i].acceleration_um_s2);
    if (ms > longest) longest = ms;
  }
  return (uint32_t)longest;
}

void fw_motion_advance(fw_motion *m) {
  int32_t before_um[FW_MAX_WINCHES];
  if (m->path == FW_REST) return;
  memcpy(before_um, m->length_um, sizeof before_um);
  m->rate = m->rate > m->slower ? m->rate - m->slower : 0;
  m->at += m->rate >> 8;
  if (m->at >= (uint64_t)m->duration_ms << 8) {
    memcpy(m->length_um, m->to_um, m->winches * sizeof *m->to_um);
    m->path = FW_REST;
  } else if (m->path == FW_LINE) {
    line_lengths(m);
  } else {
    spline_lengths(m);
  }
  if (m->path != FW_REST && m->rate < 256) { /* slower than the time's resolution: it stands */
    m->path = FW_REST;
    m->broken_off = true;
  }
  if (m->path == FW_REST)
    m->count = 0;
  else
    m->fastest_ms = time_to_rest(m, before_um);
}

uint32_t fw_motion_stop(fw_motion *m) {
  if (m->path == FW_REST) {
    m->count = 0;
    return 0;
  }
  if (m->slower == 0) m->slower = (uint32_t)divide_up(65536, m->fastest_ms ? m->fastest_ms : 1);
  return m->rate / m->slower + 1;
}

void fw_motion_halt(fw_motion *m) {
  if (m->path != FW_REST) m->broken_off = true;
  m->path = FW_REST;
  m->count = 0;
  m->position_known = false;
}

uint32_t fw_motion_remaining_ms(const fw_motion *m) {
  if (m->path == FW_REST) return 0;
  if (m->slower) return m->rate / m->slower + 1;
  return m->duration_ms - (uint32_t)(m->at >> 8);
}
