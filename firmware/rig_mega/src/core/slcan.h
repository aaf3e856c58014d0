// SLCAN, the Lawicel ASCII protocol: CAN frames as text lines over a serial line.
// Lawicel CANUSB manual, 2008; python-can, slcand and SavvyCAN speak it.
#pragma once

#include <stdint.h>

#include "can_frame.h"

namespace rig {
namespace slcan {

constexpr uint8_t kLongestLine = 26;            // T, 8 of id, length, 16 of data
constexpr uint8_t kLongestFrame = 5 + 16 + 4 + 1;  // t, 3 of id, length, data, stamp, CR
constexpr uint8_t kOk = '\r';
constexpr uint8_t kBell = 0x07;

enum class Kind : uint8_t {
  kNothing,        // an incomplete or an empty line
  kBad,            // a line that is none of ours
  kOpen,
  kClose,
  kBitRate,
  kTimestampsOff,
  kTimestampsOn,
  kVersion,
  kSerialNumber,
  kStatus,
  kFrame,          // a standard data frame: the only kind the rig listens to
  kOtherFrame,     // well-formed, but extended or remote
};

// Collects bytes into lines; immune to garbage, over-long lines and missing line ends.
class Parser {
 public:
  // Feeds one byte; on the end of a line says what it was, `frame` is then set for kFrame.
  Kind feed(uint8_t byte, CanFrame &frame);

 private:
  Kind parse(CanFrame &frame) const;

  uint8_t line_[kLongestLine] = {};
  uint8_t length_ = 0;
  bool too_long_ = false;
};

// Writes the line of a frame to `out` (kLongestFrame bytes); returns its length.
uint8_t format(const CanFrame &frame, bool stamped, uint16_t stamp_ms, uint8_t *out);

}  // namespace slcan
}  // namespace rig
