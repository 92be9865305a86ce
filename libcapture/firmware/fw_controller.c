#include "fw_controller.h"

#include <string.h>

/* ---- outputs ---- */

static fw_shot *newest_shot(fw_controller *c) { return &c->shots[(c->shot_next + FW_SHOTS - 1) % FW_SHOTS]; }

static void send(fw_controller *c, const fw_frame *frame) {
  uint8_t wire[FW_MAX_WIRE];
  const size_t n = fw_encode(frame, wire);
  size_t i;
  for (i = 0; i < n; ++i) c->hal->write_byte(c->hal->self, wire[i]);
}

static void end_exposure(fw_controller *c, uint8_t state) {
  fw_shot *shot = newest_shot(c);
  fw_frame done;
  if (!c->exposing) return;
  c->hal->set_shutter(c->hal->self, false);
  c->exposing = false;
  shot->state = state;
  shot->exposed_ms = c->now_ms - c->exposure_start_ms;

  memset(&done, 0, sizeof done);
  done.version = FW_VERSION;
  done.type = FW_DONE;
  done.nonce = c->nonce;
  done.sequence = shot->sequence;
  done.length = 9;
  fw_put_u32(done.payload, shot->number);
  done.payload[4] = state;
  fw_put_u32(done.payload + 5, shot->exposed_ms);
  send(c, &done);
}

static void solenoid_off(fw_controller *c) {
  if (!c->solenoid) return;
  c->hal->set_solenoid(c->hal->self, false);
  c->solenoid = false;
  c->solenoid_rests = true;
  c->solenoid_end_ms = c->now_ms;
}

static uint32_t stop(fw_controller *c, uint8_t what) {
  if (what & FW_STOP_EXPOSURE) end_exposure(c, FW_SHOT_CUT);
  if (what & FW_STOP_SOLENOID) solenoid_off(c);
  return what & FW_STOP_MOVE ? fw_motion_stop(&c->motion) : 0;
}

/* ---- requests: each returns 0 or a NAK's code, and writes its data to `out` ---- */

typedef struct {
  const fw_frame *in;
  fw_frame *out; /* payload[0] is the request's type; data are appended */
  int32_t detail;
} fw_request;

static void add_u8(fw_request *r, uint8_t value) { r->out->payload[r->out->length++] = value; }
static void add_u16(fw_request *r, uint16_t value) {
  fw_put_u16(r->out->payload + r->out->length, value);
  r->out->length = (uint8_t)(r->out->length + 2);
}
static void add_u32(fw_request *r, uint32_t value) {
  fw_put_u32(r->out->payload + r->out->length, value);
  r->out->length = (uint8_t)(r->out->length + 4);
}

/* n and n lengths, from `at` to the end of the payload. */
static bool get_lengths(const fw_controller *c, const fw_frame *in, uint8_t at, int32_t *length_um) {
  uint8_t i;
  if (in->length != at + 1 + 4 * c->motion.winches || in->payload[at] != c->motion.winches) return false;
  for (i = 0; i < c->motion.winches; ++i) length_um[i] = fw_get_i32(in->payload + at + 1 + 4 * i);
  return true;
}

static uint8_t do_status(fw_controller *c, fw_request *r) {
  uint8_t i;
  if (r->in->length != 0) return FW_BAD_PAYLOAD;
  add_u16(r, fw_controller_flags(c));
  add_u32(r, fw_motion_remaining_ms(&c->motion));
  add_u8(r, c->motion.winches);
  for (i = 0; i < c->motion.winches; ++i) add_u32(r, (uint32_t)c->motion.length_um[i]);
  return 0;
}

static const fw_shot *find_shot(const fw_controller *c, uint32_t number) {
  uint8_t i;
  for (i = 0; i < c->shot_count; ++i)
    if (c->shots[i].number == number) return &c->shots[i];
  return NULL;
}

static uint8_t do_shot_status(fw_controller *c, fw_request *r) {
  uint32_t number, exposed_ms = 0;
  uint8_t state = FW_SHOT_NONE;
  const fw_shot *shot;
  if (r->in->length != 4) return FW_BAD_PAYLOAD;
  number = fw_get_u32(r->in->payload);
  shot = find_shot(c, number);
  if (shot) {
    state = shot->state;
    exposed_ms = state == FW_SHOT_EXPOSING ? c->now_ms - c->exposure_start_ms : shot->exposed_ms;
  } else if (c->forgot && number <= c->forgotten) {
    state = FW_SHOT_FORGOTTEN;
  }
  add_u32(r, number);
  add_u8(r, state);
  add_u32(r, exposed_ms);
  return 0;
}

