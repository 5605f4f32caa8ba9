#include "evaluate.hpp"

#include <cstring>

#include "parallel.hpp"

// One binary carries code for several instruction sets; the loader picks at start.
#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__)
#define PW_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define PW_CLONES
#endif

namespace partwright {
namespace {

struct Block {
  alignas(64) float x[BLOCK], y[BLOCK], z[BLOCK];
};

// Missing points of the last block repeat the first one; callers ignore or zero-weight them.
int load(const float* points, int64_t first, int64_t count, Block& block) {
  const int n = int(std::min<int64_t>(BLOCK, count - first));
  for (int i = 0; i < BLOCK; ++i) {
    const float* p = points + 3 * (first + (i < n ? i : 0));
    block.x[i] = p[0];
    block.y[i] = p[1];
    block.z[i] = p[2];
  }
  return n;
}

PW_CLONES void values(const Part& p, const Block& b, float* __restrict out) {
  if (p.bent && p.hollow) {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<true, true>(p, b.x[i], b.y[i], b.z[i]);
  } else if (p.bent) {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<true, false>(p, b.x[i], b.y[i], b.z[i]);
  } else if (p.hollow) {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<false, true>(p, b.x[i], b.y[i], b.z[i]);
  } else {
    for (int i = 0; i < BLOCK; ++i) out[i] = value<false, false>(p, b.x[i], b.y[i], b.z[i]);
  }
}

PW_CLONES void derivatives(const Part& part, const Block& b, float* __restrict out) {
  const Part p = part;
  alignas(64) float scratch[SCRATCH_ROWS * BLOCK];
  for (int i = 0; i < BLOCK; ++i) bend_step(p, b.x[i], b.y[i], b.z[i], scratch + i, BLOCK);
  for (int i = 0; i < BLOCK; ++i) section_step(p, scratch + i, BLOCK);
  if (p.hollow) {
    for (int i = 0; i < BLOCK; ++i) profile_step<true>(p, scratch + i, BLOCK);
  } else {
    for (int i = 0; i < BLOCK; ++i) profile_step<false>(p, scratch + i, BLOCK);
  }
  for (int i = 0; i < BLOCK; ++i) chain_step(p, scratch + i, out + i, BLOCK);
}

// F - G is the complement of (not F) + G, so that a sign before and after the smooth minimum makes both.
PW_CLONES void fold_block(float* __restrict field, const float* __restrict g, float k, float sharp, float sign, float* __restrict weight) {
  for (int i = 0; i < BLOCK; ++i) {
    const float before = sign * field[i], w = smooth_weight(before, g[i], sharp);
    weight[i] = w;
    field[i] = sign * smooth_minimum(before, g[i], k, w);
  }
}

void fold(float* field, const float* g, const Part& part, float* weight) {
  fold_block(field, g, part.blend > 1e-9f ? part.blend : 0.f, sharpness(part.blend), part.sign, weight);
}

PW_CLONES void unfold(float* __restrict carried, const float* __restrict weight, float sign, float* __restrict share, float* __restrict blend) {
  for (int i = 0; i < BLOCK; ++i) {
    share[i] = sign * carried[i] * (1 - weight[i]);
    blend[i] = -share[i] * weight[i];
    carried[i] *= weight[i];
  }
}

// The fold of no parts: farther than any point, and small enough for sums to stay finite.
constexpr float FAR = 1e6f;

// What the first part of a fold leaves, nothing where it is subtracted.
void begin(float* field, const float* g, const Part& part) {
  if (part.sign > 0)
    std::memcpy(field, g, BLOCK * sizeof(float));
  else
    std::fill_n(field, BLOCK, FAR);
}

// exp by the polynomial of the base-2 fraction; relative error 2e-7, no library call in the loop.
PW_INLINE float exponential(float v) {
  const float t = std::min(std::max(v * 1.44269504f, -120.f), 120.f);
  const float whole = std::floor(t + 0.5f), f = t - whole;
  float p = 0.00015403530f;
  p = p * f + 0.0013333558f;
  p = p * f + 0.0096181291f;
  p = p * f + 0.0555041087f;
  p = p * f + 0.2402265070f;
  p = p * f + 0.6931471806f;
  p = p * f + 1.f;
  const int32_t bits = (int32_t(whole) + 127) << 23;
  float scale;
  std::memcpy(&scale, &bits, 4);
  return p * scale;
}

PW_CLONES void occupancy(const float* __restrict field, float beta, float* __restrict out) {
  for (int i = 0; i < BLOCK; ++i) out[i] = 1.f / (1.f + exponential(beta * field[i]));
}

// Sixteen floats that the compiler keeps in one register where the machine has one that wide.
#if defined(__GNUC__)
typedef float Lanes __attribute__((vector_size(64)));
PW_INLINE void multiply_add(Lanes& sum, const float* a, const float* b) {
  Lanes x, y;
  std::memcpy(&x, a, sizeof x);
  std::memcpy(&y, b, sizeof y);
  sum += x * y;
}
#else
struct Lanes {
  float v[16];
  float operator[](int i) const { return v[i]; }
};
PW_INLINE void multiply_add(Lanes& sum, const float* a, const float* b) {
  for (int lane = 0; lane < 16; ++lane) sum.v[lane] += a[lane] * b[lane];
}
#endif

// C (RA x RB) += A B^T over `length` samples.
template <int RA, int RB>
PW_INLINE void outer_tile(const float* a, const float* b, int length, double* c, int stride) {
  Lanes sums[RA][RB] = {};
  for (int l = 0; l < length; l += 16)
#pragma GCC unroll 8
    for (int i = 0; i < RA; ++i)
#pragma GCC unroll 8
      for (int j = 0; j < RB; ++j) multiply_add(sums[i][j], a + i * length + l, b + j * length + l);
  for (int i = 0; i < RA; ++i)
    for (int j = 0; j < RB; ++j) {
      float total = 0;
      for (int lane = 0; lane < 16; ++lane) total += sums[i][j][lane];
      c[i * stride + j] += total;
    }
}

PW_CLONES void outer_product(const float* a, const float* b, int length, double* c) {
  for (int i = 0; i < DERIVATIVES; i += 3)
    for (int j = 0; j < DERIVATIVES; j += 5) outer_tile<3, 5>(a + i * length, b + j * length, length, c + i * DERIVATIVES + j, DERIVATIVES);
}

// A A^T: only tiles that reach the lower triangle; `mirror` fills in the rest once all are summed.
PW_CLONES void outer_square(const float* a, int length, double* c) {
  for (int i = 0; i < DERIVATIVES; i += 3)
    for (int j = 0; j <= i + 2; j += 5) outer_tile<3, 5>(a + i * length, a + j * length, length, c + i * DERIVATIVES + j, DERIVATIVES);
}

void mirror(std::vector<double>& c) {
  for (int i = 0; i < DERIVATIVES; ++i)
    for (int j = i + 1; j < DERIVATIVES; ++j) c[size_t(i) * DERIVATIVES + j] = c[size_t(j) * DERIVATIVES + i];
}

PW_CLONES void times_vector(const float* a, const float* v, int length, double* c) {
  for (int i = 0; i < DERIVATIVES; i += 3) outer_tile<3, 1>(a + i * length, v, length, c + i, 1);
}

PW_CLONES void scale_rows(const float* __restrict d, const float* __restrict by, int rows, int length, float* __restrict out) {
  for (int r = 0; r < rows; ++r)
    for (int i = 0; i < BLOCK; ++i) out[r * length + i] = d[r * BLOCK + i] * by[i];
}

// Columns of a Jacobian: which points of a block have one, padded to whole lanes.
struct Columns {
  int index[BLOCK];
  int count = 0, padded = 0;

