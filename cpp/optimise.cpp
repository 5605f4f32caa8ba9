#include "optimise.hpp"

#include <cmath>

#include "compact_samples.hpp"
#include "parallel.hpp"

namespace partwright {
namespace {

using Square = std::array<double, DERIVATIVES * DERIVATIVES>;
using Vector = std::array<double, DERIVATIVES>;

// Lower Cholesky factor in place; false when not positive definite.
bool factor(Square& a) {
  for (int i = 0; i < DERIVATIVES; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = a[i * DERIVATIVES + j];
      for (int k = 0; k < j; ++k) sum -= a[i * DERIVATIVES + k] * a[j * DERIVATIVES + k];
      if (i == j && !(sum > 0)) return false;
      a[i * DERIVATIVES + j] = i == j ? std::sqrt(sum) : sum / a[j * DERIVATIVES + j];
    }
  return true;
}

void solve(const Square& l, const double* b, double* x) {
  for (int i = 0; i < DERIVATIVES; ++i) {
    double sum = b[i];
    for (int k = 0; k < i; ++k) sum -= l[i * DERIVATIVES + k] * x[k];
    x[i] = sum / l[i * DERIVATIVES + i];
  }
  for (int i = DERIVATIVES - 1; i >= 0; --i) {
    double sum = x[i];
    for (int k = i + 1; k < DERIVATIVES; ++k) sum -= l[k * DERIVATIVES + i] * x[k];
    x[i] = sum / l[i * DERIVATIVES + i];
  }
}

// Diagonal damping that keeps parameters without influence in place.
constexpr double FLOOR = 1e-3;

// The damped Gauss-Newton step by conjugate gradients. Parts couple only where they touch, so each part's own
// block is nearly all there is: with the blocks' factors as preconditioner a few products with the sparse matrix
// do, where a dense factorisation would cost the cube of the number of parts.
class DampedStep {
 public:
  DampedStep(const NormalEquations& system, const std::vector<char>& moving) : system_(system), moving_(moving) {}

  // Entries of `step` that do not move are 0. False when a block is not positive definite.
  bool operator()(double damping, std::vector<double>& step) {
    const size_t n = moving_.size();
    factors_.assign(n / DERIVATIVES, identity());
    damping_.assign(n, 0.0);
    for (const auto& [pair, block] : system_.blocks) {
      if (pair.first != pair.second) continue;
      const size_t base = size_t(pair.first) * DERIVATIVES;
      Square& own = factors_[size_t(pair.first)];
      for (int r = 0; r < DERIVATIVES; ++r)
        for (int c = 0; c < DERIVATIVES; ++c)
          if (moving_[base + r] && moving_[base + c]) own[r * DERIVATIVES + c] = block[r * DERIVATIVES + c];
      for (int r = 0; r < DERIVATIVES; ++r) {
        if (!moving_[base + r]) continue;
        damping_[base + r] = damping * (block[r * DERIVATIVES + r] + FLOOR) + 1e-9;
        own[r * DERIVATIVES + r] += damping_[base + r];
      }
      if (!factor(own)) return false;
    }
    step.assign(n, 0.0);
    std::vector<double> residual(n), z(n), p(n), q(n);
    for (size_t i = 0; i < n; ++i) residual[i] = moving_[i] ? -system_.gradient[i] : 0.0;
    precondition(residual, z);
    p = z;
    double rz = dot(residual, z);
    const double enough = rz * 1e-6;
    for (int iteration = 0; iteration < 60 && rz > enough && rz > 0; ++iteration) {
      multiply(p, q);
      const double alpha = rz / dot(p, q);
      for (size_t i = 0; i < n; ++i) {
        step[i] += alpha * p[i];
        residual[i] -= alpha * q[i];
      }
      precondition(residual, z);
      const double next = dot(residual, z);
      for (size_t i = 0; i < n; ++i) p[i] = z[i] + next / rz * p[i];
      rz = next;
    }
    return true;
  }

 private:
  static Square identity() {
    Square a{};
    for (int i = 0; i < DERIVATIVES; ++i) a[i * DERIVATIVES + i] = 1;
    return a;
  }

  static double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  }

  void precondition(const std::vector<double>& r, std::vector<double>& z) const {
    for (size_t i = 0; i < factors_.size(); ++i) solve(factors_[i], &r[i * DERIVATIVES], &z[i * DERIVATIVES]);
    for (size_t i = 0; i < z.size(); ++i) z[i] = moving_[i] ? z[i] : 0.0;
  }

  void multiply(const std::vector<double>& x, std::vector<double>& y) const {
    for (size_t i = 0; i < y.size(); ++i) y[i] = damping_[i] * x[i];
    for (const auto& [pair, block] : system_.blocks) {
      const double *xi = &x[size_t(pair.first) * DERIVATIVES], *xj = &x[size_t(pair.second) * DERIVATIVES];
      double *yi = &y[size_t(pair.first) * DERIVATIVES], *yj = &y[size_t(pair.second) * DERIVATIVES];
      const bool twice = pair.first != pair.second;
      for (int r = 0; r < DERIVATIVES; ++r) {
        double sum = 0;
        for (int c = 0; c < DERIVATIVES; ++c) sum += block[r * DERIVATIVES + c] * xj[c];
        yi[r] += sum;
        if (twice)
          for (int c = 0; c < DERIVATIVES; ++c) yj[c] += block[r * DERIVATIVES + c] * xi[r];
      }
    }
    for (size_t i = 0; i < y.size(); ++i) y[i] = moving_[i] ? y[i] : 0.0;
  }

