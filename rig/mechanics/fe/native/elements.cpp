#include "elements.h"

#include <cstring>
#include <new>
#include <vector>

/* The kernel is compiled once for each width of vectors; the processor decides at run time. The
 * compiler lowers vectors where they are written, so that function attributes would come too late. */
namespace plain {
constexpr int kLanes = 2, kRows = 1;
#include "stiffness.inc"
}  // namespace plain

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define RIG_WIDER_VECTORS
#pragma GCC push_options
#pragma GCC target("arch=haswell")
namespace haswell {
constexpr int kLanes = 4, kRows = 2;
#include "stiffness.inc"
}  // namespace haswell
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("arch=skylake-avx512", "prefer-vector-width=512")
namespace skylake {
constexpr int kLanes = 8, kRows = 4;
#include "stiffness.inc"
}  // namespace skylake
#pragma GCC pop_options
#endif

extern "C" int elements_stiffness(const element_matrices *given, double *out,
                                  int64_t element_stride, int64_t row_stride) {
  auto kernel = plain::stiffness;
#ifdef RIG_WIDER_VECTORS
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")) {
    kernel = skylake::stiffness;
  } else if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
             __builtin_cpu_supports("bmi2")) {
    kernel = haswell::stiffness;
  }
#endif
  const size_t rows = 3 * static_cast<size_t>(given->points) + given->modes;
  try {
    std::vector<double> work((given->dim + 1) * rows * ELEMENTS_MAX_NODES);
    return kernel(given, work.data(), out, element_stride, row_stride);
  } catch (const std::bad_alloc &) {
    return 0;
  }
}

extern "C" void elements_scatter(int32_t elements, int32_t nodes, int32_t width,
                                 const int32_t *base, const int32_t *stride,
                                 const double *matrices, double *data) {
  const int64_t row = static_cast<int64_t>(nodes) * width;
  for (int32_t e = 0; e < elements; ++e) {
    for (int32_t a = 0; a < nodes; ++a) {
      for (int32_t b = 0; b < nodes; ++b) {
        double *into = data + *base++;
        const double *from = matrices + a * width * row + b * width;
        for (int32_t k = 0; k < width; ++k) {
          for (int32_t i = 0; i < width; ++i) into[i] += from[i * row + k];
          into += stride[b];
        }
      }
    }
    stride += nodes;
    matrices += row * row;
  }
}
