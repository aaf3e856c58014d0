#include "rig_host_test.h"

#include <string.h>

#include "crc.h"
#include "e2e.h"
#include "generated/rig.h"
#include "hx711.h"
#include "messages.h"
#include "parameters.h"
#include "plunger_motion.h"
#include "pressure_loop.h"
#include "setpoint_ramp.h"
#include "slcan.h"

namespace {

constexpr bool kAtRest = true;

void finish(rig::CanFrame frame, uint8_t alive, uint8_t *payload) {
  rig::protect(frame, alive);
  memcpy(payload, frame.data, 8);
}

}  // namespace

uint8_t rig_test_crc8(const uint8_t *data, size_t size) { return rig::crc8_j1850(data, size); }

uint16_t rig_test_crc16(const uint8_t *data, size_t size) {
  return rig::crc16_ccitt_false(data, size);
}

void rig_test_protect(uint16_t id, uint8_t alive, uint8_t *payload) {
  rig::CanFrame frame = {id, 8, {}};
  memcpy(frame.data, payload, 8);
  rig::protect(frame, alive);
  memcpy(payload, frame.data, 8);
}

void rig_test_pack_heartbeat(uint8_t alive, uint8_t state, uint8_t fault, uint8_t number,
                             uint8_t result, uint8_t reset_cause, uint8_t flags,
                             uint16_t uptime_s, uint8_t *payload) {
  const auto flag = [flags](int bit) { return (flags >> bit & 1) != 0; };
  finish(rig::pack(rig::Heartbeat{static_cast<rig::State>(state), static_cast<rig::Fault>(fault),
                                  number, static_cast<rig::CommandResult>(result), reset_cause,
                                  flag(0), flag(1), flag(2), flag(3), flag(4), flag(5), flag(6),
                                  flag(7), uptime_s}),
         alive, payload);
}

void rig_test_pack_pressure(uint8_t alive, int plausible, int saturated, float pressure_kpa,
                            float setpoint_kpa, float plunger_ml, uint8_t *payload) {
  finish(rig::pack(rig::PressureReport{plausible != 0, saturated != 0, rig::kpa(pressure_kpa),
                                       rig::kpa(setpoint_kpa), rig::ml(plunger_ml)}),
         alive, payload);
}

void rig_test_pack_controller(uint8_t alive, float velocity_ml_s, float integral_ml_s,
                              float transducer_v, uint8_t *payload) {
  finish(rig::pack(rig::ControllerReport{rig::ml_s(velocity_ml_s), rig::ml_s(integral_ml_s),
                                         rig::volts(transducer_v)}),
         alive, payload);
}

void rig_test_pack_load_cell(uint8_t alive, uint8_t status, int32_t counts, uint16_t sample,
                             uint8_t *payload) {
  finish(rig::pack(
             rig::LoadCellReport{static_cast<rig::LoadCellStatus>(status), counts, sample}),
         alive, payload);
}

void rig_test_pack_fault(uint8_t alive, uint8_t code, float value, float age_s, uint8_t *payload) {
  finish(rig::pack(rig::FaultReport{static_cast<rig::Fault>(code), value, rig::seconds(age_s)}),
         alive, payload);
}

void rig_test_pack_parameter(uint8_t alive, uint8_t result, uint8_t number, uint8_t index,
                             float value, uint8_t *payload) {
  finish(rig::pack(rig::ParameterReport{static_cast<rig::ParameterResult>(result), number, index,
                                        value}),
         alive, payload);
}

void rig_test_pack_identity(uint8_t alive, uint8_t board_kind, uint32_t firmware_git,
                            uint8_t *payload) {
  finish(rig::pack(rig::IdentityReport{board_kind, firmware_git}), alive, payload);
}

void rig_test_unpack_command(const uint8_t *payload, uint8_t *opcode, uint8_t *number,
                             float *argument) {
  rig::CanFrame frame = {RIG_COMMAND_FRAME_ID, 8, {}};
  memcpy(frame.data, payload, 8);
  const rig::Command command = rig::unpack_command(frame);
  *opcode = static_cast<uint8_t>(command.opcode);
  *number = command.number;
  *argument = command.argument;
}

int32_t rig_test_hx711_counts(uint32_t word) { return rig::hx711_counts(word); }

void rig_test_hx711_judge(const uint32_t *words, size_t count, uint8_t *status) {
  rig::Hx711 hx711;
  for (size_t i = 0; i < count; ++i) status[i] = static_cast<uint8_t>(hx711.accept(words[i]));
}

size_t rig_test_slcan_parse(const uint8_t *bytes, size_t count, uint8_t *kinds, size_t capacity,
                            uint16_t *id, uint8_t *length, uint8_t *data) {
  rig::slcan::Parser parser;
  size_t lines = 0;
  for (size_t i = 0; i < count; ++i) {
    rig::CanFrame frame;
    const rig::slcan::Kind kind = parser.feed(bytes[i], frame);
    if (kind == rig::slcan::Kind::kNothing) continue;
    if (kind == rig::slcan::Kind::kFrame) {
      *id = frame.id;
      *length = frame.length;
      memcpy(data, frame.data, 8);
    }
    if (lines < capacity) kinds[lines] = static_cast<uint8_t>(kind);
    ++lines;
  }
  return lines;
}

