// Parts that are small networks, each asked only near its own cuboid: partsdf/local.py's decoder in single precision.
#pragma once

#include <cstdint>
#include <vector>

namespace partwright {

// G networks of the same form, linear maps with leaky ReLUs between. widths: what goes into each layer, and what comes
// out of the last, which is 1. weights: of each layer (G, I, O), shifts: (G, O).
struct Networks {
  int64_t parts;
  std::vector<int> widths;
  std::vector<const float*> weights, shifts;

  int layers() const { return int(widths.size()) - 1; }
};

// How parts lie and see places: half-lengths of cuboids (G, 3), how far parts reach along their axes and the unit
// that networks see places in, both (G, 3) in half-lengths; `reach` is how far around its room a part is asked.
struct Rooms {
  const float *scale, *room, *unit;
  float reach;
  int octaves;
  bool learning;  // networks that say less than the room hear of it where more is wanted
};

// Distances (G, N) at local points (G, N, 3): the network's near a part's room, else that from the room.
void distances(const Networks& networks, const Rooms& rooms, const float* local, int64_t count, float* out, int threads);

// Derivatives of sum(upstream * distances) by local points (G, N, 3), half-lengths (G, 3), weights and shifts. Networks
// are asked again, but only where `upstream` (G, N) is not zero: of the parts at a point, a loss sees few.
void distance_gradients(const Networks& networks, const Rooms& rooms, const float* local, int64_t count,
                        const float* upstream, float* by_local, float* by_scale, const std::vector<float*>& by_weight,
                        const std::vector<float*>& by_shift, int threads);

}  // namespace partwright
