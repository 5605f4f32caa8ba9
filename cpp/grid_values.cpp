#include "grid_values.hpp"

#include <algorithm>
#include <cmath>

namespace partwright {

void read_grid(const float* values, const std::array<int64_t, 3>& counts, const double* origin, double spacing,
               const double* points, int64_t count, double* out) {
  const int64_t steps[3] = {counts[1] * counts[2], counts[2], 1};
  for (int64_t i = 0; i < count; ++i) {
    int64_t first = 0, next[3];
    double share[3], beyond = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = (points[3 * i + axis] - origin[axis]) / spacing;
      // As a number that is none compares with nothing, it is read at the first place, and stays what it is.
      const double within = std::min(std::max(0.0, cell), double(counts[axis] - 1));
      const int64_t below = std::min(int64_t(within), std::max<int64_t>(counts[axis] - 2, 0));
      share[axis] = within - double(below);
      beyond += (cell - within) * (cell - within);
      first += below * steps[axis];
      next[axis] = below + 1 < counts[axis] ? steps[axis] : 0;
    }
    const float* v = values + first;
    const auto along = [&](int64_t at) { return v[at] + share[2] * (double(v[at + next[2]]) - v[at]); };
    const auto across = [&](int64_t at) {
      const double low = along(at);
      return low + share[1] * (along(at + next[1]) - low);
    };
    const double low = across(0);
    out[i] = low + share[0] * (across(next[0]) - low) + spacing * std::sqrt(beyond);
  }
}

}  // namespace partwright
