#include "part_networks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "blocks.hpp"
#include "parallel.hpp"

namespace partwright {
namespace {

constexpr int ROWS = 96;    // at once: their activations stay in the cache from layer to layer
constexpr int ROW_TILE = 6;  // with two vectors a row, as many sums as fit the registers of a machine with AVX2
constexpr int LANES = 8;
constexpr int COLUMN_TILE = 2 * LANES;
constexpr float LEAK = 0.1f;
constexpr float QUARTER = 1.57079633f;  // turn

#if defined(__GNUC__)
typedef float Lanes __attribute__((vector_size(LANES * sizeof(float))));
PW_INLINE void add_times(Lanes& sum, float a, const Lanes& b) { sum += a * b; }
#else
struct Lanes {
  float v[LANES];
};
PW_INLINE void add_times(Lanes& sum, float a, const Lanes& b) {
  for (int i = 0; i < LANES; ++i) sum.v[i] += a * b.v[i];
}
#endif

PW_INLINE void load(Lanes& v, const float* p) { std::memcpy(&v, p, sizeof v); }
PW_INLINE void store(float* p, const Lanes& v) { std::memcpy(p, &v, sizeof v); }

// C (R x COLUMN_TILE) = start, or what it holds, + A B over `depth`. A is read in steps of `row` and `column`, so
// that it may be a transpose.
template <int R>
PW_INLINE void tile(const float* a, int row, int column, const float* b, int b_row, int depth, const float* start, float* c,
                    int c_row) {
  Lanes sums[R][2];
#pragma GCC unroll 8
  for (int i = 0; i < R; ++i)
    for (int h = 0; h < 2; ++h) load(sums[i][h], start ? start + h * LANES : c + i * c_row + h * LANES);
  for (int k = 0; k < depth; ++k) {
    Lanes left, right;
    load(left, b + k * b_row);
    load(right, b + k * b_row + LANES);
#pragma GCC unroll 8
    for (int i = 0; i < R; ++i) {
      add_times(sums[i][0], a[i * row + k * column], left);
      add_times(sums[i][1], a[i * row + k * column], right);
    }
  }
#pragma GCC unroll 8
  for (int i = 0; i < R; ++i)
    for (int h = 0; h < 2; ++h) store(c + i * c_row + h * LANES, sums[i][h]);
}

// C (rows x columns) = start (columns,), or C, + A B; columns and the rows of B and C are filled up.
PW_CLONES void multiply(const float* a, int row, int column, const float* b, int b_row, int depth, const float* start, float* c,
                        int c_row, int rows, int columns) {
  for (int j = 0; j < columns; j += COLUMN_TILE) {
    const float* from = start ? start + j : nullptr;
    int i = 0;
    for (; i + ROW_TILE <= rows; i += ROW_TILE)
      tile<ROW_TILE>(a + i * row, row, column, b + j, b_row, depth, from, c + i * c_row + j, c_row);
    for (; i < rows; ++i) tile<1>(a + i * row, row, column, b + j, b_row, depth, from, c + i * c_row + j, c_row);
  }
}

PW_CLONES void activate(float* v, int64_t count) {
  for (int64_t i = 0; i < count; ++i) v[i] = v[i] > 0 ? v[i] : LEAK * v[i];
}

PW_CLONES void carry_back(float* v, const float* activated, int64_t count) {
  for (int64_t i = 0; i < count; ++i) v[i] = activated[i] > 0 ? v[i] : LEAK * v[i];
}

PW_CLONES void add_rows(const float* v, int rows, int columns, float* sums) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) sums[j] += v[i * columns + j];
}

// To rows that are a whole number of tiles.
int filled(int width) { return (width + COLUMN_TILE - 1) / COLUMN_TILE * COLUMN_TILE; }

// One part's weights with rows filled up, and, where derivatives are to be carried back, transposed.
struct Packed {
  Packed(const Networks& n, int64_t part, bool transposed) {
    for (int l = 0; l < n.layers(); ++l) {
      const int in = n.widths[l], out = n.widths[l + 1], wide = filled(out), tall = filled(in);
      const float* from = n.weights[l] + part * in * out;
      weights.emplace_back(size_t(in) * wide);
      for (int i = 0; i < in; ++i) std::copy_n(from + i * out, out, weights[l].data() + i * wide);
      shifts.emplace_back(wide);
      std::copy_n(n.shifts[l] + part * out, out, shifts[l].data());
      if (!transposed) continue;
      turned.emplace_back(size_t(out) * tall);
      for (int o = 0; o < out; ++o)
        for (int i = 0; i < in; ++i) turned[l][size_t(o) * tall + i] = from[i * out + o];
    }
  }
  std::vector<std::vector<float>> weights, shifts, turned;
};

