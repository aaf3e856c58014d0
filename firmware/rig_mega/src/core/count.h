// Counters that stay at their highest value rather than start over.
#pragma once

#include <stdint.h>

namespace rig {

inline void increment(uint16_t &counter) {
  if (counter != 0xFFFF) ++counter;
}

}  // namespace rig
