// How far parts reach: whether they can matter to points that lie close together, without looking at each.
#pragma once

#include "superfrustum.hpp"

namespace partwright {

// A bound from below on the values at points no further than `reach` from a place. Unbent, they fall by no more
// than the way; bent, they are no less than the distance from the box.
inline float least_value(const Part& p, float px, float py, float pz, float reach) {
  if (!p.bent) return (p.hollow ? value<false, true>(p, px, py, pz) : value<false, false>(p, px, py, pz)) - reach;
  float local[3], square = 0;
  to_local(p, px, py, pz, local[0], local[1], local[2]);
  for (int i = 0; i < 3; ++i) {
    const float beyond = std::max(std::max(p.low[i] - local[i], local[i] - p.high[i]), 0.f);
    square += beyond * beyond;
  }
  const float outside = std::sqrt(square) - p.dilation - reach;
  return outside > 0 ? outside : -std::numeric_limits<float>::infinity();
}

struct Ball {
  float x, y, z, radius;
};

// Whether some value of a part at the points in a ball may be below `bound`.
inline bool reaches(const Part& part, const Ball& ball, float bound) {
  return least_value(part, ball.x, ball.y, ball.z, ball.radius) < bound;
}

}  // namespace partwright
