// The normal equations of a fit: residuals of occupancy, overlap and blending over samples of a shape.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
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
// again, and those of parts that stay never change.
class PartDistances {
 public:
  PartDistances(size_t parts, int64_t count) : row_(parts * BLOCK), values_(size_t((count + BLOCK - 1) / BLOCK) * row_) {}
  float* block(int64_t b) { return values_.data() + size_t(b) * row_; }
  const float* block(int64_t b) const { return values_.data() + size_t(b) * row_; }

 private:
  size_t row_;
  std::vector<float> values_;
};

PartDistances part_distances(const std::vector<Part>& parts, const Samples& samples, int threads);

// `live[i]` says whether part i moves; blocks and gradients of the others are not formed.
NormalEquations normal_equations(const std::vector<Part>& parts, const std::vector<char>& live, const Samples& samples,
                                 float beta, Penalties penalties, int threads, const PartDistances& distances);

// Brings the distances of live parts up to date on the way.
double loss(const std::vector<Part>& parts, const std::vector<char>& live, const Samples& samples, float beta,
            Penalties penalties, int threads, PartDistances& distances);

}  // namespace partwright
