// The HX711's two wires: data ready, then 24 bits and one clock more for channel A at gain 128.
#pragma once

#include <stdint.h>

namespace rig {
namespace mega {

void hx711_begin();
bool hx711_ready();
// Only when ready.
uint32_t hx711_read();
// Off for 60 us or longer and on again is a restart: channel A, gain 128, bits in step.
void hx711_power(bool on);

}  // namespace mega
}  // namespace rig
