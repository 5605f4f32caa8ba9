// Products of rows of a Jacobian over the points of a block, summed into doubles.
#pragma once

#include <cstdint>

#include "superfrustum.hpp"

namespace partwright {

// Entries of one point's row: the derivatives by one part's parameters, and its residual. A whole register, so that the
// product of two rows is one instruction for each entry of the first.
constexpr int ROW = DERIVATIVES + 1;
static_assert(ROW == 16);

// So many rows (DERIVATIVES, stride) of derivatives at `count` points, a multiple of 8, as rows of points (count, ROW).
void by_points(const float* derivatives, int stride, int count, float* rows);

// C (DERIVATIVES, ROW) += A^T B, over `count` of their rows (n, ROW).
void add_products(const float* a, const float* b, const uint8_t* index, int count, double* c);

}  // namespace partwright
