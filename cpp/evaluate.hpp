// Running the SuperFrustum over points: values, gradients, and what the removal of a part would change.
#pragma once

#include <cstdint>
#include <vector>

#include "superfrustum.hpp"

namespace partwright {

// Signed distances of the folded assembly at N points (N, 3). The fold goes from first to last: a part that is
// added joins what came before it, one that is subtracted is taken from it and from nothing that comes later.
void evaluate(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads);

// Signed distances of each part alone: (M, N).
void evaluate_parts(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads);

// Which points each part alone covers: (M, N), 1 where its distance is below 0.
void covered(const std::vector<Part>& parts, const float* points, int64_t count, uint8_t* out, int threads);

// Weighted intersection and union of each of K occupancies (K, N) with `inside`: (K, 2, 2), first over the points
// before `split`, then over the others.
void occupancy_sums(const uint8_t* occupied, int64_t rows, const uint8_t* inside, const float* weight, int64_t count,
                    int64_t split, double* out, int threads);

// d(sum upstream * F)/d(parameters): (M, DERIVATIVES).
void gradients(const std::vector<Part>& parts, const float* points, const float* upstream, int64_t count,
               double* out, int threads);

// Weighted intersection and union with the occupancy `inside`, of the whole assembly (last entry) and of the
// assembly without each part: (M + 1, 2). Only blocks that a part touches are folded again without it.
void removal_counts(const std::vector<Part>& parts, const float* points, const uint8_t* inside, const float* weight,
                    int64_t count, double* out, int threads);

}  // namespace partwright
