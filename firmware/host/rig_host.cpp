// The host HAL: pins and serial line of the firmware core as plain memory.

#include "rig_host.h"

#include <memory>
#include <vector>

#include "rig_core.h"
#include "rig_host_test.h"
#include "tick.h"

namespace {

constexpr uint8_t kHostBoard = 0;  // board_kind of rig.dbc
constexpr uint8_t kErased = 0xFF;
constexpr uint16_t kTimerTicksPerMs = rig::kTimerTicksPerTick / rig::kTickMs;
static_assert(rig::kTickMs == 2, "a tick is two calls of the bench");

}  // namespace

struct rig_host {
  rig::BoardInfo board;
  std::vector<uint8_t> nonvolatile;
  std::unique_ptr<rig::RigCore> core;  // from the first millisecond on
  std::vector<uint8_t> received, transmitted;
  size_t taken = 0;  // of `transmitted`
  size_t bytes_per_ms = SIZE_MAX, room_on_line = SIZE_MAX;
  uint64_t time_ms = 0;
  uint32_t held_ms = 0, dead_ms = 0;
  rig::Inputs inputs = {};
  rig_pins_out out = {};

  rig_host(uint32_t firmware_git, uint8_t reset_cause)
      : board{kHostBoard, firmware_git, static_cast<rig::ResetCause>(reset_cause)},
        nonvolatile(rig::Parameters::kImageSize, kErased) {
    out.valve_open = out.hx711_powered = 1;
  }

  void boot() { core.reset(new rig::RigCore(board, nonvolatile.data())); }

  void restart(rig::ResetCause cause, uint32_t held, uint32_t dead) {
    board.reset_cause = cause;
    held_ms = held;
    dead_ms = dead;
    inputs = {};
    out.steps = 0;
    boot();
  }

  void stay_dead() {
    --dead_ms;
    received.clear();
    if (held_ms > 0) --held_ms;
    if (held_ms == 0) out = {0, 0, 1, 0};
  }

  void read_line() {
    for (const uint8_t byte : received) {
      core->receive(byte);
      drain();
    }
    received.clear();
  }

  void drain() {
    auto &queue = core->transmit_queue();
    for (; !queue.empty() && room_on_line > 0; --room_on_line) transmitted.push_back(queue.pop());
  }

  void take_pins(const rig_pins_in &in) {
    for (uint8_t i = 0; i < in.adc_count && i < 10; ++i) inputs.adc_sum += in.adc[i];
    inputs.adc_count = static_cast<uint8_t>(inputs.adc_count + in.adc_count);
    inputs.home_switch = in.home_switch != 0;
    inputs.end_switch = in.end_switch != 0;
    inputs.emergency_stop = in.emergency_stop != 0;
    if (in.hx711_ready && core->outputs().load_cell_powered) core->load_cell_word(in.hx711_word);
  }

  // Of the steps of a tick, those of its first or second millisecond.
  void show_pins(bool first_half) {
    const rig::Outputs &outputs = core->outputs();
    const uint16_t early = rig::steps_before(outputs.steps, kTimerTicksPerMs);
    const int32_t steps = first_half ? early : outputs.steps.count - early;
    out.steps = outputs.steps.inward ? steps : -steps;
    out.motor_enabled = outputs.motor_enabled;
    out.valve_open = outputs.valve_open;
    out.hx711_powered = outputs.load_cell_powered;
  }

  void millisecond(rig_bench_fn bench_fn, void *bench) {
    rig_pins_in in = {};
    bench_fn(bench, &out, &in);
    ++time_ms;
    if (dead_ms > 0) {
      stay_dead();
      return;
    }
    room_on_line = bytes_per_ms;
    read_line();
    take_pins(in);
    const bool tick_ends = time_ms % rig::kTickMs == 0;
    if (tick_ends) {
      core->tick(inputs);
      inputs.adc_sum = 0;
      inputs.adc_count = 0;
      core->take_save(nonvolatile.data());
    }
    show_pins(tick_ends);
    drain();
  }
};

rig_host *rig_host_new(uint32_t firmware_git, uint8_t reset_cause) {
  return new rig_host(firmware_git, reset_cause);
}

void rig_host_free(rig_host *host) { delete host; }

void rig_host_receive(rig_host *host, const uint8_t *bytes, size_t count) {
  host->received.insert(host->received.end(), bytes, bytes + count);
}

void rig_host_pace_line(rig_host *host, size_t bytes_per_ms) { host->bytes_per_ms = bytes_per_ms; }

uint32_t rig_host_run(rig_host *host, rig_bench_fn bench_fn, void *bench, uint32_t milliseconds,
                      int stop_on_tx) {
  if (!host->core) host->boot();
  for (uint32_t done = 0; done < milliseconds; ++done) {
    const size_t before = host->transmitted.size();
    host->millisecond(bench_fn, bench);
    if (stop_on_tx && host->transmitted.size() != before) return done + 1;
  }
  return milliseconds;
}

size_t rig_host_pending(const rig_host *host) { return host->transmitted.size() - host->taken; }

size_t rig_host_transmit(rig_host *host, uint8_t *out, size_t capacity) {
  const size_t waiting = rig_host_pending(host);
  const size_t count = waiting < capacity ? waiting : capacity;
  const auto first = host->transmitted.begin() + static_cast<std::ptrdiff_t>(host->taken);
  std::copy(first, first + static_cast<std::ptrdiff_t>(count), out);
  host->taken += count;
  if (host->taken == host->transmitted.size()) {
    host->transmitted.clear();
    host->taken = 0;
  }
  return count;
}

uint8_t rig_host_state(const rig_host *host) {
  return static_cast<uint8_t>(host->core->safety().state());
}

float rig_host_parameter(const rig_host *host, unsigned index) {
  return host->core->parameters().get(static_cast<uint8_t>(index));
}

uint64_t rig_host_time_ms(const rig_host *host) { return host->time_ms; }

size_t rig_host_nonvolatile_size(void) { return rig::Parameters::kImageSize; }

void rig_host_nonvolatile_load(rig_host *host, const uint8_t *image) {
  host->nonvolatile.assign(image, image + rig::Parameters::kImageSize);
}

void rig_host_nonvolatile_store(const rig_host *host, uint8_t *image) {
  std::copy(host->nonvolatile.begin(), host->nonvolatile.end(), image);
}

void rig_host_restart(rig_host *host, uint8_t reset_cause, uint32_t held_ms, uint32_t dead_ms) {
  host->restart(static_cast<rig::ResetCause>(reset_cause), held_ms, dead_ms);
}

unsigned rig_host_parameter_count(void) { return rig::Parameters::kCount; }

float rig_host_parameter_default(unsigned index) {
  return rig::Parameters::rule(static_cast<uint8_t>(index)).initial;
}

float rig_host_parameter_min(unsigned index) {
  return rig::Parameters::rule(static_cast<uint8_t>(index)).low;
}

float rig_host_parameter_max(unsigned index) {
  return rig::Parameters::rule(static_cast<uint8_t>(index)).high;
}

int rig_host_parameter_live(unsigned index) {
  return rig::Parameters::rule(static_cast<uint8_t>(index)).live;
}

rig_link_counters rig_host_link_counters(const rig_host *host) {
  if (!host->core) return {};
  const rig::LinkCounters &c = host->core->link().counters();
  return {c.corrupt, c.repeated, c.unknown, c.bad_lines, c.not_sent};
}
