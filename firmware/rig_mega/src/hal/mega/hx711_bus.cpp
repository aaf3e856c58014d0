#include "hx711_bus.h"

#include <avr/io.h>
#include <util/atomic.h>

#include "pins.h"

namespace rig {
namespace mega {

namespace {

constexpr uint8_t kBits = 24;

// A clock that stays high for 60 us puts the chip to sleep: no interrupt inside the pulse.
bool clock_bit() {
  bool bit;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    PORTC |= kHx711Clock;
    __builtin_avr_delay_cycles(16);
    bit = (PINC & kHx711Data) != 0;
    PORTC &= static_cast<uint8_t>(~kHx711Clock);
  }
  __builtin_avr_delay_cycles(12);
  return bit;
}

}  // namespace

void hx711_begin() {
  DDRC |= kHx711Clock;
  PORTC &= static_cast<uint8_t>(~kHx711Clock);
  PORTC |= kHx711Data;  // pull-up: a missing chip is never ready
}

bool hx711_ready() { return (PINC & kHx711Data) == 0; }

uint32_t hx711_read() {
  uint32_t word = 0;
  for (uint8_t i = 0; i < kBits; ++i) word = word << 1 | (clock_bit() ? 1u : 0u);
  clock_bit();
  return word;
}

void hx711_power(bool on) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (on) {
      PORTC &= static_cast<uint8_t>(~kHx711Clock);
    } else {
      PORTC |= kHx711Clock;
    }
  }
}

}  // namespace mega
}  // namespace rig
