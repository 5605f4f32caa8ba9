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

// Half the sum of a block's squares, lane by lane and then of the lanes.
PW_CLONES double half_sum(const float* squares) {
  double lanes[8] = {};
  for (int i = 0; i < BLOCK; i += 8)
    for (int lane = 0; lane < 8; ++lane) lanes[lane] += squares[i + lane];
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return 0.5 * sum;
}

PW_CLONES double reconstruction(const float* __restrict target, const float* __restrict root, const float* __restrict assembled,
                                float beta, Residuals& r) {
  float squares[BLOCK];
  for (int i = 0; i < BLOCK; ++i) {
    const float o = assembled[i], slope = -beta * o * (1 - o);
    r.rec[i] = root[i] * (o - target[i]);
    r.rec_f[i] = root[i] * slope;
    squares[i] = r.rec[i] * r.rec[i];
  }
  return half_sum(squares);
}

// That and what overlaps and blends.
PW_CLONES double all_residuals(const float* __restrict target, const float* __restrict root, const float* __restrict assembled,
                               const float* __restrict total, float beta, Penalties penalties, Residuals& r) {
  const float so = std::sqrt(penalties.overlap), sb = std::sqrt(penalties.blending);
  float squares[BLOCK];
  for (int i = 0; i < BLOCK; ++i) {
    const float sw = root[i], o = assembled[i], slope = -beta * o * (1 - o);
    r.rec[i] = sw * (o - target[i]);
    r.rec_f[i] = sw * slope;
    const float over = total[i] - 1, wo = sw * so;
    r.over[i] = over > 0 ? wo * over : 0.f;
    r.over_o[i] = over > 0 ? wo : 0.f;
    const float excess = o - std::min(total[i], 1.f), wb = sw * sb;
    r.blended[i] = excess > 0 ? wb * excess : 0.f;
    r.blended_f[i] = excess > 0 ? wb * slope : 0.f;
    r.blended_o[i] = (excess > 0) & (total[i] < 1) ? -wb : 0.f;
    squares[i] = r.rec[i] * r.rec[i] + r.over[i] * r.over[i] + r.blended[i] * r.blended[i];
  }
  return half_sum(squares);
}

PW_CLONES void by_part(const float* __restrict f, const float* __restrict share, const float* __restrict o, const float* __restrict occ,
                       float beta, float* __restrict out) {
  for (int i = 0; i < BLOCK; ++i) out[i] = f[i] * share[i] - o[i] * beta * occ[i] * (1 - occ[i]);
}

PW_CLONES void add(float* __restrict total, const float* __restrict v) {
  for (int i = 0; i < BLOCK; ++i) total[i] += v[i];
}

// Residuals of a block of samples at which the distances g (M, BLOCK) of the parts that count are.
double residuals(const std::vector<Part>& parts, const SampleBlocks& samples, int64_t b, Penalties penalties, const float* g,
                 Workspace& w, Residuals& r) {
  const SampleBlock& s = samples[b];
  const float beta = samples.beta();
  fold_all(parts, samples.background() ? s.background : nullptr, g, w);
  occupancy(w.field, beta, w.assembled);
  if (!(penalties.overlap > 0 || penalties.blending > 0)) return reconstruction(s.target, s.root, w.assembled, beta, r);
  if (samples.background())
    occupancy(s.background, beta, w.total);
  else
    std::fill_n(w.total, BLOCK, 0.f);
  for (const size_t m : w.folded) {
    if (parts[m].sign < 0) continue;
    occupancy(g + m * BLOCK, beta, &w.occ[m * BLOCK]);
    add(w.total, &w.occ[m * BLOCK]);
  }
  return all_residuals(s.target, s.root, w.assembled, w.total, beta, penalties, r);
}

// Points of a block, or of such a selection, that are of any use; as columns of a Jacobian padded to whole lanes.
struct Selection {
  int index[BLOCK];
  int count = 0, padded = 0;
  bool all = false;

