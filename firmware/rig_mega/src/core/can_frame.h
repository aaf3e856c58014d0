// A standard CAN data frame.
#pragma once

#include <stdint.h>

namespace rig {

struct CanFrame {
  uint16_t id;
  uint8_t length;
  uint8_t data[8];
};

}  // namespace rig
