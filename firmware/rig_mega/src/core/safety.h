// The state of the board, the latched fault, and which command is allowed when.
#pragma once

#include <stdint.h>

#include "faults.h"
#include "generated/rig.h"

namespace rig {

enum class State : uint8_t {
  kBoot = RIG_HEARTBEAT_STATE_BOOT_CHOICE,
  kIdle = RIG_HEARTBEAT_STATE_IDLE_CHOICE,
  kHoming = RIG_HEARTBEAT_STATE_HOMING_CHOICE,
  kHold = RIG_HEARTBEAT_STATE_HOLD_CHOICE,
  kRun = RIG_HEARTBEAT_STATE_RUN_CHOICE,
  kVent = RIG_HEARTBEAT_STATE_VENT_CHOICE,
  kFault = RIG_HEARTBEAT_STATE_FAULT_CHOICE,
};

enum class Opcode : uint8_t {
  kNone = RIG_COMMAND_OPCODE_NONE_CHOICE,
  kSetPressure = RIG_COMMAND_OPCODE_SET_PRESSURE_CHOICE,
  kHold = RIG_COMMAND_OPCODE_HOLD_CHOICE,
  kVent = RIG_COMMAND_OPCODE_VENT_CHOICE,
  kZeroPressure = RIG_COMMAND_OPCODE_ZERO_PRESSURE_CHOICE,
  kTare = RIG_COMMAND_OPCODE_TARE_CHOICE,
  kHome = RIG_COMMAND_OPCODE_HOME_CHOICE,
  kJog = RIG_COMMAND_OPCODE_JOG_CHOICE,
  kClearFault = RIG_COMMAND_OPCODE_CLEAR_FAULT_CHOICE,
  kIdle = RIG_COMMAND_OPCODE_IDLE_CHOICE,
};

enum class CommandResult : uint8_t {
  kAccepted = RIG_HEARTBEAT_COMMAND_RESULT_ACCEPTED_CHOICE,
  kUnknownOpcode = RIG_HEARTBEAT_COMMAND_RESULT_UNKNOWN_OPCODE_CHOICE,
  kOutOfRange = RIG_HEARTBEAT_COMMAND_RESULT_OUT_OF_RANGE_CHOICE,
  kWrongState = RIG_HEARTBEAT_COMMAND_RESULT_WRONG_STATE_CHOICE,
  kNotHomed = RIG_HEARTBEAT_COMMAND_RESULT_NOT_HOMED_CHOICE,
  kFaulted = RIG_HEARTBEAT_COMMAND_RESULT_FAULTED_CHOICE,
  kBusy = RIG_HEARTBEAT_COMMAND_RESULT_BUSY_CHOICE,
  kNotFinite = RIG_HEARTBEAT_COMMAND_RESULT_NOT_FINITE_CHOICE,
  kNotZeroed = RIG_HEARTBEAT_COMMAND_RESULT_NOT_ZEROED_CHOICE,
};

// Whether the state alone allows a command.
CommandResult permitted(Opcode opcode, State state);

class Safety {
 public:
  State state() const { return state_; }
  Fault fault() const { return finding_.fault; }
  float fault_value() const { return finding_.value; }
  uint32_t fault_ticks() const { return fault_ticks_; }  // since it was found

  bool valve_open() const;
  // The host is answerable for the bench: it must keep talking.
  bool needs_host() const;

  void enter(State state) { state_ = state; }

  // The first fault stays until it is cleared; false if one stood already.
  bool latch(const Finding &finding);
  void clear();
  void tick() {
    if (state_ == State::kFault) ++fault_ticks_;
  }

 private:
  State state_ = State::kBoot;
  Finding finding_ = kNoFinding;
  uint32_t fault_ticks_ = 0;
};

}  // namespace rig
