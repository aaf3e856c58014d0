// See translation.h.
//
// A block begins wherever something may jump to, and runs on until the next one, past conditions
// that do not hold. What only the interpreter knows is left in front of it, with `stop`.
// SPDX-License-Identifier: GPL-3.0-or-later

#include "translation.h"

#include <cstdio>
#include <vector>

namespace rig_emulator_parts {

namespace {

constexpr uint32_t kVectors = 58, kWordsPerVector = 2;
constexpr int kLongestBlock = 64;  // instructions

#define RIG_NAME(name) #name,
constexpr const char *kOperations[] = {RIG_OPERATIONS(RIG_NAME)};
constexpr const char *kConditions[] = {RIG_CONDITIONS(RIG_NAME)};
#undef RIG_NAME

bool is_operation(const Instruction &i) {
  return i.code >= kFirstOperation && i.code < kFirstCondition;
}
bool is_condition(const Instruction &i) { return i.code >= kFirstCondition && i.code < kJump; }
bool asks_a_device(const Instruction &i) { return i.code == kIfPinClear || i.code == kIfPinSet; }
bool goes_on(const Instruction &i) {
  return i.code != kJump && i.code != kRet && i.code != kReti;
}

template <typename... Values>
std::string line(const char *format, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

class Translator {
 public:
  explicit Translator(const Image &image) : image_(image), entry_(image.words, false) {
    for (uint32_t vector = 0; vector < kVectors; ++vector) enter(vector * kWordsPerVector);
    while (!unseen_.empty()) {
      const uint32_t from = unseen_.back();
      unseen_.pop_back();
      follow(from);
    }
  }

  std::string source() const {
    std::string declared, defined, table;
    uint32_t count = 0;
    for (uint32_t word = 0; word < image_.words; ++word) {
      if (entry_[word]) count = word + 1;
    }
    for (uint32_t word = 0; word < count; ++word) {
      if (entry_[word]) {
        declared += line("static uint32_t b%x(Machine *__restrict, uint8_t *__restrict);\n", word);
        defined += block(word);
        table += line("b%x, ", word);
      } else {
        table += "0, ";
      }
    }
    return "#include \"machine.h\"\nusing namespace rig_emulator_parts;\n" + declared + defined +
           "extern \"C\" const Block rig_blocks[] = {" + table + "};\n" +
           line("extern \"C\" const uint32_t rig_block_count = %uu;\n", count) +
           line("extern \"C\" const uint64_t rig_digest = 0x%llxull;\n",
                static_cast<unsigned long long>(digest_of(image_)));
  }

 private:
  void enter(uint32_t word) {
    if (word >= image_.words || entry_[word]) return;
    entry_[word] = true;
    unseen_.push_back(word);
  }

  // Finds what the instructions from an entry on may jump to.
  void follow(uint32_t pc) {
    for (int length = 0; length < kLongestBlock; ++length) {
      const Instruction i = decode(image_, pc);
      const uint32_t next = pc + i.words;
      if (is_condition(i) || asks_a_device(i) || i.code == kJump || i.code == kCall) enter(i.k);
      if (!is_operation(i) && !is_condition(i)) {
        if (goes_on(i)) enter(next);
        return;
      }
      pc = next;
    }
    enter(pc);
  }

  std::string block(uint32_t from) const {
    std::string body;
    uint32_t pc = from, cycles = 0, before_last = 0;
    const auto go_to = [&](uint32_t target, uint32_t after) {
      return line("{ m->cycle += %u; return b%x(m, memory); }\n", after, target);
    };
    for (;;) {
      const Instruction i = decode(image_, pc);
      const uint32_t next = pc + i.words;
      if (pc != from && entry_[pc]) {
        body += go_to(pc, cycles);
        break;
      }
      const std::string stop = line("return m->stop(%uu, %u);\n", pc, cycles);
      before_last = cycles;
      cycles += i.cycles;
      if (is_operation(i)) {
        body += line("if (!m->%s(memory, %u, %u, %u)) ", kOperations[i.code - kFirstOperation], i.d,
                     i.r, i.k) + stop;
      } else if (is_condition(i)) {
        body += line("if (m->%s(%u, %u)) ", kConditions[i.code - kFirstCondition], i.d, i.r) +
                go_to(i.k, cycles + i.extra);
      } else if (i.code == kJump) {
        body += go_to(i.k, cycles);
        break;
      } else if (i.code == kCall) {
        body += line("if (!m->push_address(memory, %u)) ", next) + stop + go_to(i.k, cycles);
        break;
      } else if (i.code == kRet) {
        body += "uint32_t back; if (!m->pop_address(memory, back)) " + stop +
                line("m->cycle += %u; return back;\n", cycles);
        break;
      } else {
        body += stop;
        break;
      }
      pc = next;
    }
    return line("static uint32_t b%x(Machine *__restrict m, uint8_t *__restrict memory) {\n", from) +
           line("if (!m->has_time(%u)) return m->stop(%uu, 0);\n", before_last, from) + body + "}\n";
  }

  const Image &image_;
  std::vector<bool> entry_;
  std::vector<uint32_t> unseen_;
};

}  // namespace

std::string translation(const Image &image) { return Translator(image).source(); }

uint64_t digest_of(const Image &image) {
  uint64_t digest = 0xCBF29CE484222325;
  for (uint32_t i = 0; i < 2 * image.words; ++i) {
    digest = (digest ^ image.flash[i]) * 0x100000001B3;
  }
  return digest;
}

}  // namespace rig_emulator_parts
