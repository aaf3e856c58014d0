/* The firmware as it runs on the host: one board, one bench, milliseconds as asked for.
 *
 * The bench is a function that is shown what the board's outputs did during one millisecond and
 * says what the board's inputs were. Time passes only inside `rig_host_run`.
 */
#ifndef RIG_HOST_H
#define RIG_HOST_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What the bench shows the board during one millisecond. `adc` holds the conversions of the
 * pressure input; `hx711_word` (24 bits) is taken when `hx711_ready`. */
typedef struct {
  uint16_t adc[10];
  uint8_t adc_count;
  uint8_t home_switch, end_switch, emergency_stop;
  uint8_t hx711_ready;
  uint32_t hx711_word;
} rig_pins_in;

/* Signed step pulses in this millisecond (+ pushes air in), and three levels; an HX711 that is not
 * powered gives no words and starts anew. */
typedef struct {
  int32_t steps;
  uint8_t motor_enabled, valve_open, hx711_powered;
} rig_pins_out;

/* Advances the bench by 1 ms. */
typedef void (*rig_bench_fn)(void *bench, const rig_pins_out *out, rig_pins_in *in);

typedef struct rig_host rig_host;

/* `firmware_git`: the first 24 bits of the commit; `reset_cause` as in rig.dbc. */
rig_host *rig_host_new(uint32_t firmware_git, uint8_t reset_cause);
void rig_host_free(rig_host *host);

/* Bytes of the serial line, host to board; the board reads them in the next millisecond. */
void rig_host_receive(rig_host *host, const uint8_t *bytes, size_t count);

/* How many bytes the line takes from the board in a millisecond; 115200 baud takes 11. New boards
 * have a line as fast as needed. */
void rig_host_pace_line(rig_host *host, size_t bytes_per_ms);

/* Runs at most `milliseconds`; returns how many were run. With `stop_on_tx` it stops after the
 * millisecond in which the board sent something. */
uint32_t rig_host_run(rig_host *host, rig_bench_fn bench_fn, void *bench, uint32_t milliseconds,
                      int stop_on_tx);

/* Bytes of the serial line, board to host: how many wait, and taking at most `capacity`. */
size_t rig_host_pending(const rig_host *host);
size_t rig_host_transmit(rig_host *host, uint8_t *out, size_t capacity);

/* The state of the board (heartbeat of rig.dbc) and a parameter, without asking over the line; the
 * board must have run. */
uint8_t rig_host_state(const rig_host *host);
float rig_host_parameter(const rig_host *host, unsigned index);

uint64_t rig_host_time_ms(const rig_host *host);

/* The non-volatile memory; what is loaded before the first millisecond is what the board boots
 * with. New boards have it erased. */
size_t rig_host_nonvolatile_size(void);
void rig_host_nonvolatile_load(rig_host *host, const uint8_t *image);
void rig_host_nonvolatile_store(const rig_host *host, uint8_t *image);

/* The board is dead for `dead_ms`, then starts anew with this reset cause; the non-volatile memory
 * stays. Meanwhile no step is made and no byte read. The outputs stay as they are for the first
 * `held_ms`, then fall off, which opens the valve. */
void rig_host_restart(rig_host *host, uint8_t reset_cause, uint32_t held_ms, uint32_t dead_ms);

/* The parameter table; indices and names are those of rig.dbc. `live` parameters may be written
 * while the bench is under pressure. */
unsigned rig_host_parameter_count(void);
float rig_host_parameter_default(unsigned index);
float rig_host_parameter_min(unsigned index);
float rig_host_parameter_max(unsigned index);
int rig_host_parameter_live(unsigned index);

#ifdef __cplusplus
}
#endif

#endif
