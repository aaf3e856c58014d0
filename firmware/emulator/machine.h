// The registers of an AVR with 22 bits of program counter, and what each instruction does to them:
// defined once, for the interpreter (processor.cpp) and for translated images alike. After the AVR
// Instruction Set Manual (Microchip DS40002198).
// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdint.h>

namespace rig_emulator_parts {

// Instructions that only work on registers and memory.
#define RIG_OPERATIONS(X) \
  X(nop) X(mov) X(movw) X(ldi) \
  X(add) X(adc) X(sub) X(sbc) X(and_) X(or_) X(eor) X(cp) X(cpc) \
  X(subi) X(sbci) X(andi) X(ori) X(cpi) X(adiw) X(sbiw) X(mul) X(muls) X(mulsu) \
  X(com) X(neg) X(swap) X(inc) X(dec) X(asr) X(lsr) X(ror) \
  X(sec) X(clc) X(set) X(clt) X(bst) X(bld) \
  X(load) X(load_inc) X(load_dec) X(store) X(store_inc) X(store_dec) X(lds) X(sts) \
  X(push) X(pop) X(read_status) X(write_status)
// Those that ask something of the registers, and jump or not.
#define RIG_CONDITIONS(X) \
  X(if_carry) X(if_no_carry) X(if_zero) X(if_not_zero) X(if_negative) X(if_positive) \
  X(if_less) X(if_not_less) X(if_transfer) X(if_no_transfer) X(if_same) X(if_bit_clear) \
  X(if_bit_set)

constexpr uint32_t kStackLow = 0x5D;  // where the stack pointer lies in memory

struct Machine {
  uint8_t r[32];
  // The status register, each flag where the operations leave it: what nobody asks for is not
  // worked out.
  uint32_t carry;     // 0 or 1
  uint32_t not_zero;  // any bit
  uint32_t negative, overflow, sign;  // bit 7
  uint32_t half;      // bit 4
  uint32_t transfer;  // 0 or 1
  uint32_t interrupts;  // 0 or 1, switched by the interpreter alone

  uint64_t cycle;
  uint64_t deadline;  // no instruction begins then or later, but for the first
  uint32_t memory_begins, memory_ends;  // between them nothing but memory; inclusive
  bool stopped;       // in front of an instruction that the interpreter must run

  using Memory = uint8_t *__restrict;  // where no register of this structure lies

  // --- instructions: false, and nothing done, if it takes the interpreter: the address is not one
  // of memory, or interrupts are switched ---------------------------------------------------------

  bool nop(Memory, uint32_t, uint32_t, uint32_t) { return true; }
  bool mov(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, r[s]); }
  bool movw(Memory, uint32_t d, uint32_t s, uint32_t) { return put_pair(d, pair(s)); }
  bool ldi(Memory, uint32_t d, uint32_t, uint32_t k) { return put(d, k); }

