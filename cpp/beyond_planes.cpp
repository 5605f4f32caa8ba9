#include "beyond_planes.hpp"

#include <algorithm>
#include <vector>

namespace partwright {

void volumes_beyond(const double* vertices, int64_t vertex_count, const int64_t* faces, const double* areas,
                    int64_t face_count, const double* normal, const double* offsets, int64_t count, double* out) {
  std::vector<double> height(vertex_count);
  for (int64_t i = 0; i < vertex_count; ++i) {
    const double* v = vertices + 3 * i;
    height[i] = v[0] * normal[0] + v[1] * normal[1] + v[2] * normal[2];
  }
  std::fill(out, out + count, 0.0);
  const double lowest = *std::min_element(offsets, offsets + count);
  for (int64_t f = 0; f < face_count; ++f) {
    const int64_t* corner = faces + 3 * f;
    double low = height[corner[0]], middle = height[corner[1]], high = height[corner[2]];
    if (low > middle) std::swap(low, middle);
    if (middle > high) std::swap(middle, high);
    if (low > middle) std::swap(low, middle);
    if (high <= lowest) continue;
    const double* a = areas + 3 * f;
    const double area = a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2];
    const double mean = (low + middle + high) / 3;
    for (int64_t k = 0; k < count; ++k) {
      const double offset = offsets[k], below = offset - low, above = high - offset;
      if (above <= 0) continue;
      if (below <= 0)
        out[k] += area * (mean - offset);
      else if (offset < middle)
        out[k] += area * (mean - offset + below * below * below / (3 * (middle - low) * (high - low)));
      else
        out[k] += area * above * above * above / (3 * (high - low) * (high - middle));
    }
  }
}

}  // namespace partwright
