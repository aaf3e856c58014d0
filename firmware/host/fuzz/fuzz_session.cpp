// A whole board, led by the input through commands, parameters, pins, load-cell words, line noise
// and time. Whatever the order, the promises of firmware/README.md must hold after every tick.
//
// The input is a list of actions: a byte that says which, then its operands; see `Session::act` and
// seeds.py. Frames get the right counter and CRC here, so that they reach the core.

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "e2e.h"
#include "generated/rig.h"
#include "generated/schema.h"
#include "rig_core.h"
#include "slcan.h"
#include "tick.h"

namespace {

void require(bool holds, const char *what) {
  if (holds) return;
  fprintf(stderr, "fuzz_session: broken: %s\n", what);
  abort();
}

class Script {
 public:
  Script(const uint8_t *bytes, size_t count) : next_(bytes), left_(count) {}
  bool ended() const { return left_ == 0; }
  uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *next_++;
  }
  float number() {
    uint8_t bytes[4] = {byte(), byte(), byte(), byte()};
    float value;
    memcpy(&value, bytes, sizeof value);
    return value;
  }

 private:
  const uint8_t *next_;
  size_t left_;
};

constexpr int32_t kStartSteps = 200;
constexpr int32_t kCountsAtAmbient = 102;  // 0.5 V of 5 V
constexpr int32_t kStepsPerCount = 200;                         // a bench of little gas

class Session {
 public:
  Session() : core_({0, 0xABCDEF, rig::ResetCause::kPowerOn}, blank_image()) {
    type("O\r");
    run(30);
  }

  // Homed and zeroed, so that the fuzzer need not find the way there every time.
  static const Session &ready() {
    static const Session session = [] {
      Session s;
      s.command(RIG_COMMAND_OPCODE_HOME_CHOICE, 0.0f);
      s.run_talking(1500);
      s.command(RIG_COMMAND_OPCODE_ZERO_PRESSURE_CHOICE, 0.0f);
      s.run_talking(600);
      s.command(RIG_COMMAND_OPCODE_SET_PRESSURE_CHOICE, 1.0f);
      require(s.core_.safety().state() == rig::State::kRun, "a homed and zeroed board runs");
      s.ticks_ = 0;
      return s;
    }();
    return session;
  }

  // Some seconds of bench time are enough for any story.
  bool has_time() const { return ticks_ < 4000; }

  void act(Script &script) {
    const uint8_t action = script.byte();
    switch (action & 0x07) {
      case 0: run(script.byte()); break;
      case 1: noise(script); break;
      case 2: command(action >> 4, script.number()); break;
      case 3: parameter(action >> 4, script.byte(), script.number()); break;
      case 4: heartbeat(script.byte()); break;
      case 5:
        pins_ = script.byte();
        adc_offset_ = static_cast<int16_t>(8 * (script.byte() - 128));
        break;
      case 6: word(script); break;
      case 7: run_talking(static_cast<uint16_t>(script.byte() * 8)); break;
    }
  }

 private:
  enum Pin : uint8_t { kHomeInverted = 1, kEnd = 2, kStop = 4, kNoConversions = 8, kStall = 16 };

  static const uint8_t *blank_image() {
    static uint8_t image[rig::Parameters::kImageSize];
    memset(image, 0xFF, sizeof image);
    return image;
  }

  void type(const char *text) {
    for (; *text != 0; ++text) core_.receive(static_cast<uint8_t>(*text));
  }

  void send(uint16_t id, const uint8_t (&payload)[8]) {
    rig::CanFrame frame = {id, 8, {}};
    memcpy(frame.data, payload, sizeof payload);
    uint8_t &alive = alive_[id % 64];
    alive = static_cast<uint8_t>((alive + 1) % rig::kAliveCount);
    rig::protect(frame, alive);
    uint8_t line[rig::slcan::kLongestFrame];
    const uint8_t length = rig::slcan::format(frame, false, 0, line);
    for (uint8_t i = 0; i < length; ++i) core_.receive(line[i]);
    listen();
  }

  void command(uint8_t opcode, float argument) {
    if (++number_ == 0) ++number_;
    uint8_t payload[8] = {0, static_cast<uint8_t>(opcode << 4), number_};
    memcpy(payload + 3, &argument, sizeof argument);
    send(RIG_COMMAND_FRAME_ID, payload);
  }

  void parameter(uint8_t operation, uint8_t index, float value) {
    uint8_t payload[8] = {0, static_cast<uint8_t>(operation << 4), 1, index};
    memcpy(payload + 4, &value, sizeof value);
    send(RIG_PARAMETER_REQUEST_FRAME_ID, payload);
    for (uint8_t i = 0; i < rig::Parameters::kCount; ++i) {
      const rig::ParameterRule &rule = rig::Parameters::rule(i);
      const float held = core_.parameters().get(i);
      require(held >= rule.low && held <= rule.high, "a parameter is within its range");
    }
  }

  void heartbeat(uint8_t version) {
    if (version == rig::kProtocolVersion) silent_ticks_ = 0;
    const uint8_t payload[8] = {0, 0, version};
    send(RIG_HOST_HEARTBEAT_FRAME_ID, payload);
  }

  void noise(Script &script) {
    const uint8_t count = script.byte() % 32;
    for (uint8_t i = 0; i < count && !script.ended(); ++i) core_.receive(script.byte());
    silent_ticks_ = 0;  // it may have held a heartbeat
    listen();
  }

  void word(Script &script) {
    const uint32_t high = script.byte(), middle = script.byte(), low = script.byte();
    core_.load_cell_word(high << 16 | middle << 8 | low);
  }

