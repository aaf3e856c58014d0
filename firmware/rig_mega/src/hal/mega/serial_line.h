// UART 0, 115200 baud, both directions through rings filled and emptied by interrupts.
#pragma once

#include <stdint.h>

namespace rig {
namespace mega {

void serial_begin();
// False if nothing was received.
bool serial_read(uint8_t &byte);
bool serial_can_write();
// Only after serial_can_write.
void serial_write(uint8_t byte);

}  // namespace mega
}  // namespace rig