size_t rig_test_slcan_format(uint16_t id, const uint8_t *data, uint8_t length, int stamped,
                             uint16_t stamp_ms, uint8_t *out) {
  rig::CanFrame frame = {id, length, {}};
  memcpy(frame.data, data, length);
  return rig::slcan::format(frame, stamped != 0, stamp_ms, out);
}

struct rig_test_plunger {
  rig::PlungerMotion motion;
};

rig_test_plunger *rig_test_plunger_new(float max_flow_ml_s, float acceleration_ml_s2,
                                       float syringe_ml) {
  rig::Parameters parameters;
  parameters.set(RIG_PARAMETER_PARAMETER_INDEX_MAX_FLOW_ML_S_CHOICE, max_flow_ml_s, kAtRest);
  parameters.set(RIG_PARAMETER_PARAMETER_INDEX_MAX_FLOW_ACCELERATION_ML_S2_CHOICE,
                 acceleration_ml_s2, kAtRest);
  parameters.set(RIG_PARAMETER_PARAMETER_INDEX_SYRINGE_VOLUME_ML_CHOICE, syringe_ml, kAtRest);
  auto *plunger = new rig_test_plunger;
  plunger->motion.configure(parameters);
  plunger->motion.set_home();
  return plunger;
}

void rig_test_plunger_free(rig_test_plunger *plunger) { delete plunger; }

void rig_test_plunger_set_velocity(rig_test_plunger *plunger, float flow_ml_s) {
  plunger->motion.set_velocity(rig::ml_s(flow_ml_s));
}

void rig_test_plunger_move_to(rig_test_plunger *plunger, float target_ml, float speed_ml_s) {
  plunger->motion.move_to(rig::ml(target_ml), rig::ml_s(speed_ml_s));
}

int32_t rig_test_plunger_tick(rig_test_plunger *plunger, uint16_t *first, uint32_t *interval) {
  const rig::StepSchedule steps = plunger->motion.tick();
  *first = steps.first;
  *interval = steps.interval;
  return steps.inward ? steps.count : -static_cast<int32_t>(steps.count);
}

float rig_test_plunger_position_ml(const rig_test_plunger *plunger) {
  return rig::to_ml(plunger->motion.position());
}

float rig_test_plunger_velocity_ml_s(const rig_test_plunger *plunger) {
  return rig::to_ml_s(plunger->motion.velocity());
}

int rig_test_plunger_arrived(const rig_test_plunger *plunger) {
  return plunger->motion.arrived();
}

struct rig_test_loop {
  rig::Parameters parameters;
  rig::SetpointRamp setpoint;
  rig::PressureLoop loop;
};

rig_test_loop *rig_test_loop_new(float proportional, float integral, float feed_forward,
                                 float deadband_kpa, float max_flow_ml_s) {
  auto *loop = new rig_test_loop;
  rig::Parameters &p = loop->parameters;
  p.set(RIG_PARAMETER_PARAMETER_INDEX_PROPORTIONAL_ML_S_KPA_CHOICE, proportional, kAtRest);
  p.set(RIG_PARAMETER_PARAMETER_INDEX_INTEGRAL_ML_S2_KPA_CHOICE, integral, kAtRest);
  p.set(RIG_PARAMETER_PARAMETER_INDEX_FEED_FORWARD_CHOICE, feed_forward, kAtRest);
  p.set(RIG_PARAMETER_PARAMETER_INDEX_DEADBAND_KPA_CHOICE, deadband_kpa, kAtRest);
  p.set(RIG_PARAMETER_PARAMETER_INDEX_MAX_FLOW_ML_S_CHOICE, max_flow_ml_s, kAtRest);
  return loop;
}

void rig_test_loop_free(rig_test_loop *loop) { delete loop; }

void rig_test_loop_target(rig_test_loop *loop, float start_kpa, float target_kpa) {
  loop->setpoint.start_from(rig::kpa(start_kpa));
  loop->setpoint.set_target(rig::kpa(target_kpa));
}

void rig_test_loop_retarget(rig_test_loop *loop, float target_kpa) {
  loop->setpoint.set_target(rig::kpa(target_kpa));
}

float rig_test_loop_tick(rig_test_loop *loop, float measured_kpa, float plunger_ml, int blocked) {
  loop->setpoint.tick(rig::ramp_limits(loop->parameters, loop->setpoint.value(),
                                       rig::ml(plunger_ml)));
  return rig::to_ml_s(loop->loop.tick(loop->parameters, loop->setpoint, rig::kpa(measured_kpa),
                                      rig::ml(plunger_ml), static_cast<int8_t>(blocked)));
}

float rig_test_loop_setpoint_kpa(const rig_test_loop *loop) {
  return rig::to_kpa(loop->setpoint.value());
}

float rig_test_loop_integral_ml_s(const rig_test_loop *loop) {
  return rig::to_ml_s(loop->loop.integral());
}

int rig_test_loop_saturated(const rig_test_loop *loop) { return loop->loop.saturated(); }
