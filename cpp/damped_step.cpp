#include "damped_step.hpp"

#include <algorithm>
#include <cmath>

namespace partwright {
namespace {

// Diagonal damping that keeps parameters without influence in place.
constexpr double FLOOR = 1e-3;

// The upper Cholesky factor U of U^T U in place; what is below the diagonal is of no use then. False when not positive
// definite. What rows lose to a row above is subtracted at once, whole registers at a time.
PW_CLONES bool factor(Square& a) {
  for (int j = 0; j < DERIVATIVES; ++j) {
    if (!(a.rows[j][j] > 0)) return false;
    const double pivot = std::sqrt(a.rows[j][j]);
    alignas(64) double row[PADDED];
    for (int i = 0; i < PADDED; ++i) row[i] = a.rows[j][i] / pivot;
    row[j] = pivot;
    std::copy_n(row, PADDED, a.rows[j]);
    for (int k = j + 1; k < DERIVATIVES; ++k)
      for (int i = 0; i < PADDED; ++i) a.rows[k][i] -= row[k] * row[i];
  }
  return true;
}

// The inverse of U^T U, whose product with a vector has no number that waits for another.
PW_CLONES void invert(const Square& u, Square& inverse) {
  alignas(64) double x[DERIVATIVES][PADDED] = {};
  double pivots[DERIVATIVES];
  for (int k = 0; k < DERIVATIVES; ++k) pivots[k] = 1 / u.rows[k][k];
  for (int k = 0; k < DERIVATIVES; ++k) {
    x[k][k] += 1;
    for (int i = 0; i < PADDED; ++i) x[k][i] *= pivots[k];
    for (int j = k + 1; j < DERIVATIVES; ++j)
      for (int i = 0; i < PADDED; ++i) x[j][i] -= u.rows[k][j] * x[k][i];
  }
  for (int k = DERIVATIVES - 1; k >= 0; --k) {
    for (int i = 0; i < PADDED; ++i) x[k][i] *= pivots[k];
    for (int j = 0; j < k; ++j)
      for (int i = 0; i < PADDED; ++i) x[j][i] -= u.rows[j][k] * x[k][i];
  }
  // Where rounding leaves it no symmetric, conjugate gradients would not be conjugate.
  for (int i = 0; i < DERIVATIVES; ++i)
    for (int j = 0; j < PADDED; ++j) inverse.rows[i][j] = j < DERIVATIVES ? (x[i][j] + x[j < DERIVATIVES ? j : 0][i]) / 2 : 0.0;
}

// y += A^T x.
PW_CLONES void add_product(const Square& a, const double* __restrict x, double* __restrict y) {
  alignas(64) double sums[PADDED];
  std::copy_n(y, PADDED, sums);
  for (int r = 0; r < DERIVATIVES; ++r)
    for (int c = 0; c < PADDED; ++c) sums[c] += a.rows[r][c] * x[r];
  std::copy_n(sums, PADDED, y);
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

DampedStep::DampedStep(const NormalEquations& system, const std::vector<char>& moving)
    : moving_(moving.size() / DERIVATIVES * PADDED), gradient_(moving_.size()), damping_(moving_.size()) {
  for (size_t i = 0; i < moving.size(); ++i) {
    const size_t at = i / DERIVATIVES * PADDED + i % DERIVATIVES;
    moving_[at] = moving[i];
    gradient_[at] = system.gradient[i];
  }
  for (const auto& [pair, block] : system.blocks) {
    Pair one{pair.first, pair.second, {}, {}};
    for (int r = 0; r < DERIVATIVES; ++r)
      for (int c = 0; c < DERIVATIVES; ++c) one.block.rows[r][c] = one.transposed.rows[c][r] = block[size_t(r * DERIVATIVES + c)];
    pairs_.push_back(one);
  }
}

bool DampedStep::operator()(double damping, std::vector<double>& step) {
  const size_t n = moving_.size();
  Square identity{};
  for (int i = 0; i < DERIVATIVES; ++i) identity.rows[i][i] = 1;
  inverses_.assign(n / PADDED, identity);
  damping_.assign(n, 0.0);
  for (const Pair& pair : pairs_) {
    if (pair.first != pair.second) continue;
    const size_t base = size_t(pair.first) * PADDED;
    Square& own = inverses_[size_t(pair.first)];
    for (int r = 0; r < DERIVATIVES; ++r)
      for (int c = 0; c < DERIVATIVES; ++c)
        if (moving_[base + r] && moving_[base + c]) own.rows[r][c] = pair.block.rows[r][c];
    for (int r = 0; r < DERIVATIVES; ++r) {
      if (!moving_[base + r]) continue;
      damping_[base + r] = damping * (pair.block.rows[r][r] + FLOOR) + 1e-9;
      own.rows[r][r] += damping_[base + r];
    }
    if (!factor(own)) return false;
    invert(own, own);
  }
  std::vector<double> x(n), residual(n), z(n), p(n), q(n);
  for (size_t i = 0; i < n; ++i) residual[i] = moving_[i] ? -gradient_[i] : 0.0;
  precondition(residual, z);
  if (inverses_.size() == 1) x = z;  // which is the step itself
  p = z;
  double rz = inverses_.size() == 1 ? 0 : dot(residual, z);
  const double enough = rz * 1e-6;
  for (int iteration = 0; iteration < 60 && rz > enough && rz > 0; ++iteration) {
    multiply(p, q);
    const double alpha = rz / dot(p, q);
    for (size_t i = 0; i < n; ++i) {
      x[i] += alpha * p[i];
      residual[i] -= alpha * q[i];
    }
    precondition(residual, z);
    const double next = dot(residual, z);
    for (size_t i = 0; i < n; ++i) p[i] = z[i] + next / rz * p[i];
    rz = next;
  }
  step.resize(n / PADDED * DERIVATIVES);
  for (size_t i = 0; i < step.size(); ++i) step[i] = x[i / DERIVATIVES * PADDED + i % DERIVATIVES];
  return true;
}

void DampedStep::precondition(const std::vector<double>& r, std::vector<double>& z) const {
  std::fill(z.begin(), z.end(), 0.0);
  for (size_t i = 0; i < inverses_.size(); ++i) add_product(inverses_[i], &r[i * PADDED], &z[i * PADDED]);
  for (size_t i = 0; i < z.size(); ++i) z[i] = moving_[i] ? z[i] : 0.0;
}

void DampedStep::multiply(const std::vector<double>& x, std::vector<double>& y) const {
  for (size_t i = 0; i < y.size(); ++i) y[i] = damping_[i] * x[i];
  for (const Pair& pair : pairs_) {
    const size_t first = size_t(pair.first) * PADDED, second = size_t(pair.second) * PADDED;
    double own[PADDED] = {};
    add_product(pair.transposed, &x[second], own);
    for (int r = 0; r < PADDED; ++r) y[first + size_t(r)] += own[r];
    if (first != second) add_product(pair.block, &x[first], &y[second]);
  }
  for (size_t i = 0; i < y.size(); ++i) y[i] = moving_[i] ? y[i] : 0.0;
}

}  // namespace partwright