  // Those of `from` points whose size is above the least; all of them where that is most.
  void collect(const float* size, float least, int from) {
    count = 0;
    for (int i = 0; i < from; ++i) {
      index[count] = i;
      count += size[i] > least;
    }
    if (4 * count > 3 * from)
      collect_all(from);
    else
      pad(false);
  }

  void collect_all(int from) {
    count = from;
    pad(true);
  }

 private:
  void pad(bool whole) {
    all = whole;
    padded = (count + 15) / 16 * 16;
  }
};

void gather(const float* v, const Selection& selection, float* out) {
  if (selection.all)
    std::memcpy(out, v, size_t(selection.count) * sizeof(float));
  else
    for (int i = 0; i < selection.count; ++i) out[i] = v[selection.index[i]];
  std::fill(out + selection.count, out + selection.padded, 0.f);
}

// Derivatives d (rows, BLOCK) at selected points, times the selected factors `by`.
PW_CLONES void scale_selected(const float* __restrict d, const float* __restrict by, const Selection& selection, int rows, int length,
                              float* __restrict out) {
  const int padded = selection.padded;
  for (int r = 0; r < rows; ++r) {
    const float* row = d + r * BLOCK;
    if (selection.all)
      for (int i = 0; i < padded; ++i) out[r * length + i] = row[i] * by[i];
    else
      for (int i = 0; i < padded; ++i) out[r * length + i] = row[selection.index[i < selection.count ? i : 0]] * by[i];
  }
}

// The selected points of a block, padded with one of them; the block itself where that is all.
const Block& selected_points(const Block& from, const Selection& selection, Block& block) {
  if (selection.all) return from;
  for (int i = 0; i < selection.padded; ++i) {
    const int j = selection.index[i < selection.count ? i : 0];
    block.x[i] = from.x[j];
    block.y[i] = from.y[j];
    block.z[i] = from.z[j];
  }
  return block;
}

// Buffers of one thread for the equations of M parts.
struct Scratchpad {
  explicit Scratchpad(size_t m) : w(m), d(DERIVATIVES * BLOCK), coefficients(m * KINDS * BLOCK) {}
  Workspace w;
  std::vector<float> d, rows, coefficients;
  std::vector<int> active;
};

PW_CLONES void keep_larger(float* __restrict size, const float* __restrict v) {
  for (int i = 0; i < BLOCK; ++i) size[i] = std::max(size[i], std::fabs(v[i]));
}

}  // namespace

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
void update(const std::vector<Part>& parts, size_t m, const SampleBlocks& samples, int64_t b, PartDistances& distances) {
  const SampleBlock& s = samples[b];
  const bool felt = parts.size() == 1 || reaches(parts[m], s.ball, unfelt_from(parts[m], samples.beta()));
  distances.felt(b, m) = felt;
  if (felt) values(parts[m], s.at, distances.block(b) + m * BLOCK);
}

}  // namespace

void measure(const std::vector<Part>& parts, const SampleBlocks& samples, int threads, PartDistances& distances) {
  parallel_for(piece_count(samples.count()), threads, [&](int64_t piece) {
    const auto [first, last] = piece_range(samples.count(), piece);
    for (int64_t b = first; b < last; ++b)
      for (size_t m = 0; m < parts.size(); ++m) update(parts, m, samples, b, distances);
  });
}