  void collect(const float* size, float least) {
    count = 0;
    for (int i = 0; i < BLOCK; ++i) {
      index[count] = i;
      count += size[i] > least;
    }
    padded = (count + 15) / 16 * 16;
  }
};

void gather(const float* v, const Columns& columns, float* out) {
  for (int i = 0; i < columns.count; ++i) out[i] = v[columns.index[i]];
  std::fill(out + columns.count, out + columns.padded, 0.f);
}

PW_CLONES void gather_scaled(const float* __restrict d, const float* __restrict by, const Columns& columns, int rows, int length,
                             float* __restrict out) {
  for (int r = 0; r < rows; ++r) {
    for (int i = 0; i < columns.count; ++i) out[r * length + i] = d[r * BLOCK + columns.index[i]] * by[columns.index[i]];
    for (int i = columns.count; i < columns.padded; ++i) out[r * length + i] = 0;
  }
}

PW_CLONES void keep_larger(float* __restrict size, const float* __restrict v) {
  for (int i = 0; i < BLOCK; ++i) size[i] = std::max(size[i], std::fabs(v[i]));
}

PW_CLONES float largest(const float* v) {
  float top[16] = {};
  for (int i = 0; i < BLOCK; i += 16)
    for (int lane = 0; lane < 16; ++lane) top[lane] = std::max(top[lane], std::fabs(v[i + lane]));
  return *std::max_element(top, top + 16);
}

// Buffers of one thread for an assembly of M parts.
struct Workspace {
  explicit Workspace(size_t m) : g(m * BLOCK), weight(m * BLOCK), share(m * BLOCK), blend(m * BLOCK), occ(m * BLOCK) {}
  std::vector<float> g, weight, share, blend, occ;
  Block block;
  alignas(64) float field[BLOCK], total[BLOCK], carried[BLOCK], assembled[BLOCK], weights[BLOCK];
};

// Fold of all parts over one block, keeping each part's value and fold weight.
void forward(const std::vector<Part>& parts, const float* background, Workspace& w) {
  if (background) std::memcpy(w.field, background, sizeof w.field);
  for (size_t m = 0; m < parts.size(); ++m) {
    float* g = w.g.data() + m * BLOCK;
    values(parts[m], w.block, g);
    if (m == 0 && !background) {
      begin(w.field, g, parts[m]);
      std::fill_n(w.weight.data(), BLOCK, parts[m].sign > 0 ? 0.f : 1.f);
    } else {
      fold(w.field, g, parts[m], w.weight.data() + m * BLOCK);
    }
  }
}

// dF/dg and dF/dk of every part from the fold weights; `carried` starts as the upstream derivative.
void backward(const std::vector<Part>& parts, Workspace& w) {
  for (size_t m = parts.size(); m-- > 0;)
    unfold(w.carried, &w.weight[m * BLOCK], parts[m].sign, &w.share[m * BLOCK], &w.blend[m * BLOCK]);
}

PW_CLONES void add(float* __restrict total, const float* __restrict v) {
  for (int i = 0; i < BLOCK; ++i) total[i] += v[i];
}

// Reconstruction, overlap and smooth-union consistency.
constexpr int KINDS = 3;

// Residuals of one block and their derivatives by F and by each part's occupancy.
struct Residuals {
  alignas(64) float rec[BLOCK], over[BLOCK], blended[BLOCK];
  alignas(64) float rec_f[BLOCK], over_o[BLOCK], blended_f[BLOCK], blended_o[BLOCK];
};

PW_CLONES double residuals(const float* __restrict target, const float* __restrict weight, const float* __restrict assembled,
                           const float* __restrict total, float beta, Penalties penalties, Residuals& r) {
  const float so = std::sqrt(penalties.overlap), sb = std::sqrt(penalties.blending);
  float sums[BLOCK];
  for (int i = 0; i < BLOCK; ++i) {
    const float sw = std::sqrt(weight[i]), o = assembled[i], slope = -beta * o * (1 - o);
    r.rec[i] = sw * (o - target[i]);
    r.rec_f[i] = sw * slope;
    const float over = total[i] - 1, wo = sw * so;
    r.over[i] = over > 0 ? wo * over : 0.f;
    r.over_o[i] = over > 0 ? wo : 0.f;
    const float excess = o - std::min(total[i], 1.f), wb = sw * sb;
    r.blended[i] = excess > 0 ? wb * excess : 0.f;
    r.blended_f[i] = excess > 0 ? wb * slope : 0.f;
    r.blended_o[i] = (excess > 0) & (total[i] < 1) ? -wb : 0.f;
    sums[i] = r.rec[i] * r.rec[i] + r.over[i] * r.over[i] + r.blended[i] * r.blended[i];
  }
  double sum = 0;
  for (int i = 0; i < BLOCK; ++i) sum += sums[i];
  return 0.5 * sum;
}

PW_CLONES void by_part(const float* __restrict f, const float* __restrict share, const float* __restrict o, const float* __restrict occ,
                       float beta, float* __restrict out) {
  for (int i = 0; i < BLOCK; ++i) out[i] = f[i] * share[i] - o[i] * beta * occ[i] * (1 - occ[i]);
}

// Loads a block of samples and evaluates residuals; padding gets weight 0.
double sample_block(const std::vector<Part>& parts, const Samples& s, int64_t first, float beta, Penalties penalties,
                    Workspace& w, Residuals& r) {
  alignas(64) float background[BLOCK], distance[BLOCK], target[BLOCK];
  const int n = load(s.points, first, s.count, w.block);
  for (int i = 0; i < BLOCK; ++i) {
    const int64_t j = first + (i < n ? i : 0);
    distance[i] = s.distance[j];
    w.weights[i] = i < n ? s.weight[j] : 0.f;
    if (s.background) background[i] = s.background[j];
  }
  forward(parts, s.background ? background : nullptr, w);
  occupancy(distance, beta, target);
  occupancy(w.field, beta, w.assembled);
  if (penalties.overlap > 0 || penalties.blending > 0) {
    if (s.background)
      occupancy(background, beta, w.total);
    else
      std::fill_n(w.total, BLOCK, 0.f);
    for (size_t m = 0; m < parts.size(); ++m) {
      if (parts[m].sign < 0) continue;
      occupancy(&w.g[m * BLOCK], beta, &w.occ[m * BLOCK]);
      add(w.total, &w.occ[m * BLOCK]);
    }
  } else {
    std::memcpy(w.total, w.assembled, sizeof w.total);
  }
  return residuals(target, w.weights, w.assembled, w.total, beta, penalties, r);
}

// Blocks first .. last of one of the fixed pieces.
std::pair<int64_t, int64_t> piece_range(int64_t count, int64_t piece) {
  const int64_t blocks = (count + BLOCK - 1) / BLOCK;
  return {blocks * piece / PIECES, blocks * (piece + 1) / PIECES};
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
      forward(parts, nullptr, w);
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

NormalEquations normal_equations(const std::vector<Part>& parts, const std::vector<char>& live, const Samples& samples,
                                 float beta, Penalties penalties, int threads) {
  std::vector<NormalEquations> pieces(PIECES);
  parallel_for(PIECES, threads, [&](int64_t piece) {
    NormalEquations& sum = pieces[size_t(piece)];
    sum.gradient.assign(parts.size() * DERIVATIVES, 0.0);
    Workspace w(parts.size());
    Residuals r;
    alignas(64) float none[BLOCK] = {};
    std::vector<float> d(DERIVATIVES * BLOCK), rows, coefficients;
    std::vector<int> active;
    const auto [first, last] = piece_range(samples.count, piece);
    for (int64_t b = first; b < last; ++b) {
      sum.loss += sample_block(parts, samples, b * BLOCK, beta, penalties, w, r);
      std::fill_n(w.carried, BLOCK, 1.f);
      backward(parts, w);
      // Each point has up to three residuals, and each residual that moves with some part is a column of the
      // block's Jacobian. Saturated points, most of them where beta is large, have none.
      const bool over = penalties.overlap > 0 && largest(r.over) > 0;
      const bool blended = penalties.blending > 0 && largest(r.blended) > 0;
      const bool used[KINDS] = {true, over, blended};
      const float* residual[KINDS] = {r.rec, r.over, r.blended};
      const float *by_field[KINDS] = {r.rec_f, none, r.blended_f}, *by_occupancy[KINDS] = {none, r.over_o, r.blended_o};
      const float least = 1e-3f * 0.25f * beta * std::sqrt(*std::max_element(w.weights, w.weights + BLOCK));
      alignas(64) float size[KINDS][BLOCK] = {};
      active.clear();
      coefficients.clear();
      for (size_t m = 0; m < parts.size(); ++m) {
        if (!live[m]) continue;
        coefficients.resize((active.size() + 1) * KINDS * BLOCK);
        float* c = &coefficients[active.size() * KINDS * BLOCK];
        float top = 0;
        for (int kind = 0; kind < KINDS; ++kind) {
          if (!used[kind]) continue;
          const float* by_added = parts[m].sign > 0 ? by_occupancy[kind] : none;
          by_part(by_field[kind], &w.share[m * BLOCK], by_added, &w.occ[m * BLOCK], beta, c + kind * BLOCK);
          top = std::max(top, largest(c + kind * BLOCK));
        }
        if (top < least) continue;
        for (int kind = 0; kind < KINDS; ++kind)
          if (used[kind]) keep_larger(size[kind], c + kind * BLOCK);
        active.push_back(int(m));
      }
      if (active.empty()) continue;
      Columns columns[KINDS];
      int length = 0;
      for (int kind = 0; kind < KINDS; ++kind) {
        if (used[kind]) columns[kind].collect(size[kind], least);
        length += columns[kind].padded;
      }
      alignas(64) float errors[KINDS * BLOCK];
      for (int kind = 0, at = 0; kind < KINDS; at += columns[kind++].padded) gather(residual[kind], columns[kind], errors + at);
      rows.resize(active.size() * DERIVATIVES * size_t(length));
      for (size_t i = 0; i < active.size(); ++i) {
        const size_t m = size_t(active[i]);
        float* out = &rows[i * DERIVATIVES * size_t(length)];
        derivatives(parts[m], w.block, d.data());
        for (int kind = 0, at = 0; kind < KINDS; at += columns[kind++].padded) {
          gather_scaled(d.data(), &coefficients[(i * KINDS + size_t(kind)) * BLOCK], columns[kind], FIELD_DERIVATIVES, length, out + at);
          gather_scaled(&w.blend[m * BLOCK], by_field[kind], columns[kind], 1, length, out + D_BLEND * length + at);
        }
        times_vector(out, errors, length, &sum.gradient[m * DERIVATIVES]);
      }
      for (size_t i = 0; i < active.size(); ++i)
        for (size_t j = i; j < active.size(); ++j) {
          auto& block = sum.blocks[{active[i], active[j]}];
          if (block.empty()) block.assign(DERIVATIVES * DERIVATIVES, 0.0);
          const float *a = &rows[i * DERIVATIVES * size_t(length)], *c = &rows[j * DERIVATIVES * size_t(length)];
          if (i == j)
            outer_square(a, length, block.data());
          else
            outer_product(a, c, length, block.data());
        }
    }
  });
  NormalEquations total = std::move(pieces[0]);
  for (int piece = 1; piece < PIECES; ++piece) {
    const NormalEquations& part = pieces[size_t(piece)];
    total.loss += part.loss;
    for (size_t i = 0; i < total.gradient.size(); ++i) total.gradient[i] += part.gradient[i];
    for (const auto& [key, block] : part.blocks) {
      auto& sum = total.blocks[key];
      if (sum.empty()) sum.assign(DERIVATIVES * DERIVATIVES, 0.0);
      for (size_t i = 0; i < block.size(); ++i) sum[i] += block[i];
    }
  }
  for (auto& [pair, block] : total.blocks)
    if (pair.first == pair.second) mirror(block);
  return total;
}

double loss(const std::vector<Part>& parts, const Samples& samples, float beta, Penalties penalties, int threads) {
  double sums[PIECES] = {};
  parallel_for(PIECES, threads, [&](int64_t piece) {
    Workspace w(parts.size());
    Residuals r;
    const auto [first, last] = piece_range(samples.count, piece);
    for (int64_t b = first; b < last; ++b) sums[piece] += sample_block(parts, samples, b * BLOCK, beta, penalties, w, r);
  });
  double total = 0;
  for (double sum : sums) total += sum;
  return total;
}

namespace {

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
      forward(parts, nullptr, w);
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