static uint8_t do_fire(fw_controller *c, fw_request *r) {
  uint32_t number, exposure_ms;
  const fw_shot *known;
  fw_shot *shot;
  if (r->in->length != 8) return FW_BAD_PAYLOAD;
  number = fw_get_u32(r->in->payload);
  exposure_ms = fw_get_u32(r->in->payload + 4);
  known = find_shot(c, number);
  if (known) {
    r->detail = known->state;
    return FW_SHOT_KNOWN;
  }
  if (c->forgot && number <= c->forgotten) return FW_SHOT_OLD;
  if (c->stopped) return FW_STOPPED;
  if (c->motion.path != FW_REST || c->exposing || c->solenoid) return FW_BUSY;
  if (exposure_ms < 1 || exposure_ms > c->config->max_exposure_ms) {
    r->detail = -1;
    return FW_LIMIT;
  }

  shot = &c->shots[c->shot_next];
  if (c->shot_count < FW_SHOTS) {
    ++c->shot_count;
  } else {
    if (!c->forgot || shot->number > c->forgotten) c->forgotten = shot->number;
    c->forgot = true;
  }
  c->shot_next = (uint8_t)((c->shot_next + 1) % FW_SHOTS);
  shot->number = number;
  shot->state = FW_SHOT_EXPOSING;
  shot->exposed_ms = 0;
  shot->sequence = r->in->sequence;
  c->exposing = true;
  c->exposure_start_ms = c->now_ms;
  c->exposure_ms = exposure_ms;
  c->hal->set_shutter(c->hal->self, true);
  add_u32(r, number);
  return 0;
}

static uint8_t do_solenoid(fw_controller *c, fw_request *r) {
  uint32_t ms;
  if (r->in->length != 4) return FW_BAD_PAYLOAD;
  ms = fw_get_u32(r->in->payload);
  if (ms == 0) {
    solenoid_off(c);
  } else {
    if (c->stopped) return FW_STOPPED;
    if (c->motion.path != FW_REST || c->exposing || c->solenoid || c->solenoid_rests) return FW_BUSY;
    if (ms > c->config->max_solenoid_ms) {
      r->detail = -1;
      return FW_LIMIT;
    }
    c->solenoid = true;
    c->solenoid_start_ms = c->now_ms;
    c->solenoid_ms = ms;
    c->hal->set_solenoid(c->hal->self, true);
  }
  add_u32(r, ms);
  return 0;
}

static uint8_t do_limits(fw_controller *c, fw_request *r) {
  const uint8_t *in = r->in->payload;
  fw_limits limits;
  uint8_t code;
  if (r->in->length != 17) return FW_BAD_PAYLOAD;
  limits.min_um = fw_get_i32(in + 1);
  limits.max_um = fw_get_i32(in + 5);
  limits.speed_um_s = fw_get_i32(in + 9);
  limits.acceleration_um_s2 = fw_get_i32(in + 13);
  code = fw_motion_limits(&c->motion, in[0], &limits, &r->detail);
  if (!code) add_u8(r, in[0]);
  return code;
}

static uint8_t do_declare(fw_controller *c, fw_request *r) {
  int32_t length_um[FW_MAX_WINCHES];
  if (!get_lengths(c, r->in, 0, length_um)) return FW_BAD_PAYLOAD;
  if (c->stopped) return FW_STOPPED;
  return fw_motion_declare(&c->motion, length_um, &r->detail);
}

static uint8_t do_move(fw_controller *c, fw_request *r) {
  int32_t to_um[FW_MAX_WINCHES];
  uint8_t code;
  if (!get_lengths(c, r->in, 0, to_um)) return FW_BAD_PAYLOAD;
  if (c->stopped) return FW_STOPPED;
  if (c->exposing || c->solenoid) return FW_BUSY;
  code = fw_motion_line(&c->motion, to_um, &r->detail);
  if (!code) add_u32(r, c->motion.duration_ms);
  return code;
}

static uint8_t do_setpoint(fw_controller *c, fw_request *r) {
  int32_t to_um[FW_MAX_WINCHES];
  uint8_t code;
  if (!get_lengths(c, r->in, 3, to_um)) return FW_BAD_PAYLOAD;
  if (c->stopped) return FW_STOPPED;
  code = fw_motion_setpoint(&c->motion, r->in->payload[0], fw_get_u16(r->in->payload + 1), to_um, &r->detail);
  if (!code) add_u8(r, r->in->payload[0]);
  return code;
}

