// Running the SuperFrustum over points: values, gradients, and the normal equations of a fit.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "superfrustum.hpp"

namespace partwright {

// Points are handled in blocks that stay in the first-level cache.
constexpr int BLOCK = 128;
// Sums run over this many fixed pieces whatever the number of threads, so that they always round alike.
constexpr int PIECES = 16;

// Signed distances of the folded assembly at N points (N, 3). The fold goes from first to last: a part that is
// added joins what came before it, one that is subtracted is taken from it and from nothing that comes later.
void evaluate(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads);

// Signed distances of each part alone: (M, N).
void evaluate_parts(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads);

// d(sum upstream * F)/d(parameters): (M, DERIVATIVES).
void gradients(const std::vector<Part>& parts, const float* points, const float* upstream, int64_t count,
               double* out, int threads);

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

// `live[i]` says whether part i moves; blocks and gradients of the others are not formed.
NormalEquations normal_equations(const std::vector<Part>& parts, const std::vector<char>& live, const Samples& samples,
                                 float beta, Penalties penalties, int threads);

double loss(const std::vector<Part>& parts, const Samples& samples, float beta, Penalties penalties, int threads);

// Weighted intersection and union with the occupancy `inside`, of the whole assembly (last entry) and of the
// assembly without each part: (M + 1, 2). Only blocks that a part touches are folded again without it.
void removal_counts(const std::vector<Part>& parts, const float* points, const uint8_t* inside, const float* weight,
                    int64_t count, double* out, int threads);

}  // namespace partwright
