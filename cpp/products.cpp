#include "products.hpp"

#include <cstring>

#include "blocks.hpp"

namespace partwright {

#if defined(__GNUC__)
namespace {

template <int LANES>
struct Register {
  typedef float type __attribute__((vector_size(LANES * sizeof(float))));
};
using Eight = Register<8>::type;
#if defined(__clang__)
#define PW_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
typedef int Places __attribute__((vector_size(8 * sizeof(int))));
#define PW_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, Places{__VA_ARGS__})
#endif

// Eight rows of eight, `stride` apart, as rows of points.
PW_INLINE void transpose(const float* in, int stride, float* out) {
  Eight v[8], pairs[8], fours[8];
#pragma GCC unroll 8
  for (int i = 0; i < 8; ++i) std::memcpy(&v[i], in + i * stride, sizeof v[i]);
#pragma GCC unroll 8
  for (int i = 0; i < 8; i += 2) {
    pairs[i] = PW_SHUFFLE(v[i], v[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    pairs[i + 1] = PW_SHUFFLE(v[i], v[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
#pragma GCC unroll 8
  for (int i = 0; i < 8; i += 4)
#pragma GCC unroll 8
    for (int half = 0; half < 2; ++half) {
      fours[i + 2 * half] = PW_SHUFFLE(pairs[i + half], pairs[i + half + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      fours[i + 2 * half + 1] = PW_SHUFFLE(pairs[i + half], pairs[i + half + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
#pragma GCC unroll 8
  for (int i = 0; i < 4; ++i) {
    const Eight low = PW_SHUFFLE(fours[i], fours[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    const Eight high = PW_SHUFFLE(fours[i], fours[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    std::memcpy(out + i * ROW, &low, sizeof low);
    std::memcpy(out + (i + 4) * ROW, &high, sizeof high);
  }
}

// Of the products the rows FROM ... FROM + COUNT, and of these the first LANES entries: as many as stay in registers.
template <int LANES, int FROM, int COUNT>
PW_INLINE void add_tile(const float* a, const float* b, const uint8_t* index, int count, double* c) {
  using Vector = typename Register<LANES>::type;
  Vector sums[COUNT] = {};
  for (int k = 0; k < count; ++k) {
    const float* x = a + index[k] * ROW + FROM;
    Vector y;
    std::memcpy(&y, b + index[k] * ROW, sizeof y);
#pragma GCC unroll 16
    for (int i = 0; i < COUNT; ++i) sums[i] += x[i] * y;
  }
  for (int i = 0; i < COUNT; ++i)
    for (int j = 0; j < LANES; ++j) c[(FROM + i) * ROW + j] += double(sums[i][j]);
}

// Half of a row at a time, and half of the rows: a machine with AVX2 has sixteen registers of eight.
PW_CLONES void add_by_halves(const float* a, const float* b, const uint8_t* index, int count, double* c) {
  for (int half = 0; half < ROW; half += 8) {
    add_tile<8, 0, 8>(a, b + half, index, count, c + half);
    add_tile<8, 8, DERIVATIVES - 8>(a, b + half, index, count, c + half);
  }
}

// The same sums, to the bit, where there are twice as many registers of twice the width.
#if defined(__x86_64__)
__attribute__((target("avx512f,avx512vl,fma"))) void add_whole(const float* a, const float* b, const uint8_t* index, int count, double* c) {
  add_tile<16, 0, DERIVATIVES>(a, b, index, count, c);
}
const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl");
#endif

}  // namespace

PW_CLONES void by_points(const float* derivatives, int stride, int count, float* rows) {
  for (int at = 0; at < count; at += 8)
    for (int half = 0; half < ROW; half += 8) transpose(derivatives + half * stride + at, stride, rows + at * ROW + half);
}

void add_products(const float* a, const float* b, const uint8_t* index, int count, double* c) {
#if defined(__x86_64__)
  if (wide) return add_whole(a, b, index, count, c);
#endif
  add_by_halves(a, b, index, count, c);
}

#else

void by_points(const float* derivatives, int stride, int count, float* rows) {
  for (int at = 0; at < count; ++at)
    for (int i = 0; i < ROW; ++i) rows[at * ROW + i] = derivatives[i * stride + at];
}

void add_products(const float* a, const float* b, const uint8_t* index, int count, double* c) {
  float sums[DERIVATIVES][ROW] = {};
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < DERIVATIVES; ++i)
      for (int j = 0; j < ROW; ++j) sums[i][j] += a[index[k] * ROW + i] * b[index[k] * ROW + j];
  for (int i = 0; i < DERIVATIVES; ++i)
    for (int j = 0; j < ROW; ++j) c[i * ROW + j] += double(sums[i][j]);
}

#endif

}  // namespace partwright
