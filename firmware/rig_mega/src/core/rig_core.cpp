#include "rig_core.h"

#include "count.h"
#include "generated/rig.h"
#include "generated/schema.h"
#include "tick.h"

namespace rig {

namespace {

constexpr uint16_t kBootTicks = ticks_of_ms(50);  // the filters fill; over before the first heartbeat
constexpr uint16_t kSecondTicks = ticks_of_ms(1000);
constexpr uint8_t kHeartbeatTicks = ticks_of_ms(100);
constexpr uint8_t kPressureTicks = ticks_of_ms(20);
constexpr uint8_t kControllerTicks = ticks_of_ms(100);
constexpr uint8_t kCommandsAhead = 127;  // at most, of one that was lost before it
constexpr uint16_t kJogTicks = ticks_of_ms(500);
// With the home switch closed the plunger cannot be further in than this.
constexpr Volume kFalseHome = ml(1.0f);

Finding boot_finding(ResetCause cause, Parameters::Image image) {
  if (cause == ResetCause::kWatchdog) return {Fault::kWatchdogReset, 0.0f};
  if (cause == ResetCause::kBrownOut) return {Fault::kBrownOut, 0.0f};
  if (image == Parameters::Image::kCorrupt) return {Fault::kParametersCorrupt, 0.0f};
  return kNoFinding;
}

// Commands are numbered 1 to 255 and over again; after a start the first may have any number.
bool behind(uint8_t number, uint8_t last) {
  const uint8_t ahead = static_cast<uint8_t>(number >= last ? number - last : number + 255 - last);
  return last != 0 && ahead > kCommandsAhead;
}

// Counts up to `period`, then starts over and says so.
template <typename Counter>
bool every(Counter period, Counter &counter) {
  if (++counter < period) return false;
  counter = 0;
  return true;
}

}  // namespace

RigCore::RigCore(const BoardInfo &board, const uint8_t *nonvolatile_image) : board_(board) {
  boot_finding_ = boot_finding(board.reset_cause, parameters_.load(nonvolatile_image));
  configure();
  outputs_ = {kNoSteps, false, true, true};
}

void RigCore::configure() {
  transducer_.configure(parameters_);
  pressure_monitor_.configure(parameters_);
  motion_.configure(parameters_);
  load_cell_.configure(parameters_);
  host_timeout_ticks_ = ticks_of(parameters_.communication_timeout());
}

// --- a tick ------------------------------------------------------------------------------------

void RigCore::tick(const Inputs &inputs) {
  sense(inputs);
  watch(inputs);
  act(inputs);
  report();
}

void RigCore::sense(const Inputs &inputs) {
  inputs_ = inputs;
  link_.tick();
  safety_.tick();
  transducer_.sample(inputs.adc_sum, inputs.adc_count);
  if (zeroing_.tick(transducer_.tick_voltage())) {
    transducer_.zero(zeroing_.mean(), parameters_.zero_limit());
  }
}

void RigCore::watch(const Inputs &inputs) {
  const Finding finding = find_fault(inputs);
  if (safety_.state() == State::kBoot) {
    if (++boot_ticks_ < kBootTicks) return;
    enter(State::kIdle);
    if (boot_finding_.fault != Fault::kNone) react_to(boot_finding_);
    return;
  }
  if (finding.fault != Fault::kNone) react_to(finding);
}

// The most immediate danger first. Every monitor runs in every tick, so that none is out of date.
Finding RigCore::find_fault(const Inputs &inputs) {
  const Finding travel = watch_travel(inputs);
  const Finding pressure = pressure_monitor_.tick(
      transducer_, {inputs.adc_count != 0, !safety_.valve_open(), motion_.position()});
  const Finding regulation = safety_.valve_open() ? kNoFinding : watch_regulation();
  const Finding cell = load_cell_.tick();
  const Finding host = watch_host();
  if (inputs.emergency_stop) return {Fault::kEmergencyStop, 0.0f};
  const Finding *const findings[] = {&travel, &pressure, &regulation, &cell, &host};
  for (const Finding *finding : findings) {
    if (finding->fault != Fault::kNone) return *finding;
  }
  return kNoFinding;
}

Finding RigCore::watch_travel(const Inputs &inputs) {
  const State state = safety_.state();
  const bool into_end = inputs.end_switch && motion_.velocity() > Flow{};
  const bool lost = inputs.home_switch && (state == State::kHold || state == State::kRun) &&
                    motion_.homed() && motion_.position() > kFalseHome;
  if (into_end || false_home_(lost)) {
    return {Fault::kTravelLimit, to_ml(motion_.position())};
  }
  return kNoFinding;
}

Finding RigCore::watch_regulation() {
  const bool wants_more = safety_.state() == State::kRun && motion_.blocked() > 0 &&
                          setpoint_.value() - transducer_.pressure() > parameters_.deadband();
  if (out_of_travel_(wants_more)) return {Fault::kTravelLimit, to_ml(motion_.position())};
  return leak_monitor_.tick(motion_.position(), transducer_.pressure(), parameters_.leak_volume());
}

Finding RigCore::watch_host() {
  if (!safety_.needs_host() && !jogging()) {
    host_silent_ticks_ = 0;
    return kNoFinding;
  }
  if (++host_silent_ticks_ <= host_timeout_ticks_) return kNoFinding;
  return {Fault::kCommunicationLost, to_seconds(duration_of(host_silent_ticks_))};
}

// Whatever the fault: the loop ends and the valve opens at once; the plunger stops and, if it can
// be trusted, retracts.
void RigCore::react_to(const Finding &finding) {
  if (finding.fault == Fault::kEmergencyStop) {
    motion_.stop_at_once();
    motion_.forget_home();  // without current the plunger may be moved by hand
    outputs_.motor_enabled = false;
    retracting_ = false;
  }
  if (!safety_.latch(finding)) return;
  enter(State::kFault);
  retracting_ = plunger_may_retract(finding.fault) && motion_.homed();
  if (retracting_) homing_.go_back(motion_, parameters_);
  fault_report_ticks_ = 0;
  send_fault();
  send_heartbeat();
}

void RigCore::enter(State state) {
  if (safety_.valve_open()) leak_monitor_.start(motion_.position(), transducer_.pressure());
  safety_.enter(state);
  motion_.seek_home(false);
  motion_.stop();
  jog_ticks_ = 0;
  if (state != State::kIdle && state != State::kVent) zeroing_.abandon();
}

void RigCore::act(const Inputs &inputs) {
  switch (safety_.state()) {
    case State::kBoot: break;
    case State::kIdle:
    case State::kHold: follow_jog(inputs); break;
    case State::kHoming:
    case State::kVent: follow_home(inputs); break;
    case State::kRun: regulate(); break;
    case State::kFault:
      if (retracting_) {
        retracting_ = homing_.tick(motion_, parameters_, inputs.home_switch) ==
                      Homing::Progress::kWorking;
      }
      break;
  }
  outputs_.steps = outputs_.motor_enabled ? motion_.tick() : kNoSteps;
  outputs_.valve_open = safety_.valve_open();
  outputs_.load_cell_powered = load_cell_.powered();
}

void RigCore::regulate() {
  if (!pressure_monitor_.plausible()) {
    motion_.stop();  // until the monitor has made up its mind
    return;
  }
  if (!setpoint_.resting()) {
    setpoint_.tick(ramp_limits(parameters_, setpoint_.value(), motion_.position()));
  }
  motion_.set_velocity(loop_.tick(parameters_, setpoint_, transducer_.pressure(),
                                  motion_.position(), motion_.blocked()));
}

void RigCore::follow_home(const Inputs &inputs) {
  switch (homing_.tick(motion_, parameters_, inputs.home_switch)) {
    case Homing::Progress::kWorking: break;
    case Homing::Progress::kFound: enter(State::kIdle); break;
    case Homing::Progress::kFailed:
      react_to({Fault::kHomingFailed, to_ml(homing_.travelled(motion_))});
      break;
  }
}

void RigCore::follow_jog(const Inputs &inputs) {
  if (!jogging()) return;
  --jog_ticks_;
  if (!jogging()) motion_.stop();
  if (inputs.home_switch && motion_.velocity() < Flow{}) {
    motion_.stop_at_once();
    jog_ticks_ = 0;
  }
}

// --- commands ----------------------------------------------------------------------------------

void RigCore::receive(uint8_t byte) {
  CanFrame frame;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled where it counts
  if (link_.receive(byte, frame)) handle(frame);
}

void RigCore::handle(const CanFrame &frame) {
  switch (frame.id) {
    case RIG_HOST_HEARTBEAT_FRAME_ID:
      if (unpack_protocol_version(frame) == kProtocolVersion) host_silent_ticks_ = 0;
      break;
    case RIG_COMMAND_FRAME_ID: handle(unpack_command(frame)); break;
    case RIG_PARAMETER_REQUEST_FRAME_ID: handle(unpack_parameter_request(frame)); break;
    default:  // the link lets four through, of which this is RIG_IDENTITY_REQUEST_FRAME_ID
      link_.send(pack(IdentityReport{board_.kind, board_.firmware_git}));
  }
}

// The same number again is acknowledged again and not repeated; a number that lies behind is of a
// frame that came late or twice, and must not move anything now.
void RigCore::handle(const Command &command) {
  if (command.number == 0 || behind(command.number, command_number_)) return;
  if (command.number != command_number_) {
    command_number_ = command.number;
    command_result_ = execute(command);
  }
  send_heartbeat();
}

CommandResult RigCore::execute(const Command &command) {
  const CommandResult allowed = permitted(command.opcode, safety_.state());
  if (allowed != CommandResult::kAccepted) return allowed;
  switch (command.opcode) {
    case Opcode::kNone: break;
    case Opcode::kSetPressure: return set_pressure(command.argument);
    case Opcode::kHold: enter(State::kHold); break;
    case Opcode::kVent: vent(); break;
    case Opcode::kZeroPressure:
      transducer_.doubt_zero();
      zeroing_.begin();
      break;
    case Opcode::kTare: load_cell_.begin_tare(); break;
    case Opcode::kHome:
      enter(State::kHoming);
      outputs_.motor_enabled = true;
      homing_.search(motion_, parameters_);
      break;
    case Opcode::kJog: return jog(command.argument);
    case Opcode::kClearFault: return clear_fault();
    case Opcode::kIdle: enter(State::kIdle); break;
  }
  return CommandResult::kAccepted;
}

void RigCore::vent() {
  const State before = safety_.state();
  // the valve is open and the plunger on its way home already
  if (before == State::kHoming) safety_.enter(State::kVent);
  if (before == State::kHoming || before == State::kVent) return;
  enter(State::kVent);
  outputs_.motor_enabled = true;
  homing_.go_back(motion_, parameters_);
}

CommandResult RigCore::set_pressure(float target_kpa) {
  if (!is_finite(target_kpa)) return CommandResult::kNotFinite;
  const Pressure target = kpa(target_kpa);
  if (target < Pressure{} || target >= parameters_.pressure_limit()) {
    return CommandResult::kOutOfRange;
  }
  if (!motion_.homed()) return CommandResult::kNotHomed;
  if (zeroing_.active()) return CommandResult::kBusy;
  if (!transducer_.zeroed()) return CommandResult::kNotZeroed;
  if (safety_.state() != State::kRun) {
    enter(State::kRun);
    loop_.reset();
    out_of_travel_.reset();
    setpoint_.start_from(transducer_.pressure());
  }
  setpoint_.set_target(target);
  return CommandResult::kAccepted;
}

CommandResult RigCore::jog(float flow_ml_s) {
  if (!is_finite(flow_ml_s)) return CommandResult::kNotFinite;
  const Flow flow = ml_s(flow_ml_s);
  if (magnitude(flow) > parameters_.max_flow()) return CommandResult::kOutOfRange;
  if (zeroing_.active()) return CommandResult::kBusy;
  outputs_.motor_enabled = true;
  motion_.set_velocity(flow);
  jog_ticks_ = kJogTicks;
  return CommandResult::kAccepted;
}

CommandResult RigCore::clear_fault() {
  if (safety_.state() != State::kFault) return CommandResult::kAccepted;
  if (retracting_) return CommandResult::kBusy;
  const bool cause_stands = inputs_.emergency_stop || !pressure_monitor_.plausible() ||
                            transducer_.pressure() > parameters_.pressure_limit();
  if (cause_stands) return CommandResult::kFaulted;
  load_cell_.forgive();
  safety_.clear();
  enter(State::kIdle);
  return CommandResult::kAccepted;
}

void RigCore::handle(const ParameterRequest &request) {
  const bool known = request.index < Parameters::kCount;
  ParameterResult result = ParameterResult::kUnknownParameter;
  switch (request.operation) {
    case ParameterOperation::kRead:
      if (known) result = ParameterResult::kAccepted;
      break;
    case ParameterOperation::kWrite: result = write(request); break;
    case ParameterOperation::kSave:
      save_asked_ = true;
      result = ParameterResult::kAccepted;
      break;
  }
  const float value = known ? parameters_.get(request.index) : 0.0f;
  link_.send(pack(ParameterReport{result, request.number, request.index, value}));
}

ParameterResult RigCore::write(const ParameterRequest &request) {
  const bool at_rest = !safety_.needs_host() && !motion_.moving();
  const ParameterResult result = parameters_.set(request.index, request.value, at_rest);
  if (result == ParameterResult::kAccepted) configure();
  return result;
}

bool RigCore::take_save(uint8_t *image) {
  if (!save_asked_) return false;
  save_asked_ = false;
  parameters_.store(image);
  return true;
}

// --- telemetry ---------------------------------------------------------------------------------

void RigCore::load_cell_word(uint32_t word) {
  const bool credible = load_cell_.due();  // a stuck line would flood the host
  const LoadCellStatus status = load_cell_.accept(word);
  if (credible) send_load_cell(status);
}

void RigCore::report() {
  if (every(kSecondTicks, second_ticks_)) increment(uptime_s_);
  if (every(kPressureTicks, pressure_ticks_)) send_pressure();
  if (every(kHeartbeatTicks, heartbeat_ticks_)) send_heartbeat();
  if (every(kControllerTicks, controller_ticks_)) send_controller();
  if (link_.take_opened()) fault_report_ticks_ = kSecondTicks - 1;  // due now
  if (safety_.fault() != Fault::kNone && every(kSecondTicks, fault_report_ticks_)) send_fault();
  if (!load_cell_.powered()) send_load_cell(LoadCellStatus::kRestarted);
  if (load_cell_.silent() && every(kSecondTicks, timeout_report_ticks_)) {
    send_load_cell(LoadCellStatus::kTimeout);
  }
}

void RigCore::send_heartbeat() {
  link_.send(pack(Heartbeat{
      safety_.state(), safety_.fault(), command_number_, command_result_,
      static_cast<uint8_t>(board_.reset_cause), inputs_.home_switch, inputs_.end_switch,
      inputs_.emergency_stop, safety_.valve_open(), outputs_.motor_enabled, motion_.homed(),
      transducer_.zeroed(), load_cell_.tared(), uptime_s_}));
}

void RigCore::send_pressure() {
  const bool running = safety_.state() == State::kRun;
  link_.send(pack(PressureReport{
      pressure_monitor_.plausible(), running && loop_.saturated(), transducer_.pressure(),
      running ? setpoint_.value() : Pressure{}, motion_.position()}));
}

void RigCore::send_controller() {
  const bool running = safety_.state() == State::kRun;
  link_.send(pack(ControllerReport{motion_.velocity(), running ? loop_.integral() : Flow{},
                                   transducer_.voltage()}));
}

void RigCore::send_load_cell(LoadCellStatus status) {
  link_.send(pack(LoadCellReport{status, load_cell_.net_counts(), load_cell_.sample()}));
}

void RigCore::send_fault() {
  link_.send(pack(FaultReport{safety_.fault(), safety_.fault_value(),
                              duration_of(safety_.fault_ticks())}));
}

}  // namespace rig
