// One story on the real firmware, for builds with sanitizers: garbage on the line, homing,
// regulation, every command and parameter with odd arguments, a broken sensor, recovery.
// The behaviour itself is tested in tests/firmware; here nothing may be read or written astray.

#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmath>
#include <random>
#include <string>

#include "../rig_host_test.h"
#include "generated/rig.h"

namespace {

int failures = 0;

void expect(bool holds, const char *what) {
  if (holds) return;
  ++failures;
  fprintf(stderr, "self test: expected %s\n", what);
}

class Session {
 public:
  Session() : host_(rig_host_new(0xABCDEF, 1)), bench_(rig_test_bench_new(7)) {
    type("C\rS6\r\rO\rO\rZ1\r");
  }
  ~Session() {
    rig_host_free(host_);
    rig_test_bench_free(bench_);
  }

  void type(const std::string &text) {
    rig_host_receive(host_, reinterpret_cast<const uint8_t *>(text.data()), text.size());
  }

  void send(uint16_t id, uint8_t *payload) {
    rig_test_protect(id, alive_++ % 15, payload);
    char line[32];
    int end = snprintf(line, sizeof line, "t%03X8", id);
    for (int i = 0; i < 8; ++i) end += snprintf(line + end, sizeof line - static_cast<size_t>(end), "%02X", payload[i]);
    type(std::string(line) + "\r");
  }

  void command(uint8_t opcode, float argument) {
    uint8_t payload[8] = {0, static_cast<uint8_t>(opcode << 4), ++number_};
    memcpy(payload + 3, &argument, sizeof argument);
    send(RIG_COMMAND_FRAME_ID, payload);
    run(10);
  }

  void parameter(uint8_t operation, uint8_t index, float value) {
    uint8_t payload[8] = {0, static_cast<uint8_t>(operation << 4), ++number_, index};
    memcpy(payload + 4, &value, sizeof value);
    send(RIG_PARAMETER_REQUEST_FRAME_ID, payload);
    run(4);
  }

  void run(uint32_t milliseconds) {
    for (uint32_t done = 0; done < milliseconds; done += 100) {
      uint8_t payload[8] = {0, 0, 1};
      send(RIG_HOST_HEARTBEAT_FRAME_ID, payload);
      const uint32_t left = milliseconds - done;
      rig_host_run(host_, rig_test_bench_step, bench_, left < 100 ? left : 100, 0);
    }
    uint8_t buffer[256];
    while (size_t count = rig_host_transmit(host_, buffer, sizeof buffer)) sent_ += count;
  }

  rig_test_bench_state &bench() { return *rig_test_bench_access(bench_); }
  size_t sent() const { return sent_; }

 private:
  rig_host *host_;
  rig_test_bench *bench_;
  uint8_t alive_ = 0;
  uint8_t number_ = 0;
  size_t sent_ = 0;
};

}  // namespace

int main() {
  Session session;
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    std::string noise(random() % 40, ' ');
    for (char &c : noise) c = static_cast<char>(random());
    session.type(noise + (i % 3 ? "\r" : ""));
    session.run(2);
  }
  session.type("\rO\r");
  session.command(RIG_COMMAND_OPCODE_HOME_CHOICE, 0);
  session.run(8000);
  session.command(RIG_COMMAND_OPCODE_ZERO_PRESSURE_CHOICE, 0);
  session.command(RIG_COMMAND_OPCODE_TARE_CHOICE, 0);
  session.run(2500);
  session.command(RIG_COMMAND_OPCODE_SET_PRESSURE_CHOICE, 5);
  session.run(6000);
  expect(std::fabs(session.bench().pressure_kpa - 5) < 0.02, "5 kPa to be held");
  const float odd[] = {0.0f, -1.0f, 1e9f, -1e9f, NAN, INFINITY, -INFINITY, 3.0f};
  for (const float argument : odd) {
    for (uint8_t opcode = 0; opcode < 16; ++opcode) session.command(opcode, argument);
    for (int index = 0; index < 256; index += 5) {
      for (uint8_t operation = 0; operation < 4; ++operation) {
        session.parameter(operation, static_cast<uint8_t>(index), argument);
      }
    }
  }
  for (int sensor = 1; sensor <= 4; ++sensor) {
    session.bench().sensor = sensor;
    session.run(3000);
    session.bench().sensor = 0;
    session.run(1000);
    session.command(RIG_COMMAND_OPCODE_CLEAR_FAULT_CHOICE, 0);
  }
  expect(session.sent() > 100000, "telemetry");
  if (failures == 0) puts("firmware self test passed");
  return failures != 0;
}
