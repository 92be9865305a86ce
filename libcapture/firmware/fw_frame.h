/* Frames of PROTOCOL.md, section 1. C99, no allocation, no operating system. */
#ifndef LUMIHULL_FW_FRAME_H
#define LUMIHULL_FW_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FW_VERSION 1
#define FW_HEADER 9
#define FW_MAX_PAYLOAD 64
#define FW_MAX_FRAME (FW_HEADER + FW_MAX_PAYLOAD + 2)
#define FW_MAX_COBS (FW_MAX_FRAME + 1)
#define FW_MAX_WIRE (FW_MAX_COBS + 2) /* a zero on either side */

typedef struct {
  uint8_t version;
  uint8_t type;
  uint32_t nonce;
  uint16_t sequence;
  uint8_t length; /* 0 ... FW_MAX_PAYLOAD */
  uint8_t payload[FW_MAX_PAYLOAD];
} fw_frame;

/* Collects the bytes between two zeros. All zero = empty. */
typedef struct {
  uint8_t bytes[FW_MAX_COBS];
  uint8_t count;
  bool overflow; /* too long: everything up to the next zero is forgotten */
} fw_receiver;

/* CRC-16/CCITT-FALSE; of "123456789" it is 0x29B1. */
uint16_t fw_crc16(const uint8_t *bytes, size_t n);

/* The bytes on the line; returns their number, at most FW_MAX_WIRE. frame->length must be in its range. */
size_t fw_encode(const fw_frame *frame, uint8_t wire[FW_MAX_WIRE]);

/* Takes one byte from the line; true when it completed a sound frame, which is then in *frame. */
bool fw_receive(fw_receiver *receiver, uint8_t byte, fw_frame *frame);

/* Little-endian numbers in payloads. */
uint16_t fw_get_u16(const uint8_t *at);
uint32_t fw_get_u32(const uint8_t *at);
int32_t fw_get_i32(const uint8_t *at);
void fw_put_u16(uint8_t *at, uint16_t value);
void fw_put_u32(uint8_t *at, uint32_t value);

#endif
