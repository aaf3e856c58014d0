/* The virtual bench in C: fluid, plunger, actuator dynamics and sensors at a fixed step.
 *
 * Plain data in, plain data out: the state is one block of memory, so saving and restoring it is a
 * copy, and the same seed gives the same bytes. All quantities are SI; pressures are absolute
 * unless named gauge. `plant_tick` has the signature that the firmware's host HAL calls.
 */
#ifndef RIG_PLANT_H
#define RIG_PLANT_H

#include <stddef.h>
#include <stdint.h>

#include "rig_host.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PLANT_TABLE = 1024, PLANT_PLAYS = 3, PLANT_CREEPS = 4 };

/* Quasi-static response over uniform gauge pressures from table_low to table_high. */
typedef struct {
  double table_low, table_high;
  double deformation[PLANT_TABLE];    /* rad or m, tip free */
  double blocked_force[PLANT_TABLE];  /* N, tip blocked */
  double volume_free[PLANT_TABLE];    /* m3 */
  double volume_blocked[PLANT_TABLE]; /* m3 */
} plant_response;

typedef struct {
  int32_t substeps; /* of the physics in a millisecond */
  /* surroundings */
  double ambient_pressure, ambient_temperature;
  /* plunger: volume swept per step pulse, backlash as swept volume, travel, dead volume */
  double volume_per_step, backlash_volume, syringe_volume, dead_volume;
  double start_volume; /* where the plunger stands at power-on, pushed in from home */
  double plunger_area;
  /* friction of the seal: N, N, N s/m. Without breakaway force the seal moves with the rod and
   * stays where it is in the backlash, whatever the pressure. */
  double breakaway_force, sliding_force, viscous_friction;
  double rod_compliance; /* m/N, between nut and seal; needs friction */
  /* stepper: pull-out torque at standstill (0: any torque), pulse rates in Hz at which it is down
   * to 1/sqrt(2) and from which it can start, pulses in an electrical cycle, screw in m */
  double holding_torque, corner_rate, start_rate, pulses_per_cycle, torque_per_force;
  /* fluid: air of molar_mass, or a liquid with its density and air in it */
  int32_t liquid;
  double molar_mass, density, viscosity;
  double bulk_modulus;     /* Pa, of the liquid without bubbles */
  double entrained_air;    /* share of the volume that is bubbles at ambient pressure */
  double solubility;       /* volume of gas that a volume of liquid dissolves, at any pressure */
  double dissolution_time; /* of bubbles to solution and back */
  double heat_exchange_time; /* gas to wall */
  /* tube: its gas counts as the syringe's */
  double tube_volume, tube_area, tube_diameter;
  double tube_resistance; /* laminar, Pa s/m3 */
  double minor_loss;      /* of the dynamic pressure */
  double tube_length_over_area; /* 1/m; 0: what flows has no mass */
  int32_t turbulence;
  double valve_conductance;    /* sonic, m3/s (ISO 8778 conditions) per Pa */
  double valve_critical_ratio;
  double leak_conductance; /* m3/s (ambient conditions) per Pa gauge */
  /* actuator */
  double full_pressure; /* Pa; to there and back is one load cycle */
  double response_time; /* s; lag of the shape behind the pressure by damping */
  double shape_inertia; /* s2; 1 / (natural angular frequency)^2; 0: no mass */
  double creep_share[PLANT_CREEPS], creep_time[PLANT_CREEPS];
  double play_share, play_radius[PLANT_PLAYS]; /* hysteresis: share and radii in Pa */
  double mullins_share, mullins_width, mullins_cycles; /* d, beta, N0 in actuator.h */
  double ageing; /* more shape per decade of load cycles */
  /* transducer and converter: volts = voltage_at_zero + (gauge - bow 4 x (1 - x)) / gain, with
   * x = gauge / span */
  double transducer_gain, transducer_voltage_at_zero, transducer_noise;
  double transducer_bow, transducer_span;
  double transducer_drift; /* Pa; standard deviation of the zero's change over a long time */
  double adc_reference, adc_levels;
  /* load cell */
  double counts_per_newton, load_cell_zero_counts, load_cell_noise_counts;
  double load_cell_creep_share, load_cell_creep_time;
  double load_cell_bow, load_cell_span; /* N, as the transducer's */
  double load_cell_drift;               /* N, as the transducer's */
  double load_cell_period, bad_word_probability;
  double drift_time; /* correlation time of both zeros */
} plant_parameters;

