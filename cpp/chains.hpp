// Chains of corners in the plane. approximation/sketches/chains.py is their face; tests have them in readable form.
#pragma once

#include <cstdint>
#include <vector>

namespace partwright {

struct Circle {
  double x, y, radius, off;
};

// The circle nearest to points (count, 2), in the sense of squares, and the largest distance of any from it; of points on a
// line the radius and that distance are infinite.
Circle circle_through(const double* points, int64_t count);

// Indices, ends included, of the corners of an open chain (count, 2) that stay: the farthest from chords, until all others
// lie within the tolerance of them.
std::vector<int64_t> open_line(const double* points, int64_t count, double tolerance);

}  // namespace partwright
