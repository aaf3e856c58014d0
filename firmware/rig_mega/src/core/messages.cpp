#include "messages.h"

#include "generated/rig.h"
#include "generated/schema.h"

namespace rig {

namespace {

// The ranges of the scaled signals; beyond them they would wrap around.
constexpr Pressure kLowestPressure = kpa(-10.0f);
constexpr Pressure kHighestPressure = kpa(55.535f);
constexpr Volume kLowestVolume = ml(-1.0f);
constexpr Volume kHighestVolume = ml(64.535f);
constexpr Flow kHighestFlow = ml_s(32.767f);
constexpr Voltage kHighestVoltage = volts(6.5535f);
constexpr Duration kHighestAge = seconds(25.5f);

constexpr uint8_t bit(bool set) { return set ? 1 : 0; }

uint16_t pressure(Pressure p) {
  return rig_pressure_pressure_kpa_encode(to_kpa(clamp(p, kLowestPressure, kHighestPressure)));
}

int16_t flow(Flow q) {
  return rig_controller_integral_ml_s_encode(to_ml_s(clamp(q, -kHighestFlow, kHighestFlow)));
}

template <typename Message>
CanFrame packed(uint16_t id, int (*pack_it)(uint8_t *, const Message *, size_t),
                const Message &message) {
  CanFrame frame = {id, 8, {}};
  pack_it(frame.data, &message, sizeof frame.data);
  return frame;
}

}  // namespace

CanFrame pack(const Heartbeat &message) {
  rig_heartbeat_t m = {};
  m.state = static_cast<uint8_t>(message.state);
  m.fault_code = static_cast<uint8_t>(message.fault);
  m.command_number = message.command_number;
  m.command_result = static_cast<uint8_t>(message.command_result);
  m.reset_cause = message.reset_cause;
  m.home_switch = bit(message.home_switch);
  m.end_switch = bit(message.end_switch);
  m.emergency_stop = bit(message.emergency_stop);
  m.valve_open = bit(message.valve_open);
  m.motor_enabled = bit(message.motor_enabled);
  m.homed = bit(message.homed);
  m.zeroed = bit(message.zeroed);
  m.tared = bit(message.tared);
  m.uptime_s = message.uptime_s;
  return packed(RIG_HEARTBEAT_FRAME_ID, rig_heartbeat_pack, m);
}

CanFrame pack(const PressureReport &message) {
  rig_pressure_t m = {};
  m.plausible = bit(message.plausible);
  m.saturated = bit(message.saturated);
  m.pressure_kpa = pressure(message.pressure);
  m.setpoint_kpa = pressure(message.setpoint);
  m.plunger_ml =
      rig_pressure_plunger_ml_encode(to_ml(clamp(message.plunger, kLowestVolume, kHighestVolume)));
  return packed(RIG_PRESSURE_FRAME_ID, rig_pressure_pack, m);
}

CanFrame pack(const ControllerReport &message) {
  rig_controller_t m = {};
  m.plunger_velocity_ml_s = flow(message.plunger_velocity);
  m.integral_ml_s = flow(message.integral);
  m.transducer_v = rig_controller_transducer_v_encode(
      to_volts(clamp(message.transducer, Voltage{}, kHighestVoltage)));
  return packed(RIG_CONTROLLER_FRAME_ID, rig_controller_pack, m);
}

CanFrame pack(const LoadCellReport &message) {
  rig_load_cell_t m = {};
  m.load_cell_status = static_cast<uint8_t>(message.status);
  m.load_cell_counts = message.counts;
  m.load_cell_sample = message.sample;
  return packed(RIG_LOAD_CELL_FRAME_ID, rig_load_cell_pack, m);
}

CanFrame pack(const FaultReport &message) {
  rig_fault_t m = {};
  m.code = static_cast<uint8_t>(message.code);
  m.fault_value = message.value;
  m.age_s = rig_fault_age_s_encode(to_seconds(clamp(message.age, Duration{}, kHighestAge)));
  return packed(RIG_FAULT_FRAME_ID, rig_fault_pack, m);
}

CanFrame pack(const ParameterReport &message) {
  rig_parameter_t m = {};
  m.parameter_result = static_cast<uint8_t>(message.result);
  m.number = message.number;
  m.parameter_index = message.index;
  m.parameter_value = message.value;
  return packed(RIG_PARAMETER_FRAME_ID, rig_parameter_pack, m);
}

CanFrame pack(const IdentityReport &message) {
  rig_identity_t m = {};
  m.board_kind = message.board_kind;
  m.protocol_version = kProtocolVersion;
  m.schema_crc = kSchemaCrc;
  m.firmware_git = message.firmware_git;
  return packed(RIG_IDENTITY_FRAME_ID, rig_identity_pack, m);
}

Command unpack_command(const CanFrame &frame) {
  rig_command_t m = {};
  rig_command_unpack(&m, frame.data, sizeof frame.data);
  return {static_cast<Opcode>(m.opcode), m.number, m.argument};
}

ParameterRequest unpack_parameter_request(const CanFrame &frame) {
  rig_parameter_request_t m = {};
  rig_parameter_request_unpack(&m, frame.data, sizeof frame.data);
  return {static_cast<ParameterOperation>(m.operation), m.number, m.parameter_index,
          m.parameter_value};
}

uint8_t unpack_protocol_version(const CanFrame &host_heartbeat) {
  rig_host_heartbeat_t m = {};
  rig_host_heartbeat_unpack(&m, host_heartbeat.data, sizeof host_heartbeat.data);
  return m.protocol_version;
}

}  // namespace rig
