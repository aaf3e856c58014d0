// The Mega on its bench: libsimavr's processor, the device models, and the wires between them. The
// pins are those of rig_mega/src/hal/mega/pins.h.
// SPDX-License-Identifier: GPL-3.0-or-later

#include "emulator.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <memory>
#include <string>
#include <vector>

extern "C" {
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/avr_watchdog.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_vcd_file.h>
}

#include "hx711_chip.h"
#include "processor.h"
#include "stepper_driver.h"
#include "translation.h"

namespace {

using rig_emulator_parts::Hx711Chip;
using rig_emulator_parts::Processor;
using rig_emulator_parts::StepperDriver;

constexpr uint32_t kFrequency = 16000000;
constexpr uint32_t kCyclesPerMs = kFrequency / 1000;
constexpr uint32_t kSupplyMillivolts = 5000;
constexpr uint32_t kAdcLevels = 1023;
// libsimavr paces its receiver at 11 bits a byte; 117647 baud is what the divider makes of 115200.
constexpr uint32_t kCyclesPerByte = 11 * 136;
// An interrupt takes 5 cycles to begin on a processor with 22 bits of program counter (ATmega2560
// datasheet, "Interrupt Response Time"), which libsimavr does not count, and 5 to return.
constexpr uint32_t kEntryCycles = 5, kReturnCycles = 5;
// How far libsimavr may run without looking at its timers; less only costs time.
constexpr avr_cycle_count_t kLongestRun = 100000;

// Port A.
constexpr uint8_t kStep = 1 << 0, kDirection = 1 << 1, kMotorOff = 1 << 2, kValve = 1 << 3;
constexpr uint8_t kSwitchesBegin = 4, kSwitches = 3;  // home, end, emergency stop: normally closed
constexpr uint8_t kSwitchMask = 0x70;
// What the bench makes of outputs that are not driven: motor off, valve open.
constexpr uint8_t kUndriven = kMotorOff | kValve;
// Port C.
constexpr uint8_t kHx711Clock = 6, kHx711Data = 7;

// ATmega2560 registers and vectors.
constexpr uint16_t kMcuStatus = 0x54;
constexpr uint8_t kStepVector = 17, kTickVector = 18;
constexpr size_t kEepromSize = 4096;

// reset_cause of rig.dbc to the flags of MCUSR.
uint8_t status_flags(uint8_t cause) {
  switch (cause) {
    case 1: return 1 << 0;  // power-on
    case 2: return 1 << 1;  // external
    case 3: return 1 << 2;  // brown-out
    case 4: return 1 << 3;  // watchdog
    default: return 0;
  }
}

std::string last_complaint;

void take_complaint(avr_t *, const int level, const char *format, va_list arguments) {
  if (level > LOG_ERROR) return;
  char text[256];
  std::vsnprintf(text, sizeof text, format, arguments);
  last_complaint = text;
}

}  // namespace

struct rig_emulator {
  avr_t *avr = nullptr;
  std::unique_ptr<Processor> processor;
  avr_io_t module = {};  // how libsimavr tells of resets and of the watchdog instruction
  avr_irq_t *port_a = nullptr, *port_c = nullptr, *adc = nullptr, *uart = nullptr;
  avr_flashaddr_t hang_address = 0;

  StepperDriver stepper;
  Hx711Chip hx711;
  int hx711_hold = RIG_LINE_FREE;

  rig_bench_fn bench_fn = nullptr;
  void *bench = nullptr;
  rig_pins_in pins = {};
  uint64_t time_ms = 0;
  avr_cycle_count_t millisecond_ends = kCyclesPerMs;
  uint32_t dead_ms = 0;
  uint8_t restart_cause = 0;

  uint8_t port = 0, drive = 0;  // registers of port A
  uint8_t levels = kUndriven;

  std::deque<uint8_t> to_board;
  std::vector<uint8_t> to_host;
  size_t taken = 0;  // of `to_host`

