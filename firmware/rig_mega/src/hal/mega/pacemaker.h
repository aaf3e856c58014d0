// Timer 1 runs freely at 2 MHz: compare B paces the ticks, compare A gives the steps. What one
// tick decides, the next carries out, so that steps are exact whatever the main loop does.
#pragma once

#include <stdint.h>

#include "../../core/step_schedule.h"

namespace rig {
namespace mega {

struct TickSample {
  uint32_t adc_sum;
  uint8_t adc_count;
};

void pacemaker_begin();

extern volatile uint8_t ticks_waiting;
// Asked after every interrupt, so without a call.
inline bool tick_waiting() { return ticks_waiting != 0; }

// True once for each tick, with the conversions made during it.
bool tick_due(TickSample &sample);

// The steps of the next tick. If the main loop was late and a plan is still waiting, both are given
// together: steps are never lost, for they are the plunger's position.
void plan_steps(const StepSchedule &schedule);

}  // namespace mega
}  // namespace rig
