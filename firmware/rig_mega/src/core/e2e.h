// End-to-end protection of frames (AUTOSAR E2E profile 1 in spirit): byte 0 holds CRC-8 SAE J1850
// over the id (low byte, high byte) and payload[1..7]; the low half of byte 1 an alive counter
// of 0 to 14 for each id.
#pragma once

#include <stdint.h>

#include "can_frame.h"

namespace rig {

constexpr uint8_t kAliveCount = 15;

uint8_t frame_crc(const CanFrame &frame);

// Writes `alive` and the CRC into an eight-byte frame.
void protect(CanFrame &frame, uint8_t alive);

enum class Reception : uint8_t { kFresh, kCorrupt, kRepeated };

// Judges the received frames of one id.
class AliveCheck {
 public:
  Reception judge(const CanFrame &frame);
  void forget() { last_ = kNone; }

 private:
  static constexpr uint8_t kNone = 0xFF;
  uint8_t last_ = kNone;
};

}  // namespace rig