  rig_load_figures load = {};
  uint64_t load_begins = 0, interrupt_cycles = 0, interrupt_began = 0;
  struct Tick {
    uint64_t began, interrupt_cycles;
  };
  std::deque<Tick> ticks;  // begun, and not yet done
  uint64_t step_due = 0;
  size_t step_log_capacity = 0;
  std::vector<uint64_t> steps_due, steps_rose;

  std::unique_ptr<avr_vcd_t> trace;

  ~rig_emulator() {
    if (avr == nullptr) return;
    end_trace();
    avr_terminate(avr);
    std::free(avr);
  }

  // --- set-up ------------------------------------------------------------------------------------

  bool load_elf(const char *elf) {
    elf_firmware_t firmware = {};
    if (elf_read_firmware(elf, &firmware) != 0 || firmware.flashsize == 0) return false;
    for (uint32_t i = 0; i < firmware.symbolcount; ++i) {
      if (std::string(firmware.symbol[i]->symbol) == "_exit") {
        hang_address = firmware.symbol[i]->addr + 2;  // behind its cli: a jump to itself
      }
    }
    avr = avr_make_mcu_by_name("atmega2560");
    avr_init(avr);
    firmware.frequency = kFrequency;
    avr_load_firmware(avr, &firmware);
    return true;
  }

  void wire() {
    avr->frequency = kFrequency;
    avr->vcc = avr->avcc = avr->aref = kSupplyMillivolts;
    processor.reset(new Processor(avr));
    avr->run = [](avr_t *a) { owner(a)->processor->run(); };
    avr->sleep = [](avr_t *a, avr_cycle_count_t cycles) { owner(a)->sleeps(cycles); };
    avr->custom.data = this;
    uint32_t no_flags = 0;  // neither an echo on our own terminal nor a rest in wall time
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &no_flags);