  const NormalEquations& system_;
  const std::vector<char>& moving_;
  std::vector<Square> factors_;
  std::vector<double> damping_;
};

float& shape_entry(float* row, int derivative) { return row[SX + derivative - D_SX]; }

// `moving` says which entries may change; all others keep their bits.
void move(float* row, const double* delta, const char* moving, const Limits& limits, bool tied) {
  double d[DERIVATIVES];
  for (int i = 0; i < DERIVATIVES; ++i)
    d[i] = std::min(std::max(delta[i], -double(limits.step[i])), double(limits.step[i]));
  for (int i = 0; i < 3; ++i) row[TX + i] += float(d[D_TX + i]);
  const double angle = std::sqrt(d[D_WX] * d[D_WX] + d[D_WY] * d[D_WY] + d[D_WZ] * d[D_WZ]);
  const double s = angle > 1e-9 ? std::sin(angle / 2) / angle : 0.5, c = std::cos(angle / 2);
  const double q[4] = {row[QW], row[QX], row[QY], row[QZ]}, v[3] = {s * d[D_WX], s * d[D_WY], s * d[D_WZ]};
  const double turned[4] = {q[0] * c - q[1] * v[0] - q[2] * v[1] - q[3] * v[2],
                            q[0] * v[0] + q[1] * c + q[2] * v[2] - q[3] * v[1],
                            q[0] * v[1] - q[1] * v[2] + q[2] * c + q[3] * v[0],
                            q[0] * v[2] + q[1] * v[1] - q[2] * v[0] + q[3] * c};
  double norm = 0;
  for (double e : turned) norm += e * e;
  if (angle > 0)
    for (int i = 0; i < 4; ++i) row[QW + i] = float(turned[i] / std::sqrt(norm));
  for (int i = D_SX; i < DERIVATIVES; ++i) {
    if (!moving[i]) continue;
    float& entry = shape_entry(row, i);
    entry = std::min(std::max(entry + float(d[i]), limits.lower[i]), limits.upper[i]);
  }
  if (tied && moving[D_SX]) row[SY] = row[SX];
  if (moving[D_BULGE]) row[BULGE] = std::min(row[BULGE], tightest_bulge(row[SX], row[SZ]));
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

Outcome minimised(std::vector<float> rows, const std::vector<char>& free, const std::vector<char>& tied,
                  const Samples& samples, const std::vector<Stage>& stages, Penalties penalties, const Limits& limits,
                  int threads) {
  const int parts = int(rows.size() / COLUMNS);
  std::vector<char> live(size_t(parts), 0);
  for (int i = 0; i < parts; ++i)
    for (int d = 0; d < DERIVATIVES; ++d) live[size_t(i)] |= free[size_t(i) * DERIVATIVES + d];
  Outcome out{std::move(rows), 0, 0};
  std::vector<char> moving(size_t(parts) * DERIVATIVES);
  std::vector<double> step;
  PartDistances distances(size_t(parts), samples), tried(distances);
  for (const Stage& stage : stages) {
    double damping = 1e-2;
    measure(prepared(out.rows), samples, stage.beta, threads, distances);
    tried = distances;
    NormalEquations system = normal_equations(prepared(out.rows), live, samples, stage.beta, penalties, threads, distances);
    tie(system, tied);
    for (int iteration = 0; iteration < stage.iterations; ++iteration) {
      // A variable at its bound that wants to leave the box takes no part in the step.
      for (size_t at = 0; at < moving.size(); ++at) {
        const size_t i = at / DERIVATIVES;
        const int d = int(at % DERIVATIVES);
        moving[at] = free[at] && !(tied[i] && d == D_SY);
        if (!moving[at] || d < D_SX) continue;
        const float v = shape_entry(&out.rows[i * COLUMNS], d);
        if ((v <= limits.lower[d] && system.gradient[at] > 0) || (v >= limits.upper[d] && system.gradient[at] < 0)) moving[at] = 0;
      }
      DampedStep damped(system, moving);
      bool accepted = false;
      double gain = 0;
      for (int attempt = 0; attempt < 5 && !accepted; ++attempt) {
        if (damped(damping, step)) {
          std::vector<float> candidate = out.rows;
          for (int i = 0; i < parts; ++i)
            if (live[size_t(i)]) move(&candidate[size_t(i) * COLUMNS], &step[size_t(i) * DERIVATIVES], &moving[size_t(i) * DERIVATIVES], limits, tied[size_t(i)]);
          const double now = loss(prepared(candidate), live, samples, stage.beta, penalties, threads, tried);
          if (now < system.loss) {
            gain = (system.loss - now) / system.loss;
            out.rows = std::move(candidate);
            std::swap(distances, tried);
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
      system = normal_equations(prepared(out.rows), live, samples, stage.beta, penalties, threads, distances);
      tie(system, tied);
    }
    out.loss = system.loss;
  }
  return out;
}

}  // namespace

Outcome levenberg_marquardt(std::vector<float> rows, const std::vector<char>& free, const std::vector<char>& tied,
                            const Samples& samples, const std::vector<Stage>& stages, Penalties penalties,
                            const Limits& limits, int threads) {
  if (rows.size() > COLUMNS) {
    const CompactSamples compact(samples);
    return minimised(std::move(rows), free, tied, compact.samples(), stages, penalties, limits, threads);
  }
  return minimised(std::move(rows), free, tied, samples, stages, penalties, limits, threads);
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
