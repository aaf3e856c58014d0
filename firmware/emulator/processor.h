// The instructions of an AVR with 22 bits of program counter, decoded once and then run fast.
// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdint.h>

#include <vector>

struct avr_t;

namespace rig_emulator_parts {

// Runs what works on registers, memory and flash by itself, and hands everything else (registers
// of devices, interrupts, sleep, the rare instruction) to libsimavr, one instruction at a time.
// Cycles and results are those of libsimavr, which the tests compare; only the time differs.
class Processor {
 public:
  explicit Processor(avr_t *avr);

  // Until the next of libsimavr's timers is due, an interrupt may begin, or the processor rests:
  // what avr->run does.
  void run();

 private:
  struct Instruction {
    uint8_t code;
    uint8_t d, r;     // registers, bit numbers, constants
    uint8_t unused;
    int32_t k;        // address, displacement
  };

  uint32_t execute();
  void decode(uint32_t word);
  bool is_long(uint32_t word) const;
  uint32_t opcode(uint32_t word) const;

  avr_t *avr_;
  std::vector<Instruction> program_;
};

}  // namespace rig_emulator_parts
