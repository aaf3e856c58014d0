// The processor of the Mega: runs what works on registers and memory by itself, and asks libsimavr
// for the rest.
// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdint.h>

#include <string>
#include <vector>

#include "instruction.h"

struct avr_t;

namespace rig_emulator_parts {

// Registers of devices are read and written as libsimavr does it; the rare instruction is handed
// over to it. Cycles and results are those of libsimavr, which the tests compare; only the time
// differs, most of all with a translated image.
class Processor {
 public:
  explicit Processor(avr_t *avr);

  // Until the next of libsimavr's timers is due, an interrupt may begin, or the processor rests:
  // what avr->run does.
  void run();

  // The image as a C++ source, to be compiled for `use`.
  std::string translation() const;

  // Runs translated blocks, `count` of them by address, where there are some. False, and nothing
  // changed, unless `digest` is that of the image in flash.
  bool use(const Block *blocks, uint32_t count, uint64_t digest);

 private:
  uint32_t execute();
  uint32_t interpret(Machine &machine, uint32_t pc);
  bool with_device(Machine &machine, const Instruction &instruction);
  uint32_t hand_over(Machine &machine, uint32_t pc);
  void take(Machine &machine) const;
  void give(const Machine &machine) const;
  uint8_t read_device(Machine &machine, uint32_t address);
  void write_device(Machine &machine, uint32_t address, uint8_t value);
  void switch_interrupts(Machine &machine, bool on);
  void find_deadline(Machine &machine) const;

  avr_t *avr_;
  Image image_;
  std::vector<Instruction> program_;
  const Block *blocks_ = nullptr;
  uint32_t block_count_ = 0;
};

}  // namespace rig_emulator_parts
