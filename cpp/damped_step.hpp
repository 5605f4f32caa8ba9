// The damped Gauss-Newton step by conjugate gradients. Parts couple only where they touch, so each part's own block
// is nearly all there is: with the blocks' inverses as preconditioner a few products with the sparse matrix do, where
// a dense factorisation would cost the cube of the number of parts.
#pragma once

#include <vector>

#include "normal_equations.hpp"

namespace partwright {

// Rows of doubles are padded to whole registers.
constexpr int PADDED = (DERIVATIVES + 7) / 8 * 8;

struct Square {
  alignas(64) double rows[DERIVATIVES][PADDED];
};

class DampedStep {
 public:
  // Of the entries that are `moving` (M x DERIVATIVES).
  DampedStep(const NormalEquations& system, const std::vector<char>& moving);

  // Entries of `step` (M x DERIVATIVES) that do not move are 0. False when a block is not positive definite.
  bool operator()(double damping, std::vector<double>& step);

 private:
  struct Pair {
    int first, second;
    Square block, transposed;
  };

  void precondition(const std::vector<double>& r, std::vector<double>& z) const;
  void multiply(const std::vector<double>& x, std::vector<double>& y) const;

  std::vector<Pair> pairs_;
  std::vector<char> moving_;  // padded, as are all that follow
  std::vector<double> gradient_, damping_;
  std::vector<Square> inverses_;  // of the parts' own blocks
};

}  // namespace partwright
