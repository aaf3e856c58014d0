#include "mega_board.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "../../core/rig_core.h"
#include "adc.h"
#include "hx711_bus.h"
#include "pacemaker.h"
#include "parameter_store.h"
#include "pins.h"
#include "reset.h"
#include "serial_line.h"

#ifndef RIG_FIRMWARE_GIT
#define RIG_FIRMWARE_GIT 0  // the Makefile gives the commit; the Arduino IDE cannot
#endif

namespace rig {
namespace mega {

namespace {

constexpr uint8_t kMegaBoard = 1;  // board_kind of rig.dbc

ParameterStore store;

RigCore &core() {
  static RigCore instance({kMegaBoard, RIG_FIRMWARE_GIT, reset_cause()}, store.image());
  return instance;
}

// The Arduino core leaves all timers running; only ours are needed.
void stop_timers() {
  TIMSK0 = 0;
  TCCR0B = TCCR2B = TCCR3B = TCCR4B = TCCR5B = 0;
}

void pins_begin() {
  PORTA = kSafe;
  DDRA = kStep | kDirection | kMotorOff | kValve;
}

void set_pin(uint8_t pin, bool high) {
  const uint8_t before = SREG;
  cli();  // the step interrupt writes the same port
  if (high) {
    PORTA |= pin;
  } else {
    PORTA &= static_cast<uint8_t>(~pin);
  }
  SREG = before;
}

Inputs read_pins(const TickSample &sample) {
  const uint8_t pins = PINA;
  return {sample.adc_sum, sample.adc_count, (pins & kHomeSwitch) != 0, (pins & kEndSwitch) != 0,
          (pins & kEmergencyStop) != 0};
}

void write_pins(const Outputs &outputs) {
  set_pin(kValve, outputs.valve_open);
  set_pin(kMotorOff, !outputs.motor_enabled);
  plan_steps(outputs.steps);
  hx711_power(outputs.load_cell_powered);
}

void exchange_bytes(RigCore &rig) {
  uint8_t byte;
  while (serial_read(byte)) rig.receive(byte);
  HostLink::TransmitQueue &queue = rig.transmit_queue();
  while (!queue.empty() && serial_can_write()) serial_write(queue.pop());
}

// Conversions and bytes wake the processor twenty times a tick, for nothing that cannot wait. No
// tick slips in between the question and the sleep: what follows sei is still carried out.
void sleep_until_tick() {
  SMCR = _BV(SE);  // idle
  cli();
  while (!tick_waiting()) {
    sei();
    sleep_cpu();
    cli();
  }
  sei();
  SMCR = 0;
}

}  // namespace

void begin() {
  stop_timers();
  pins_begin();
  store.read();
  core();
  serial_begin();
  hx711_begin();
  adc_begin();
  pacemaker_begin();
  watchdog_begin();
}

// The tick first: the next one carries out what this one decides.
void step() {
  RigCore &rig = core();
  TickSample sample;
  if (tick_due(sample)) {
    const uint16_t queued = rig.transmit_queue().size();
    rig.tick(read_pins(sample));
    // a message and a conversion in one tick would make it late; the chip waits
    const bool reported = rig.transmit_queue().size() != queued;
    write_pins(rig.outputs());
    wdt_reset();
    if (!reported && rig.outputs().load_cell_powered && hx711_ready()) {
      rig.load_cell_word(hx711_read());
    }
    if (!store.writing() && rig.take_save(store.image())) store.begin_write();
    store.step();
  }
  exchange_bytes(rig);
  sleep_until_tick();
}

}  // namespace mega
}  // namespace rig
