// The converter on the transducer's pin: one conversion after another, started by software.
#pragma once

#include <stdint.h>

namespace rig {
namespace mega {

void adc_begin();

// Takes the conversions since the last call; with interrupts off.
void adc_collect(uint32_t &sum, uint8_t &count);

}  // namespace mega
}  // namespace rig
