#include "optimise.hpp"

#include <cmath>

#include "damped_step.hpp"
#include "parallel.hpp"

namespace partwright {
namespace {

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

// By how much of it a sum may differ with the order of its terms.
constexpr double ROUNDED = 1e-9;

// stages: each with the samples at its sharpness.
using Sharpened = std::vector<std::pair<Stage, SampleBlocks>>;

Sharpened sharpened(const Samples& samples, bool compact, const std::vector<Stage>& stages, int threads) {
  Sharpened result;
  for (const Stage& stage : stages) {
    if (result.empty())
      result.emplace_back(stage, SampleBlocks(samples, compact, threads));
    else
      result.emplace_back(stage, result.back().second);
    result.back().second.sharpen(stage.beta);
  }
  return result;
}

Outcome minimised(std::vector<float> rows, const std::vector<char>& free, const std::vector<char>& tied, const Sharpened& stages,
                  Penalties penalties, const Limits& limits, int threads) {
  const int parts = int(rows.size() / COLUMNS);
  std::vector<char> live(size_t(parts), 0);
  for (int i = 0; i < parts; ++i)
    for (int d = 0; d < DERIVATIVES; ++d) live[size_t(i)] |= free[size_t(i) * DERIVATIVES + d];
  Outcome out{std::move(rows), 0, 0};
  std::vector<char> moving(size_t(parts) * DERIVATIVES);
  std::vector<double> step;
  if (stages.empty()) return out;
  PartDistances distances(size_t(parts), stages[0].second), tried(size_t(parts), stages[0].second);
  for (const auto& [stage, samples] : stages) {
    double damping = 1e-2;
    measure(prepared(out.rows), samples, threads, distances);
    tried.take(distances, live);
    NormalEquations system = normal_equations(prepared(out.rows), live, samples, penalties, threads, distances);
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
          const double now = loss(prepared(candidate), live, samples, penalties, threads, tried, system.loss * (1 + ROUNDED));
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
      system = normal_equations(prepared(out.rows), live, samples, penalties, threads, distances);
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
  return minimised(std::move(rows), free, tied, sharpened(samples, rows.size() > COLUMNS, stages, threads), penalties, limits, threads);
}

std::vector<Outcome> fit_starts(const std::vector<float>& starts, const std::vector<int64_t>& first,
                                const std::vector<int64_t>& last, const std::vector<char>& free,
                                const std::vector<char>& tied, const Samples& samples, const std::vector<Stage>& stages,
                                Penalties penalties, const Limits& limits, int threads) {
  // Those of the same range, which mostly come one after another, share its samples.
  std::vector<size_t> run_of(first.size()), begun;
  for (size_t i = 0; i < first.size(); ++i) {
    if (!i || first[i] != first[i - 1] || last[i] != last[i - 1]) begun.push_back(i);
    run_of[i] = begun.size() - 1;
  }
  std::vector<Sharpened> shared(begun.size());
  parallel_for(int64_t(begun.size()), threads, [&](int64_t run) {
    const int64_t a = first[begun[size_t(run)]];
    const Samples own{samples.points + 3 * a, samples.distance + a, samples.weight + a,
                      samples.background ? samples.background + a : nullptr, last[begun[size_t(run)]] - a};
    shared[size_t(run)] = sharpened(own, false, stages, 1);
  });
  std::vector<Outcome> out(first.size());
  parallel_for(int64_t(first.size()), threads, [&](int64_t start) {
    const size_t i = size_t(start);
    const std::vector<float> row(&starts[i * COLUMNS], &starts[i * COLUMNS] + COLUMNS);
    const std::vector<char> mask(&free[i * DERIVATIVES], &free[i * DERIVATIVES] + DERIVATIVES);
    out[i] = minimised(row, mask, {tied[i]}, shared[run_of[i]], penalties, limits, 1);
  });
  return out;
}

}  // namespace partwright
