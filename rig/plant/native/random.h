// xoshiro256** 1.0 (Blackman and Vigna, 2018), seeded by splitmix64, and normals by the polar method.
#pragma once

#include <cmath>
#include <cstdint>

struct Random {
  uint64_t s[4];
  double spare;
  bool has_spare;

  explicit Random(uint64_t seed) : spare(0), has_spare(false) {
    for (uint64_t &word : s) {
      seed += 0x9E3779B97F4A7C15ull;
      uint64_t z = seed;
      z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
      z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
      word = z ^ (z >> 31);
    }
  }

  uint64_t next() {
    const uint64_t result = rotate(s[1] * 5, 7) * 9;
    const uint64_t t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate(s[3], 45);
    return result;
  }

  double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

  double normal() {
    if (has_spare) {
      has_spare = false;
      return spare;
    }
    double u, v, r;
    do {
      u = 2 * uniform() - 1;
      v = 2 * uniform() - 1;
      r = u * u + v * v;
    } while (r >= 1 || r == 0);
    const double scale = std::sqrt(-2 * std::log(r) / r);
    spare = v * scale;
    has_spare = true;
    return u * scale;
  }

 private:
  static uint64_t rotate(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }
};
