// Samples in an order in which those of a block lie close together: most parts are then far from most blocks.
#pragma once

#include <vector>

#include "normal_equations.hpp"

namespace partwright {

class CompactSamples {
 public:
  explicit CompactSamples(const Samples& given);
  Samples samples() const;

 private:
  std::vector<float> points_, distance_, weight_, background_;
};

}  // namespace partwright