// Of up to ROWS rows: what goes into each layer, and what comes out of the last; rows are filled up.
struct Activations {
  explicit Activations(const Networks& n) {
    for (int width : n.widths) each.emplace_back(size_t(ROWS) * filled(width));
  }
  std::vector<std::vector<float>> each;
};

void through(const Networks& n, const Packed& packed, int count, Activations& a) {
  for (int l = 0; l < n.layers(); ++l) {
    const int in = filled(n.widths[l]), out = filled(n.widths[l + 1]);
    multiply(a.each[l].data(), in, 1, packed.weights[l].data(), out, n.widths[l], packed.shifts[l].data(),
             a.each[l + 1].data(), out, count, out);
    if (l + 1 < n.layers()) activate(a.each[l + 1].data(), int64_t(count) * out);
  }
}

// Sums of one part's derivatives by its weights and shifts, in rows that are filled up.
struct Sums {
  explicit Sums(const Networks& n) {
    for (int l = 0; l < n.layers(); ++l) {
      const int out = filled(n.widths[l + 1]);
      weights.emplace_back(size_t(n.widths[l]) * out);
      shifts.emplace_back(out);
      zeros.resize(std::max<size_t>(zeros.size(), filled(n.widths[l])));
    }
  }
  std::vector<std::vector<float>> weights, shifts;
  std::vector<float> zeros;
};

// From derivatives by the last activations, in `back`, to those by all others.
void carried_back(const Networks& n, const Packed& packed, int count, const Activations& a, Activations& back, Sums& sums) {
  for (int l = n.layers() - 1; l >= 0; --l) {
    const int in = filled(n.widths[l]), out = filled(n.widths[l + 1]);
    float* now = back.each[l + 1].data();
    if (l + 1 < n.layers()) carry_back(now, a.each[l + 1].data(), int64_t(count) * out);
    multiply(a.each[l].data(), 1, in, now, out, count, nullptr, sums.weights[l].data(), out, n.widths[l], out);
    add_rows(now, count, out, sums.shifts[l].data());
    multiply(now, out, 1, packed.turned[l].data(), in, n.widths[l + 1], sums.zeros.data(), back.each[l].data(), in, count, in);
  }
}

// One part's place: as in Rooms.
struct Room {
  Room(const Rooms& rooms, int64_t part)
      : scale(rooms.scale + 3 * part), room(rooms.room + 3 * part), unit(rooms.unit + 3 * part), octaves(rooms.octaves) {
    for (int d = 1; d < 3; ++d)
      if (scale[d] * unit[d] < scale[shortest] * unit[shortest]) shortest = d;
    least = scale[shortest] * unit[shortest];
  }

  // Distance of a local point from the room, and the axis that tells it.
  std::pair<float, int> off(const float* point) const {
    std::pair<float, int> most{-1e30f, 0};
    for (int d = 0; d < 3; ++d) most = std::max(most, {(std::abs(point[d]) - room[d]) * scale[d], -d});
    return {most.first, -most.second};
  }

  // The local point in the network's unit, with its sines and cosines, and the same point in unit lengths.
  void encode(const float* point, float* row) const {
    float *sines = row + 3, *cosines = sines + 3 * octaves;
    for (int d = 0; d < 3; ++d) {
      row[d] = point[d] / unit[d];
      float s = std::sin(QUARTER * row[d]), c = std::cos(QUARTER * row[d]);
      for (int o = 0; o < octaves; ++o) {
        sines[d * octaves + o] = s;
        cosines[d * octaves + o] = c;
        const float twice = 2 * s * c;
        c = 1 - 2 * s * s;
        s = twice;
      }
      cosines[3 * octaves + d] = point[d] * scale[d];
    }
  }

  // Adds derivatives by the point and by half-lengths, from those by its row.
  void decode(const float* point, const float* row, const float* by_row, float* by_point, float* by_scale) const {
    const float *sines = row + 3, *cosines = sines + 3 * octaves;
    const float *by_sines = by_row + 3, *by_cosines = by_sines + 3 * octaves;
    for (int d = 0; d < 3; ++d) {
      float sum = by_row[d], pitch = QUARTER;
      for (int o = d * octaves; o < (d + 1) * octaves; ++o, pitch *= 2)
        sum += pitch * (cosines[o] * by_sines[o] - sines[o] * by_cosines[o]);
      const float by_place = by_cosines[3 * octaves + d];
      by_point[d] += sum / unit[d] + by_place * scale[d];
      by_scale[d] += by_place * point[d];
    }
  }

