/* The virtual bench in C: pneumatics, plunger, actuator dynamics and sensors at a fixed 1 ms step.
 *
 * Plain data in, plain data out: the state is one block of memory, so saving and restoring it is a
 * copy, and the same seed gives the same bytes. All quantities are SI; pressures are absolute
 * unless named gauge. `plant_do_step` has the signature that the firmware's host HAL calls.
 */
#ifndef RIG_PLANT_H
#define RIG_PLANT_H

#include <stddef.h>
#include <stdint.h>

#include "rig_host.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PLANT_TABLE = 1024, PLANT_PLAYS = 3 };

/* Quasi-static response over uniform gauge pressures from table_low to table_high. */
typedef struct {
  double table_low, table_high;
  double angle[PLANT_TABLE];          /* rad, tip free */
  double blocked_force[PLANT_TABLE];  /* N, tip blocked */
  double volume_free[PLANT_TABLE];    /* m3 */
  double volume_blocked[PLANT_TABLE]; /* m3 */
} plant_response;

typedef struct {
  /* surroundings */
  double ambient_pressure, ambient_temperature;
  /* plunger: volume swept per step pulse, backlash as swept volume, travel, dead volume */
  double volume_per_step, backlash_volume, syringe_volume, dead_volume;
  double start_volume; /* where the plunger stands at power-on, pushed in from home */
  /* gas */
  double tube_volume, tube_resistance; /* Pa s/m3 */
  double valve_resistance;             /* Pa s/m3 when open */
  double leak_conductance;             /* m3/s (ambient conditions) per Pa gauge */
  double heat_exchange_time;
  /* actuator dynamics */
  double response_time; /* first-order lag of shape behind pressure */
  double creep_share, creep_time;
  double play_share, play_radius[PLANT_PLAYS]; /* hysteresis: share and radii in Pa */
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
  double time, gauge_pressure, angle, force, actuator_volume, pushed_volume, gas_moles;
  double temperature;
  double actuator_pressure, peak_pressure;
  double valve_opened; /* when the closed valve was last opened */
  int32_t valve_open;
} plant_truth;

typedef struct plant plant;

plant *plant_new(const plant_parameters *parameters, const plant_response *response,
                 uint64_t seed);
void plant_free(plant *p);
/* Advances the bench by 1 ms; a rig_bench_fn. */
void plant_do_step(void *p, const rig_pins_out *out, rig_pins_in *in);
/* The same with idle pins, n times; for physics tests and settling. */
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
