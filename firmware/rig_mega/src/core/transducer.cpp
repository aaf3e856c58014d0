#include "transducer.h"

#include "tick.h"

namespace rig {

namespace {

constexpr float kAdcCounts = 1024;
// An ADC rounds down: a conversion stands for the middle of its step.
constexpr float kHalfCount = 0.5f;

bool differ(Voltage a, Voltage b) { return a < b || a > b; }

}  // namespace

void Transducer::configure(const Parameters &parameters) {
  constexpr float kPerTick = kTicksPerSecond / (kRateTicks - 1);
  gain_kpa_v_ = parameters.transducer_gain_kpa_v();
  rate_gain_kpa_s_v_ = gain_kpa_v_ * kPerTick;
  const Voltage offset = parameters.transducer_offset();
  const Voltage reference = parameters.adc_reference();
  if (differ(offset, offset_) || differ(reference, reference_)) {
    shift_ = {};
    zeroed_ = false;
  }
  offset_ = offset;
  reference_ = reference;
  volts_per_count_ = to_volts(reference) / kAdcCounts;
  scales_[0] = scales_[1] = {};
  find_zero();
}

float Transducer::volts_per_sum(uint8_t count) {
  Scale &scale = scales_[count % 2];
  if (scale.count != count) scale = {count, volts_per_count_ / static_cast<float>(count)};
  return scale.volts;
}

void Transducer::sample(uint32_t sum, uint8_t count) {
  if (count != 0) {
    const float mean_volts = static_cast<float>(sum) * volts_per_sum(count);
    tick_ = volts(mean_volts + kHalfCount * volts_per_count_);
  }
  if (!filled_ && count != 0) {
    for (Voltage &v : recent_) v = tick_;
    for (Voltage &v : history_) v = tick_;
    filled_ = true;
  }
  recent_[next_recent_] = tick_;
  next_recent_ = static_cast<uint8_t>((next_recent_ + 1) % kFilterTicks);
  Voltage sum_v = recent_[0];
  for (uint8_t i = 1; i < kFilterTicks; ++i) sum_v += recent_[i];
  filtered_ = sum_v * (1.0f / kFilterTicks);
  pressure_ = pressure_of(filtered_);
  history_[next_history_] = filtered_;
  next_history_ = static_cast<uint8_t>((next_history_ + 1) % kRateTicks);
}

PressureRate Transducer::rate() const {
  return kpa_s(rate_gain_kpa_s_v_ * to_volts(filtered_ - history_[next_history_]));
}

bool Transducer::zero(Voltage at_ambient, Pressure limit) {
  const Voltage shift = at_ambient - offset_;
  if (magnitude(kpa(gain_kpa_v_ * to_volts(shift))) > limit) return false;
  shift_ = shift;
  zeroed_ = true;
  find_zero();
  return true;
}

}  // namespace rig
