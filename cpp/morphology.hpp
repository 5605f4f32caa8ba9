// Morphological shape decomposition: peel the thickest part first (SuperFrusta, section 3.3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace partwright {

struct Grid {
  int nx, ny, nz;
  float spacing;
  size_t size() const { return size_t(nx) * ny * nz; }
  size_t at(int x, int y, int z) const { return (size_t(x) * ny + y) * nz + z; }
};

struct Peeling {
  int regions;          // at most so many
  double fraction;      // kappa: a core holds this share of the volume that is left
  double least_depth;   // cores shallower than this end the peeling
  double least_voxels;  // regions smaller than this end the peeling
};

// Writes each voxel's region, or -1, into `labels`; returns the erosion depth |tau| of each region.
std::vector<float> decompose(std::vector<float> field, const Grid& grid, const Peeling& peeling, int32_t* labels);

}  // namespace partwright