/* Plugged: the tube ends in a plug instead of the actuator. */
typedef enum { PLANT_FREE = 0, PLANT_BLOCKED = 1, PLANT_PLUGGED = 2 } plant_fixture;

/* How a limit switch misbehaves. */
enum { PLANT_SWITCH_LIVE = 0, PLANT_SWITCH_STUCK_OPEN = 1, PLANT_SWITCH_STUCK_CLOSED = 2 };

/* Scripted faults; zero means healthy. */
typedef struct {
  double leak_conductance;  /* besides the usual leak; m3/s (ambient conditions) per Pa gauge */
  double drift_rate;        /* Pa/s by which the transducer's reading runs away */
  double spike_voltage;     /* V on top of the transducer's */
  double lost_steps;        /* share of the pulses that move nothing */
  double bad_words;         /* share of the HX711's words that arrive shifted */
  int32_t sensor_open;      /* transducer wire broken: input reads near zero */
  int32_t sensor_short;     /* transducer shorted to supply */
  int32_t sensor_stuck;     /* transducer frozen at its last voltage */
  int32_t sensor_reversed;  /* its voltage falls as the pressure rises */
  int32_t tube_off;         /* syringe and actuator both end in open air */
  int32_t tube_blocked;     /* no gas passes between syringe and actuator */
  int32_t home_switch, end_switch; /* PLANT_SWITCH_... */
  int32_t load_cell_reversed; /* a push reads as a pull */
  int32_t hx711_silent;     /* no conversions any more */
  int32_t hx711_stuck;      /* every word reads hx711_word */
  uint32_t hx711_word;
  int32_t emergency_stop;
} plant_faults;

/* What is really so; never reaches the measurement path. `peak_pressure` is the highest gauge
 * pressure anywhere since power-on; `valve_opened` and `valve_open` are of the valve output. */
typedef struct {
  double time, gauge_pressure, deformation, force, actuator_volume, pushed_volume, gas_moles;
  double temperature;
  double actuator_pressure, peak_pressure;
  double valve_opened; /* when the closed valve was last opened */
  int32_t valve_open;
  double tube_flow;      /* m3/s, to the actuator */
  double shape_pressure; /* Pa; the quasi-static pressure of the shape */
  double load_cycles;
  double missed_pulses;
  double dissolved_moles, liquid_volume; /* liquid as at ambient pressure */
  /* J: internal energy of the air now; since power-on work done on it and heat taken up, and
   * enthalpy and moles gone to ambient */
  double energy, work, heat, enthalpy_out, moles_out;
} plant_truth;

typedef struct plant plant;

plant *plant_new(const plant_parameters *parameters, const plant_response *response,
                 uint64_t seed);
void plant_free(plant *p);
/* Advances the bench by 1 ms and reads its sensors; a rig_bench_fn. */
void plant_tick(void *p, const rig_pins_out *out, rig_pins_in *in);
/* Advances the physics alone from time t by h, at most 5 ms, during which `pulses` are made, evenly
 * and not as whole ones; those of `out` do not count. Returns 0, and does nothing, if t is not the
 * plant's time to 1 ns or h is out of range. */
int plant_do_step(plant *p, double t, double h, double pulses, const rig_pins_out *out);
/* n ticks; for physics tests and settling. */
void plant_run(plant *p, const rig_pins_out *out, rig_pins_in *in, size_t n);
void plant_set_fixture(plant *p, plant_fixture fixture);
/* Force in N of masses that somebody places on the load cell. */
void plant_set_cell_load(plant *p, double force);
void plant_set_faults(plant *p, const plant_faults *faults);
void plant_get_truth(const plant *p, plant_truth *truth);
size_t plant_state_size(void);
void plant_save(const plant *p, void *state);
void plant_restore(plant *p, const void *state);

#ifdef __cplusplus
}
#endif
#endif
