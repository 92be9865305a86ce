#include "fw_frame.h"

#include <string.h>

/* Four bits at a time: a table of 32 bytes suits a small controller. */
uint16_t fw_crc16(const uint8_t *bytes, size_t n) {
  static const uint16_t table[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50a5, 0x60c6, 0x70e7,
                                     0x8108, 0x9129, 0xa14a, 0xb16b, 0xc18c, 0xd1ad, 0xe1ce, 0xf1ef};
  uint16_t crc = 0xffff;
  size_t i;
  for (i = 0; i < n; ++i) {
    crc = (uint16_t)((uint16_t)(crc << 4) ^ table[(crc >> 12) ^ (bytes[i] >> 4)]);
    crc = (uint16_t)((uint16_t)(crc << 4) ^ table[(crc >> 12) ^ (bytes[i] & 15)]);
  }
  return crc;
}

uint16_t fw_get_u16(const uint8_t *at) { return (uint16_t)(at[0] | at[1] << 8); }

uint32_t fw_get_u32(const uint8_t *at) { return fw_get_u16(at) | (uint32_t)fw_get_u16(at + 2) << 16; }

int32_t fw_get_i32(const uint8_t *at) {
  const uint32_t value = fw_get_u32(at);
  /* The cast of a value that does not fit would be the compiler's choice. */
  return value <= INT32_MAX ? (int32_t)value : -(int32_t)(UINT32_MAX - value) - 1;
}

void fw_put_u16(uint8_t *at, uint16_t value) {
  at[0] = (uint8_t)(value & 0xff);
  at[1] = (uint8_t)(value >> 8);
}

void fw_put_u32(uint8_t *at, uint32_t value) {
  fw_put_u16(at, (uint16_t)(value & 0xffff));
  fw_put_u16(at + 2, (uint16_t)(value >> 16));
}

size_t fw_encode(const fw_frame *frame, uint8_t wire[FW_MAX_WIRE]) {
  uint8_t bytes[FW_MAX_FRAME];
  const size_t body = FW_HEADER + (size_t)frame->length;
  size_t i, code, out;

  bytes[0] = frame->version;
  bytes[1] = frame->type;
  fw_put_u32(bytes + 2, frame->nonce);
  fw_put_u16(bytes + 6, frame->sequence);
  bytes[8] = frame->length;
  memcpy(bytes + FW_HEADER, frame->payload, frame->length);
  fw_put_u16(bytes + body, fw_crc16(bytes, body));

  wire[0] = 0;
  code = 1; /* where the length of the present piece goes */
  out = 2;
  for (i = 0; i < body + 2; ++i) {
    if (bytes[i] != 0) {
      wire[out++] = bytes[i];
    } else {
      wire[code] = (uint8_t)(out - code);
      code = out++;
    }
  }
  wire[code] = (uint8_t)(out - code);
  wire[out++] = 0;
  return out;
}

/* In place; returns the number of bytes, or 0 where a piece reaches beyond the end. */
static size_t undo_cobs(uint8_t *bytes, size_t n) {
  size_t in = 0, out = 0;
  while (in < n) {
    const size_t piece = bytes[in];
    if (in + piece > n) return 0;
    memmove(bytes + out, bytes + in + 1, piece - 1);
    out += piece - 1;
    in += piece;
    if (in < n) bytes[out++] = 0;
  }
  return out;
}

static bool parse(const uint8_t *bytes, size_t n, fw_frame *frame) {
  if (n < FW_HEADER + 2 || n > FW_MAX_FRAME || bytes[8] != n - FW_HEADER - 2) return false;
  if (fw_crc16(bytes, n - 2) != fw_get_u16(bytes + n - 2)) return false;
  frame->version = bytes[0];
  frame->type = bytes[1];
  frame->nonce = fw_get_u32(bytes + 2);
  frame->sequence = fw_get_u16(bytes + 6);
  frame->length = bytes[8];
  memcpy(frame->payload, bytes + FW_HEADER, frame->length);
  return true;
}

bool fw_receive(fw_receiver *receiver, uint8_t byte, fw_frame *frame) {
  bool sound = false;
  if (byte != 0) {
    if (receiver->count == FW_MAX_COBS)
      receiver->overflow = true;
    else
      receiver->bytes[receiver->count++] = byte;
    return false;
  }
  if (receiver->count > 0 && !receiver->overflow)
    sound = parse(receiver->bytes, undo_cobs(receiver->bytes, receiver->count), frame);
  receiver->count = 0;
  receiver->overflow = false;
  return sound;
}
