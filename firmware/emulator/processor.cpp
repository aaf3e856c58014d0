// See processor.h.
// SPDX-License-Identifier: GPL-3.0-or-later

#include "processor.h"

#include <algorithm>

#include "translation.h"

extern "C" {
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

// exported, though declared in no header that is installed
avr_flashaddr_t avr_run_one(avr_t *avr);
}

namespace rig_emulator_parts {

namespace {

static_assert(kDevicesEnd == MAX_IOs + 31 && kMemoryBegins == MAX_IOs + 32, "as libsimavr has it");
static_assert(kStackLow == R_SPL, "as libsimavr has it");
constexpr avr_cycle_count_t kWithoutTimer = 1000;  // libsimavr's default

}  // namespace

Processor::Processor(avr_t *avr)
    : avr_(avr), image_{avr->flash, (avr->flashend + 1) / 2, avr->ramend, {}, {}},
      program_(image_.words) {
  for (uint32_t address = kDevicesBegin; address < kDevicesEnd; ++address) {
    const auto &device = avr->io[address - kDevicesBegin];
    image_.plain_reads[address] = device.r.c == nullptr;
    image_.plain_writes[address] = device.w.c == nullptr;
  }
}

std::string Processor::translation() const { return rig_emulator_parts::translation(image_); }

bool Processor::use(const Block *blocks, uint32_t count, uint64_t digest) {
  if (digest != digest_of(image_)) return false;
  blocks_ = blocks;
  block_count_ = count;
  return true;
}

// --- running -------------------------------------------------------------------------------------

void Processor::take(Machine &m) const {
  std::copy_n(avr_->data, sizeof m.r, m.r);
  const uint8_t *const flag = avr_->sreg;
  m.carry = flag[S_C];
  m.not_zero = !flag[S_Z];
  m.negative = static_cast<uint32_t>(flag[S_N] << 7);
  m.overflow = static_cast<uint32_t>(flag[S_V] << 7);
  m.sign = static_cast<uint32_t>(flag[S_S] << 7);
  m.half = static_cast<uint32_t>(flag[S_H] << 4);
  m.transfer = flag[S_T];
  m.interrupts = flag[S_I];
  m.cycle = avr_->cycle;
}

void Processor::give(const Machine &m) const {
  std::copy_n(m.r, sizeof m.r, avr_->data);
  uint8_t *const flag = avr_->sreg;
  flag[S_C] = static_cast<uint8_t>(m.carry);
  flag[S_Z] = m.not_zero == 0;
  flag[S_N] = m.negative >> 7 & 1;
  flag[S_V] = m.overflow >> 7 & 1;
  flag[S_S] = m.sign >> 7 & 1;
  flag[S_H] = m.half >> 4 & 1;
  flag[S_T] = static_cast<uint8_t>(m.transfer);
  avr_->cycle = m.cycle;
}

// A device may have asked for a timer or an interrupt, or stopped the processor.
void Processor::find_deadline(Machine &m) const {
  const avr_cycle_timer_slot_t *next = avr_->cycle_timers.timer;
  const bool stops = avr_->interrupt_state != 0 || avr_->state != cpu_Running;
  m.deadline = stops ? 0 : next != nullptr ? next->when : m.cycle + kWithoutTimer;
}

uint8_t Processor::read_device(Machine &m, uint32_t address) {
  if (image_.plain_reads[address]) return avr_->data[address];
  const auto &device = avr_->io[address - kDevicesBegin].r;
  avr_->cycle = m.cycle;
  avr_->data[address] = device.c(avr_, static_cast<avr_io_addr_t>(address), device.param);
  find_deadline(m);
  return avr_->data[address];
}

void Processor::write_device(Machine &m, uint32_t address, uint8_t value) {
  if (image_.plain_writes[address]) {
    avr_->data[address] = value;
    return;
  }
  const auto &device = avr_->io[address - kDevicesBegin].w;
  avr_->cycle = m.cycle;
  device.c(avr_, static_cast<avr_io_addr_t>(address), value, device.param);
  find_deadline(m);
}

void Processor::switch_interrupts(Machine &m, bool on) {
  avr_sreg_set(avr_, S_I, on);
  m.interrupts = on;
  if (avr_->interrupt_state != 0) m.deadline = 0;
}

uint32_t Processor::hand_over(Machine &m, uint32_t pc) {
  give(m);
  avr_->pc = 2 * pc;
  avr_->run_cycle_count = 1;  // no more than one instruction
  const uint32_t next = avr_run_one(avr_) / 2;
  take(m);
  find_deadline(m);
  return next;
}

// What the machine cannot do by itself, but no instruction that libsimavr must see.
bool Processor::with_device(Machine &m, const Instruction &i) {
  if (i.code == k_write_status) {
    m.set_flags(m.r[i.d]);
    switch_interrupts(m, m.r[i.d] >> 7);
    return true;
  }
  if (i.code != k_load && i.code != k_store) return false;
  const uint32_t address = (static_cast<uint32_t>(m.r[i.r] | m.r[i.r + 1] << 8) + i.k) & 0xFFFF;
  if (address < kDevicesBegin || address >= kDevicesEnd || address == R_SREG) return false;
  if (i.code == k_load) {
    m.r[i.d] = read_device(m, address);
  } else {
    write_device(m, address, m.r[i.d]);
  }
  return true;
}

// Runs one instruction; returns the address of the next.
uint32_t Processor::interpret(Machine &m, const uint32_t pc) {
  uint8_t *const memory = avr_->data;
  Instruction &known = program_[pc];
  if (known.code == kUndecoded) known = decode(image_, pc);
  const Instruction i = known;
  uint32_t next = pc + i.words;
  const auto jump_if = [&](bool condition) {
    if (!condition) return;
    next = i.k;
    m.cycle += i.extra;
  };
  bool done = true;
  switch (i.code) {
#define RIG_RUN(name) case k_##name: done = m.name(memory, i.d, i.r, i.k); break;
    RIG_OPERATIONS(RIG_RUN)
#undef RIG_RUN
#define RIG_ASK(name) case k_##name: jump_if(m.name(i.d, i.r)); break;
    RIG_CONDITIONS(RIG_ASK)
#undef RIG_ASK
    case kJump: next = i.k; break;
    case kCall:
      done = m.push_address(memory, next);
      next = i.k;
      break;
    case kRet: done = m.pop_address(memory, next); break;
    case kReti:
      if (!(done = m.pop_address(memory, next))) break;
      avr_->cycle = m.cycle;
      switch_interrupts(m, true);
      avr_interrupt_reti(avr_);
      break;
    case kSei: switch_interrupts(m, true); break;
    case kCli: switch_interrupts(m, false); break;
    case kReadDevice: m.r[i.d] = read_device(m, i.k); break;
    case kWriteDevice: write_device(m, i.k, m.r[i.d]); break;
    case kSetBit: write_device(m, i.d, read_device(m, i.d) | i.r); break;
    case kClearBit: write_device(m, i.d, static_cast<uint8_t>(read_device(m, i.d) & ~i.r)); break;
    case kIfPinClear: jump_if((read_device(m, i.d) & i.r) == 0); break;
    case kIfPinSet: jump_if((read_device(m, i.d) & i.r) != 0); break;
    case kSleep:
      if (!avr_has_pending_interrupts(avr_) || !m.interrupts) avr_->state = cpu_Sleeping;
      m.deadline = 0;
      break;
    default: done = false;
  }
  if (!done && !with_device(m, i)) return hand_over(m, pc);
  m.cycle += i.cycles;
  return next;
}

// The next address of flash in bytes, as libsimavr's avr_run_one returns it.
uint32_t Processor::execute() {
  Machine m;
  take(m);
  m.memory_begins = kMemoryBegins;
  m.memory_ends = avr_->ramend;
  // At least one instruction is run, and no more than one with an interrupt about to begin.
  m.deadline = avr_->interrupt_state != 0 ? 0 : m.cycle + avr_->run_cycle_count;
  uint32_t pc = avr_->pc / 2;
  do {
    if (m.cycle < m.deadline && pc < block_count_ && blocks_[pc] != nullptr) {
      m.stopped = false;
      pc = blocks_[pc](&m, avr_->data);
      if (!m.stopped || m.cycle >= m.deadline) continue;
    }
    pc = interpret(m, pc);
  } while (m.cycle < m.deadline);
  give(m);
  return 2 * pc;
}

void Processor::run() {
  avr_flashaddr_t next = avr_->pc;
  if (avr_->state == cpu_Running) next = execute();
  const avr_cycle_count_t rest = avr_cycle_timer_process(avr_);
  avr_->pc = next;
  if (avr_->state == cpu_Sleeping) {
    if (!avr_->sreg[S_I]) {
      avr_->state = cpu_Done;  // nothing could wake it
      return;
    }
    avr_->sleep(avr_, rest);
    avr_->cycle += 1 + rest;  // the sleep function takes the one off again
  }
  if (avr_->state == cpu_Running || avr_->state == cpu_Sleeping) avr_service_interrupts(avr_);
}

}  // namespace rig_emulator_parts
