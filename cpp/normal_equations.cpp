#include "normal_equations.hpp"

#include <cstring>

#include "blocks.hpp"
#include "parallel.hpp"
#include "products.hpp"

namespace partwright {
namespace {

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

PW_CLONES void add(float* __restrict total, const float* __restrict v) {
  for (int i = 0; i < BLOCK; ++i) total[i] += v[i];
}

// Residuals of the block of samples at which the distances g (M, BLOCK) of the parts that count are; padding gets
// weight 0.
double sample_block(const std::vector<Part>& parts, const Samples& s, int64_t first, float beta, Penalties penalties,
                    const float* g, Workspace& w, Residuals& r) {
  alignas(64) float background[BLOCK], distance[BLOCK], target[BLOCK];
  const int n = int(std::min<int64_t>(BLOCK, s.count - first));
  for (int i = 0; i < BLOCK; ++i) {
    const int64_t j = first + (i < n ? i : 0);
    distance[i] = s.distance[j];
    w.weights[i] = i < n ? s.weight[j] : 0.f;
    if (s.background) background[i] = s.background[j];
  }
  fold_all(parts, s.background ? background : nullptr, g, w);
  occupancy(distance, beta, target);
  occupancy(w.field, beta, w.assembled);
  if (penalties.overlap > 0 || penalties.blending > 0) {
    if (s.background)
      occupancy(background, beta, w.total);
    else
      std::fill_n(w.total, BLOCK, 0.f);
    for (const size_t m : w.folded) {
      if (parts[m].sign < 0) continue;
      occupancy(g + m * BLOCK, beta, &w.occ[m * BLOCK]);
      add(w.total, &w.occ[m * BLOCK]);
    }
  } else {
    std::memcpy(w.total, w.assembled, sizeof w.total);
  }
  return residuals(target, w.weights, w.assembled, w.total, beta, penalties, r);
}

// Points of a block, or of such a selection, that are of any use; as columns of a Jacobian padded to whole lanes.
struct Selection {
  int index[BLOCK];
  int count = 0, padded = 0;

