/* Single pieces of the firmware core, for tests: each does what its C++ namesake does. */
#ifndef RIG_HOST_TEST_H
#define RIG_HOST_TEST_H

#include "rig_host.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  uint16_t corrupt, repeated, unknown, bad_lines, not_sent;
} rig_link_counters;

rig_link_counters rig_host_link_counters(const rig_host *host);

uint8_t rig_test_crc8(const uint8_t *data, size_t size);
uint16_t rig_test_crc16(const uint8_t *data, size_t size);

/* Fills in CRC and alive counter of an eight-byte payload. */
void rig_test_protect(uint16_t id, uint8_t alive, uint8_t *payload);

/* Frames as the firmware packs them, with alive counter and CRC; each writes eight bytes. `flags` of
 * the heartbeat are its eight single bits in the order of rig.dbc. */
void rig_test_pack_heartbeat(uint8_t alive, uint8_t state, uint8_t fault, uint8_t number,
                             uint8_t result, uint8_t reset_cause, uint8_t flags,
                             uint16_t uptime_s, uint8_t *payload);
void rig_test_pack_pressure(uint8_t alive, int plausible, int saturated, float pressure_kpa,
                            float setpoint_kpa, float plunger_ml, uint8_t *payload);
void rig_test_pack_controller(uint8_t alive, float velocity_ml_s, float integral_ml_s,
                              float transducer_v, uint8_t *payload);
void rig_test_pack_load_cell(uint8_t alive, uint8_t status, int32_t counts, uint16_t sample,
                             uint8_t *payload);
void rig_test_pack_fault(uint8_t alive, uint8_t code, float value, float age_s, uint8_t *payload);
void rig_test_pack_parameter(uint8_t alive, uint8_t result, uint8_t number, uint8_t index,
                             float value, uint8_t *payload);
void rig_test_pack_identity(uint8_t alive, uint8_t board_kind, uint32_t firmware_git,
                            uint8_t *payload);
void rig_test_unpack_command(const uint8_t *payload, uint8_t *opcode, uint8_t *number,
                             float *argument);

int32_t rig_test_hx711_counts(uint32_t word);
/* Judges `count` words in turn; `status` as load_cell_status of rig.dbc. */
void rig_test_hx711_judge(const uint32_t *words, size_t count, uint8_t *status);

/* Feeds a parser; writes for each completed line its kind (slcan::Kind) and, for data frames, the
 * last frame. Returns the number of completed, non-empty lines, of which `capacity` are written. */
size_t rig_test_slcan_parse(const uint8_t *bytes, size_t count, uint8_t *kinds, size_t capacity,
                            uint16_t *id, uint8_t *length, uint8_t *data);
size_t rig_test_slcan_format(uint16_t id, const uint8_t *data, uint8_t length, int stamped,
                             uint16_t stamp_ms, uint8_t *out);

/* A plunger alone, with default parameters but these; travel in mL from home. */
typedef struct rig_test_plunger rig_test_plunger;
rig_test_plunger *rig_test_plunger_new(float max_flow_ml_s, float acceleration_ml_s2,
                                       float syringe_ml);
void rig_test_plunger_free(rig_test_plunger *plunger);
void rig_test_plunger_set_velocity(rig_test_plunger *plunger, float flow_ml_s);
void rig_test_plunger_move_to(rig_test_plunger *plunger, float target_ml, float speed_ml_s);
/* One tick of 2 ms; returns the signed steps, and where they fall: the first in timer ticks of
 * 0.5 us, the interval in 1/256 of them. */
int32_t rig_test_plunger_tick(rig_test_plunger *plunger, uint16_t *first, uint32_t *interval);
float rig_test_plunger_position_ml(const rig_test_plunger *plunger);
float rig_test_plunger_velocity_ml_s(const rig_test_plunger *plunger);
int rig_test_plunger_arrived(const rig_test_plunger *plunger);

/* The pressure loop alone, with default parameters. */
typedef struct rig_test_loop rig_test_loop;
rig_test_loop *rig_test_loop_new(float proportional, float integral, float feed_forward,
                                 float deadband_kpa, float max_flow_ml_s);
void rig_test_loop_free(rig_test_loop *loop);
void rig_test_loop_target(rig_test_loop *loop, float start_kpa, float target_kpa);
void rig_test_loop_retarget(rig_test_loop *loop, float target_kpa);
float rig_test_loop_tick(rig_test_loop *loop, float measured_kpa, float plunger_ml, int blocked);
float rig_test_loop_setpoint_kpa(const rig_test_loop *loop);
float rig_test_loop_integral_ml_s(const rig_test_loop *loop);
int rig_test_loop_saturated(const rig_test_loop *loop);

/* A simple bench: syringe, tube lag, gas with heat exchange, leak, backlash, noisy transducer. */
typedef struct {
  double step_ul;
  double syringe_ml;
  double system_ml;
  double ambient_kpa;
  double backlash_ml;
  double tube_lag_s;
  double heat_exchange_s;
  double leak_ml_s_kpa;
  double valve_ml_s_kpa;
  double compliance_ml_kpa;     /* the actuator swells */
  double noise_lsb;
  double offset_kpa;            /* of the transducer */
  double load_cell_counts;
  int load_cell_period_ms;      /* 0: none connected */
  int adc_per_ms;
  int emergency_stop;
  int motor_stalled;
  int home_switch_broken;       /* never closes */
  int home_switch_stuck;        /* always closed */
  int sensor;                   /* 0 live, 1 open (low), 2 short (high), 3 frozen, 4 ADC dead */
  uint32_t hx711_stuck_word;    /* if not 0, every word reads this */
  int hx711_asleep;             /* 1: no words until it is restarted */
  int hx711_shifted;            /* 1: words lost a clock edge, until it is restarted */
  int hx711_line_low;           /* a word of zeros seems to be ready all the time */
  /* state, to be read */
  double time_s;
  double plunger_ml;
  double pressure_kpa;          /* in the system */
  double shown_kpa;             /* at the transducer, behind the tube */
  int32_t steps;
  int max_steps_per_ms;
  int valve_open;
  int motor_enabled;
  int hx711_restarts;
} rig_test_bench_state;

typedef struct rig_test_bench rig_test_bench;
rig_test_bench *rig_test_bench_new(uint32_t seed);
void rig_test_bench_free(rig_test_bench *bench);
rig_test_bench_state *rig_test_bench_access(rig_test_bench *bench);
void rig_test_bench_place(rig_test_bench *bench, double plunger_ml);
/* A rig_bench_fn. */
void rig_test_bench_step(void *bench, const rig_pins_out *out, rig_pins_in *in);
/* Shows ambient pressure without noise; for measuring the firmware's own time. */
void rig_test_bench_idle(void *bench, const rig_pins_out *out, rig_pins_in *in);
/* Runs the host against a test bench, and returns the mean, least and greatest true pressure. */
void rig_test_run(rig_host *host, rig_test_bench *bench, uint32_t milliseconds, double *mean_kpa,
                  double *least_kpa, double *greatest_kpa);

#ifdef __cplusplus
}
#endif

#endif
