// Samples of a fit by blocks, laid out as the loops read them, with what stays the same from one evaluation to the
// next computed once.
#pragma once

#include <cstdint>
#include <vector>

#include "blocks.hpp"

namespace partwright {

// What a fit compares with: at each point the shape's signed distance, a weight, and (optionally) the field of
// parts that stay as they are, which joins the fold first.
struct Samples {
  const float* points;
  const float* distance;
  const float* weight;
  const float* background;  // null when there is none
  int64_t count;
};

// Padding repeats the first sample at weight 0.
struct SampleBlock {
  Block at;
  alignas(64) float distance[BLOCK], background[BLOCK];
  alignas(64) float root[BLOCK];    // of the weights
  alignas(64) float target[BLOCK];  // occupancies of the shape
  float heaviest;                   // root
  Ball ball;                        // that holds the points
};

class SampleBlocks {
 public:
  // compact: in an order in which the samples of a block lie close together: most parts are then far from most
  // blocks.
  SampleBlocks(const Samples& given, bool compact, int threads = 1);

  // Sets the targets; every use is at the sharpness `beta` from then on.
  void sharpen(float beta);

  const SampleBlock& operator[](int64_t b) const { return blocks_[size_t(b)]; }
  int64_t count() const { return count_; }
  int64_t blocks() const { return int64_t(blocks_.size()); }
  bool background() const { return background_; }
  float beta() const { return beta_; }

 private:
  std::vector<SampleBlock> blocks_;
  int64_t count_;
  bool background_;
  float beta_ = 0;
};

}  // namespace partwright
