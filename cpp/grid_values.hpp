// Values on a grid, read between its points.
#pragma once

#include <array>
#include <cstdint>

namespace partwright {

// The distance at points (count, 3) of values on a grid, interpolated along each axis; beyond the grid that of its nearest
// place, and the way there.
void read_grid(const float* values, const std::array<int64_t, 3>& counts, const double* origin, double spacing,
               const double* points, int64_t count, double* out);

}  // namespace partwright