NormalEquations normal_equations(const std::vector<Part>& parts, const std::vector<char>& live, const SampleBlocks& samples,
                                 Penalties penalties, int threads, const PartDistances& distances) {
  const float beta = samples.beta();
  std::vector<NormalEquations> pieces(size_t(piece_count(samples.count())));
  const auto scratch = [&] { return Scratchpad(parts.size()); };
  parallel_for(int64_t(pieces.size()), threads, scratch, [&](int64_t piece, Scratchpad& pad) {
    NormalEquations& sum = pieces[size_t(piece)];
    sum.gradient.assign(parts.size() * DERIVATIVES, 0.0);
    auto& [w, d, rows, coefficients, active] = pad;
    Residuals r;
    Block block;
    alignas(64) float none[BLOCK] = {};
    const auto [first, last] = piece_range(samples.count(), piece);
    for (int64_t b = first; b < last; ++b) {
      distances.felt(b, w.folded);
      sum.loss += residuals(parts, samples, b, penalties, distances.block(b), w, r);
      std::fill_n(w.carried, BLOCK, 1.f);
      backward(parts, w);
      // Each point has up to three residuals, and each residual that moves with some part is a column of the
      // block's Jacobian. Saturated points, most of them where beta is large, have none.
      const bool over = penalties.overlap > 0 && largest(r.over) > 0;
      const bool blended = penalties.blending > 0 && largest(r.blended) > 0;
      const bool used[KINDS] = {true, over, blended};
      const float* residual[KINDS] = {r.rec, r.over, r.blended};
      const float *by_field[KINDS] = {r.rec_f, none, r.blended_f}, *by_occupancy[KINDS] = {none, r.over_o, r.blended_o};
      const float least = 1e-3f * 0.25f * beta * samples[b].heaviest;
      alignas(64) float size[KINDS][BLOCK] = {}, any[BLOCK] = {};
      active.clear();
      for (const size_t m : w.folded) {
        if (!live[m]) continue;
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
      const Block& at = selected_points(samples[b].at, points, block);
      int length = 0;
      alignas(64) float errors[KINDS * BLOCK], selected[BLOCK], by[BLOCK];
      for (int kind = 0; kind < KINDS; ++kind) {
        if (!used[kind]) continue;
        if (over || blended) {
          gather(size[kind], points, selected);
          columns[kind].collect(selected, least, points.count);
        } else {
          columns[kind].collect_all(points.count);
        }
        gather(residual[kind], points, selected);
        gather(selected, columns[kind], errors + length);
        length += columns[kind].padded;
      }
      rows.resize(active.size() * DERIVATIVES * size_t(length));
      for (size_t i = 0; i < active.size(); ++i) {
        const size_t m = size_t(active[i]);
        float* out = &rows[i * DERIVATIVES * size_t(length)];
        derivatives(parts[m], at, d.data(), points.padded);
        gather(&w.blend[m * BLOCK], points, &d[D_BLEND * BLOCK]);
        for (int kind = 0, start = 0; kind < KINDS; start += columns[kind++].padded) {
          if (!used[kind]) continue;
          gather(&coefficients[(i * KINDS + size_t(kind)) * BLOCK], points, selected);
          gather(selected, columns[kind], by);
          scale_selected(d.data(), by, columns[kind], FIELD_DERIVATIVES, length, out + start);
          gather(by_field[kind], points, selected);
          gather(selected, columns[kind], by);
          scale_selected(&d[D_BLEND * BLOCK], by, columns[kind], 1, length, out + D_BLEND * length + start);
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

double loss(const std::vector<Part>& parts, const std::vector<char>& live, const SampleBlocks& samples,
            Penalties penalties, int threads, PartDistances& distances) {
  double sums[MOST_PIECES] = {};
  const auto workspace = [&] { return Workspace(parts.size()); };
  parallel_for(piece_count(samples.count()), threads, workspace, [&](int64_t piece, Workspace& w) {
    Residuals r;
    const auto [first, last] = piece_range(samples.count(), piece);
    for (int64_t b = first; b < last; ++b) {
      for (size_t m = 0; m < parts.size(); ++m)
        if (live[m]) update(parts, m, samples, b, distances);
      distances.felt(b, w.folded);
      sums[piece] += residuals(parts, samples, b, penalties, distances.block(b), w, r);
    }
  });
  double total = 0;
  for (double sum : sums) total += sum;
  return total;
}

}  // namespace partwright
