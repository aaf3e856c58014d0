// The faults of rig.dbc and where each one leaves the bench.
#pragma once

#include <stdint.h>

#include "generated/rig.h"

namespace rig {

enum class Fault : uint8_t {
  kNone = RIG_FAULT_CODE_NONE_CHOICE,
  kOverPressure = RIG_FAULT_CODE_OVER_PRESSURE_CHOICE,
  kSensorOpen = RIG_FAULT_CODE_SENSOR_OPEN_CHOICE,
  kSensorShort = RIG_FAULT_CODE_SENSOR_SHORT_CHOICE,
  kSensorStuck = RIG_FAULT_CODE_SENSOR_STUCK_CHOICE,
  kRateImplausible = RIG_FAULT_CODE_RATE_IMPLAUSIBLE_CHOICE,
  kLeak = RIG_FAULT_CODE_LEAK_CHOICE,
  kTravelLimit = RIG_FAULT_CODE_TRAVEL_LIMIT_CHOICE,
  kHx711Timeout = RIG_FAULT_CODE_HX711_TIMEOUT_CHOICE,
  kHx711Desync = RIG_FAULT_CODE_HX711_DESYNC_CHOICE,
  kCommunicationLost = RIG_FAULT_CODE_COMMUNICATION_LOST_CHOICE,
  kWatchdogReset = RIG_FAULT_CODE_WATCHDOG_RESET_CHOICE,
  kEmergencyStop = RIG_FAULT_CODE_EMERGENCY_STOP_CHOICE,
  kBrownOut = RIG_FAULT_CODE_BROWN_OUT_CHOICE,
  kParametersCorrupt = RIG_FAULT_CODE_PARAMETERS_CORRUPT_CHOICE,
  kHomingFailed = RIG_FAULT_CODE_HOMING_FAILED_CHOICE,
};

// After these the plunger must not, or cannot be trusted to, move by itself.
constexpr bool plunger_may_retract(Fault fault) {
  return fault != Fault::kEmergencyStop && fault != Fault::kHomingFailed &&
         fault != Fault::kWatchdogReset && fault != Fault::kBrownOut &&
         fault != Fault::kParametersCorrupt;
}

struct Finding {
  Fault fault;
  float value;  // in the unit of the fault's entry in firmware/README.md
};

constexpr Finding kNoFinding = {Fault::kNone, 0.0f};

}  // namespace rig
