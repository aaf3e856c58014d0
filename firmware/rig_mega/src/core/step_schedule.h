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
// after a reversal), `travel` the positive distance of this tick in steps; together at least one step.
inline StepSchedule schedule_steps(bool inward, float phase, float travel) {
  const float end = phase + travel;
  const uint16_t count = static_cast<uint16_t>(end);
  const float interval = static_cast<float>(kTimerTicksPerTick) / travel;
  const float first = (1.0f - phase) * interval;
  // rounding down keeps the last step inside its tick
  const float scaled = (interval < 65535.0f ? interval : 65535.0f) * kIntervalScale;
  return {inward, count, static_cast<uint16_t>(first), static_cast<uint32_t>(scaled)};
}

// How many of the steps fall before `timer_ticks` after the start of the tick.
inline uint16_t steps_before(const StepSchedule &schedule, uint16_t timer_ticks) {
  if (schedule.count == 0 || schedule.first >= timer_ticks) return 0;
  const uint32_t since_first = static_cast<uint32_t>(timer_ticks - schedule.first) * kIntervalScale;
  const uint16_t passed = static_cast<uint16_t>(1 + (since_first - 1) / schedule.interval);
  return passed < schedule.count ? passed : schedule.count;
}

}  // namespace rig