    port_a = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('A'), 0);
    port_c = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), 0);
    adc = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, 0);
    uart = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), 0);
    listen<&rig_emulator::port_written>(port_a + IOPORT_IRQ_REG_PORT);
    listen<&rig_emulator::direction_written>(port_a + IOPORT_IRQ_DIRECTION_ALL);
    listen<&rig_emulator::hx711_clocked>(port_c + kHx711Clock);
    listen<&rig_emulator::conversion_starts>(adc + ADC_IRQ_OUT_TRIGGER);
    listen<&rig_emulator::byte_sent>(uart + UART_IRQ_OUTPUT);
    for (uint8_t vector = 1; vector < RIG_VECTORS; ++vector) {
      avr_irq_t *irq = avr_get_interrupt_irq(avr, vector);
      if (irq != nullptr) listen<&rig_emulator::interrupt_runs>(irq + AVR_INT_IRQ_RUNNING);
    }
    listen<&rig_emulator::step_requested>(avr_get_interrupt_irq(avr, kStepVector) +
                                          AVR_INT_IRQ_PENDING);

    module.kind = "rig";
    module.reset = [](avr_io_t *io) { owner(io->avr)->was_reset(); };
    module.ioctl = [](avr_io_t *io, uint32_t control, void *) {
      if (control == AVR_IOCTL_WATCHDOG_RESET) owner(io->avr)->watchdog_fed();
      return -1;  // for the watchdog itself to answer
    };
    avr_register_io(avr, &module);
  }

  static rig_emulator *owner(avr_t *avr) { return static_cast<rig_emulator *>(avr->custom.data); }

  template <void (rig_emulator::*Handler)(avr_irq_t *, uint32_t)>
  void listen(avr_irq_t *irq) {
    avr_irq_register_notify(
        irq,
        [](avr_irq_t *source, uint32_t value, void *self) {
          (static_cast<rig_emulator *>(self)->*Handler)(source, value);
        },
        this);
  }

  template <avr_cycle_count_t (rig_emulator::*Handler)(avr_cycle_count_t)>
  static avr_cycle_count_t timer(avr_t *avr, avr_cycle_count_t when, void *) {
    return (owner(avr)->*Handler)(when);
  }

  // --- resets ------------------------------------------------------------------------------------

  void restart(uint8_t cause) {
    avr_reset(avr);
    avr->data[kMcuStatus] = status_flags(cause);
    avr->state = cpu_Running;
  }

  // libsimavr forgets its timers and the levels at the pins, and holds back repeated levels.
  void was_reset() {
    avr->run_cycle_limit = kLongestRun;
    avr_cycle_timer_register(avr, millisecond_ends - avr->cycle,
                             timer<&rig_emulator::millisecond_over>, nullptr);
    if (!to_board.empty()) feed();
    avr_raise_irq(port_a + IOPORT_IRQ_REG_PORT, 0);
    avr_raise_irq(port_a + IOPORT_IRQ_DIRECTION_ALL, 0);
    avr_raise_irq(port_c + kHx711Clock, 0);
    set_outputs(0, 0);
    drive_inputs(true);
    ticks.clear();
    interrupt_began = 0;
  }

  // --- a millisecond -----------------------------------------------------------------------------

  uint32_t run(uint32_t milliseconds) {
    const uint64_t first = time_ms, goal = first + milliseconds;
    while (time_ms < goal) {
      if (dead_ms > 0) {
        avr->cycle = millisecond_ends;
        to_board.clear();
        step_bench();
        if (--dead_ms == 0) restart(restart_cause);
      } else {
        const int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) break;
      }
    }
    return static_cast<uint32_t>(time_ms - first);
  }

  avr_cycle_count_t millisecond_over(avr_cycle_count_t) {
    step_bench();
    drive_inputs(false);
    if (!to_board.empty() &&
        avr_cycle_timer_status(avr, timer<&rig_emulator::byte_arrives>, nullptr) == 0) {
      feed();
    }
    return millisecond_ends;
  }

  void step_bench() {
    const rig_pins_out out = {stepper.take_steps(), stepper.enabled(), (levels & kValve) != 0,
                              hx711.awake()};
    pins = {};
    bench_fn(bench, &out, &pins);
    ++time_ms;
    millisecond_ends += kCyclesPerMs;
    if (pins.hx711_ready) hx711.converted(pins.hx711_word);
  }

  // --- pins --------------------------------------------------------------------------------------

  void port_written(avr_irq_t *, uint32_t value) { set_outputs(static_cast<uint8_t>(value), drive); }
  void direction_written(avr_irq_t *, uint32_t value) {
    set_outputs(port, static_cast<uint8_t>(value));
  }

  void set_outputs(uint8_t new_port, uint8_t new_drive) {
    const uint8_t pull_ups_before = port & ~drive & kSwitchMask;
    port = new_port;
    drive = new_drive;
    const uint8_t now = static_cast<uint8_t>((port & drive) | (kUndriven & ~drive));
    const uint8_t changed = now ^ levels;
    levels = now;
    if (changed & kDirection) stepper.turn((now & kDirection) != 0, avr->cycle);
    if (changed & kMotorOff) stepper.switch_off((now & kMotorOff) != 0);
    if (changed & kStep) {
      if (now & kStep) {
        log_step();
        stepper.step_rises(avr->cycle);
      } else {
        stepper.step_falls(avr->cycle);
      }
    }
    if ((port & ~drive & kSwitchMask) != pull_ups_before) drive_inputs(false);
  }

  // An opened contact leaves the pin to the pull-up, if the firmware has switched that on.
  void drive_inputs(bool again) {
    const uint8_t open = static_cast<uint8_t>((pins.home_switch ? 1 : 0) |
                                              (pins.end_switch ? 2 : 0) |
                                              (pins.emergency_stop ? 4 : 0));
    const uint8_t shown = static_cast<uint8_t>(open << kSwitchesBegin) & port & ~drive;
    avr_ioport_external_t outside = {'A', kSwitchMask, shown};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('A'), &outside);
    for (uint8_t pin = kSwitchesBegin; pin < kSwitchesBegin + kSwitches; ++pin) {
      drive_pin(port_a + pin, shown >> pin & 1, again);
    }
    drive_hx711(again);
  }

  void drive_hx711(bool again) {
    const bool level = hx711_hold == RIG_LINE_FREE ? hx711.data_line() : hx711_hold == RIG_LINE_HIGH;
    avr_ioport_external_t outside = {'C', 1 << kHx711Data,
                                     static_cast<unsigned long>(level) << kHx711Data};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('C'), &outside);
    drive_pin(port_c + kHx711Data, level, again);
  }

  static void drive_pin(avr_irq_t *pin, bool level, bool again) {
    if (again) avr_raise_irq(pin, !level);
    avr_raise_irq(pin, level);
  }

  void hx711_clocked(avr_irq_t *, uint32_t level) {
    if (level) {
      hx711.clock_rises(avr->cycle);
      avr_cycle_timer_register(avr, Hx711Chip::kSleepCycles, timer<&rig_emulator::hx711_sleeps>,
                               nullptr);
    } else {
      hx711.clock_falls(avr->cycle);
      avr_cycle_timer_cancel(avr, timer<&rig_emulator::hx711_sleeps>, nullptr);
    }
    drive_hx711(false);
  }

  avr_cycle_count_t hx711_sleeps(avr_cycle_count_t) {
    hx711.sleep();
    drive_hx711(false);
    return 0;
  }

  // A conversion holds what the bench shows at its start: of the millisecond's values the one whose
  // turn it is. libsimavr wants millivolts and scales them to 1023 levels, rounding down.
  void conversion_starts(avr_irq_t *, uint32_t) {
    uint32_t value = 0;
    if (pins.adc_count > 0) {
      const avr_cycle_count_t elapsed = avr->cycle + kCyclesPerMs - millisecond_ends;
      const avr_cycle_count_t turn = elapsed * pins.adc_count / kCyclesPerMs;
      value = pins.adc[std::min<avr_cycle_count_t>(turn, pins.adc_count - 1u)];
    }
    avr_raise_irq(adc, (value * kSupplyMillivolts + kAdcLevels - 1) / kAdcLevels);
  }

  // --- serial line -------------------------------------------------------------------------------

  void feed() {
    avr_cycle_timer_register(avr, kCyclesPerByte, timer<&rig_emulator::byte_arrives>, nullptr);
  }

  avr_cycle_count_t byte_arrives(avr_cycle_count_t when) {
    if (to_board.empty()) return 0;
    avr_raise_irq(uart + UART_IRQ_INPUT, to_board.front());
    to_board.pop_front();
    return to_board.empty() ? 0 : when + kCyclesPerByte;
  }

  void byte_sent(avr_irq_t *, uint32_t byte) { to_host.push_back(static_cast<uint8_t>(byte)); }

  // --- measuring ---------------------------------------------------------------------------------

  void sleeps(avr_cycle_count_t cycles) {
    avr->cycle -= 1;  // libsimavr adds one to every sleep
    load.slept += cycles;
  }

  // The firmware feeds the watchdog when a tick is decided and its pins are written.
  void watchdog_fed() {
    if (ticks.empty()) return;  // switching the watchdog on feeds it, too
    const Tick tick = ticks.front();
    ticks.pop_front();
    const uint64_t response = avr->cycle - tick.began;
    const uint64_t own = response - (interrupt_cycles - tick.interrupt_cycles);
    ++load.ticks;
    load.response_cycles += response;
    load.own_cycles += own;
    load.most_response = std::max(load.most_response, static_cast<uint32_t>(response));
    load.most_own = std::max(load.most_own, static_cast<uint32_t>(own));
  }

  // libsimavr numbers the signals of an interrupt from 256 times its vector.
  static uint8_t vector_of(const avr_irq_t *irq) { return static_cast<uint8_t>(irq->irq >> 8); }

  void interrupt_runs(avr_irq_t *irq, uint32_t running) {
    if (running) {
      interrupt_began = avr->cycle;
      avr->cycle += kEntryCycles;
      avr->run_cycle_count -= std::min<avr_cycle_count_t>(avr->run_cycle_count, kEntryCycles);
      if (vector_of(irq) == kTickVector) ticks.push_back({interrupt_began, interrupt_cycles});
    } else {
      const uint64_t cycles = avr->cycle + kReturnCycles - interrupt_began;
      interrupt_cycles += cycles;
      rig_interrupt_figures &figures = load.interrupts[vector_of(irq)];
      ++figures.count;
      figures.cycles += cycles;
      figures.most = std::max(figures.most, static_cast<uint32_t>(cycles));
    }
  }

  void step_requested(avr_irq_t *, uint32_t pending) {
    if (pending) step_due = avr->cycle;
  }

  void log_step() {
    if (steps_rose.size() >= step_log_capacity) return;
    steps_due.push_back(step_due);
    steps_rose.push_back(avr->cycle);
  }

  bool start_trace(const char *file) {
    trace.reset(new avr_vcd_t());
    if (avr_vcd_init(avr, file, trace.get(), 100000) != 0) return false;
    const struct {
      avr_irq_t *irq;
      int bits;
      const char *name;
    } signals[] = {
        {port_a + 0, 1, "step"},        {port_a + 1, 1, "direction"},
        {port_a + 2, 1, "motor_off"},   {port_a + 3, 1, "valve"},
        {port_a + 4, 1, "home_switch"}, {port_a + 5, 1, "end_switch"},
        {port_a + 6, 1, "emergency"},   {port_c + kHx711Clock, 1, "hx711_clock"},
        {port_c + kHx711Data, 1, "hx711_data"},
        {adc + ADC_IRQ_ADC0, 16, "pressure_mv"},
        {uart + UART_IRQ_INPUT, 8, "from_host"},
        {uart + UART_IRQ_OUTPUT, 8, "to_host"},
    };
    for (const auto &signal : signals) {
      avr_vcd_add_signal(trace.get(), signal.irq, signal.bits, signal.name);
    }
    return avr_vcd_start(trace.get()) == 0;
  }

  void end_trace() {
    if (trace) avr_vcd_close(trace.get());
    trace.reset();
  }

  avr_eeprom_desc_t eeprom() const {
    avr_eeprom_desc_t desc = {};
    avr_ioctl(avr, AVR_IOCTL_EEPROM_GET, &desc);
    return desc;
  }
};