  // Those of `from` points whose size is above the least; all of them where that is most.
  void collect(const float* size, float least, int from) {
    count = 0;
    for (int i = 0; i < from; ++i) {
      index[count] = i;
      count += size[i] > least;
    }
    if (4 * count > 3 * from) {
      for (int i = count = from; i-- > 0;) index[i] = i;
    }
    padded = (count + 15) / 16 * 16;
  }
};

void gather(const float* v, const Selection& selection, float* out) {
  for (int i = 0; i < selection.count; ++i) out[i] = v[selection.index[i]];
  std::fill(out + selection.count, out + selection.padded, 0.f);
}

// Derivatives d (rows, BLOCK) at the selected of `from` points, times the selected factors `by`.
PW_CLONES void scale_selected(const float* __restrict d, const float* __restrict by, const Selection& selection, int from, int rows,
                              int length, float* __restrict out) {
  const int padded = selection.padded;
  for (int r = 0; r < rows; ++r) {
    const float* row = d + r * BLOCK;
    if (selection.count == from)
      for (int i = 0; i < padded; ++i) out[r * length + i] = row[i] * by[i];
    else
      for (int i = 0; i < padded; ++i) out[r * length + i] = row[selection.index[i < selection.count ? i : 0]] * by[i];
  }
}

// The selected points of a block, padded with one of them.
void load_selected(const float* points, int64_t first, int64_t count, const Selection& selection, Block& block) {
  for (int i = 0; i < selection.padded; ++i) {
    const int64_t j = first + selection.index[i < selection.count ? i : 0];
    const float* p = points + 3 * (j < count ? j : first);
    block.x[i] = p[0];
    block.y[i] = p[1];
    block.z[i] = p[2];
  }
}

PW_CLONES void keep_larger(float* __restrict size, const float* __restrict v) {
  for (int i = 0; i < BLOCK; ++i) size[i] = std::max(size[i], std::fabs(v[i]));
}

}  // namespace

PartDistances::PartDistances(size_t parts, const Samples& samples) : parts_(parts) {
  const auto blocks = size_t((samples.count + BLOCK - 1) / BLOCK);
  values_.resize(blocks * parts * BLOCK);
  felt_.resize(blocks * parts);
  balls_.resize(blocks);
  if (parts == 1) return;  // it is felt everywhere
  Block block;
  for (size_t b = 0; b < blocks; ++b) {
    load(samples.points, int64_t(b) * BLOCK, samples.count, block);
    balls_[b] = around(block);
  }
}

void PartDistances::felt(int64_t b, std::vector<size_t>& parts) const {
  parts.clear();
  for (size_t m = 0; m < parts_; ++m)
    if (felt_[size_t(b) * parts_ + m]) parts.push_back(m);
}

namespace {

// From where on a part is not felt: its occupancy is below exp(-SILENT), six millionths, and no blend reaches so
// far.
constexpr float SILENT = 12;
float unfelt_from(const Part& part, float beta) { return SILENT / beta + part.blend; }

// The distances of a part in a block, if it is felt there; a single part always is.
void update(const std::vector<Part>& parts, size_t m, float beta, const Block& block, int64_t b, PartDistances& distances) {
  const bool felt = parts.size() == 1 || reaches(parts[m], distances.ball(b), unfelt_from(parts[m], beta));
  distances.felt(b, m) = felt;
  if (felt) values(parts[m], block, distances.block(b) + m * BLOCK);
}

}  // namespace

void measure(const std::vector<Part>& parts, const Samples& samples, float beta, int threads, PartDistances& distances) {
  parallel_for(piece_count(samples.count), threads, [&](int64_t piece) {
    Block block;
    const auto [first, last] = piece_range(samples.count, piece);
    for (int64_t b = first; b < last; ++b) {
      load(samples.points, b * BLOCK, samples.count, block);
      for (size_t m = 0; m < parts.size(); ++m) update(parts, m, beta, block, b, distances);
    }
  });
}

NormalEquations normal_equations(const std::vector<Part>& parts, const std::vector<char>& live, const Samples& samples,
                                 float beta, Penalties penalties, int threads, const PartDistances& distances) {
  std::vector<NormalEquations> pieces(size_t(piece_count(samples.count)));
  parallel_for(int64_t(pieces.size()), threads, [&](int64_t piece) {
    NormalEquations& sum = pieces[size_t(piece)];
    sum.gradient.assign(parts.size() * DERIVATIVES, 0.0);
    Workspace w(parts.size());
    Residuals r;
    Block block;
    alignas(64) float none[BLOCK] = {};
    std::vector<float> d(DERIVATIVES * BLOCK), rows, coefficients;
    std::vector<int> active;
    const auto [first, last] = piece_range(samples.count, piece);
    for (int64_t b = first; b < last; ++b) {
      distances.felt(b, w.folded);
      sum.loss += sample_block(parts, samples, b * BLOCK, beta, penalties, distances.block(b), w, r);
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
      alignas(64) float size[KINDS][BLOCK] = {}, any[BLOCK] = {};
      active.clear();
      coefficients.clear();
      for (const size_t m : w.folded) {
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
      for (const auto& of_kind : size) keep_larger(any, of_kind);
      // Derivatives are of the points that have a column; what a kind lacks of those is left out of its columns.
      Selection points, columns[KINDS];
      points.collect(any, least, BLOCK);
      load_selected(samples.points, b * BLOCK, samples.count, points, block);
      int length = 0;
      alignas(64) float errors[KINDS * BLOCK], selected[BLOCK], by[BLOCK];
      for (int kind = 0; kind < KINDS; ++kind) {
        if (!used[kind]) continue;
        gather(size[kind], points, selected);
        columns[kind].collect(selected, least, points.count);
        gather(residual[kind], points, selected);
        gather(selected, columns[kind], errors + length);
        length += columns[kind].padded;
      }
      rows.resize(active.size() * DERIVATIVES * size_t(length));
      for (size_t i = 0; i < active.size(); ++i) {
        const size_t m = size_t(active[i]);
        float* out = &rows[i * DERIVATIVES * size_t(length)];
        derivatives(parts[m], block, d.data(), points.padded);
        gather(&w.blend[m * BLOCK], points, &d[D_BLEND * BLOCK]);
        for (int kind = 0, at = 0; kind < KINDS; at += columns[kind++].padded) {
          if (!used[kind]) continue;
          gather(&coefficients[(i * KINDS + size_t(kind)) * BLOCK], points, selected);
          gather(selected, columns[kind], by);
          scale_selected(d.data(), by, columns[kind], points.count, FIELD_DERIVATIVES, length, out + at);
          gather(by_field[kind], points, selected);
          gather(selected, columns[kind], by);
          scale_selected(&d[D_BLEND * BLOCK], by, columns[kind], points.count, 1, length, out + D_BLEND * length + at);
        }
        times_vector(out, errors, length, &sum.gradient[m * DERIVATIVES]);
      }
      for (size_t i = 0; i < active.size(); ++i)
        for (size_t j = i; j < active.size(); ++j) {
          auto& product = sum.blocks[{active[i], active[j]}];
          if (product.empty()) product.assign(DERIVATIVES * DERIVATIVES, 0.0);
          const float *a = &rows[i * DERIVATIVES * size_t(length)], *c = &rows[j * DERIVATIVES * size_t(length)];
          if (i == j)
            outer_square(a, length, product.data());
          else
            outer_product(a, c, length, product.data());
        }
    }
  });
  NormalEquations total = std::move(pieces[0]);
  for (size_t piece = 1; piece < pieces.size(); ++piece) {
    const NormalEquations& part = pieces[piece];
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

double loss(const std::vector<Part>& parts, const std::vector<char>& live, const Samples& samples, float beta,
            Penalties penalties, int threads, PartDistances& distances) {
  double sums[MOST_PIECES] = {};
  parallel_for(piece_count(samples.count), threads, [&](int64_t piece) {
    Workspace w(parts.size());
    Residuals r;
    const auto [first, last] = piece_range(samples.count, piece);
    for (int64_t b = first; b < last; ++b) {
      load(samples.points, b * BLOCK, samples.count, w.block);
      for (size_t m = 0; m < parts.size(); ++m)
        if (live[m]) update(parts, m, beta, w.block, b, distances);
      distances.felt(b, w.folded);
      sums[piece] += sample_block(parts, samples, b * BLOCK, beta, penalties, distances.block(b), w, r);
    }
  });
  double total = 0;
  for (double sum : sums) total += sum;
  return total;
}

}  // namespace partwright
