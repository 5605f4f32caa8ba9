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

// C (RA x RB) += A B^T over `length` samples.
template <int RA, int RB>
PW_INLINE void outer_tile(const float* a, const float* b, int length, double* c, int stride) {
  Lanes sums[RA][RB] = {};
  for (int l = 0; l < length; l += LANES)
#pragma GCC unroll 8
    for (int i = 0; i < RA; ++i)
#pragma GCC unroll 8
      for (int j = 0; j < RB; ++j) multiply_add(sums[i][j], a + i * length + l, b + j * length + l);
  for (int i = 0; i < RA; ++i)
    for (int j = 0; j < RB; ++j) {
      float total = 0;
      for (int lane = 0; lane < LANES; ++lane) total += sums[i][j][lane];
      c[i * stride + j] += total;
    }
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
