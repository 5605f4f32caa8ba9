// Levenberg-Marquardt over the parameters of an assembly, with bounds.
#pragma once

#include <array>
#include <vector>

#include "normal_equations.hpp"

namespace partwright {

// A run at one sharpness of the occupancy sigmoid.
struct Stage {
  float beta;
  int iterations;
};

struct Limits {
  std::array<float, DERIVATIVES> lower, upper, step;
};

struct Outcome {
  std::vector<float> rows;  // M x COLUMNS
  double loss;
  int iterations;
};

// Minimises the loss over the entries that `free` (M x DERIVATIVES) marks; others stay bit for bit.
// `tied[i]` keeps sx = sy of part i (round cross-sections stay round).
Outcome levenberg_marquardt(std::vector<float> rows, const std::vector<char>& free, const std::vector<char>& tied,
                            const Samples& samples, const std::vector<Stage>& stages, Penalties penalties,
                            const Limits& limits, int threads);

// One independent single-part run per start, each on its own range of the samples.
std::vector<Outcome> fit_starts(const std::vector<float>& starts, const std::vector<int64_t>& first,
                                const std::vector<int64_t>& last, const std::vector<char>& free,
                                const std::vector<char>& tied, const Samples& samples, const std::vector<Stage>& stages,
                                Penalties penalties, const Limits& limits, int threads);

}  // namespace partwright
