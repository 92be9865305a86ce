/* Winches: limits, synchronised moves (PROTOCOL.md, section 5). Whole numbers only. */
#ifndef LUMIHULL_FW_MOTION_H
#define LUMIHULL_FW_MOTION_H

#include <stdbool.h>
#include <stdint.h>

#define FW_MAX_WINCHES 12
#ifndef FW_QUEUE
#define FW_QUEUE 64 /* setpoints; at most 255; each takes 50 bytes */
#endif
#define FW_MAX_LENGTH_UM 100000000 /* keeps products within 64 bits */
#define FW_MAX_DURATION_MS 600000

typedef struct {
  int32_t min_um, max_um, speed_um_s, acceleration_um_s2;
} fw_limits;

typedef enum { FW_REST, FW_LINE, FW_SPLINE } fw_path;

typedef struct {
  uint8_t winches;
  fw_limits built_in[FW_MAX_WINCHES]; /* what the machine stands, whatever the host says */
  fw_limits limits[FW_MAX_WINCHES];
  uint16_t limits_set; /* one bit a winch */
  bool position_known;
  bool broken_off; /* the last move did not reach its end */
  int32_t length_um[FW_MAX_WINCHES];

  uint8_t count; /* setpoints held */
  uint16_t step_ms[FW_QUEUE];
  int32_t setpoint_um[FW_QUEUE][FW_MAX_WINCHES];

  fw_path path;
  int32_t from_um[FW_MAX_WINCHES], to_um[FW_MAX_WINCHES];
  uint32_t x_ms, acceleration_ms; /* of a line: duration = x + acceleration */
  uint32_t duration_ms;
  uint64_t at;     /* time along the path, 1/256 ms */
  uint32_t rate;   /* of that time, 65536 = as planned; falls to 0 in a stop */
  uint32_t slower; /* per ms, in a stop; else 0 */
  uint8_t piece;   /* of a spline */
  uint32_t piece_start_ms;
  uint32_t fastest_ms; /* the longest time that a winch needs from its present speed to rest */
} fw_motion;

/* All functions that refuse return 0 or a NAK code, with *detail set; then nothing has changed. */
void fw_motion_init(fw_motion *m, uint8_t winches, const fw_limits *built_in);
uint8_t fw_motion_limits(fw_motion *m, uint8_t winch, const fw_limits *limits, int32_t *detail);
uint8_t fw_motion_declare(fw_motion *m, const int32_t *length_um, int32_t *detail);
uint8_t fw_motion_line(fw_motion *m, const int32_t *to_um, int32_t *detail);
uint8_t fw_motion_setpoint(fw_motion *m, uint8_t index, uint16_t step_ms, const int32_t *to_um, int32_t *detail);
uint8_t fw_motion_start(fw_motion *m, uint8_t count, int32_t *detail);

uint32_t fw_motion_stop(fw_motion *m); /* returns the time until it stands still */
void fw_motion_halt(fw_motion *m);     /* power is gone: at once, and the position is lost */
void fw_motion_advance(fw_motion *m);  /* by one millisecond */
uint32_t fw_motion_remaining_ms(const fw_motion *m);
bool fw_motion_limits_set(const fw_motion *m);

#endif
