// What of blocks.hpp is mostly choices of the least or the greatest: compiled for finite numbers, of which 0 has one sign,
// each is one instruction and not two.
#include "blocks.hpp"

namespace partwright {
namespace {

// One of a block's values, lane by lane and then of the lanes.
template <typename Pick>
PW_INLINE float reduced(const float* v, Pick pick) {
  float best[16];
  for (int lane = 0; lane < 16; ++lane) best[lane] = v[lane];
  for (int i = 16; i < BLOCK; i += 16)
    for (int lane = 0; lane < 16; ++lane) best[lane] = pick(best[lane], v[i + lane]);
  float result = best[0];
  for (int lane = 1; lane < 16; ++lane) result = pick(result, best[lane]);
  return result;
}

// F - G is the complement of (not F) + G, so that a sign before and after the smooth minimum makes both.
PW_CLONES void fold_block(float* __restrict field, const float* __restrict g, float k, float sharp, float sign, float* __restrict weight) {
  for (int i = 0; i < BLOCK; ++i) {
    const float before = sign * field[i], w = smooth_weight(before, g[i], sharp);
    weight[i] = w;
    field[i] = sign * smooth_minimum(before, g[i], k, w);
  }
}

}  // namespace

PW_CLONES void values(const Part& p, const Block& b, float* __restrict out) {
  if (p.bent && p.hollow) {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<true, true>(p, b.x[i], b.y[i], b.z[i]);
  } else if (p.bent) {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<true, false>(p, b.x[i], b.y[i], b.z[i]);
  } else if (p.hollow) {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<false, true>(p, b.x[i], b.y[i], b.z[i]);
  } else {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<false, false>(p, b.x[i], b.y[i], b.z[i]);
  }
}

void fold(float* field, const float* g, const Part& part, float* weight) {
  fold_block(field, g, part.blend > 1e-9f ? part.blend : 0.f, sharpness(part.blend), part.sign, weight);
}

PW_CLONES float largest(const float* v) {
  float top[16] = {};
  for (int i = 0; i < BLOCK; i += 16)
    for (int lane = 0; lane < 16; ++lane) top[lane] = std::max(top[lane], std::fabs(v[i + lane]));
  return *std::max_element(top, top + 16);
}

PW_CLONES float highest(const float* v) {
  return reduced(v, [](float a, float b) { return std::max(a, b); });
}

PW_CLONES float lowest(const float* v) {
  return reduced(v, [](float a, float b) { return std::min(a, b); });
}

}  // namespace partwright
