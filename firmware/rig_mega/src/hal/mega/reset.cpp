#include "reset.h"

#include <avr/io.h>
#include <avr/wdt.h>

namespace rig {
namespace mega {

namespace {

uint8_t flags __attribute__((section(".noinit")));

}  // namespace

// Before anything else: a watchdog that fired stays on, at its shortest period.
extern "C" void rig_keep_reset_flags() __attribute__((naked, used, section(".init3")));
extern "C" void rig_keep_reset_flags() {
  flags = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

ResetCause reset_cause() {
  if (flags & _BV(WDRF)) return ResetCause::kWatchdog;
  // at power-on the supply also passes through brown-out
  if (flags & _BV(PORF)) return ResetCause::kPowerOn;
  if (flags & _BV(BORF)) return ResetCause::kBrownOut;
  if (flags & _BV(EXTRF)) return ResetCause::kExternal;
  return ResetCause::kUnknown;
}

void watchdog_begin() { wdt_enable(WDTO_120MS); }

}  // namespace mega
}  // namespace rig
