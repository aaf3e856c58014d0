#include "reset.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "pins.h"

namespace rig {
namespace mega {

namespace {

uint8_t flags __attribute__((section(".noinit")));

// The Mega's bootloader erases the flags before the sketch sees them. Memory outlives every reset
// but the loss of power, so what happened is written there too.
enum Mark : uint16_t { kRunning = 0x5AA5, kHung = 0xC33C };
volatile uint16_t mark __attribute__((section(".noinit")));

ResetCause remembered_cause() {
  if (mark == kHung) return ResetCause::kWatchdog;
  return mark == kRunning ? ResetCause::kUnknown : ResetCause::kPowerOn;
}

ResetCause flagged_cause() {
  if (flags & _BV(WDRF)) return ResetCause::kWatchdog;
  // at power-on the supply also passes through brown-out
  if (flags & _BV(PORF)) return ResetCause::kPowerOn;
  if (flags & _BV(BORF)) return ResetCause::kBrownOut;
  if (flags & _BV(EXTRF)) return ResetCause::kExternal;
  return remembered_cause();
}

}  // namespace

// Before anything else: a watchdog that fired stays on, at its shortest period.
extern "C" void rig_keep_reset_flags() __attribute__((naked, used, section(".init3")));
extern "C" void rig_keep_reset_flags() {
  flags = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

ResetCause reset_cause() {
  const ResetCause cause = flagged_cause();
  mark = kRunning;
  return cause;
}

// 60 ms to the interrupt, 60 ms more to the reset, which comes even if interrupts are off.
void watchdog_begin() {
  wdt_enable(WDTO_60MS);
  WDTCSR |= _BV(WDIE);
}

// The main loop hangs: vent without it, and remember why the reset follows.
ISR(WDT_vect) {
  TIMSK1 = 0;
  PORTA = kSafe;
  mark = kHung;
  for (;;) {
  }
}

}  // namespace mega
}  // namespace rig
