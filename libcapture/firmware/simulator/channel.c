#include "channel.h"

#include <string.h>

/* splitmix64 (Steele, Lea & Flood 2014). */
uint64_t sim_random(uint64_t *state) {
  uint64_t z = (*state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double sim_uniform(uint64_t *state) { return (double)(sim_random(state) >> 11) / 9007199254740992.0; }

static bool happens(sim_channel *channel, double probability) {
  return probability > 0 && sim_uniform(channel->random) < probability;
}

static uint32_t below(sim_channel *channel, uint32_t n) { return (uint32_t)(sim_random(channel->random) % n); }

static void dispatch(sim_channel *channel, const uint8_t *bytes, size_t n, uint64_t due_ms) {
  size_t i;
  for (i = 0; i < SIM_PARCELS; ++i) {
    sim_parcel *parcel = &channel->parcels[i];
    if (parcel->used) continue;
    parcel->used = true;
    ++channel->on_the_way;
    parcel->due_ms = due_ms;
    parcel->order = channel->order++;
    parcel->length = (uint16_t)n;
    memcpy(parcel->bytes, bytes, n);
    return;
  }
}

static size_t spoil(sim_channel *channel, uint8_t *bytes, size_t n) {
  const size_t at = below(channel, (uint32_t)n);
  switch (below(channel, 4)) {
    case 0: bytes[at] ^= (uint8_t)(1u << below(channel, 8)); break;
    case 1: /* a byte is lost */ memmove(bytes + at, bytes + at + 1, n - at - 1); return n - 1;
    case 2: /* a byte comes twice */
      if (n == SIM_PARCEL) break;
      memmove(bytes + at + 1, bytes + at, n - at);
      return n + 1;
    default: bytes[at] = (uint8_t)below(channel, 256);
  }
  return n;
}

bool sim_put(sim_channel *channel, uint8_t byte, uint64_t now_ms) {
  const sim_faults *faults = channel->faults;
  uint8_t bytes[SIM_PARCEL];
  size_t n;
  bool frame;
  channel->bytes[channel->length++] = byte;
  if (byte != 0 && channel->length < SIM_PARCEL) return false;
  n = channel->length;
  frame = n > 1;
  memcpy(bytes, channel->bytes, n);
  channel->length = 0;
  if (!frame) { /* the zero before a frame */
    dispatch(channel, bytes, n, now_ms);
    return false;
  }

  if (happens(channel, faults->garbage)) {
    uint8_t noise[100];
    const size_t length = 1 + below(channel, sizeof noise);
    size_t i;
    for (i = 0; i < length; ++i) noise[i] = (uint8_t)below(channel, 256);
    dispatch(channel, noise, length, now_ms);
  }
  if (happens(channel, faults->duplicate))
    dispatch(channel, bytes, n, now_ms + below(channel, faults->max_delay_ms + 1));
  if (happens(channel, faults->drop)) return true;
  if (happens(channel, faults->damage)) n = spoil(channel, bytes, n);
  dispatch(channel, bytes, n,
           now_ms + (happens(channel, faults->delay) ? below(channel, faults->max_delay_ms + 1) : 0));
  return true;
}

const sim_parcel *sim_take(sim_channel *channel, uint64_t now_ms) {
  sim_parcel *first = NULL;
  size_t i;
  if (channel->on_the_way == 0) return NULL;
  for (i = 0; i < SIM_PARCELS; ++i) {
    sim_parcel *parcel = &channel->parcels[i];
    if (parcel->used && parcel->due_ms <= now_ms && (!first || parcel->order < first->order)) first = parcel;
  }
  if (first) {
    first->used = false;
    --channel->on_the_way;
  }
  return first;
}

void sim_clear(sim_channel *channel) {
  size_t i;
  for (i = 0; i < SIM_PARCELS; ++i) channel->parcels[i].used = false;
  channel->on_the_way = 0;
  channel->length = 0;
}
