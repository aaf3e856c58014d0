// Watches the transducer: open or short circuit, frozen, too high, too fast.
#pragma once

#include <stdint.h>

#include "debounce.h"
#include "faults.h"
#include "parameters.h"
#include "transducer.h"
#include "units.h"

namespace rig {

struct PressureScene {
  bool converted;         // the ADC delivered conversions this tick
  bool closed;            // the valve is closed: pressure can only change by the plunger
  Volume plunger;
};

class PressureMonitor {
 public:
  void configure(const Parameters &parameters);

  Finding tick(const Transducer &transducer, const PressureScene &scene);

  // False as soon as the voltage cannot be the transducer's, before a fault is latched.
  bool plausible() const { return plausible_; }

 private:
  Finding rails(const Transducer &transducer, bool converted);
  Finding frozen(const Transducer &transducer, const PressureScene &scene);
  Finding rate(const Transducer &transducer, bool closed);

  // Rails before rate: a broken wire also looks like an implausible rate.
  Debounce<5> open_;
  Debounce<5> short_;
  Debounce<3> over_;
  Debounce<8> fast_;
  uint16_t settling_ticks_ = 0;  // after the valve moved the gas may move at any rate
  bool was_closed_ = false;
  bool plausible_ = false;

  Voltage frozen_voltage_ = {};
  Volume frozen_plunger_ = {};
  uint32_t frozen_ticks_ = 0;

  Voltage lowest_ = {};
  Voltage highest_ = {};
  Pressure limit_ = {};
  PressureRate rate_limit_ = {};
  uint32_t stuck_ticks_ = 0;
  Volume stuck_volume_ = {};
};

}  // namespace rig
