// Blocks of points: parts evaluated over them, folded into an assembly, and the derivatives carried back.
#pragma once

#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "reach.hpp"

// One binary carries code for several instruction sets; the loader picks at start.
#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__)
#define PW_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define PW_CLONES
#endif

namespace partwright {

// Points are handled in blocks that stay in the first-level cache.
constexpr int BLOCK = 128;
// Sums run over pieces that only depend on the number of points, so that they round alike whatever the number of
// threads. A piece costs its own buffers and sums, so that few points are few pieces.
constexpr int MOST_PIECES = 16;
constexpr int LEAST_BLOCKS = 8;  // of a piece, where there is more than one

// Parts at points that are worth another thread, which may take some tens of microseconds until it is awake.
constexpr int64_t LEAST_VALUES = 1 << 15;

// The fold of no parts: farther than any point, and small enough for sums to stay finite.
constexpr float FAR = 1e6f;

struct Block {
  alignas(64) float x[BLOCK], y[BLOCK], z[BLOCK];
};

// Missing points of the last block repeat the first one; callers ignore or zero-weight them.
int load(const float* points, int64_t first, int64_t count, Block& block);

// A ball that holds the points of a block.
Ball around(const Block& block);

// Of one part over a block: its signed distance, and (DERIVATIVES, BLOCK) with its derivatives, of which only the
// first `count` points are wanted.
void values(const Part& part, const Block& block, float* out);
void derivatives(const Part& part, const Block& block, float* out, int count = BLOCK);

// What the first part of a fold leaves, nothing where it is subtracted.
void begin(float* field, const float* g, const Part& part);

// The next part; `weight` is what the fold keeps of `field`.
void fold(float* field, const float* g, const Part& part, float* weight);

// 1 / (1 + exp(beta field)).
void occupancy(const float* field, float beta, float* out);

// The largest magnitude, and the highest and lowest values.
float largest(const float* v);
float highest(const float* v);
float lowest(const float* v);

// Buffers of one thread for an assembly of M parts; `folded` are those that count, all unless some are left out.
struct Workspace {
  explicit Workspace(size_t m)
      : g(m * BLOCK), weight(m * BLOCK), share(m * BLOCK), blend(m * BLOCK), occ(m * BLOCK), folded(m) {
    std::iota(folded.begin(), folded.end(), size_t(0));
  }
  std::vector<float> g, weight, share, blend, occ;
  std::vector<size_t> folded;
  Block block;
  alignas(64) float field[BLOCK], total[BLOCK], carried[BLOCK], assembled[BLOCK];
};

// Fold of the parts that count over one block, from the distances g (M, BLOCK) of all, keeping each one's fold
// weight.
void fold_all(const std::vector<Part>& parts, const float* background, const float* g, Workspace& w);

// The same from the points of the block, keeping each part's value, too.
void forward(const std::vector<Part>& parts, Workspace& w);

// dF/dg and dF/dk of every part that counts from the fold weights; `carried` starts as the upstream derivative.
void backward(const std::vector<Part>& parts, Workspace& w);

int64_t piece_count(int64_t points);

// Blocks first .. last of one of the pieces of so many points.
std::pair<int64_t, int64_t> piece_range(int64_t points, int64_t piece);

}  // namespace partwright
