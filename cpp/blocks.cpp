#include "blocks.hpp"

#include <cstring>

#include "superfrustum_derivatives.hpp"

namespace partwright {
namespace {

PW_CLONES void unfold(float* __restrict carried, const float* __restrict weight, float sign, float* __restrict share, float* __restrict blend) {
  for (int i = 0; i < BLOCK; ++i) {
    share[i] = sign * carried[i] * (1 - weight[i]);
    blend[i] = -share[i] * weight[i];
    carried[i] *= weight[i];
  }
}

// exp by the polynomial of the base-2 fraction; relative error 2e-7, no library call in the loop.
PW_INLINE float exponential(float v) {
  const float t = std::min(std::max(v * 1.44269504f, -120.f), 120.f);
  const float whole = std::floor(t + 0.5f), f = t - whole;
  float p = 0.00015403530f;
  p = p * f + 0.0013333558f;
  p = p * f + 0.0096181291f;
  p = p * f + 0.0555041087f;
  p = p * f + 0.2402265070f;
  p = p * f + 0.6931471806f;
  p = p * f + 1.f;
  const int32_t bits = (int32_t(whole) + 127) << 23;
  float scale;
  std::memcpy(&scale, &bits, 4);
  return p * scale;
}

}  // namespace

int load(const float* points, int64_t first, int64_t count, Block& block) {
  const int n = int(std::min<int64_t>(BLOCK, count - first));
  for (int i = 0; i < BLOCK; ++i) {
    const float* p = points + 3 * (first + (i < n ? i : 0));
    block.x[i] = p[0];
    block.y[i] = p[1];
    block.z[i] = p[2];
  }
  return n;
}

PW_CLONES Ball around(const Block& block) {
  const float* axes[3] = {block.x, block.y, block.z};
  float middle[3];
  for (int axis = 0; axis < 3; ++axis) middle[axis] = (lowest(axes[axis]) + highest(axes[axis])) / 2;
  float squares[BLOCK];
  for (int i = 0; i < BLOCK; ++i) {
    const float x = block.x[i] - middle[0], y = block.y[i] - middle[1], z = block.z[i] - middle[2];
    squares[i] = x * x + y * y + z * z;
  }
  return {middle[0], middle[1], middle[2], std::sqrt(largest(squares))};
}

PW_CLONES void derivatives(const Part& part, const Block& b, float* __restrict out, int count) {
  const Part p = part;
  alignas(64) float scratch[SCRATCH_ROWS * BLOCK];
  for (int i = 0; i < count; ++i) bend_step(p, b.x[i], b.y[i], b.z[i], scratch + i, BLOCK);
  for (int i = 0; i < count; ++i) section_step(p, scratch + i, BLOCK);
  if (p.hollow) {
    for (int i = 0; i < count; ++i) profile_step<true>(p, scratch + i, BLOCK);
  } else {
    for (int i = 0; i < count; ++i) profile_step<false>(p, scratch + i, BLOCK);
  }
  for (int i = 0; i < count; ++i) chain_step(p, scratch + i, out + i, BLOCK);
}

void begin(float* field, const float* g, const Part& part) {
  if (part.sign > 0)
    std::memcpy(field, g, BLOCK * sizeof(float));
  else
    std::fill_n(field, BLOCK, FAR);
}

PW_CLONES void occupancy(const float* __restrict field, float beta, float* __restrict out) {
  for (int i = 0; i < BLOCK; ++i) out[i] = 1.f / (1.f + exponential(beta * field[i]));
}

void fold_all(const std::vector<Part>& parts, const float* background, const float* g, Workspace& w) {
  bool empty = !background;
  if (background)
    std::memcpy(w.field, background, sizeof w.field);
  else if (w.folded.empty())
    std::fill_n(w.field, BLOCK, FAR);
  for (const size_t m : w.folded) {
    if (empty) {
      begin(w.field, g + m * BLOCK, parts[m]);
      std::fill_n(&w.weight[m * BLOCK], BLOCK, parts[m].sign > 0 ? 0.f : 1.f);
    } else {
      fold(w.field, g + m * BLOCK, parts[m], &w.weight[m * BLOCK]);
    }
    empty = false;
  }
}

void forward(const std::vector<Part>& parts, Workspace& w) {
  for (size_t m = 0; m < parts.size(); ++m) values(parts[m], w.block, w.g.data() + m * BLOCK);
  fold_all(parts, nullptr, w.g.data(), w);
}

void backward(const std::vector<Part>& parts, Workspace& w) {
  for (auto m = w.folded.rbegin(); m != w.folded.rend(); ++m)
    unfold(w.carried, &w.weight[*m * BLOCK], parts[*m].sign, &w.share[*m * BLOCK], &w.blend[*m * BLOCK]);
}

int64_t piece_count(int64_t points) {
  const int64_t blocks = (points + BLOCK - 1) / BLOCK;
  return std::clamp<int64_t>(blocks / LEAST_BLOCKS, 1, MOST_PIECES);
}

std::pair<int64_t, int64_t> piece_range(int64_t points, int64_t piece) {
  const int64_t blocks = (points + BLOCK - 1) / BLOCK, pieces = piece_count(points);
  return {blocks * piece / pieces, blocks * (piece + 1) / pieces};
}

}  // namespace partwright
