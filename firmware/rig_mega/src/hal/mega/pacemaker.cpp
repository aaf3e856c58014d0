#include "pacemaker.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "adc.h"
#include "pins.h"

namespace rig {
namespace mega {

namespace {

// A compare value this close ahead of the counter, or behind it, would be missed for 32 ms.
constexpr int16_t kSoonest = 8;
// Drivers want a pulse 2 us long; working out when the next one is due takes as long.
constexpr uint32_t kPulseRest = 16;

StepSchedule planned = kNoSteps;
StepSchedule running = kNoSteps;  // `count` is what is left
uint8_t step_fraction;           // of a timer tick, by which the next step is due later
TickSample sample_waiting;

int16_t signed_steps(const StepSchedule &schedule) {
  const int16_t count = static_cast<int16_t>(schedule.count);
  return schedule.inward ? count : static_cast<int16_t>(-count);
}

StepSchedule merged(const StepSchedule &a, const StepSchedule &b) {
  const int16_t sum = static_cast<int16_t>(signed_steps(a) + signed_steps(b));
  if (sum == 0) return kNoSteps;
  const uint16_t count = static_cast<uint16_t>(sum > 0 ? sum : -sum);
  const uint16_t interval = kTimerTicksPerTick / count;
  return {sum > 0, count, static_cast<uint16_t>(interval / 2),
          static_cast<uint32_t>(interval) * kIntervalScale};
}

void step_at(uint16_t when) {
  const uint16_t soonest = static_cast<uint16_t>(TCNT1 + kSoonest);
  if (static_cast<int16_t>(when - soonest) < 0) when = soonest;
  OCR1A = when;
}

}  // namespace

volatile uint8_t ticks_waiting;

void pacemaker_begin() {
  TCCR1A = 0;
  TCCR1B = _BV(CS11);  // 16 MHz / 8, no wave form
  OCR1B = static_cast<uint16_t>(TCNT1 + kTimerTicksPerTick);
  TIFR1 = _BV(OCF1A) | _BV(OCF1B);
  TIMSK1 = _BV(OCIE1B);
}

bool tick_due(TickSample &sample) {
  bool due = false;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (ticks_waiting != 0) {
      ticks_waiting = static_cast<uint8_t>(ticks_waiting - 1);
      sample = sample_waiting;
      due = true;
    }
  }
  return due;
}

void plan_steps(const StepSchedule &schedule) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    planned = planned.count == 0 ? schedule : merged(planned, schedule);
  }
}

ISR(TIMER1_COMPB_vect) {
  const uint16_t start = OCR1B;
  OCR1B = static_cast<uint16_t>(start + kTimerTicksPerTick);
  // steps are only left over if interrupts were late
  running = running.count == 0 ? planned : merged(running, planned);
  planned = kNoSteps;
  if (running.count != 0) {
    if (running.inward) {
      PORTA |= kDirection;
    } else {
      PORTA &= static_cast<uint8_t>(~kDirection);
    }
    step_fraction = 0;
    step_at(static_cast<uint16_t>(start + running.first));
    TIFR1 = _BV(OCF1A);
    TIMSK1 |= _BV(OCIE1A);
  }
  adc_collect(sample_waiting.adc_sum, sample_waiting.adc_count);
  ticks_waiting = static_cast<uint8_t>(ticks_waiting + 1);
}

ISR(TIMER1_COMPA_vect) {
  PORTA |= kStep;
  const uint16_t left = static_cast<uint16_t>(running.count - 1);
  running.count = left;
  if (left == 0) {
    TIMSK1 &= static_cast<uint8_t>(~_BV(OCIE1A));
    __builtin_avr_delay_cycles(kPulseRest);
  } else {
    const uint8_t before = step_fraction;
    step_fraction = static_cast<uint8_t>(before + (running.interval & 0xFF));
    const uint16_t interval = static_cast<uint16_t>(running.interval >> 8);
    step_at(static_cast<uint16_t>(OCR1A + interval + (step_fraction < before ? 1 : 0)));
  }
  PORTA &= static_cast<uint8_t>(~kStep);
}

}  // namespace mega
}  // namespace rig
