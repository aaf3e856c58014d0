// Checksums: CRC-8 SAE J1850 for frames, CRC-16/CCITT-FALSE for stored parameters.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace rig {

constexpr uint8_t kCrc8Start = 0xFF;
constexpr uint8_t kCrc8Xor = 0xFF;

// Continues a CRC-8; begin with kCrc8Start and XOR the end with kCrc8Xor.
uint8_t crc8_update(uint8_t crc, uint8_t byte);
uint8_t crc8_j1850(const uint8_t *data, size_t size);
uint16_t crc16_ccitt_false(const uint8_t *data, size_t size);

}  // namespace rig
