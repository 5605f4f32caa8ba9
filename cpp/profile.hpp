// The signed distance in the plane to a closed outline of lines and arcs with holes, and its derivatives by every corner
// and bulge. fields/profile_distance.py is the same in readable form, and tests hold the two together.
#pragma once

#include <cstdint>
#include <vector>

namespace partwright {

// One side of the outline, from a to b; the centre and radius are of an arc only. pieces: the side cut where it is level,
// so that a level line meets each piece at most once.
struct Side {
  double ax, ay, bx, by, bulge;
  double cx, cy, radius;      // radius 0: a straight side
  double mx, my, cosine;      // direction from the centre to the arc's middle, and cosine of half its angle
  int64_t first, last;        // its corners in the table
  bool counts;                // sides on the axis of a revolution bound nothing
};

struct Piece {
  double low, high;           // heights
  double ax, ay, bx, by;      // of a straight piece
  double cx, cy, square;      // of an arc: centre and squared radius; 0 for a straight piece
  bool right;                 // of an arc: whether it lies on the right of its centre
};

struct Outline {
  std::vector<Side> sides;
  std::vector<Piece> pieces;
};

// corners: x, y, bulge of the side that begins there. starts: where loops begin, and their end. counts: per side.
Outline outline_of(const double* corners, const std::vector<int64_t>& starts, const uint8_t* counts);

// Distances at points (N, 2), negative inside.
void profile_distances(const Outline& outline, const double* points, int64_t count, double* out, int threads);

// Derivatives (V, 3) of sum(upstream * distance) by the corners, and (N, 2) of the distance by the points.
void profile_gradients(const Outline& outline, const double* points, const double* upstream, int64_t count,
                       int64_t corners, double* out, double* by_point, int threads);

}  // namespace partwright
