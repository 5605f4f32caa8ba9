#include "normal_equations.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "blocks.hpp"
#include "parallel.hpp"
#include "products.hpp"

namespace partwright {
namespace {

// Reconstruction, overlap and smooth-union consistency.
constexpr int KINDS = 3;
// Of the steepest that a residual can be: where it moves less with a part, it is not taken to.
constexpr float LEAST = 3e-4f;

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

int lowest_bit(uint64_t word) {
#if defined(__GNUC__)
  return __builtin_ctzll(word);
#else
  int bit = 0;
  while (!(word >> bit & 1)) ++bit;
  return bit;
#endif
}

// Which points of a block are of any use.
struct Chosen {
  uint64_t words[BLOCK / 64] = {};

  bool none() const { return !(words[0] | words[1]); }
  friend Chosen operator|(Chosen a, Chosen b) { return {{a.words[0] | b.words[0], a.words[1] | b.words[1]}}; }
  friend Chosen operator&(Chosen a, Chosen b) { return {{a.words[0] & b.words[0], a.words[1] & b.words[1]}}; }

  // Their indices, and how many they are.
  int list(uint8_t* index) const {
    int count = 0;
    for (int word = 0; word < BLOCK / 64; ++word)
      for (uint64_t left = words[word]; left; left &= left - 1) index[count++] = uint8_t(64 * word + lowest_bit(left));
    return count;
  }
};
static_assert(BLOCK == 128);

// Those whose size is above the least.
PW_CLONES Chosen above(const float* __restrict size, float least) {
  alignas(64) uint8_t flags[BLOCK];
  for (int i = 0; i < BLOCK; ++i) flags[i] = std::fabs(size[i]) > least;
  Chosen chosen;
  for (int i = 0; i < BLOCK; i += 8) {
    // Eight bytes of 0 or 1 times this have their sum of bits in the highest byte.
    uint64_t eight;
    std::memcpy(&eight, flags + i, sizeof eight);
    chosen.words[i / 64] |= (eight * 0x0102040810204080ull >> 56) << i % 64;
  }
  return chosen;
}

// One residual's rows of points (BLOCK, ROW): derivatives `rows` (count, ROW) of the field at the points of this index,
// each of whose last is 1, times factors of the field and of its blend, and the residual. All of them by index are written.
PW_CLONES void scale_rows(const float* __restrict rows, const uint8_t* __restrict index, int count, const float* __restrict by,
                          const float* __restrict by_blend, const float* __restrict residual, float* __restrict out) {
  for (int k = 0; k < count; ++k) {
    const int point = index[k];
    const float scale = by[point], of_blend = by_blend[point], last = residual[point];
    for (int i = 0; i < ROW; ++i) out[point * ROW + i] = rows[k * ROW + i] * (i < D_BLEND ? scale : i == D_BLEND ? of_blend : last);
  }
}

PW_CLONES void pick(const float* __restrict from, const uint8_t* __restrict index, int count, float* __restrict out) {
  for (int i = 0; i < count; ++i) out[i] = from[index[i]];
}

// Sums of a piece: blocks of the matrix by pairs of parts, each with J^T r as its last column.
class Sums {
 public:
  explicit Sums(size_t parts) : parts_(parts), place_(parts * parts, -1) {}

  double* block(int first, int second) {
    int& place = place_[size_t(first) * parts_ + size_t(second)];
    if (place < 0) {
      place = int(pairs_.size());
      pairs_.emplace_back(first, second);
      sums_.resize(sums_.size() + DERIVATIVES * ROW, 0.0);
    }
    return &sums_[size_t(place) * DERIVATIVES * ROW];
  }

  void add_to(NormalEquations& total) const {
    for (size_t at = 0; at < pairs_.size(); ++at) {
      const auto [first, second] = pairs_[at];
      const double* from = &sums_[at * DERIVATIVES * ROW];
      auto& block = total.blocks[pairs_[at]];
      if (block.empty()) block.assign(DERIVATIVES * DERIVATIVES, 0.0);
      for (size_t r = 0; r < DERIVATIVES; ++r) {
        for (size_t c = 0; c < DERIVATIVES; ++c) block[r * DERIVATIVES + c] += from[r * ROW + c];
        if (first == second) total.gradient[size_t(first) * DERIVATIVES + r] += from[r * ROW + DERIVATIVES];
      }
    }
  }