rig_emulator *rig_emulator_new(const char *elf, char *problem, size_t size) {
  avr_global_logger_set(take_complaint);
  last_complaint.clear();
  std::unique_ptr<rig_emulator> emulator(new rig_emulator);
  if (!emulator->load_elf(elf)) {
    std::snprintf(problem, size, "%s",
                  last_complaint.empty() ? "not an ELF of an AVR" : last_complaint.c_str());
    return nullptr;
  }
  emulator->wire();
  emulator->restart(1);
  return emulator.release();
}

void rig_emulator_free(rig_emulator *emulator) { delete emulator; }

void rig_emulator_receive(rig_emulator *emulator, const uint8_t *bytes, size_t count) {
  emulator->to_board.insert(emulator->to_board.end(), bytes, bytes + count);
}

uint32_t rig_emulator_run(rig_emulator *emulator, rig_bench_fn bench_fn, void *bench,
                          uint32_t milliseconds) {
  emulator->bench_fn = bench_fn;
  emulator->bench = bench;
  return emulator->run(milliseconds);
}

size_t rig_emulator_transmit(rig_emulator *emulator, uint8_t *out, size_t capacity) {
  std::vector<uint8_t> &line = emulator->to_host;
  const size_t count = std::min(line.size() - emulator->taken, capacity);
  std::copy_n(line.begin() + static_cast<std::ptrdiff_t>(emulator->taken), count, out);
  emulator->taken += count;
  if (emulator->taken == line.size()) {
    line.clear();
    emulator->taken = 0;
  }
  return count;
}

