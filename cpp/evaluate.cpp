#include "evaluate.hpp"

#include <cstring>

#include "blocks.hpp"
#include "parallel.hpp"
#include "products.hpp"

namespace partwright {
namespace {

PW_CLONES void scale_rows(const float* __restrict d, const float* __restrict by, int rows, int length, float* __restrict out) {
  for (int r = 0; r < rows; ++r)
    for (int i = 0; i < BLOCK; ++i) out[r * length + i] = d[r * BLOCK + i] * by[i];
}

PW_CLONES void count(const float* __restrict field, const float* __restrict inside, const float* __restrict weight, float* __restrict both,
                     float* __restrict either) {
  for (int i = 0; i < BLOCK; ++i) {
    const float in = field[i] < 0 ? 1.f : 0.f;
    both[i] = weight[i] * in * inside[i];
    either[i] = weight[i] * std::max(in, inside[i]);
  }
}

double sum(const float* v) {
  double total = 0;
  for (int i = 0; i < BLOCK; ++i) total += v[i];
  return total;
}

}  // namespace

void evaluate(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads) {
  const int64_t blocks = (count + BLOCK - 1) / BLOCK, batch = 16;
  parallel_for((blocks + batch - 1) / batch, threads, [&](int64_t item) {
    Block block;
    alignas(64) float field[BLOCK], g[BLOCK], weight[BLOCK];
    for (int64_t b = item * batch; b < std::min(blocks, (item + 1) * batch); ++b) {
      const int n = load(points, b * BLOCK, count, block);
      for (size_t m = 0; m < parts.size(); ++m) {
        values(parts[m], block, g);
        if (m)
          fold(field, g, parts[m], weight);
        else
          begin(field, g, parts[m]);
      }
      std::memcpy(out + b * BLOCK, field, size_t(n) * sizeof(float));
    }
  });
}

void evaluate_parts(const std::vector<Part>& parts, const float* points, int64_t count, float* out, int threads) {
  const int64_t blocks = (count + BLOCK - 1) / BLOCK, batch = 16;
  parallel_for((blocks + batch - 1) / batch, threads, [&](int64_t item) {
    Block block;
    alignas(64) float g[BLOCK];
    for (int64_t b = item * batch; b < std::min(blocks, (item + 1) * batch); ++b) {
      const int n = load(points, b * BLOCK, count, block);
      for (size_t m = 0; m < parts.size(); ++m) {
        values(parts[m], block, g);
        std::memcpy(out + int64_t(m) * count + b * BLOCK, g, size_t(n) * sizeof(float));
      }
    }
  });
}

void gradients(const std::vector<Part>& parts, const float* points, const float* upstream, int64_t count, double* out,
               int threads) {
  const size_t size = parts.size() * DERIVATIVES;
  std::vector<double> sums(PIECES * size, 0.0);
  parallel_for(PIECES, threads, [&](int64_t piece) {
    Workspace w(parts.size());
    std::vector<float> d(DERIVATIVES * BLOCK), scaled(DERIVATIVES * BLOCK);
    alignas(64) float ones[BLOCK];
    std::fill_n(ones, BLOCK, 1.f);
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
        scale_rows(d.data(), share, FIELD_DERIVATIVES, BLOCK, scaled.data());
        std::memcpy(&scaled[D_BLEND * BLOCK], blend, BLOCK * sizeof(float));
        times_vector(scaled.data(), ones, BLOCK, &sums[size_t(piece) * size + m * DERIVATIVES]);
      }
    }
  });
  for (size_t i = 0; i < size; ++i) {
    out[i] = 0;
    for (int piece = 0; piece < PIECES; ++piece) out[i] += sums[size_t(piece) * size + i];
  }
}

void removal_counts(const std::vector<Part>& parts, const float* points, const uint8_t* inside, const float* weight,
                    int64_t total, double* out, int threads) {
  const size_t m = parts.size(), size = 2 * (m + 1);
  std::vector<double> sums(PIECES * size, 0.0);
  const bool carved = std::any_of(parts.begin(), parts.end(), [](const Part& p) { return p.sign < 0; });
  parallel_for(PIECES, threads, [&](int64_t piece) {
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
    for (int piece = 0; piece < PIECES; ++piece) out[i] += sums[size_t(piece) * size + i];
  }
}

}  // namespace partwright
