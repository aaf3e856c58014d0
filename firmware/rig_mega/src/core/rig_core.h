// The application: what the board does with its pins, whatever board it is.
//
// The HAL calls `receive` for each byte of the serial line, `load_cell_word` for each conversion,
// `tick` every 2 ms with what the pins showed since, and carries out `outputs` in the next 2 ms.
#pragma once

#include <stdint.h>

#include "debounce.h"
#include "homing.h"
#include "host_link.h"
#include "leak_monitor.h"
#include "load_cell.h"
#include "messages.h"
#include "parameters.h"
#include "plunger_motion.h"
#include "pressure_loop.h"
#include "pressure_monitor.h"
#include "safety.h"
#include "setpoint_ramp.h"
#include "transducer.h"
#include "zeroing.h"

namespace rig {

enum class ResetCause : uint8_t {
  kUnknown = 0,
  kPowerOn = 1,
  kExternal = 2,
  kBrownOut = 3,
  kWatchdog = 4,
};

struct BoardInfo {
  uint8_t kind;  // board_kind of rig.dbc
  uint32_t firmware_git;
  ResetCause reset_cause;
};

struct Inputs {
  uint32_t adc_sum;
  uint8_t adc_count;
  bool home_switch, end_switch, emergency_stop;
};

struct Outputs {
  StepSchedule steps;
  bool motor_enabled;
  bool valve_open;
  bool load_cell_powered;  // false for one tick restarts the HX711
};

class RigCore {
 public:
  RigCore(const BoardInfo &board, const uint8_t *nonvolatile_image);

  void receive(uint8_t byte);
  void load_cell_word(uint32_t word);
  void tick(const Inputs &inputs);

  const Outputs &outputs() const { return outputs_; }
  HostLink::TransmitQueue &transmit_queue() { return link_.transmit_queue(); }

  // True once after a save was asked for; `image` then holds what to keep.
  bool take_save(uint8_t *image);

  const HostLink &link() const { return link_; }
  const Parameters &parameters() const { return parameters_; }
  const Safety &safety() const { return safety_; }

 private:
  // one tick, in this order
  void sense(const Inputs &inputs);
  void watch(const Inputs &inputs);
  void act(const Inputs &inputs);
  void report();

  Finding find_fault(const Inputs &inputs);
  Finding watch_travel(const Inputs &inputs);
  Finding watch_regulation();
  Finding watch_host();

  void regulate();
  void follow_home(const Inputs &inputs);
  void follow_jog(const Inputs &inputs);
  void enter(State state);
  void react_to(const Finding &finding);
  bool jogging() const { return jog_ticks_ > 0; }

  void handle(const CanFrame &frame);
  void handle(const Command &command);
  void handle(const ParameterRequest &request);
  ParameterResult write(const ParameterRequest &request);
  CommandResult execute(const Command &command);
  void vent();
  CommandResult set_pressure(float target_kpa);
  CommandResult jog(float flow_ml_s);
  CommandResult clear_fault();
  void configure();

  void send_heartbeat();
  void send_pressure();
  void send_controller();
  void send_load_cell(LoadCellStatus status);
  void send_fault();

  BoardInfo board_;
  Parameters parameters_;
  HostLink link_;
  Safety safety_;
  Transducer transducer_;
  PressureMonitor pressure_monitor_;
  LeakMonitor leak_monitor_;
  SetpointRamp setpoint_;
  PressureLoop loop_;
  PlungerMotion motion_;
  Homing homing_;
  LoadCell load_cell_;
  Zeroing zeroing_;
  Outputs outputs_ = {};
  Inputs inputs_ = {};

  Finding boot_finding_ = kNoFinding;
  Debounce<5> false_home_;
  Debounce<250> out_of_travel_;
  uint32_t host_silent_ticks_ = 0;
  uint32_t host_timeout_ticks_ = 0;
  uint16_t jog_ticks_ = 0;
  bool retracting_ = false;  // after a fault
  bool save_asked_ = false;

  uint8_t command_number_ = 0;
  CommandResult command_result_ = CommandResult::kAccepted;

  uint16_t uptime_s_ = 0;
  uint16_t second_ticks_ = 0;
  uint16_t boot_ticks_ = 0;
  uint16_t fault_report_ticks_ = 0;
  uint16_t timeout_report_ticks_ = 0;
  // staggered: packing all of them in one tick would make the Mega late
  uint8_t pressure_ticks_ = 0;
  uint8_t heartbeat_ticks_ = 3;
  uint8_t controller_ticks_ = 6;
};

}  // namespace rig