static uint8_t do_start(fw_controller *c, fw_request *r) {
  uint8_t code;
  if (r->in->length != 1) return FW_BAD_PAYLOAD;
  if (c->stopped) return FW_STOPPED;
  if (c->exposing || c->solenoid) return FW_BUSY;
  code = fw_motion_start(&c->motion, r->in->payload[0], &r->detail);
  if (!code) add_u32(r, c->motion.duration_ms);
  return code;
}

static uint8_t do_stop(fw_controller *c, fw_request *r) {
  if (r->in->length != 1 || (r->in->payload[0] & ~FW_STOP_ALL)) return FW_BAD_PAYLOAD;
  add_u32(r, stop(c, r->in->payload[0]));
  return 0;
}

static uint8_t carry_out(fw_controller *c, fw_request *r) {
  const uint8_t type = r->in->type;
  if (type >= FW_LIMITS && type <= FW_START && c->motion.winches == 0) return FW_BAD_TYPE;
  switch (type) {
    case FW_STATUS: return do_status(c, r);
    case FW_SHOT_STATUS: return do_shot_status(c, r);
    case FW_FIRE: return do_fire(c, r);
    case FW_SOLENOID: return do_solenoid(c, r);
    case FW_LIMITS: return do_limits(c, r);
    case FW_DECLARE: return do_declare(c, r);
    case FW_MOVE: return do_move(c, r);
    case FW_SETPOINT: return do_setpoint(c, r);
    case FW_START: return do_start(c, r);
    case FW_STOP: return do_stop(c, r);
    default: return FW_BAD_TYPE;
  }
}

/* ---- frames ---- */

static void prepare(const fw_controller *c, const fw_frame *in, fw_frame *out) {
  memset(out, 0, sizeof *out);
  out->version = FW_VERSION;
  out->type = FW_ACK;
  out->nonce = c->nonce;
  out->sequence = in->sequence;
  out->length = 1;
  out->payload[0] = in->type;
}

static void make_nak(fw_frame *out, uint8_t code, int32_t detail) {
  out->type = FW_NAK;
  out->length = 6;
  out->payload[1] = code;
  fw_put_u32(out->payload + 2, (uint32_t)detail);
}

/* A NAK that is not kept. */
static void turn_away(fw_controller *c, const fw_frame *in, uint8_t code, int32_t detail) {
  fw_frame out;
  prepare(c, in, &out);
  make_nak(&out, code, detail);
  send(c, &out);
}

static void hello(fw_controller *c, const fw_frame *in) {
  fw_request r;
  uint32_t session;
  if (in->length != 4) {
    turn_away(c, in, FW_BAD_PAYLOAD, 0);
    return;
  }
  session = fw_get_u32(in->payload);
  if (c->in_session && c->session == session) {
    const uint16_t ahead = (uint16_t)(in->sequence - c->last.sequence);
    if (ahead > 32767) return; /* an old copy */
    if (ahead == 0) {
      if (c->last_type == FW_HELLO) send(c, &c->last);
      return;
    }
  } else {
    stop(c, FW_STOP_ALL);
  }
  c->in_session = true;
  c->session = session;
  c->last_type = FW_HELLO;

  prepare(c, in, &c->last);
  r.in = in;
  r.out = &c->last;
  add_u32(&r, session);
  add_u32(&r, c->now_ms - c->boot_ms);
  add_u8(&r, c->motion.winches);
  add_u8(&r, FW_QUEUE);
  add_u32(&r, c->config->max_exposure_ms);
  add_u32(&r, c->config->max_solenoid_ms);
  add_u16(&r, fw_controller_flags(c));
  c->host_lost = false;
  send(c, &c->last);
}

static void request(fw_controller *c, const fw_frame *in) {
  fw_request r;
  uint16_t ahead;
  uint8_t code;
  ahead = (uint16_t)(in->sequence - c->last.sequence);
  if (!c->in_session || ahead > 1 || (ahead == 0 && in->type != c->last_type)) {
    turn_away(c, in, FW_BAD_SEQUENCE, c->in_session ? c->last.sequence : -1);
    return;
  }
  if (ahead == 1) {
    prepare(c, in, &c->last);
    c->last_type = in->type;
    r.in = in;
    r.out = &c->last;
    r.detail = 0;
    code = carry_out(c, &r);
    if (code) make_nak(&c->last, code, r.detail);
  }
  send(c, &c->last);
}

