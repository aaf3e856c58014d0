// The HX711's two wires: data ready, then 24 bits and one clock more for channel A at gain 128.
#pragma once

#include <stdint.h>

namespace rig {
namespace mega {

void hx711_begin();
bool hx711_ready();
// Only when ready.
uint32_t hx711_read();

}  // namespace mega
}  // namespace rig
