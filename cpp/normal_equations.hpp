// The normal equations of a fit: residuals of occupancy, overlap and blending over samples of a shape.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "sample_blocks.hpp"

namespace partwright {

// Weights of the residuals that accompany the reconstruction (eq. 7): overlap and smooth-union consistency. Both
// look at the parts that are added, for eq. 8 knows no others.
struct Penalties {
  float overlap;
  float blending;
};

// J^T J by pairs of parts that share a point, J^T r, and the loss (half the sum of squares).
struct NormalEquations {
  using Block = std::vector<double>;  // DERIVATIVES x DERIVATIVES, row-major
  std::map<std::pair<int, int>, Block> blocks;
  std::vector<double> gradient;
  double loss = 0;
};

// Distances of each part alone at all samples, by blocks. The search for a step asks for the same ones again and
// again, and those of parts that stay never change. Where a part is too far from all of a block to be felt there
// at this sharpness, it has none: most parts are far from most blocks.
class PartDistances {
 public:
  static constexpr double UNKNOWN = -1;

  PartDistances(size_t parts, const SampleBlocks& samples)
      : parts_(parts),
        values_(new float[size_t(samples.blocks()) * parts * BLOCK]),
        felt_(size_t(samples.blocks()) * parts),
        still_(size_t(samples.blocks()), UNKNOWN) {}

  // Those of the parts that stay, of another set for the same samples.
  void take(const PartDistances& other, const std::vector<char>& live);

  float* block(int64_t b) { return values_.get() + size_t(b) * parts_ * BLOCK; }
  const float* block(int64_t b) const { return values_.get() + size_t(b) * parts_ * BLOCK; }
  char& felt(int64_t b, size_t part) { return felt_[size_t(b) * parts_ + part]; }
  // The loss of a block in which no part that moves is felt.
  double& still(int64_t b) { return still_[size_t(b)]; }
  double still(int64_t b) const { return still_[size_t(b)]; }
  // The parts with distances in a block, in their order.
  void felt(int64_t b, std::vector<size_t>& parts) const;

 private:
  size_t parts_;
  std::unique_ptr<float[]> values_;  // where a part is felt; not set elsewhere
  std::vector<char> felt_;
  std::vector<double> still_;
};

// Brings the distances of all parts up to date, for calls at the samples' sharpness.
void measure(const std::vector<Part>& parts, const SampleBlocks& samples, int threads, PartDistances& distances);

// `live[i]` says whether part i moves; blocks and gradients of the others are not formed.
NormalEquations normal_equations(const std::vector<Part>& parts, const std::vector<char>& live, const SampleBlocks& samples,
                                 Penalties penalties, int threads, const PartDistances& distances);

// Brings the distances of live parts up to date on the way. Ends early, with what it has then, where the sum so far is no
// less than `enough` by more than it can be rounded.
double loss(const std::vector<Part>& parts, const std::vector<char>& live, const SampleBlocks& samples, Penalties penalties,
            int threads, PartDistances& distances, double enough = std::numeric_limits<double>::infinity());

}  // namespace partwright
