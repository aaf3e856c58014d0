// Which pin is what. Switches are normally closed to ground with the pull-up on: pressed, or a
// broken wire, reads high.
#pragma once

#include <avr/io.h>

namespace rig {
namespace mega {

// Port A, digital pins 22 to 28.
constexpr uint8_t kStep = _BV(PA0);         // D22
constexpr uint8_t kDirection = _BV(PA1);    // D23, high pushes air in
constexpr uint8_t kMotorOff = _BV(PA2);     // D24, the driver's enable is active low
constexpr uint8_t kValve = _BV(PA3);        // D25, high opens
constexpr uint8_t kHomeSwitch = _BV(PA4);   // D26
constexpr uint8_t kEndSwitch = _BV(PA5);    // D27
constexpr uint8_t kEmergencyStop = _BV(PA6);  // D28

// Motor off, valve open, pull-ups of the switches on.
constexpr uint8_t kSafe = kMotorOff | kValve | kHomeSwitch | kEndSwitch | kEmergencyStop;

// Port C, digital pins 30 and 31.
constexpr uint8_t kHx711Data = _BV(PC7);    // D30
constexpr uint8_t kHx711Clock = _BV(PC6);   // D31

// The transducer is on A0, channel 0 of the converter.
constexpr uint8_t kPressureChannel = 0;

}  // namespace mega
}  // namespace rig
