#include "optimise.hpp"

#include <cmath>

#include "parallel.hpp"

namespace partwright {
namespace {

// In-place Cholesky of the lower triangle, then both triangular solves; false when not positive definite.
bool solve(std::vector<double>& a, std::vector<double>& b, int n) {
  for (int i = 0; i < n; ++i) {
    double* row = &a[size_t(i) * n];
    for (int j = 0; j <= i; ++j) {
      const double* other = &a[size_t(j) * n];
      double lanes[8] = {};
      int k = 0;
      for (; k + 8 <= j; k += 8)
        for (int lane = 0; lane < 8; ++lane) lanes[lane] += row[k + lane] * other[k + lane];
      double sum = row[j];
      for (double lane : lanes) sum -= lane;
      for (; k < j; ++k) sum -= row[k] * other[k];
      if (i == j) {
        if (!(sum > 0)) return false;
        row[j] = std::sqrt(sum);
      } else {
        row[j] = sum / other[j];
      }
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < i; ++k) b[i] -= a[size_t(i) * n + k] * b[k];
    b[i] /= a[size_t(i) * n + i];
  }
  for (int i = n - 1; i >= 0; --i) {
    b[i] /= a[size_t(i) * n + i];
    for (int k = 0; k < i; ++k) b[k] -= a[size_t(i) * n + k] * b[i];
  }
  return true;
}

float& shape_entry(float* row, int derivative) { return row[SX + derivative - D_SX]; }

void move(float* row, const double* delta, const Limits& limits, bool tied) {
  double d[DERIVATIVES];
  for (int i = 0; i < DERIVATIVES; ++i)
    d[i] = std::min(std::max(delta[i], -double(limits.step[i])), double(limits.step[i]));
  for (int i = 0; i < 3; ++i) row[TX + i] += float(d[D_T + i]);
  const double angle = std::sqrt(d[3] * d[3] + d[4] * d[4] + d[5] * d[5]);
  const double s = angle > 1e-9 ? std::sin(angle / 2) / angle : 0.5, c = std::cos(angle / 2);
  const double q[4] = {row[QW], row[QX], row[QY], row[QZ]}, v[3] = {s * d[3], s * d[4], s * d[5]};
  const double turned[4] = {q[0] * c - q[1] * v[0] - q[2] * v[1] - q[3] * v[2],
                            q[0] * v[0] + q[1] * c + q[2] * v[2] - q[3] * v[1],
                            q[0] * v[1] - q[1] * v[2] + q[2] * c + q[3] * v[0],
                            q[0] * v[2] + q[1] * v[1] - q[2] * v[0] + q[3] * c};
  double norm = 0;
  for (double e : turned) norm += e * e;
  if (angle > 0)
    for (int i = 0; i < 4; ++i) row[QW + i] = float(turned[i] / std::sqrt(norm));
  for (int i = D_SX; i < DERIVATIVES; ++i) {
    if (delta[i] == 0) continue;
    float& entry = shape_entry(row, i);
    entry = std::min(std::max(entry + float(d[i]), limits.lower[i]), limits.upper[i]);
  }
  if (tied) row[SY] = row[SX];
  // An arc tighter than half the section's width folds through its own centre.
  if (delta[D_BULGE] != 0 || delta[D_SX] != 0 || delta[D_SZ] != 0)
    row[BULGE] = std::min(row[BULGE], std::asin(std::min(1.f, row[SZ] / std::max(row[SX], 1e-6f))) / HALF_PI);
}

std::vector<Part> prepared(const std::vector<float>& rows) {
  std::vector<Part> parts(rows.size() / COLUMNS);
  for (size_t i = 0; i < parts.size(); ++i) parts[i] = prepare(&rows[i * COLUMNS]);
  return parts;
}

// sx and sy move as one variable: its derivative is the sum of both, kept in sx.
void tie(NormalEquations& system, const std::vector<char>& tied) {
  for (size_t i = 0; i < tied.size(); ++i)
    if (tied[i]) system.gradient[i * DERIVATIVES + D_SX] += system.gradient[i * DERIVATIVES + D_SY];
  for (auto& [pair, block] : system.blocks) {
    if (tied[size_t(pair.first)])
      for (int c = 0; c < DERIVATIVES; ++c) block[D_SX * DERIVATIVES + c] += block[D_SY * DERIVATIVES + c];
    if (tied[size_t(pair.second)])
      for (int r = 0; r < DERIVATIVES; ++r) block[r * DERIVATIVES + D_SX] += block[r * DERIVATIVES + D_SY];
  }
}

// Diagonal damping that keeps parameters without influence in place.
constexpr double FLOOR = 1e-3;

}  // namespace

Outcome levenberg_marquardt(std::vector<float> rows, const std::vector<char>& free, const std::vector<char>& tied,
                            const Samples& samples, const std::vector<Stage>& stages, Penalties penalties,
                            const Limits& limits, int threads) {
  const int parts = int(rows.size() / COLUMNS);
  std::vector<char> live(size_t(parts), 0);
  for (int i = 0; i < parts; ++i)
    for (int d = 0; d < DERIVATIVES; ++d) live[size_t(i)] |= free[size_t(i) * DERIVATIVES + d];
  Outcome out{std::move(rows), 0, 0};
  std::vector<int> index;
  std::vector<double> matrix, step, delta(size_t(parts) * DERIVATIVES);
  for (const Stage& stage : stages) {
    double damping = 1e-2;
    NormalEquations system = normal_equations(prepared(out.rows), live, samples, stage.beta, penalties, threads);
    tie(system, tied);
    for (int iteration = 0; iteration < stage.iterations; ++iteration) {
      // A variable at its bound that wants to leave the box takes no part in the step.
      index.assign(size_t(parts) * DERIVATIVES, -1);
      int n = 0;
      for (int i = 0; i < parts; ++i) {
        for (int d = 0; d < DERIVATIVES; ++d) {
          const size_t at = size_t(i) * DERIVATIVES + d;
          if (!free[at] || (tied[size_t(i)] && d == D_SY)) continue;
          if (d >= D_SX) {
            const float v = shape_entry(&out.rows[size_t(i) * COLUMNS], d);
            if ((v <= limits.lower[d] && system.gradient[at] > 0) || (v >= limits.upper[d] && system.gradient[at] < 0)) continue;
          }
          index[at] = n++;
        }
      }
      if (n == 0) break;
      bool accepted = false;
      double gain = 0;
      for (int attempt = 0; attempt < 5 && !accepted; ++attempt) {
        matrix.assign(size_t(n) * n, 0.0);
        step.assign(size_t(n), 0.0);
        for (const auto& [pair, block] : system.blocks)
          for (int r = 0; r < DERIVATIVES; ++r)
            for (int c = 0; c < DERIVATIVES; ++c) {
              const int i = index[size_t(pair.first) * DERIVATIVES + r], j = index[size_t(pair.second) * DERIVATIVES + c];
              if (i >= 0 && j >= 0) matrix[size_t(std::max(i, j)) * n + std::min(i, j)] = block[r * DERIVATIVES + c];
            }
        for (size_t at = 0; at < index.size(); ++at)
          if (index[at] >= 0) {
            double& diagonal = matrix[size_t(index[at]) * n + index[at]];
            diagonal += damping * (diagonal + FLOOR) + 1e-9;
            step[size_t(index[at])] = -system.gradient[at];
          }
        if (solve(matrix, step, n)) {
          std::vector<float> candidate = out.rows;
          for (int i = 0; i < parts; ++i) {
            if (!live[size_t(i)]) continue;
            double* d = &delta[size_t(i) * DERIVATIVES];
            for (int j = 0; j < DERIVATIVES; ++j) {
              const int at = index[size_t(i) * DERIVATIVES + j];
              d[j] = at >= 0 ? step[size_t(at)] : 0;
            }
            move(&candidate[size_t(i) * COLUMNS], d, limits, tied[size_t(i)]);
          }
          const double now = loss(prepared(candidate), samples, stage.beta, penalties, threads);
          if (now < system.loss) {
            gain = (system.loss - now) / system.loss;
            out.rows = std::move(candidate);
            accepted = true;
          }
        }
        damping = accepted ? std::max(damping * 0.3, 1e-6) : damping * 6;
      }
      ++out.iterations;
      if (!accepted) break;
      if (iteration + 1 == stage.iterations || gain < 1e-4) {
        system.loss *= 1 - gain;
        break;
      }
      system = normal_equations(prepared(out.rows), live, samples, stage.beta, penalties, threads);
      tie(system, tied);
    }
    out.loss = system.loss;
  }
  return out;
}

std::vector<Outcome> fit_starts(const std::vector<float>& starts, const std::vector<int64_t>& first,
                                const std::vector<int64_t>& last, const std::vector<char>& free,
                                const std::vector<char>& tied, const Samples& samples, const std::vector<Stage>& stages,
                                Penalties penalties, const Limits& limits, int threads) {
  std::vector<Outcome> out(first.size());
  parallel_for(int64_t(first.size()), threads, [&](int64_t i) {
    const int64_t a = first[size_t(i)];
    const Samples own{samples.points + 3 * a, samples.distance + a, samples.weight + a,
                      samples.background ? samples.background + a : nullptr, last[size_t(i)] - a};
    const std::vector<float> row(&starts[size_t(i) * COLUMNS], &starts[size_t(i) * COLUMNS] + COLUMNS);
    const std::vector<char> mask(&free[size_t(i) * DERIVATIVES], &free[size_t(i) * DERIVATIVES] + DERIVATIVES);
    out[size_t(i)] = levenberg_marquardt(row, mask, {tied[size_t(i)]}, own, stages, penalties, limits, 1);
  });
  return out;
}

}  // namespace partwright
