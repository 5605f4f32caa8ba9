// Products of rows of DERIVATIVES derivatives over many samples, summed into doubles.
#pragma once

#include <vector>

namespace partwright {

// C (DERIVATIVES, DERIVATIVES) += A B^T; A, B (DERIVATIVES, length), length a multiple of 16.
void outer_product(const float* a, const float* b, int length, double* c);

// C += A A^T, but only its lower triangle, which `mirror` copies to the upper once all are summed.
void outer_square(const float* a, int length, double* c);
void mirror(std::vector<double>& c);

// c (DERIVATIVES,) += A v.
void times_vector(const float* a, const float* v, int length, double* c);

}  // namespace partwright