  void run(uint16_t ticks) {
    while (ticks-- > 0) tick();
  }

  void run_talking(uint16_t ticks) {
    for (uint16_t i = 0; i < ticks; ++i) {
      if (i % 100 == 0) heartbeat(rig::kProtocolVersion);
      tick();
    }
  }

  rig::Inputs inputs() const {
    int32_t counts = kCountsAtAmbient + adc_offset_ + static_cast<int32_t>(seed_ >> 30);
    if (!core_.outputs().valve_open) counts += gas_steps_ / kStepsPerCount;
    counts = counts < 0 ? 0 : (counts > 1023 ? 1023 : counts);
    const uint8_t conversions = pins_ & kNoConversions ? 0 : 18;
    const bool home = steps_ <= 0;
    return {static_cast<uint32_t>(counts) * conversions, conversions,
            home != ((pins_ & kHomeInverted) != 0), (pins_ & kEnd) != 0, (pins_ & kStop) != 0};
  }

  void move(const rig::StepSchedule &steps) {
    if (pins_ & kStall) return;
    const int32_t moved = steps.inward ? steps.count : -static_cast<int32_t>(steps.count);
    steps_ += moved;
    gas_steps_ = core_.outputs().valve_open ? 0 : gas_steps_ + moved;
  }

  void tick() {
    ++ticks_;
    seed_ = seed_ * 1664525u + 1013904223u;  // a live transducer is never quite still
    const rig::State before = core_.safety().state();
    const rig::Inputs seen = inputs();
    core_.tick(seen);
    ++silent_ticks_;
    judge(before, seen);
    move(core_.outputs().steps);
    uint8_t image[rig::Parameters::kImageSize];
    if (core_.take_save(image)) {
      rig::Parameters kept;
      require(kept.load(image) == rig::Parameters::Image::kLoaded, "what is saved can be loaded");
    }
    listen();
  }

  void judge(rig::State before, const rig::Inputs &seen) {
    const rig::Safety &safety = core_.safety();
    const rig::Outputs &out = core_.outputs();
    const bool closed = safety.state() == rig::State::kHold || safety.state() == rig::State::kRun;
    require(out.valve_open != closed, "the valve is closed in hold and run only");
    require((safety.fault() != rig::Fault::kNone) == (safety.state() == rig::State::kFault),
            "a latched fault and the state fault go together");
    require(out.steps.count <= 48, "no more than 24 000 steps a second");
    require(out.motor_enabled || out.steps.count == 0, "no steps without current");
    if (out.steps.count > 0) {
      const uint32_t last =
          out.steps.first + (out.steps.count - 1u) * out.steps.interval / rig::kIntervalScale;
      require(last <= rig::kTimerTicksPerTick, "steps lie inside their tick");
    }
    if (seen.emergency_stop && before != rig::State::kBoot) {
      require(safety.state() == rig::State::kFault && !out.motor_enabled && out.steps.count == 0,
              "the emergency stop stops at once");
    }
    if (seen.end_switch && before != rig::State::kBoot && safety.state() != rig::State::kFault) {
      require(!out.steps.inward || out.steps.count == 0 || !pushed_,
              "nobody pushes on against the end switch");
    }
    pushed_ = seen.end_switch && out.steps.inward && out.steps.count > 0;
    const bool silent = rig::duration_of(silent_ticks_) >
                        core_.parameters().communication_timeout() + rig::kTick * 2.0f;
    require(!(silent && safety.needs_host()), "without its host the board does not go on");
    if (!safety.needs_host()) silent_ticks_ = 0;
  }

  // What the board says is SLCAN, with the right CRC and the next counter.
  void listen() {
    while (!core_.transmit_queue().empty()) {
      rig::CanFrame frame = {};
      const uint8_t byte = core_.transmit_queue().pop();
      if (byte == rig::slcan::kBell) continue;
      if (answer_.feed(byte, frame) != rig::slcan::Kind::kFrame) continue;
      require(frame.length == 8 && frame.data[0] == rig::frame_crc(frame), "a frame has its CRC");
      if (frame.id == RIG_HEARTBEAT_FRAME_ID) require_consistent(frame);
    }
  }

  // The firmware has no code to unpack what it sends: bits as in rig.dbc.
  void require_consistent(const rig::CanFrame &heartbeat) {
    const uint8_t state = heartbeat.data[1] >> 4, fault = heartbeat.data[2];
    const bool homed = (heartbeat.data[5] & 1 << 5) != 0, zeroed = (heartbeat.data[5] & 1 << 6) != 0;
    require(state <= RIG_HEARTBEAT_STATE_FAULT_CHOICE, "the state has a name");
    require(fault <= RIG_FAULT_CODE_HOMING_FAILED_CHOICE, "the fault has a name");
    require(state != RIG_HEARTBEAT_STATE_RUN_CHOICE || (homed && zeroed),
            "pressure needs a known home and zero");
  }

  rig::RigCore core_;
  rig::slcan::Parser answer_;
  uint8_t alive_[64] = {};
  uint8_t number_ = 0;
  uint8_t pins_ = 0;
  int16_t adc_offset_ = 0;
  uint32_t silent_ticks_ = 0;
  uint32_t seed_ = 1;
  uint32_t ticks_ = 0;
  int32_t steps_ = kStartSteps;
  int32_t gas_steps_ = 0;
  bool pushed_ = false;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count) {
  Script script(bytes, count);
  Session session = (script.byte() & 1) != 0 ? Session::ready() : Session();
  while (!script.ended() && session.has_time()) session.act(script);
  return 0;
}
