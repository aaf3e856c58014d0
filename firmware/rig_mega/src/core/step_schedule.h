// The steps of one tick, evenly spaced, in units of an interval timer.
#pragma once

#include <stdint.h>

namespace rig {

constexpr uint16_t kTimerTicksPerTick = 4000;  // 0.5 us each: 16 MHz / 8

struct StepSchedule {
  bool inward;        // direction: pushes air into the actuator
  uint16_t count;
  uint16_t first;     // timer ticks from the start of the tick to the first step
  uint32_t interval;  // between steps, in 1/256 of a timer tick: whole ones add up over a tick
};

constexpr StepSchedule kNoSteps = {false, 0, 0, 0};
constexpr uint16_t kIntervalScale = 256;

// `phase` in (-1, 1) is the part of a step already travelled in the direction of motion (negative
// after a reversal), `travel` the positive distance of this tick in steps; `count`, of at least
// one, is the whole steps in both together.
inline StepSchedule schedule_steps(bool inward, uint16_t count, float phase, float travel) {
  constexpr float kScaledTick = static_cast<float>(kTimerTicksPerTick) * kIntervalScale;
  constexpr float kLongest = 65535.0f * kIntervalScale;
  const float interval = kScaledTick / travel;
  const uint32_t first = static_cast<uint32_t>((1.0f - phase) * interval);
  // rounding down keeps the last step inside its tick
  return {inward, count, static_cast<uint16_t>(first / kIntervalScale),
          static_cast<uint32_t>(interval < kLongest ? interval : kLongest)};
}

// How many of the steps fall before `timer_ticks` after the start of the tick.
inline uint16_t steps_before(const StepSchedule &schedule, uint16_t timer_ticks) {
  if (schedule.count == 0 || schedule.first >= timer_ticks) return 0;
  const uint32_t since_first = static_cast<uint32_t>(timer_ticks - schedule.first) * kIntervalScale;
  const uint16_t passed = static_cast<uint16_t>(1 + (since_first - 1) / schedule.interval);
  return passed < schedule.count ? passed : schedule.count;
}

}  // namespace rig