  double loss = 0;

 private:
  size_t parts_;
  std::vector<int> place_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<double> sums_;
};

// A part that moves and is felt in a block, and the points at which each of its residuals is.
struct Active {
  int part;
  Chosen at[KINDS];
};

// Buffers of one thread for the equations of M parts.
struct Scratchpad {
  explicit Scratchpad(size_t m) : w(m), d(ROW * BLOCK), of_points(BLOCK * ROW), rows(new float[m * KINDS * BLOCK * ROW]) {
    std::fill_n(&d[DERIVATIVES * BLOCK], BLOCK, 1.f);
  }
  Workspace w;
  std::vector<float> d, of_points;
  std::unique_ptr<float[]> rows;  // as many as there may be, set as they are needed
  std::vector<Active> active;

  float* rows_of(size_t active, int kind) { return &rows[(active * KINDS + size_t(kind)) * BLOCK * ROW]; }
};

}  // namespace

void PartDistances::felt(int64_t b, std::vector<size_t>& parts) const {
  parts.clear();
  for (size_t m = 0; m < parts_; ++m)
    if (felt_[size_t(b) * parts_ + m]) parts.push_back(m);
}

void PartDistances::take(const PartDistances& other, const std::vector<char>& live) {
  felt_ = other.felt_;
  still_ = other.still_;
  for (size_t at = 0; at < felt_.size(); ++at)
    if (felt_[at] && !live[at % parts_]) std::copy_n(&other.values_[at * BLOCK], BLOCK, &values_[at * BLOCK]);
}

namespace {

// From where on a part is not felt: its occupancy is below exp(-SILENT), six millionths, and no blend reaches so
// far.
constexpr float SILENT = 12;
float unfelt_from(const Part& part, float beta) { return SILENT / beta + part.blend; }

// The distances of a part in a block, if it is felt there; a single part always is. Says whether it is.
bool update(const std::vector<Part>& parts, size_t m, const SampleBlocks& samples, int64_t b, PartDistances& distances) {
  const SampleBlock& s = samples[b];
  const bool felt = parts.size() == 1 || reaches(parts[m], s.ball, unfelt_from(parts[m], samples.beta()));
  distances.felt(b, m) = felt;
  if (felt) values(parts[m], s.at, distances.block(b) + m * BLOCK);
  return felt;
}

}  // namespace

void measure(const std::vector<Part>& parts, const SampleBlocks& samples, int threads, PartDistances& distances) {
  threads = worth_their_while(threads, int64_t(parts.size()) * samples.count(), LEAST_VALUES);
  parallel_for(piece_count(samples.count()), threads, [&](int64_t piece) {
    const auto [first, last] = piece_range(samples.count(), piece);
    for (int64_t b = first; b < last; ++b) {
      for (size_t m = 0; m < parts.size(); ++m) update(parts, m, samples, b, distances);
      distances.still(b) = PartDistances::UNKNOWN;
    }
  });
}

namespace {

// One block's part of the sums. Each point has up to three residuals, and where one moves with some part that has a row
// of derivatives. Saturated points, most of them where beta is large, have none; and where parts hardly blend one part
// has most of a point's rows.
void add_block(const std::vector<Part>& parts, const std::vector<char>& live, const SampleBlocks& samples, int64_t b, Penalties penalties,
               const PartDistances& distances, Scratchpad& pad, Sums& sums) {
  auto& w = pad.w;
  Residuals r;
  const float beta = samples.beta();
  distances.felt(b, w.folded);
  const bool moves = std::any_of(w.folded.begin(), w.folded.end(), [&](size_t m) { return live[m]; });
  const double still = distances.still(b);
  sums.loss += moves || still < 0 ? residuals(parts, samples, b, penalties, distances.block(b), w, r) : still;
  if (!moves) return;
  std::fill_n(w.carried, BLOCK, 1.f);
  backward(parts, w);
  alignas(64) static constexpr float none[BLOCK] = {};
  const bool used[KINDS] = {true, penalties.overlap > 0 && largest(r.over) > 0, penalties.blending > 0 && largest(r.blended) > 0};
  const float* residual[KINDS] = {r.rec, r.over, r.blended};
  const float *by_field[KINDS] = {r.rec_f, none, r.blended_f}, *by_occupancy[KINDS] = {none, r.over_o, r.blended_o};
  const float least = LEAST * 0.25f * beta * samples[b].heaviest;
  pad.active.clear();
  for (const size_t m : w.folded) {
    if (!live[m]) continue;
    Active one{int(m), {}};
    Chosen any;
    alignas(64) float by[KINDS][BLOCK];
    for (int kind = 0; kind < KINDS; ++kind) {
      if (!used[kind]) continue;
      by_part(by_field[kind], &w.share[m * BLOCK], parts[m].sign > 0 ? by_occupancy[kind] : none, &w.occ[m * BLOCK], beta, by[kind]);
      one.at[kind] = above(by[kind], least);
      any = any | one.at[kind];
    }
    if (any.none()) continue;
    uint8_t index[BLOCK];
    const int count = any.list(index), padded = (count + 15) / 16 * 16;
    std::fill(index + count, index + padded, index[0]);
    Block at;
    pick(samples[b].at.x, index, padded, at.x);
    pick(samples[b].at.y, index, padded, at.y);
    pick(samples[b].at.z, index, padded, at.z);
    derivatives(parts[m], at, pad.d.data(), padded);
    pick(&w.blend[m * BLOCK], index, padded, &pad.d[D_BLEND * BLOCK]);
    by_points(pad.d.data(), BLOCK, padded, pad.of_points.data());
    for (int kind = 0; kind < KINDS; ++kind)
      if (!one.at[kind].none())
        scale_rows(pad.of_points.data(), index, count, by[kind], by_field[kind], residual[kind], pad.rows_of(pad.active.size(), kind));
    pad.active.push_back(one);
  }
  for (size_t i = 0; i < pad.active.size(); ++i)
    for (size_t j = i; j < pad.active.size(); ++j) {
      double* sum = nullptr;
      for (int kind = 0; kind < KINDS; ++kind) {
        const Chosen both = pad.active[i].at[kind] & pad.active[j].at[kind];
        if (both.none()) continue;
        if (!sum) sum = sums.block(pad.active[i].part, pad.active[j].part);
        uint8_t index[BLOCK];
        const int count = both.list(index);
        add_products(pad.rows_of(i, kind), pad.rows_of(j, kind), index, count, sum);
      }
    }
}

}  // namespace

NormalEquations normal_equations(const std::vector<Part>& parts, const std::vector<char>& live, const SampleBlocks& samples,
                                 Penalties penalties, int threads, const PartDistances& distances) {
  const int64_t count = piece_count(samples.count());
  std::vector<Sums> pieces(size_t(count), Sums(parts.size()));
  const auto scratch = [&] { return Scratchpad(parts.size()); };
  parallel_for(count, threads, scratch, [&](int64_t piece, Scratchpad& pad) {
    const auto [first, last] = piece_range(samples.count(), piece);
    for (int64_t b = first; b < last; ++b) add_block(parts, live, samples, b, penalties, distances, pad, pieces[size_t(piece)]);
  });
  NormalEquations total;
  total.gradient.assign(parts.size() * DERIVATIVES, 0.0);
  for (const Sums& piece : pieces) {
    total.loss += piece.loss;
    piece.add_to(total);
  }
  return total;
}

double loss(const std::vector<Part>& parts, const std::vector<char>& live, const SampleBlocks& samples,
            Penalties penalties, int threads, PartDistances& distances, double enough) {
  double sums[MOST_PIECES] = {};
  std::atomic<double> so_far{0};
  const auto workspace = [&] { return Workspace(parts.size()); };
  parallel_for(piece_count(samples.count()), threads, workspace, [&](int64_t piece, Workspace& w) {
    Residuals r;
    const auto [first, last] = piece_range(samples.count(), piece);
    for (int64_t b = first; b < last && so_far.load(std::memory_order_relaxed) < enough; ++b) {
      bool moves = false;
      for (size_t m = 0; m < parts.size(); ++m)
        if (live[m]) moves |= update(parts, m, samples, b, distances);
      double& still = distances.still(b);
      double now = still;
      if (moves || now < 0) {
        distances.felt(b, w.folded);
        now = residuals(parts, samples, b, penalties, distances.block(b), w, r);
        if (!moves) still = now;
      }
      sums[piece] += now;
      for (double sum = so_far; !so_far.compare_exchange_weak(sum, sum + now);) {
      }
    }
  });
  double total = 0;
  for (double sum : sums) total += sum;
  return total;
}

}  // namespace partwright
