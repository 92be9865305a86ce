/* What the firmware wants of the hardware. None of these may block for more than a millisecond. */
#ifndef LUMIHULL_FW_HAL_H
#define LUMIHULL_FW_HAL_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
  void *self;                      /* handed to each of them */
  uint32_t (*time_ms)(void *self); /* may start anywhere and may wrap around */
  int (*read_byte)(void *self);    /* 0 ... 255; -1: nothing there */
  void (*write_byte)(void *self, uint8_t byte);
  void (*set_shutter)(void *self, bool closed);
  void (*set_solenoid)(void *self, bool on);
  /* Where the winches are to be now; called at least every few ms while they move. Never called to say where they are.
   */
  void (*step_winches)(void *self, const int32_t *length_um, uint8_t winches);
  bool (*emergency_stop)(void *self); /* the contact is open */
} fw_hal;

#endif
