// The volume of a solid beyond parallel planes. approximation/half_space.py is its face; tests have it in readable form.
#pragma once

#include <cstdint>

namespace partwright {

// For each of parallel planes the volume of the solid where normal . p > offset. vertices: (V, 3); faces: (F, 3) and their
// areas along each axis.
void volumes_beyond(const double* vertices, int64_t vertex_count, const int64_t* faces, const double* areas,
                    int64_t face_count, const double* normal, const double* offsets, int64_t count, double* out);

}  // namespace partwright
