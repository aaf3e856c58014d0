// The pressure transducer: oversampled 10-bit conversions to a pressure and its rate of change.
//
// A tick averages 16 to 19 conversions, the filter four ticks (8 ms): with 0.8 LSB of noise that
// leaves 0.1 LSB, 13 effective bits.
#pragma once

#include <stdint.h>

#include "parameters.h"
#include "units.h"

namespace rig {

class Transducer {
 public:
  // Another offset or reference makes the zero unknown.
  void configure(const Parameters &parameters);

  // Takes the conversions of one tick; none at all keeps the last value.
  void sample(uint32_t sum, uint8_t count);

  Voltage tick_voltage() const { return tick_; }   // mean of this tick
  Voltage voltage() const { return filtered_; }    // mean of the filter
  Pressure tick_pressure() const { return pressure_of(tick_); }
  Pressure pressure() const { return pressure_; }
  PressureRate rate() const;

  // Moves the zero so that `at_ambient` reads 0 kPa; false if that is more than `limit` away.
  bool zero(Voltage at_ambient, Pressure limit);
  bool zeroed() const { return zeroed_; }
  // The old zero holds, but no longer counts as known: a new one is on its way.
  void doubt_zero() { zeroed_ = false; }

 private:
  void find_zero() {
    zero_ = kpa(gain_kpa_v_ * to_volts(offset_ + shift_));
    pressure_ = pressure_of(filtered_);
  }
  Pressure pressure_of(Voltage voltage) const {
    return kpa(gain_kpa_v_ * to_volts(voltage)) - zero_;
  }

  float volts_per_sum(uint8_t count);

  static constexpr uint8_t kFilterTicks = 4;
  static constexpr uint8_t kRateTicks = 8;

  float gain_kpa_v_ = 1;
  float rate_gain_kpa_s_v_ = 1;  // of a change over the history
  Voltage reference_ = {};
  float volts_per_count_ = 0;
  // Of a tick's sum, by its number of conversions: that changes between two neighbours, and a
  // division takes the Mega as long as four products.
  struct Scale {
    uint8_t count;
    float volts;
  };
  Scale scales_[2] = {};
  Voltage offset_ = {};
  Voltage shift_ = {};
  Pressure zero_ = {};  // what offset and shift amount to
  Voltage tick_ = {};
  Voltage filtered_ = {};
  Pressure pressure_ = {};
  Voltage recent_[kFilterTicks] = {};
  Voltage history_[kRateTicks] = {};  // filtered values, oldest at next_history_
  uint8_t next_recent_ = 0;
  uint8_t next_history_ = 0;
  bool filled_ = false;
  bool zeroed_ = false;
};

}  // namespace rig
