#include "safety.h"

namespace rig {

namespace {

constexpr uint8_t in(State state) { return static_cast<uint8_t>(1u << static_cast<uint8_t>(state)); }

constexpr uint8_t kResting = in(State::kIdle) | in(State::kHold);
constexpr uint8_t kSeeking = in(State::kHoming) | in(State::kVent);
constexpr uint8_t kAnyButBoot = kResting | kSeeking | in(State::kRun) | in(State::kFault);

// The states in which each command makes sense, in the order of Opcode.
constexpr uint8_t kAllowed[] = {
    kAnyButBoot | in(State::kBoot),                                 // none
    kResting | in(State::kRun),                                     // set_pressure
    kResting | in(State::kRun),                                     // hold
    kResting | kSeeking | in(State::kRun),                          // vent
    in(State::kIdle) | in(State::kVent),                            // zero_pressure
    kResting | kSeeking | in(State::kRun),                          // tare
    kResting,                                                       // home
    kResting,                                                       // jog
    kAnyButBoot,                                                    // clear_fault
    kResting | kSeeking | in(State::kRun),                          // idle
};
constexpr uint8_t kOpcodes = sizeof(kAllowed) / sizeof(kAllowed[0]);
static_assert(kOpcodes == static_cast<uint8_t>(Opcode::kIdle) + 1, "one row for each opcode");

}  // namespace

CommandResult permitted(Opcode opcode, State state) {
  const uint8_t row = static_cast<uint8_t>(opcode);
  if (row >= kOpcodes) return CommandResult::kUnknownOpcode;
  if ((kAllowed[row] & in(state)) != 0) return CommandResult::kAccepted;
  if (state == State::kFault) return CommandResult::kFaulted;
  return (kSeeking & in(state)) != 0 ? CommandResult::kBusy : CommandResult::kWrongState;
}

bool Safety::valve_open() const { return state_ != State::kHold && state_ != State::kRun; }

bool Safety::needs_host() const { return (in(state_) & (kSeeking | in(State::kHold) | in(State::kRun))) != 0; }

bool Safety::latch(const Finding &finding) {
  if (finding_.fault != Fault::kNone) return false;
  finding_ = finding;
  fault_ticks_ = 0;
  state_ = State::kFault;
  return true;
}

void Safety::clear() {
  finding_ = kNoFinding;
  state_ = State::kIdle;
}

}  // namespace rig