uint64_t rig_emulator_time_ms(const rig_emulator *emulator) { return emulator->time_ms; }

uint32_t rig_emulator_program_counter(const rig_emulator *emulator) { return emulator->avr->pc; }

void rig_emulator_restart(rig_emulator *emulator, uint8_t cause, uint32_t dead_ms) {
  emulator->set_outputs(0, 0);
  if (dead_ms == 0) {
    emulator->restart(cause);
  } else {
    emulator->dead_ms = dead_ms;
    emulator->restart_cause = cause;
  }
}

int rig_emulator_translate(const rig_emulator *emulator, const char *file) {
  const std::string source = emulator->processor->translation();
  std::FILE *out = std::fopen(file, "w");
  if (out == nullptr) return 0;
  const bool written = std::fwrite(source.data(), 1, source.size(), out) == source.size();
  return std::fclose(out) == 0 && written;
}

int rig_emulator_use(rig_emulator *emulator, const char *library, char *problem, size_t size) {
  // never closed: another emulator may run it, too
  void *const opened = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  if (opened == nullptr) {
    std::snprintf(problem, size, "%s", dlerror());
    return 0;
  }
  const auto *blocks = static_cast<const rig_emulator_parts::Block *>(dlsym(opened, "rig_blocks"));
  const auto *count = static_cast<const uint32_t *>(dlsym(opened, "rig_block_count"));
  const auto *digest = static_cast<const uint64_t *>(dlsym(opened, "rig_digest"));
  if (blocks == nullptr || count == nullptr || digest == nullptr) {
    std::snprintf(problem, size, "it is no translated image");
    return 0;
  }
  if (!emulator->processor->use(blocks, *count, *digest)) {
    std::snprintf(problem, size, "it is the translation of another image");
    return 0;
  }
  return 1;
}

