#include "crc.h"

namespace rig {

namespace {

constexpr uint8_t kPolynomial8 = 0x1D;
constexpr uint16_t kPolynomial16 = 0x1021;

constexpr uint8_t shifted(uint8_t crc) {
  return static_cast<uint8_t>(crc << 1 ^ ((crc & 0x80) != 0 ? kPolynomial8 : 0));
}

constexpr uint8_t nibble_remainder(uint8_t nibble) {
  return shifted(shifted(shifted(shifted(static_cast<uint8_t>(nibble << 4)))));
}

// Half a byte at a time: 16 bytes of table instead of 256, of which the Mega has few.
constexpr uint8_t kTable8[16] = {
    nibble_remainder(0),  nibble_remainder(1),  nibble_remainder(2),  nibble_remainder(3),
    nibble_remainder(4),  nibble_remainder(5),  nibble_remainder(6),  nibble_remainder(7),
    nibble_remainder(8),  nibble_remainder(9),  nibble_remainder(10), nibble_remainder(11),
    nibble_remainder(12), nibble_remainder(13), nibble_remainder(14), nibble_remainder(15)};

}  // namespace

uint8_t crc8_update(uint8_t crc, uint8_t byte) {
  crc = static_cast<uint8_t>(crc ^ byte);
  crc = static_cast<uint8_t>((crc << 4) ^ kTable8[crc >> 4]);
  return static_cast<uint8_t>((crc << 4) ^ kTable8[crc >> 4]);
}

uint8_t crc8_j1850(const uint8_t *data, size_t size) {
  uint8_t crc = kCrc8Start;
  for (size_t i = 0; i < size; ++i) crc = crc8_update(crc, data[i]);
  return static_cast<uint8_t>(crc ^ kCrc8Xor);
}

uint16_t crc16_ccitt_false(const uint8_t *data, size_t size) {
  uint16_t crc = 0xFFFF;
  for (size_t i = 0; i < size; ++i) {
    crc = static_cast<uint16_t>(crc ^ (static_cast<uint16_t>(data[i]) << 8));
    for (uint8_t bit = 0; bit < 8; ++bit) {
      const bool carry = (crc & 0x8000u) != 0;
      crc = static_cast<uint16_t>(crc << 1);
      if (carry) crc = static_cast<uint16_t>(crc ^ kPolynomial16);
    }
  }
  return crc;
}

}  // namespace rig
