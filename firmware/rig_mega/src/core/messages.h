// The messages of rig.dbc as structures of the firmware, packed by the generated code.
// Frames come out without alive counter and CRC; e2e.h adds them.
#pragma once

#include <stdint.h>

#include "can_frame.h"
#include "hx711.h"
#include "parameters.h"
#include "safety.h"
#include "units.h"

namespace rig {

struct Heartbeat {
  State state;
  Fault fault;
  uint8_t command_number;
  CommandResult command_result;
  uint8_t reset_cause;
  bool home_switch, end_switch, emergency_stop;
  bool valve_open, motor_enabled;
  bool homed, zeroed, tared;
  uint16_t uptime_s;
};

struct PressureReport {
  bool plausible, saturated;
  Pressure pressure, setpoint;
  Volume plunger;
};

struct ControllerReport {
  Flow plunger_velocity, integral;
  Voltage transducer;
};

struct LoadCellReport {
  LoadCellStatus status;
  int32_t counts;
  uint16_t sample;
};

struct FaultReport {
  Fault code;
  float value;
  Duration age;
};

struct ParameterReport {
  ParameterResult result;
  uint8_t number, index;
  float value;
};

struct IdentityReport {
  uint8_t board_kind;
  uint32_t firmware_git;
};

CanFrame pack(const Heartbeat &message);
CanFrame pack(const PressureReport &message);
CanFrame pack(const ControllerReport &message);
CanFrame pack(const LoadCellReport &message);
CanFrame pack(const FaultReport &message);
CanFrame pack(const ParameterReport &message);
CanFrame pack(const IdentityReport &message);

struct Command {
  Opcode opcode;
  uint8_t number;
  float argument;
};

enum class ParameterOperation : uint8_t { kRead = 0, kWrite = 1, kSave = 2 };

struct ParameterRequest {
  ParameterOperation operation;
  uint8_t number, index;
  float value;
};

// The frame must have eight bytes and the id of the message.
Command unpack_command(const CanFrame &frame);
ParameterRequest unpack_parameter_request(const CanFrame &frame);
uint8_t unpack_protocol_version(const CanFrame &host_heartbeat);

}  // namespace rig
