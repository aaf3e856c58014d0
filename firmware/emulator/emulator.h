/* The Arduino Mega, emulated cycle by cycle: the firmware's ELF unchanged in libsimavr, wired to
 * device models and to the same bench function that the native firmware runs against.
 *
 * Time passes only inside `rig_emulator_run`; the same bytes at the same times give the same bytes.
 * Cycles are those of the 16 MHz clock.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (libsimavr is; the rest of rig is BSD-3-Clause)
 */
#ifndef RIG_EMULATOR_H
#define RIG_EMULATOR_H

#include <stddef.h>
#include <stdint.h>

#include "rig_host.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rig_emulator rig_emulator;

/* `elf` is a file. NULL if it cannot be loaded; `problem` (of `size` bytes) then says why. */
rig_emulator *rig_emulator_new(const char *elf, char *problem, size_t size);
void rig_emulator_free(rig_emulator *emulator);

/* Bytes of the serial line, host to board; they arrive one after another at the line's pace. */
void rig_emulator_receive(rig_emulator *emulator, const uint8_t *bytes, size_t count);

/* Runs `milliseconds`; returns how many were run, fewer if the processor stopped for good. */
uint32_t rig_emulator_run(rig_emulator *emulator, rig_bench_fn bench_fn, void *bench,
                          uint32_t milliseconds);

/* Bytes of the serial line, board to host: taking at most `capacity`. */
size_t rig_emulator_transmit(rig_emulator *emulator, uint8_t *out, size_t capacity);

uint64_t rig_emulator_time_ms(const rig_emulator *emulator);

/* Where the processor is in flash, bytes; for the message when it stopped. */
uint32_t rig_emulator_program_counter(const rig_emulator *emulator);

/* The board loses its supply, or is held in reset, for `dead_ms`; then it starts with `cause`, a
 * reset_cause of rig.dbc. Meanwhile its outputs are not driven. The EEPROM is kept. */
void rig_emulator_restart(rig_emulator *emulator, uint8_t cause, uint32_t dead_ms);

/* Writes the image as a C++ source; 0 if it cannot be written. Compiled with machine.h beside it,
 * it makes this image run several times faster: see `rig_emulator_use`. */
int rig_emulator_translate(const rig_emulator *emulator, const char *file);

/* Runs the compiled translation from now on, a shared library. 0, and nothing changed, if it cannot
 * be loaded or is of another image; `problem` (of `size` bytes) then says why. */
int rig_emulator_use(rig_emulator *emulator, const char *library, char *problem, size_t size);

/* From now on libsimavr runs every instruction itself: slower, for comparison. */
void rig_emulator_run_plainly(rig_emulator *emulator);

/* The main loop hangs, interrupts go on; only the watchdog helps. */
void rig_emulator_hang(rig_emulator *emulator);

size_t rig_emulator_eeprom_size(void);
void rig_emulator_eeprom_load(rig_emulator *emulator, const uint8_t *image);
void rig_emulator_eeprom_store(const rig_emulator *emulator, uint8_t *image);

/* The HX711's data line held, whatever the chip says: at low (always ready) or high (never). */
enum { RIG_LINE_FREE = 0, RIG_LINE_LOW = 1, RIG_LINE_HIGH = 2 };
void rig_emulator_hold_hx711(rig_emulator *emulator, int hold);

/* Writes the board's signals to a VCD file from now on; 0 if it cannot be written. */
int rig_emulator_trace(rig_emulator *emulator, const char *file);
void rig_emulator_end_trace(rig_emulator *emulator);

/* --- what the emulator measured ---------------------------------------------------------------- */

typedef struct {
  uint64_t pulses;              /* that moved the motor */
  uint64_t without_current;     /* given while the driver was off */
  uint64_t short_pulses, short_pauses, early_pulses, late_turns; /* violations of the driver's limits */
  uint32_t least_pulse, least_pause, least_setup, least_hold;    /* cycles; all ones: none yet */
} rig_stepper_figures;

typedef struct {
  uint64_t words;               /* read out in full */
  uint64_t missed;              /* overwritten unread */
  uint64_t power_downs;         /* the clock stayed high */
  uint64_t other_gains;         /* read-outs that chose another gain than channel A at 128 */
  uint32_t longest_high;        /* of the clock, cycles */
} rig_hx711_figures;

enum { RIG_VECTORS = 58 };

typedef struct {
  uint64_t count, cycles;
  uint32_t most;                /* cycles from the first instruction to the return */
} rig_interrupt_figures;

typedef struct {
  uint64_t cycles, slept;
  uint64_t ticks;
  /* of a control tick, from its interrupt until it is decided and its pins are written, which must
   * be before the next: all cycles, and those outside interrupts */
  uint64_t response_cycles, own_cycles;
  uint32_t most_response, most_own;
  rig_interrupt_figures interrupts[RIG_VECTORS]; /* by vector number */
} rig_load_figures;

void rig_emulator_stepper(const rig_emulator *emulator, rig_stepper_figures *figures);
void rig_emulator_hx711(const rig_emulator *emulator, rig_hx711_figures *figures);
void rig_emulator_load(const rig_emulator *emulator, rig_load_figures *figures);
/* Begins the load figures anew. */
void rig_emulator_restart_load(rig_emulator *emulator);

/* Cycles of every step pulse from now on, up to `capacity`: when the timer asked for it, and when
 * the pin rose. */
void rig_emulator_log_steps(rig_emulator *emulator, size_t capacity);
size_t rig_emulator_logged_steps(const rig_emulator *emulator, const uint64_t **due,
                                 const uint64_t **rose);

#ifdef __cplusplus
}
#endif

#endif