static void handle(fw_controller *c, const fw_frame *in) {
  if (in->type >= 0x80) return; /* an echo */
  if (in->version != FW_VERSION) {
    turn_away(c, in, FW_BAD_VERSION, FW_VERSION);
    return;
  }
  if (in->type != FW_HELLO && in->nonce != c->nonce) {
    turn_away(c, in, FW_BAD_NONCE, 0);
    return;
  }
  c->heard_ms = c->now_ms;
  if (in->type == FW_HELLO) {
    hello(c, in);
  } else if (in->type == FW_HEARTBEAT) {
    fw_frame out;
    prepare(c, in, &out);
    if (in->length != 0) {
      make_nak(&out, FW_BAD_PAYLOAD, 0);
    } else {
      fw_put_u16(out.payload + 1, fw_controller_flags(c));
      out.length = 3;
    }
    send(c, &out);
  } else {
    request(c, in);
  }
}

/* ---- time ---- */

static void watch(fw_controller *c) {
  const bool stopped = c->hal->emergency_stop(c->hal->self);
  if (stopped && !c->stopped) {
    stop(c, FW_STOP_SOLENOID | FW_STOP_EXPOSURE);
    fw_motion_halt(&c->motion);
  }
  c->stopped = stopped;

  if (c->exposing && c->now_ms - c->exposure_start_ms >= c->exposure_ms) end_exposure(c, FW_SHOT_DONE);
  if (c->solenoid && c->now_ms - c->solenoid_start_ms >= c->solenoid_ms) solenoid_off(c);
  if (c->solenoid_rests && c->now_ms - c->solenoid_end_ms >= c->config->max_solenoid_ms) c->solenoid_rests = false;

  if (c->in_session && !c->host_lost && c->now_ms - c->heard_ms >= FW_HOST_SILENT_MS) {
    stop(c, FW_STOP_ALL);
    c->host_lost = true;
  }
}

static void move(fw_controller *c, uint32_t elapsed_ms) {
  if (elapsed_ms == 0 || c->motion.path == FW_REST) return;
  while (elapsed_ms-- > 0 && c->motion.path != FW_REST) fw_motion_advance(&c->motion);
  c->hal->step_winches(c->hal->self, c->motion.length_um, c->motion.winches);
}

void fw_controller_init(fw_controller *c, const fw_hal *hal, const fw_config *config, uint32_t nonce) {
  memset(c, 0, sizeof *c);
  c->hal = hal;
  c->config = config;
  c->nonce = nonce;
  c->now_ms = c->boot_ms = c->heard_ms = hal->time_ms(hal->self);
  hal->set_shutter(hal->self, false);
  hal->set_solenoid(hal->self, false);
  fw_motion_init(&c->motion, config->winches, config->built_in);
}

void fw_controller_poll(fw_controller *c) {
  const uint32_t now_ms = c->hal->time_ms(c->hal->self);
  const uint32_t elapsed_ms = now_ms - c->now_ms;
  fw_frame frame;
  int byte, budget;
  c->now_ms = now_ms;
  watch(c);
  move(c, elapsed_ms);
  /* Not more than a few frames at once: a flood of noise must not hold up the outputs. */
  for (budget = 4 * FW_MAX_WIRE; budget > 0 && (byte = c->hal->read_byte(c->hal->self)) >= 0; --budget)
    if (fw_receive(&c->receiver, (uint8_t)byte, &frame)) handle(c, &frame);
}

uint16_t fw_controller_flags(const fw_controller *c) {
  unsigned flags = 0;
  if (c->motion.path != FW_REST) flags |= FW_FLAG_MOVING;
  if (c->motion.position_known) flags |= FW_FLAG_POSITION_KNOWN;
  if (c->stopped) flags |= FW_FLAG_EMERGENCY_STOP;
  if (c->exposing) flags |= FW_FLAG_EXPOSING;
  if (c->solenoid) flags |= FW_FLAG_SOLENOID;
  if (c->host_lost) flags |= FW_FLAG_HOST_LOST;
  if (fw_motion_limits_set(&c->motion)) flags |= FW_FLAG_LIMITS_SET;
  if (c->motion.broken_off) flags |= FW_FLAG_BROKEN_OFF;
  return (uint16_t)flags;
}
