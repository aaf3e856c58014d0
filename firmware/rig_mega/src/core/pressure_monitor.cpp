#include "pressure_monitor.h"

#include "tick.h"

namespace rig {

namespace {

constexpr Voltage kRailMargin = volts(0.06f);
constexpr uint16_t kValveSettlingTicks = ticks_of_ms(500);
// Readings of a live transducer differ from tick to tick; a frozen one repeats to the last bit.
constexpr Voltage kFrozenBand = volts(1e-5f);
// The plunger movement that a live transducer must show.
constexpr Pressure kVisible = kpa(0.5f);

}  // namespace

void PressureMonitor::configure(const Parameters &parameters) {
  const Voltage offset = parameters.transducer_offset();
  lowest_ = offset * 0.5f < kRailMargin ? offset * 0.5f : kRailMargin;
  highest_ = parameters.adc_reference() - kRailMargin;
  limit_ = parameters.pressure_limit();
  rate_limit_ = parameters.pressure_rate_limit();
  stuck_ticks_ = ticks_of(parameters.stuck_time());
  stuck_volume_ = parameters.system_volume() * (kVisible / parameters.ambient_pressure());
}

Finding PressureMonitor::tick(const Transducer &transducer, const PressureScene &scene) {
  const Finding rail = rails(transducer, scene.converted);
  if (rail.fault != Fault::kNone) return rail;
  const Pressure now = transducer.tick_pressure();
  if (over_(plausible_ && now > limit_)) return {Fault::kOverPressure, to_kpa(now)};
  const Finding fast = rate(transducer, scene.closed);
  if (fast.fault != Fault::kNone) return fast;
  return frozen(transducer, scene);
}

Finding PressureMonitor::rails(const Transducer &transducer, bool converted) {
  const Voltage voltage = transducer.tick_voltage();
  const bool low = !converted || voltage < lowest_;
  const bool high = converted && voltage > highest_;
  plausible_ = !low && !high;
  if (open_(low)) return {Fault::kSensorOpen, to_volts(voltage)};
  if (short_(high)) return {Fault::kSensorShort, to_volts(voltage)};
  return kNoFinding;
}

Finding PressureMonitor::rate(const Transducer &transducer, bool closed) {
  if (closed != was_closed_) settling_ticks_ = kValveSettlingTicks;
  was_closed_ = closed;
  if (settling_ticks_ > 0) --settling_ticks_;
  const bool watched = closed && settling_ticks_ == 0 && plausible_;
  const PressureRate rate = transducer.rate();
  if (fast_(watched && magnitude(rate) > rate_limit_)) {
    return {Fault::kRateImplausible, to_kpa_s(rate)};
  }
  return kNoFinding;
}

Finding PressureMonitor::frozen(const Transducer &transducer, const PressureScene &scene) {
  const Voltage voltage = transducer.tick_voltage();
  if (!scene.closed || magnitude(voltage - frozen_voltage_) > kFrozenBand) {
    frozen_voltage_ = voltage;
    frozen_plunger_ = scene.plunger;
    frozen_ticks_ = 0;
    return kNoFinding;
  }
  ++frozen_ticks_;
  if (frozen_ticks_ >= stuck_ticks_ &&
      magnitude(scene.plunger - frozen_plunger_) > stuck_volume_) {
    return {Fault::kSensorStuck, to_seconds(duration_of(frozen_ticks_))};
  }
  return kNoFinding;
}

}  // namespace rig
