#include "e2e.h"

#include "crc.h"

namespace rig {

uint8_t frame_crc(const CanFrame &frame) {
  uint8_t crc = crc8_update(kCrc8Start, static_cast<uint8_t>(frame.id & 0xFF));
  crc = crc8_update(crc, static_cast<uint8_t>(frame.id >> 8));
  for (uint8_t i = 1; i < 8; ++i) crc = crc8_update(crc, frame.data[i]);
  return static_cast<uint8_t>(crc ^ kCrc8Xor);
}

void protect(CanFrame &frame, uint8_t alive) {
  frame.data[1] = static_cast<uint8_t>((frame.data[1] & 0xF0) | (alive & 0x0F));
  frame.data[0] = frame_crc(frame);
}

Reception AliveCheck::judge(const CanFrame &frame) {
  const uint8_t alive = frame.data[1] & 0x0F;
  if (frame.length != 8 || alive >= kAliveCount || frame.data[0] != frame_crc(frame)) {
    return Reception::kCorrupt;
  }
  if (alive == last_) return Reception::kRepeated;
  last_ = alive;
  return Reception::kFresh;
}

}  // namespace rig
