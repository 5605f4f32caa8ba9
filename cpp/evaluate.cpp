#include "evaluate.hpp"

#include <cstring>

#include "blocks.hpp"
#include "parallel.hpp"

namespace partwright {
namespace {

constexpr int64_t LEAST_BYTES = 1 << 19;  // of a thread: less is summed before one is awake

// The sum of v times by, lane by lane and then of the lanes.
PW_CLONES double dot(const float* __restrict v, const float* __restrict by) {
  float lanes[16] = {};
  for (int i = 0; i < BLOCK; i += 16)
    for (int lane = 0; lane < 16; ++lane) lanes[lane] += v[i + lane] * by[i + lane];
  double sum = 0;
  for (const float lane : lanes) sum += lane;
  return sum;
}

PW_CLONES void count(const float* __restrict field, const float* __restrict inside, const float* __restrict weight, float* __restrict both,
                     float* __restrict either) {
  for (int i = 0; i < BLOCK; ++i) {
    const float in = field[i] < 0 ? 1.f : 0.f;
    both[i] = weight[i] * in * inside[i];
    either[i] = weight[i] * std::max(in, inside[i]);
  }
}

PW_CLONES void block_sums(const uint8_t* __restrict occupied, const uint8_t* __restrict inside, const float* __restrict weight, int n,
                          double& both, double& either) {
  constexpr int LANES = 16;
  float in[LANES] = {}, any[LANES] = {};
  int i = 0;
  for (; i + LANES <= n; i += LANES) {
    // A product and no choice, which would be a branch.
    int shared[LANES], some[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
      shared[lane] = occupied[i + lane] & inside[i + lane];
      some[lane] = occupied[i + lane] | inside[i + lane];
    }
    for (int lane = 0; lane < LANES; ++lane) {
      in[lane] += weight[i + lane] * float(shared[lane]);
      any[lane] += weight[i + lane] * float(some[lane]);
    }
  }
  for (; i < n; ++i) {
    in[0] += occupied[i] & inside[i] ? weight[i] : 0.f;
    any[0] += occupied[i] | inside[i] ? weight[i] : 0.f;
  }
  for (int lane = 0; lane < LANES; ++lane) {
    both += in[lane];
    either += any[lane];
  }
}

// Calls work(block, first, n) for all points, each time with the next n of them, some blocks a thread at once.
template <typename Work>
void over_blocks(const std::vector<Part>& parts, const float* points, int64_t count, int threads, Work work) {
  threads = worth_their_while(threads, int64_t(parts.size()) * count, LEAST_VALUES);
  const int64_t blocks = (count + BLOCK - 1) / BLOCK, batch = 16;
  parallel_for((blocks + batch - 1) / batch, threads, [&](int64_t item) {
    Block block;
    for (int64_t b = item * batch; b < std::min(blocks, (item + 1) * batch); ++b) {
      const int n = load(points, b * BLOCK, count, block);
      work(block, b * BLOCK, n);
    }
  });
}

double sum(const float* v) {
  double total = 0;
  for (int i = 0; i < BLOCK; ++i) total += v[i];
  return total;
}

}  // namespace

void evaluate(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads) {
  over_blocks(parts, points, count, threads, [&](const Block& block, int64_t first, int n) {
    alignas(64) float field[BLOCK], g[BLOCK], weight[BLOCK];
    const Ball ball = around(block);
    for (size_t m = 0; m < parts.size(); ++m) {
      const Part& part = parts[m];
      // From its blend on above the fold so far, or above the complement of it, a part leaves that as it is.
      if (m && !reaches(part, ball, part.blend + (part.sign > 0 ? highest(field) : -lowest(field)))) continue;
      values(part, block, g);
      if (m)
        fold(field, g, part, weight);
      else
        begin(field, g, part);
    }
    std::memcpy(out + first, field, size_t(n) * sizeof(float));
  });
}

void evaluate_parts(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads) {
  over_blocks(parts, points, count, threads, [&](const Block& block, int64_t first, int n) {
    alignas(64) float g[BLOCK];
    for (size_t m = 0; m < parts.size(); ++m) {
      values(parts[m], block, g);
      std::memcpy(out + int64_t(m) * count + first, g, size_t(n) * sizeof(float));
    }
  });
}

void covered(const std::vector<Part>& parts, const float* points, int64_t count, uint8_t* out, int threads) {
  over_blocks(parts, points, count, threads, [&](const Block& block, int64_t first, int n) {
    alignas(64) float g[BLOCK];
    const Ball ball = around(block);
    for (size_t m = 0; m < parts.size(); ++m) {
      uint8_t* row = out + int64_t(m) * count + first;
      if (!reaches(parts[m], ball, 0)) {
        std::fill_n(row, n, uint8_t(0));
        continue;
      }
      values(parts[m], block, g);
      for (int i = 0; i < n; ++i) row[i] = g[i] < 0;
    }
  });
}

void occupancy_sums(const uint8_t* occupied, int64_t rows, const uint8_t* inside, const float* weight, int64_t count,
                    int64_t split, double* out, int threads) {
  threads = worth_their_while(threads, rows * count, LEAST_BYTES);
  const int64_t ends[3] = {0, split, count};
  parallel_for(2 * rows, threads, [&](int64_t item) {
    const uint8_t* mine = occupied + item / 2 * count;
    const int64_t last = ends[item % 2 + 1];
    double both = 0, either = 0;
    for (int64_t at = ends[item % 2]; at < last; at += BLOCK)
      block_sums(mine + at, inside + at, weight + at, int(std::min<int64_t>(BLOCK, last - at)), both, either);
    out[2 * item] = both;
    out[2 * item + 1] = either;
  });
}

void gradients(const std::vector<Part>& parts, const float* points, const float* upstream, int64_t count, double* out,
               int threads) {
  const size_t size = parts.size() * DERIVATIVES;
  const int64_t pieces = piece_count(count);
  std::vector<double> sums(size_t(pieces) * size, 0.0);
  parallel_for(pieces, threads, [&](int64_t piece) {
    Workspace w(parts.size());
    std::vector<float> d(DERIVATIVES * BLOCK);
    const auto [first, last] = piece_range(count, piece);
    for (int64_t b = first; b < last; ++b) {
      const int n = load(points, b * BLOCK, count, w.block);
      forward(parts, w);
      for (int i = 0; i < BLOCK; ++i) w.carried[i] = i < n ? upstream[b * BLOCK + i] : 0.f;
      backward(parts, w);
      for (size_t m = 0; m < parts.size(); ++m) {
        const float *share = &w.share[m * BLOCK], *blend = &w.blend[m * BLOCK];
        if (largest(share) == 0 && largest(blend) == 0) continue;
        derivatives(parts[m], w.block, d.data());
        double* sum = &sums[size_t(piece) * size + m * DERIVATIVES];
        for (int i = 0; i < FIELD_DERIVATIVES; ++i) sum[i] += dot(&d[size_t(i) * BLOCK], share);
        for (int i = 0; i < BLOCK; ++i) sum[D_BLEND] += blend[i];
      }
    }
  });
  for (size_t i = 0; i < size; ++i) {
    out[i] = 0;
    for (int64_t piece = 0; piece < pieces; ++piece) out[i] += sums[size_t(piece) * size + i];
  }
}

void removal_counts(const std::vector<Part>& parts, const float* points, const uint8_t* inside, const float* weight,
                    int64_t total, double* out, int threads) {
  const size_t m = parts.size(), size = 2 * (m + 1);
  const int64_t pieces = piece_count(total);
  std::vector<double> sums(size_t(pieces) * size, 0.0);
  const bool carved = std::any_of(parts.begin(), parts.end(), [](const Part& p) { return p.sign < 0; });
  parallel_for(pieces, threads, [&](int64_t piece) {
    Workspace w(m);
    // Near the wall of a hole the field is that of the hole, and yet a part that holds the point matters.
    const auto matters = [&](size_t i) {
      const float* g = &w.g[i * BLOCK];
      return largest(&w.share[i * BLOCK]) > 0 || (carved && *std::min_element(g, g + BLOCK) < 0);
    };
    double* counts = &sums[size_t(piece) * size];
    alignas(64) float in[BLOCK], weights[BLOCK], both[BLOCK], either[BLOCK], field[BLOCK], dropped[BLOCK];
    const auto [first, last] = piece_range(total, piece);
    for (int64_t b = first; b < last; ++b) {
      const int n = load(points, b * BLOCK, total, w.block);
      for (int i = 0; i < BLOCK; ++i) {
        in[i] = i < n && inside[b * BLOCK + i] ? 1.f : 0.f;
        weights[i] = i < n ? weight[b * BLOCK + i] : 0.f;
      }
      forward(parts, w);
      count(w.field, in, weights, both, either);
      const double base_both = sum(both), base_either = sum(either);
      std::fill_n(w.carried, BLOCK, 1.f);
      backward(parts, w);
      for (size_t i = 0; i <= m; ++i) {
        double now_both = base_both, now_either = base_either;
        if (i < m && matters(i)) {
          bool empty = true;
          for (size_t j = 0; j < m; ++j) {
            if (j == i) continue;
            if (empty)
              begin(field, &w.g[j * BLOCK], parts[j]);
            else
              fold(field, &w.g[j * BLOCK], parts[j], dropped);
            empty = false;
          }
          if (empty) std::fill_n(field, BLOCK, FAR);
          count(field, in, weights, both, either);
          now_both = sum(both);
          now_either = sum(either);
        }
        counts[2 * i] += now_both;
        counts[2 * i + 1] += now_either;
      }
    }
  });
  for (size_t i = 0; i < size; ++i) {
    out[i] = 0;
    for (int64_t piece = 0; piece < pieces; ++piece) out[i] += sums[size_t(piece) * size + i];
  }
}

}  // namespace partwright