  bool add(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, sum(r[d], r[s], 0)); }
  bool adc(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, sum(r[d], r[s], carry)); }
  bool sub(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, difference(r[d], r[s], 0)); }
  bool sbc(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, further(r[d], r[s])); }
  bool and_(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, logic(r[d] & r[s])); }
  bool or_(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, logic(r[d] | r[s])); }
  bool eor(Memory, uint32_t d, uint32_t s, uint32_t) { return put(d, logic(r[d] ^ r[s])); }
  bool cp(Memory, uint32_t d, uint32_t s, uint32_t) { return difference(r[d], r[s], 0), true; }
  bool cpc(Memory, uint32_t d, uint32_t s, uint32_t) { return further(r[d], r[s]), true; }
  bool subi(Memory, uint32_t d, uint32_t, uint32_t k) { return put(d, difference(r[d], k, 0)); }
  bool sbci(Memory, uint32_t d, uint32_t, uint32_t k) { return put(d, further(r[d], k)); }
  bool andi(Memory, uint32_t d, uint32_t, uint32_t k) { return put(d, logic(r[d] & k)); }
  bool ori(Memory, uint32_t d, uint32_t, uint32_t k) { return put(d, logic(r[d] | k)); }
  bool cpi(Memory, uint32_t d, uint32_t, uint32_t k) { return difference(r[d], k, 0), true; }
  bool adiw(Memory, uint32_t d, uint32_t, uint32_t k) {
    const uint32_t before = pair(d), after = (before + k) & 0xFFFF;
    word_flags(after, ~before & after, before & ~after);
    return put_pair(d, after);
  }
  bool sbiw(Memory, uint32_t d, uint32_t, uint32_t k) {
    const uint32_t before = pair(d), after = (before - k) & 0xFFFF;
    word_flags(after, before & ~after, ~before & after);
    return put_pair(d, after);
  }
  bool mul(Memory, uint32_t d, uint32_t s, uint32_t) {
    return product(static_cast<uint32_t>(r[d]) * r[s]);
  }
  bool muls(Memory, uint32_t d, uint32_t s, uint32_t) {
    return product(
        static_cast<uint32_t>(static_cast<int8_t>(r[d]) * static_cast<int8_t>(r[s])));
  }
  bool mulsu(Memory, uint32_t d, uint32_t s, uint32_t) {
    return product(static_cast<uint32_t>(static_cast<int8_t>(r[d]) * r[s]));
  }

  bool com(Memory, uint32_t d, uint32_t, uint32_t) {
    put(d, logic(r[d] ^ 0xFFu));
    carry = 1;
    return true;
  }
  bool neg(Memory, uint32_t d, uint32_t, uint32_t) { return put(d, difference(0, r[d], 0)); }
  bool swap(Memory, uint32_t d, uint32_t, uint32_t) {
    return put(d, static_cast<uint32_t>(r[d] >> 4 | r[d] << 4));
  }
  bool inc(Memory, uint32_t d, uint32_t, uint32_t) { return put(d, counted(r[d] + 1u, 0x80)); }
  bool dec(Memory, uint32_t d, uint32_t, uint32_t) { return put(d, counted(r[d] - 1u, 0x7F)); }
  bool asr(Memory, uint32_t d, uint32_t, uint32_t) { return shift(d, r[d] & 0x80u); }
  bool lsr(Memory, uint32_t d, uint32_t, uint32_t) { return shift(d, 0); }
  bool ror(Memory, uint32_t d, uint32_t, uint32_t) { return shift(d, carry << 7); }

  bool sec(Memory, uint32_t, uint32_t, uint32_t) { return carry = 1, true; }
  bool clc(Memory, uint32_t, uint32_t, uint32_t) { return carry = 0, true; }
  bool set(Memory, uint32_t, uint32_t, uint32_t) { return transfer = 1, true; }
  bool clt(Memory, uint32_t, uint32_t, uint32_t) { return transfer = 0, true; }
  bool bst(Memory, uint32_t d, uint32_t bit, uint32_t) { return transfer = r[d] >> bit & 1, true; }
  bool bld(Memory, uint32_t d, uint32_t bit, uint32_t) {
    return put(d, (r[d] & ~(1u << bit)) | transfer << bit);
  }

  bool load(Memory memory, uint32_t d, uint32_t p, uint32_t k) {
    const uint32_t address = pair(p) + k;
    return is_memory(address) && put(d, memory[address]);
  }
  bool load_inc(Memory memory, uint32_t d, uint32_t p, uint32_t) {
    const uint32_t address = pair(p);
    return is_memory(address) && put_pair(p, address + 1) && put(d, memory[address]);
  }
  bool load_dec(Memory memory, uint32_t d, uint32_t p, uint32_t) {
    const uint32_t address = (pair(p) - 1) & 0xFFFF;
    return is_memory(address) && put_pair(p, address) && put(d, memory[address]);
  }
  bool store(Memory memory, uint32_t d, uint32_t p, uint32_t k) {
    return keep(memory, pair(p) + k, r[d]);
  }
  bool store_inc(Memory memory, uint32_t d, uint32_t p, uint32_t) {
    const uint32_t address = pair(p);
    return keep(memory, address, r[d]) && put_pair(p, address + 1);
  }
  bool store_dec(Memory memory, uint32_t d, uint32_t p, uint32_t) {
    const uint32_t address = (pair(p) - 1) & 0xFFFF;
    return keep(memory, address, r[d]) && put_pair(p, address);
  }
  bool lds(Memory memory, uint32_t d, uint32_t, uint32_t k) { return put(d, memory[k]); }
  bool sts(Memory memory, uint32_t d, uint32_t, uint32_t k) { return memory[k] = r[d], true; }

  bool push(Memory memory, uint32_t d, uint32_t, uint32_t) {
    const uint32_t stack = stack_of(memory);
    return keep(memory, stack, r[d]) && set_stack(memory, stack - 1);
  }
  bool pop(Memory memory, uint32_t d, uint32_t, uint32_t) {
    const uint32_t stack = stack_of(memory) + 1;
    return is_memory(stack) && set_stack(memory, stack) && put(d, memory[stack]);
  }
  bool read_status(Memory, uint32_t d, uint32_t, uint32_t) {
    const uint32_t value = carry | (not_zero == 0) << 1 | (negative >> 7 & 1) << 2 |
                           (overflow >> 7 & 1) << 3 | (sign >> 7 & 1) << 4 | (half >> 4 & 1) << 5 |
                           transfer << 6 | interrupts << 7;
    return put(d, value);
  }
  bool write_status(Memory, uint32_t d, uint32_t, uint32_t) {
    if (r[d] >> 7 != interrupts) return false;
    set_flags(r[d]);
    return true;
  }
  void set_flags(uint32_t value) {
    carry = value & 1;
    not_zero = !(value >> 1 & 1);
    negative = value << 5;
    overflow = value << 4;
    sign = value << 3;
    half = value >> 1;
    transfer = value >> 6 & 1;
  }

  bool push_address(Memory memory, uint32_t address) {
    const uint32_t stack = stack_of(memory);
    if (!is_memory(stack) || !is_memory(stack - 2)) return false;
    memory[stack] = static_cast<uint8_t>(address);
    memory[stack - 1] = static_cast<uint8_t>(address >> 8);
    memory[stack - 2] = static_cast<uint8_t>(address >> 16);
    return set_stack(memory, stack - 3);
  }
  bool pop_address(Memory memory, uint32_t &address) {
    const uint32_t stack = stack_of(memory) + 3;
    if (!is_memory(stack - 2) || !is_memory(stack)) return false;
    address = static_cast<uint32_t>(memory[stack - 2] << 16 | memory[stack - 1] << 8 | memory[stack]);
    return set_stack(memory, stack);
  }

  // --- conditions -------------------------------------------------------------------------------

  bool if_carry(uint32_t, uint32_t) const { return carry != 0; }
  bool if_no_carry(uint32_t, uint32_t) const { return carry == 0; }
  bool if_zero(uint32_t, uint32_t) const { return not_zero == 0; }
  bool if_not_zero(uint32_t, uint32_t) const { return not_zero != 0; }
  bool if_negative(uint32_t, uint32_t) const { return (negative & 0x80) != 0; }
  bool if_positive(uint32_t, uint32_t) const { return (negative & 0x80) == 0; }
  bool if_less(uint32_t, uint32_t) const { return (sign & 0x80) != 0; }
  bool if_not_less(uint32_t, uint32_t) const { return (sign & 0x80) == 0; }
  bool if_transfer(uint32_t, uint32_t) const { return transfer != 0; }
  bool if_no_transfer(uint32_t, uint32_t) const { return transfer == 0; }
  bool if_same(uint32_t d, uint32_t s) const { return r[d] == r[s]; }
  bool if_bit_clear(uint32_t d, uint32_t bit) const { return (r[d] >> bit & 1) == 0; }
  bool if_bit_set(uint32_t d, uint32_t bit) const { return (r[d] >> bit & 1) != 0; }

  // --- for translated images --------------------------------------------------------------------

  // Whether as many cycles may pass before the last instruction of a block begins.
  bool has_time(uint32_t cycles) const { return cycle + cycles < deadline; }
  // Leaves a block in front of the instruction at `pc`, `cycles` after it began.
  uint32_t stop(uint32_t pc, uint32_t cycles) {
    cycle += cycles;
    stopped = true;
    return pc;
  }

 private:
  uint32_t pair(uint32_t p) const { return static_cast<uint32_t>(r[p] | r[p + 1] << 8); }
  bool put(uint32_t d, uint32_t value) { return r[d] = static_cast<uint8_t>(value), true; }
  bool put_pair(uint32_t p, uint32_t value) { return put(p, value) && put(p + 1, value >> 8); }

  bool is_memory(uint32_t address) const {
    return address >= memory_begins && address <= memory_ends;
  }
  bool keep(Memory memory, uint32_t address, uint8_t value) const {
    if (!is_memory(address)) return false;
    memory[address] = value;
    return true;
  }
  static uint32_t stack_of(const uint8_t *memory) {
    return static_cast<uint32_t>(memory[kStackLow] | memory[kStackLow + 1] << 8);
  }
  static bool set_stack(Memory memory, uint32_t stack) {
    memory[kStackLow] = static_cast<uint8_t>(stack);
    memory[kStackLow + 1] = static_cast<uint8_t>(stack >> 8);
    return true;
  }

  // N, Z and S of a result whose V is known.
  uint32_t note(uint32_t result) {
    negative = result;
    not_zero = result & 0xFF;
    sign = negative ^ overflow;
    return result;
  }
  uint32_t sum(uint32_t a, uint32_t b, uint32_t with) {
    const uint32_t result = a + b + with;
    carry = result >> 8;
    half = a ^ b ^ result;
    overflow = (a ^ result) & (b ^ result);
    return note(result);
  }
  uint32_t difference(uint32_t a, uint32_t b, uint32_t borrow) {
    const uint32_t result = a - b - borrow;
    carry = result >> 31;
    half = a ^ b ^ result;
    overflow = (a ^ b) & (a ^ result);
    return note(result);
  }
  uint32_t further(uint32_t a, uint32_t b) {
    const uint32_t before = not_zero;
    const uint32_t result = difference(a, b, carry);
    not_zero |= before;
    return result;
  }
  uint32_t logic(uint32_t result) {
    overflow = 0;
    return note(result);
  }
  uint32_t counted(uint32_t result, uint8_t overflowed) {
    overflow = static_cast<uint8_t>(result) == overflowed ? 0x80 : 0;
    return note(result);
  }
  bool shift(uint32_t d, uint32_t highest) {
    const uint32_t result = r[d] >> 1 | highest;
    carry = r[d] & 1;
    overflow = result ^ carry << 7;
    return put(d, note(result));
  }
  void word_flags(uint32_t result, uint32_t overflow_at_15, uint32_t carry_at_15) {
    carry = carry_at_15 >> 15 & 1;
    overflow = overflow_at_15 >> 8;
    negative = result >> 8;
    not_zero = result;
    sign = negative ^ overflow;
  }
  bool product(uint32_t value) {
    carry = value >> 15 & 1;
    not_zero = value & 0xFFFF;
    return put_pair(0, value);
  }
};

// A translated stretch of the image: runs from its first instruction on, and into other blocks, and
// returns the address of the next instruction in words.
using Block = uint32_t (*)(Machine *__restrict, uint8_t *__restrict);

}  // namespace rig_emulator_parts
