// Convex hulls of points, and of what lies on either side of a plane.
// meshing/hulls.py is their face; tests have them in readable form.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace partwright {

struct Hull {
  std::vector<std::array<int64_t, 3>> faces;  // points' indices, counter-clockwise from outside; none if all lie in a plane
  double volume = 0;
};

// Of points (N, 3), finite. Points move to a grid of 4e-12 of their size first; there the hull is exact: closed and nowhere
// concave. Points that are out of it by no more than 6e-8 of the size, as rounding leaves them in a flat face, may be left out.
// plain: without corners in the middle of a flat face or a straight edge.
Hull convex_hull(const double* points, int64_t count, bool plain);

// A closed mesh: vertices (V, 3), faces (F, 3), edges (E, 2) each once.
struct Mesh {
  const double* vertices;
  const int64_t* faces;
  const int64_t* edges;
  int64_t vertex_count, face_count, edge_count;
};

// For each plane (normal, offset) the volume of the hulls of the mesh's two sides together; infinite where one has no more than
// what lies within `slack` of the plane.
void split_hull_volumes(const Mesh& mesh, const double* planes, int64_t count, double slack, double* out);

}  // namespace partwright
