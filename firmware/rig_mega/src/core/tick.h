// The one clock of the firmware: a tick of 2 ms. Time is counted in ticks, never read.
#pragma once

#include <stdint.h>

#include "units.h"

namespace rig {

constexpr uint32_t kTickMs = 2;
constexpr Duration kTick = seconds(0.002f);

constexpr uint32_t ticks_of_ms(uint32_t ms) { return ms / kTickMs; }

inline uint32_t ticks_of(Duration t) {
  return static_cast<uint32_t>(to_seconds(t) / to_seconds(kTick) + 0.5f);
}

}  // namespace rig
