// The one clock of the firmware: a tick of 2 ms. Time is counted in ticks, never read.
#pragma once

#include <stdint.h>

#include "units.h"

namespace rig {

constexpr uint32_t kTickMs = 2;
constexpr Duration kTick = seconds(0.002f);
constexpr float kTicksPerSecond = 500;

constexpr uint32_t ticks_of_ms(uint32_t ms) { return ms / kTickMs; }

inline uint32_t ticks_of(Duration t) {
  // never negative, and minutes at most
  return static_cast<uint32_t>(to_seconds(t) * kTicksPerSecond + 0.5f);  // NOLINT(bugprone-incorrect-roundings)
}

inline Duration duration_of(uint32_t ticks) {
  return seconds(static_cast<float>(ticks) * to_seconds(kTick));
}

// Rates by multiplication: a division takes the Mega three times as long.
inline Flow per_tick(Volume v) { return ml_s(to_ml(v) * kTicksPerSecond); }
inline PressureRate per_tick(Pressure p) { return kpa_s(to_kpa(p) * kTicksPerSecond); }

}  // namespace rig