void rig_emulator_run_plainly(rig_emulator *emulator) {
  emulator->avr->run = avr_callback_run_raw;
}

void rig_emulator_hang(rig_emulator *emulator) {
  emulator->avr->pc = emulator->hang_address;
  emulator->avr->sreg[S_I] = 1;
  emulator->avr->state = cpu_Running;
}

size_t rig_emulator_eeprom_size(void) { return kEepromSize; }

void rig_emulator_eeprom_load(rig_emulator *emulator, const uint8_t *image) {
  std::copy_n(image, kEepromSize, emulator->eeprom().ee);
}

void rig_emulator_eeprom_store(const rig_emulator *emulator, uint8_t *image) {
  std::copy_n(emulator->eeprom().ee, kEepromSize, image);
}

void rig_emulator_hold_hx711(rig_emulator *emulator, int hold) {
  emulator->hx711_hold = hold;
  emulator->drive_hx711(false);
}

int rig_emulator_trace(rig_emulator *emulator, const char *file) {
  return emulator->start_trace(file);
}

void rig_emulator_end_trace(rig_emulator *emulator) { emulator->end_trace(); }

void rig_emulator_stepper(const rig_emulator *emulator, rig_stepper_figures *figures) {
  *figures = emulator->stepper.figures();
}

void rig_emulator_hx711(const rig_emulator *emulator, rig_hx711_figures *figures) {
  *figures = emulator->hx711.figures();
}

void rig_emulator_load(const rig_emulator *emulator, rig_load_figures *figures) {
  *figures = emulator->load;
  figures->cycles = emulator->avr->cycle - emulator->load_begins;
}

void rig_emulator_restart_load(rig_emulator *emulator) {
  emulator->load = {};
  emulator->load_begins = emulator->avr->cycle;
}

void rig_emulator_log_steps(rig_emulator *emulator, size_t capacity) {
  emulator->step_log_capacity = capacity;
  emulator->steps_due.clear();
  emulator->steps_rose.clear();
}

size_t rig_emulator_logged_steps(const rig_emulator *emulator, const uint64_t **due,
                                 const uint64_t **rose) {
  *due = emulator->steps_due.data();
  *rose = emulator->steps_rose.data();
  return emulator->steps_rose.size();
}
