#include "products.hpp"

#include <cstring>

#include "blocks.hpp"

namespace partwright {
namespace {

// Eight floats: a tile of three by five of them fills the sixteen registers of a machine with AVX2. Wider ones
// would spill there, to a quarter of the speed, and machines with AVX-512 would round sums in another order.
constexpr int LANES = 8;
#if defined(__GNUC__)
typedef float Lanes __attribute__((vector_size(LANES * sizeof(float))));
#if defined(__clang__)
#define PW_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
typedef int Places __attribute__((vector_size(LANES * sizeof(int))));
#define PW_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, Places{__VA_ARGS__})
#endif
PW_INLINE void multiply_add(Lanes& sum, const float* a, const float* b) {
  Lanes x, y;
  std::memcpy(&x, a, sizeof x);
  std::memcpy(&y, b, sizeof y);
  sum += x * y;
}
#else
struct Lanes {
  float v[LANES];
  float operator[](int i) const { return v[i]; }
};
PW_INLINE void multiply_add(Lanes& sum, const float* a, const float* b) {
  for (int lane = 0; lane < LANES; ++lane) sum.v[lane] += a[lane] * b[lane];
}
#endif

// Sums of the lanes of each of eight, first to last: their transpose is summed, all eight at once.
PW_INLINE void lane_sums(const Lanes* v, float* out) {
#if defined(__GNUC__)
  Lanes pairs[8], fours[8];
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
  Lanes sum = {};
#pragma GCC unroll 8
  for (int lane = 0; lane < 4; ++lane) sum += PW_SHUFFLE(fours[lane], fours[lane + 4], 0, 1, 2, 3, 8, 9, 10, 11);
#pragma GCC unroll 8
  for (int lane = 0; lane < 4; ++lane) sum += PW_SHUFFLE(fours[lane], fours[lane + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  std::memcpy(out, &sum, sizeof sum);
#else
  for (int i = 0; i < 8; ++i) {
    out[i] = 0;
    for (int lane = 0; lane < LANES; ++lane) out[i] += v[i][lane];
  }
#endif
}

// C (RA x RB) += A B^T over `length` samples.
template <int RA, int RB>
PW_INLINE void outer_tile(const float* a, const float* b, int length, double* c, int stride) {
  constexpr int COUNT = RA * RB, PADDED = (COUNT + 7) / 8 * 8;
  Lanes sums[PADDED] = {};
  for (int l = 0; l < length; l += LANES)
#pragma GCC unroll 8
    for (int i = 0; i < RA; ++i)
#pragma GCC unroll 8
      for (int j = 0; j < RB; ++j) multiply_add(sums[i * RB + j], a + i * length + l, b + j * length + l);
  float totals[PADDED];
#pragma GCC unroll 8
  for (int i = 0; i < PADDED; i += 8) lane_sums(sums + i, totals + i);
  for (int i = 0; i < RA; ++i)
    for (int j = 0; j < RB; ++j) c[i * stride + j] += totals[i * RB + j];
}

}  // namespace

PW_CLONES void outer_product(const float* a, const float* b, int length, double* c) {
  for (int i = 0; i < DERIVATIVES; i += 3)
    for (int j = 0; j < DERIVATIVES; j += 5) outer_tile<3, 5>(a + i * length, b + j * length, length, c + i * DERIVATIVES + j, DERIVATIVES);
}

PW_CLONES void outer_square(const float* a, int length, double* c) {
  for (int i = 0; i < DERIVATIVES; i += 3)
    for (int j = 0; j <= i + 2; j += 5) outer_tile<3, 5>(a + i * length, a + j * length, length, c + i * DERIVATIVES + j, DERIVATIVES);
}

void mirror(std::vector<double>& c) {
  for (int i = 0; i < DERIVATIVES; ++i)
    for (int j = i + 1; j < DERIVATIVES; ++j) c[size_t(i) * DERIVATIVES + j] = c[size_t(j) * DERIVATIVES + i];
}

PW_CLONES void times_vector(const float* a, const float* v, int length, double* c) {
  for (int i = 0; i < DERIVATIVES; i += 3) outer_tile<3, 1>(a + i * length, v, length, c + i, 1);
}

}  // namespace partwright