  const float *scale, *room, *unit;
  int octaves, shortest = 0;
  float least;  // times what the network says: a small part's errors are small
};

}  // namespace

void distances(const Networks& n, const Rooms& rooms, const float* local, int64_t count, float* out, int threads) {
  parallel_for(n.parts, threads, [&](int64_t g) {
    const Room room(rooms, g);
    const float* points = local + 3 * g * count;
    float* values = out + g * count;
    std::vector<int64_t> near;
    for (int64_t i = 0; i < count; ++i) {
      values[i] = room.off(points + 3 * i).first;
      if (values[i] < rooms.reach) near.push_back(i);
    }
    if (near.empty()) return;
    const Packed packed(n, g, false);
    Activations a(n);
    const int wide = filled(n.widths[0]);
    for (size_t first = 0; first < near.size(); first += ROWS) {
      const int some = int(std::min<size_t>(ROWS, near.size() - first));
      for (int i = 0; i < some; ++i) room.encode(points + 3 * near[first + i], a.each[0].data() + i * wide);
      through(n, packed, some, a);
      for (int i = 0; i < some; ++i) {
        float& value = values[near[first + i]];
        value = std::max(value, room.least * a.each.back()[size_t(i) * COLUMN_TILE]);
      }
    }
  });
}

void distance_gradients(const Networks& n, const Rooms& rooms, const float* local, int64_t count, const float* upstream,
                        float* by_local, float* by_scale, const std::vector<float*>& by_weight,
                        const std::vector<float*>& by_shift, int threads) {
  parallel_for(n.parts, threads, [&](int64_t g) {
    const Room room(rooms, g);
    const float *points = local + 3 * g * count, *weight = upstream + g * count;
    float *by_points = by_local + 3 * g * count, *by_lengths = by_scale + 3 * g;
    // Where the distance is that from the room.
    const auto by_room = [&](int64_t i, int axis) {
      const float* p = points + 3 * i;
      by_points[3 * i + axis] += weight[i] * std::copysign(room.scale[axis], p[axis]);
      by_lengths[axis] += weight[i] * (std::abs(p[axis]) - room.room[axis]);
    };
    std::vector<int64_t> near;
    for (int64_t i = 0; i < count; ++i) {
      if (weight[i] == 0) continue;
      const auto [off, axis] = room.off(points + 3 * i);
      if (off < rooms.reach)
        near.push_back(i);
      else
        by_room(i, axis);
    }
    if (near.empty()) return;
    const Packed packed(n, g, true);
    Activations a(n), back(n);
    Sums sums(n);
    const int wide = filled(n.widths[0]);
    for (size_t first = 0; first < near.size(); first += ROWS) {
      const int some = int(std::min<size_t>(ROWS, near.size() - first));
      for (int i = 0; i < some; ++i) room.encode(points + 3 * near[first + i], a.each[0].data() + i * wide);
      through(n, packed, some, a);
      std::fill(back.each.back().begin(), back.each.back().end(), 0.0f);
      for (int i = 0; i < some; ++i) {
        const int64_t place = near[first + i];
        const auto [off, axis] = room.off(points + 3 * place);
        const float said = a.each.back()[size_t(i) * COLUMN_TILE];
        if (off > room.least * said) {
          by_room(place, axis);
          // Else a network that once says less than its room everywhere would never learn again.
          if (!rooms.learning || weight[place] >= 0) continue;
        }
        back.each.back()[size_t(i) * COLUMN_TILE] = weight[place] * room.least;
        by_lengths[room.shortest] += weight[place] * said * room.unit[room.shortest];
      }
      carried_back(n, packed, some, a, back, sums);
      for (int i = 0; i < some; ++i) {
        const int64_t place = 3 * near[first + i];
        room.decode(points + place, a.each[0].data() + i * wide, back.each[0].data() + i * wide, by_points + place, by_lengths);
      }
    }
    for (int l = 0; l < n.layers(); ++l) {
      const int in = n.widths[l], out = n.widths[l + 1], row = filled(out);
      for (int i = 0; i < in; ++i) std::copy_n(sums.weights[l].data() + i * row, out, by_weight[l] + (g * in + i) * out);
      std::copy_n(sums.shifts[l].data(), out, by_shift[l] + g * out);
    }
  });
}

}  // namespace partwright
