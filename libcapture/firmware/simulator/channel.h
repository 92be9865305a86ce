/* A bad line, one direction of it: frames get lost, damaged, doubled, late. */
#ifndef LUMIHULL_SIM_CHANNEL_H
#define LUMIHULL_SIM_CHANNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SIM_PARCELS 256 /* on their way at once; more are lost */
#define SIM_PARCEL 512  /* bytes; a longer stretch without a zero is cut */

/* Probabilities for each frame, 0 ... 1. */
typedef struct {
  double drop, damage, duplicate, delay;
  double garbage;        /* that noise of up to 100 bytes comes before it */
  uint32_t max_delay_ms; /* of late frames and of the second copy */
} sim_faults;

typedef struct {
  bool used;
  uint64_t due_ms, order; /* of two that are due, the lower order goes first */
  uint16_t length;
  uint8_t bytes[SIM_PARCEL];
} sim_parcel;

typedef struct {
  const sim_faults *faults;
  uint64_t *random;
  uint64_t order;
  size_t on_the_way;
  uint16_t length; /* of what has come since the last zero */
  uint8_t bytes[SIM_PARCEL];
  sim_parcel parcels[SIM_PARCELS];
} sim_channel;

uint64_t sim_random(uint64_t *state);
double sim_uniform(uint64_t *state); /* 0 <= x < 1 */

/* True where the byte completed a frame (or what a zero ended). */
bool sim_put(sim_channel *channel, uint8_t byte, uint64_t now_ms);

/* The next stretch that is due, or NULL; valid until the next call of sim_put. */
const sim_parcel *sim_take(sim_channel *channel, uint64_t now_ms);

void sim_clear(sim_channel *channel);

#endif
