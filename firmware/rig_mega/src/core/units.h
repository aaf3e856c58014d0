// Quantities as types, so that a pressure cannot be passed where a volume is meant.
// Each holds one float in the unit of the field; the unit is named wherever a bare number enters
// or leaves (RespiraWorks' units.h is the model).
#pragma once

#include <stdint.h>
#include <string.h>

namespace rig {

// A whole number that compares as the float does: IEEE 754 numbers are in order of their bits, but
// for the sign. The Mega compares whole numbers in a third of the time. Both zeros are equal.
inline int32_t ordered(float value) {
  static_assert(sizeof(float) == sizeof(int32_t), "IEEE 754, single precision");
  int32_t bits = 0;
  memcpy(&bits, &value, sizeof bits);
  return bits < 0 ? INT32_MIN - bits : bits;
}

template <typename Tag>
struct Quantity {
  float value;

  friend constexpr Quantity operator+(Quantity a, Quantity b) { return {a.value + b.value}; }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return {a.value - b.value}; }
  friend constexpr Quantity operator-(Quantity a) { return {-a.value}; }
  friend constexpr Quantity operator*(Quantity a, float k) { return {a.value * k}; }
  friend constexpr Quantity operator/(Quantity a, float k) { return {a.value / k}; }
  friend constexpr float operator/(Quantity a, Quantity b) { return a.value / b.value; }
  friend bool operator<(Quantity a, Quantity b) { return ordered(a.value) < ordered(b.value); }
  friend bool operator>(Quantity a, Quantity b) { return ordered(a.value) > ordered(b.value); }
  friend bool operator<=(Quantity a, Quantity b) { return ordered(a.value) <= ordered(b.value); }
  friend bool operator>=(Quantity a, Quantity b) { return ordered(a.value) >= ordered(b.value); }
  Quantity &operator+=(Quantity b) {
    value += b.value;
    return *this;
  }
};

using Pressure = Quantity<struct PressureTag>;
using PressureRate = Quantity<struct PressureRateTag>;
using Volume = Quantity<struct VolumeTag>;
using Flow = Quantity<struct FlowTag>;
using FlowAcceleration = Quantity<struct FlowAccelerationTag>;
using Voltage = Quantity<struct VoltageTag>;
using Duration = Quantity<struct DurationTag>;

constexpr Pressure kpa(float v) { return {v}; }
constexpr PressureRate kpa_s(float v) { return {v}; }
constexpr Volume ml(float v) { return {v}; }
constexpr Flow ml_s(float v) { return {v}; }
constexpr FlowAcceleration ml_s2(float v) { return {v}; }
constexpr Voltage volts(float v) { return {v}; }
constexpr Duration seconds(float v) { return {v}; }

constexpr float to_kpa(Pressure p) { return p.value; }
constexpr float to_kpa_s(PressureRate r) { return r.value; }
constexpr float to_ml(Volume v) { return v.value; }
constexpr float to_ml_s(Flow q) { return q.value; }
constexpr float to_volts(Voltage u) { return u.value; }
constexpr float to_seconds(Duration t) { return t.value; }

constexpr Volume operator*(Flow q, Duration t) { return ml(q.value * t.value); }
constexpr Flow operator*(FlowAcceleration a, Duration t) { return ml_s(a.value * t.value); }
constexpr Pressure operator*(PressureRate r, Duration t) { return kpa(r.value * t.value); }

template <typename Q>
Q clamp(Q x, Q low, Q high) {
  return x < low ? low : (x > high ? high : x);
}

template <typename Q>
Q magnitude(Q x) {
  return x < Q{} ? -x : x;
}

}  // namespace rig
