/* The controller of PROTOCOL.md: what stands between the line and the outputs. */
#ifndef LUMIHULL_FW_CONTROLLER_H
#define LUMIHULL_FW_CONTROLLER_H

#include "fw_frame.h"
#include "fw_hal.h"
#include "fw_motion.h"
#include "fw_protocol.h"

#define FW_SHOTS 32 /* remembered */

typedef struct {
  uint8_t winches; /* 0 ... FW_MAX_WINCHES */
  uint32_t max_exposure_ms, max_solenoid_ms;
  fw_limits built_in[FW_MAX_WINCHES];
} fw_config;

typedef struct {
  uint32_t number, exposed_ms;
  uint16_t sequence; /* of the FIRE, for DONE */
  uint8_t state;     /* fw_shot_state */
} fw_shot;

typedef struct {
  const fw_hal *hal;
  const fw_config *config;
  uint32_t nonce;
  uint32_t now_ms, boot_ms, heard_ms;

  fw_receiver receiver;
  bool in_session, host_lost;
  uint32_t session;
  fw_frame last;     /* the reply to the last request: its sequence number is the last one */
  uint8_t last_type; /* of that request */

  fw_shot shots[FW_SHOTS]; /* a ring */
  uint8_t shot_count, shot_next;
  bool forgot;
  uint32_t forgotten; /* the greatest number that left the ring */
  bool exposing;
  uint32_t exposure_start_ms, exposure_ms;

  bool solenoid, solenoid_rests;
  uint32_t solenoid_start_ms, solenoid_ms, solenoid_end_ms;

  bool stopped; /* emergency stop */
  fw_motion motion;
} fw_controller;

/* Outputs off, no session, position unknown. nonce: not 0, not used by one of the last 1000 starts. hal and config
 * are borrowed for good. */
void fw_controller_init(fw_controller *c, const fw_hal *hal, const fw_config *config, uint32_t nonce);

/* Call it again and again, at least every millisecond while anything moves. */
void fw_controller_poll(fw_controller *c);

/* The flags of STATUS. */
uint16_t fw_controller_flags(const fw_controller *c);

#endif
