// A leak, or a transducer that no longer sees the system: the plunger pushes, pressure does not
// rise. It counts the volume pushed in since the pressure last rose, or the plunger last turned.
#pragma once

#include <stdint.h>

#include "faults.h"
#include "tick.h"
#include "units.h"

namespace rig {

// Far above the noise of the reading (0.005 kPa), far below what the limit causes in a sound system
// (3 mL are 2 kPa and more).
constexpr Pressure kSoundRise = kpa(0.2f);
// Noise at the transducer may look like a rise, and last as long as the filter remembers it.
constexpr uint8_t kSpikeTicks = ticks_of_ms(20);

class LeakMonitor {
 public:
  void start(Volume plunger, Pressure pressure) {
    plunger_ = plunger;
    risen_ = pressure + kSoundRise;
    young_ticks_ = 0;
  }

  Finding tick(Volume plunger, Pressure pressure, Volume limit) {
    if (plunger < plunger_ || pressure > risen_) start(plunger, pressure);
    if (young_ticks_ < kSpikeTicks) {
      ++young_ticks_;
      if (pressure + kSoundRise < risen_) risen_ = pressure + kSoundRise;
    }
    const Volume pushed = plunger - plunger_;
    if (pushed > limit) return {Fault::kLeak, to_ml(pushed)};
    return kNoFinding;
  }

 private:
  Volume plunger_ = {};
  Pressure risen_ = {};
  uint8_t young_ticks_ = 0;  // since `start`
};

}  // namespace rig
