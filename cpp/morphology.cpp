#include "morphology.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "blocks.hpp"

namespace partwright {
namespace {

// Depths this close, in voxels, count as one level.
constexpr float LEVEL = 0.05f;

struct Box {
  int lower[3], upper[3];  // upper is one past the end
};

// The least of so many values, lane by lane and then of the lanes; no more than 0.
PW_CLONES float least(const float* v, size_t count) {
  constexpr size_t LANES = 16;
  float lanes[LANES] = {};
  size_t i = 0;
  for (; i + LANES <= count; i += LANES)
    for (size_t lane = 0; lane < LANES; ++lane) lanes[lane] = std::min(lanes[lane], v[i + lane]);
  for (; i < count; ++i) lanes[0] = std::min(lanes[0], v[i]);
  return *std::min_element(lanes, lanes + LANES);
}

// Voxels from deepest to shallowest, by a counting sort of their depth.
std::vector<uint32_t> by_depth(const std::vector<float>& field) {
  constexpr int BINS = 4096;
  const float deepest = least(field.data(), field.size());
  std::vector<uint32_t> order;
  if (deepest >= 0) return order;
  const float scale = (BINS - 1) / -deepest;
  std::vector<uint32_t> start(BINS + 1, 0);
  for (float v : field)
    if (v < 0) ++start[size_t((v - deepest) * scale) + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  order.resize(start[BINS]);
  for (size_t i = 0; i < field.size(); ++i)
    if (field[i] < 0) order[start[size_t((field[i] - deepest) * scale)]++] = uint32_t(i);
  return order;
}

// Connected components that grow voxel by voxel.
class Components {
 public:
  explicit Components(const Grid& grid) : grid_(grid), parent_(grid.size(), NONE), size_(grid.size(), 0) {}

  // Adds a voxel, joins it with its six neighbours, and returns its component's root.
  uint32_t add(uint32_t voxel) {
    parent_[voxel] = voxel;
    size_[voxel] = 1;
    const int z = int(voxel % grid_.nz), y = int(voxel / grid_.nz % grid_.ny), x = int(voxel / grid_.nz / grid_.ny);
    const uint32_t plane = uint32_t(grid_.ny) * grid_.nz;
    if (x > 0) join(voxel, voxel - plane);
    if (x + 1 < grid_.nx) join(voxel, voxel + plane);
    if (y > 0) join(voxel, voxel - grid_.nz);
    if (y + 1 < grid_.ny) join(voxel, voxel + grid_.nz);
    if (z > 0) join(voxel, voxel - 1);
    if (z + 1 < grid_.nz) join(voxel, voxel + 1);
    return root(voxel);
  }

  bool has(uint32_t voxel) const { return parent_[voxel] != NONE; }
  uint32_t size(uint32_t root) const { return size_[root]; }

  uint32_t root(uint32_t voxel) {
    while (parent_[voxel] != voxel) voxel = parent_[voxel] = parent_[parent_[voxel]];
    return voxel;
  }

 private:
  static constexpr uint32_t NONE = std::numeric_limits<uint32_t>::max();

  void join(uint32_t a, uint32_t b) {
    if (!has(b)) return;
    a = root(a);
    b = root(b);
    if (a == b) return;
    if (size_[a] < size_[b]) std::swap(a, b);
    parent_[b] = a;
    size_[a] += size_[b];
  }

  const Grid& grid_;
  std::vector<uint32_t> parent_, size_;
};

// One pass of the exact squared distance transform (lower envelope of parabolas) along a line of n values.
void distance_line(const float* f, int n, float* out, int* hull, float* cut) {
  int k = 0;
  hull[0] = 0;
  cut[0] = -1e30f;
  cut[1] = 1e30f;
  for (int q = 1; q < n; ++q) {
    const auto crossing = [&](int r) { return ((f[q] + float(q) * q) - (f[r] + float(r) * r)) / (2.f * (q - r)); };
    float s = crossing(hull[k]);
    while (s <= cut[k]) s = crossing(hull[--k]);
    hull[++k] = q;
    cut[k] = s;
    cut[k + 1] = 1e30f;
  }
  k = 0;
  for (int q = 0; q < n; ++q) {
    while (cut[k + 1] < q) ++k;
    const float d = float(q - hull[k]);
    out[q] = d * d + f[hull[k]];
  }
}

// Squared distances in voxels, within a box, to the voxels where `seed` holds.
template <typename Seed>
std::vector<float> squared_distance(const Grid& grid, const Box& box, Seed seed) {
  const int n[3] = {box.upper[0] - box.lower[0], box.upper[1] - box.lower[1], box.upper[2] - box.lower[2]};
  std::vector<float> d(size_t(n[0]) * n[1] * n[2]);
  size_t i = 0;
  for (int x = 0; x < n[0]; ++x)
    for (int y = 0; y < n[1]; ++y)
      for (int z = 0; z < n[2]; ++z, ++i) d[i] = seed(grid.at(x + box.lower[0], y + box.lower[1], z + box.lower[2])) ? 0.f : 1e8f;
  const int longest = std::max({n[0], n[1], n[2]});
  std::vector<float> line(longest), out(longest), cut(longest + 1);
  std::vector<int> hull(longest);
  const size_t strides[3] = {size_t(n[1]) * n[2], size_t(n[2]), 1};
  for (int axis = 2; axis >= 0; --axis) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (int u = 0; u < n[a]; ++u)
      for (int v = 0; v < n[b]; ++v) {
        float* start = &d[u * strides[a] + v * strides[b]];
        bool any = false;
        for (int k = 0; k < n[axis]; ++k) {
          line[k] = start[k * strides[axis]];
          any |= line[k] < 1e8f;
        }
        if (!any) continue;
        distance_line(line.data(), n[axis], out.data(), hull.data(), cut.data());
        for (int k = 0; k < n[axis]; ++k) start[k * strides[axis]] = out[k];
      }
  }
  return d;
}

template <typename Inside>
Box bounds(const Grid& grid, const std::vector<uint32_t>& voxels, float margin, Inside inside) {
  Box box{{grid.nx, grid.ny, grid.nz}, {0, 0, 0}};
  for (uint32_t v : voxels) {
    if (!inside(v)) continue;
    const int c[3] = {int(v / grid.nz / grid.ny), int(v / grid.nz % grid.ny), int(v % grid.nz)};
    for (int i = 0; i < 3; ++i) {
      box.lower[i] = std::min(box.lower[i], c[i]);
      box.upper[i] = std::max(box.upper[i], c[i] + 1);
    }
  }
  const int n[3] = {grid.nx, grid.ny, grid.nz}, m = int(std::ceil(margin));
  for (int i = 0; i < 3; ++i) {
    box.lower[i] = std::max(0, box.lower[i] - m);
    box.upper[i] = std::min(n[i], box.upper[i] + m);
  }
  return box;
}

}  // namespace

std::vector<float> decompose(std::vector<float> field, const Grid& grid, const Peeling& peeling, int32_t* labels) {
  std::fill_n(labels, grid.size(), -1);
  std::vector<float> depths;
  for (int region = 0; region < peeling.regions; ++region) {
    const std::vector<uint32_t> order = by_depth(field);
    if (order.empty() || double(order.size()) < peeling.least_voxels) break;
    const float deepest = -field[order[0]];
    if (deepest < peeling.least_depth) break;

    // Eq. 5: sink the threshold until a connected core holds the wanted share of the volume. Where no core ever
    // does (crumbs), take the largest component.
    const double wanted = std::max(1.0, peeling.fraction * double(order.size()));
    Components components(grid);
    uint32_t core = 0, largest = 0;
    float depth = 0;
    bool found = false;
    for (uint32_t voxel : order) {
      // Voxels as deep as the threshold belong to the core whatever their order: a plate's middle is one level.
      if (found && -field[voxel] < depth - LEVEL * grid.spacing) break;
      const uint32_t root = components.add(voxel);
      if (!found && components.size(root) > largest) {
        largest = components.size(root);
        core = root;
      }
      if (!found && components.size(root) >= wanted) {
        depth = -field[voxel];
        found = true;
        core = root;
      }
    }
    core = components.root(core);
    if (!found) depth = 0;

    // Dilate the core back by the depth it was eroded by. Half a voxel more makes up for the distance being
    // measured between voxel centres.
    const auto in_core = [&](size_t v) { return components.has(uint32_t(v)) && components.root(uint32_t(v)) == core; };
    const float reach = depth / grid.spacing + 0.5f;
    const Box around = bounds(grid, order, reach + 1, in_core);
    const std::vector<float> to_core = squared_distance(grid, around, in_core);
    std::vector<uint32_t> taken;
    size_t i = 0;
    for (int x = around.lower[0]; x < around.upper[0]; ++x)
      for (int y = around.lower[1]; y < around.upper[1]; ++y)
        for (int z = around.lower[2]; z < around.upper[2]; ++z, ++i) {
          const size_t v = grid.at(x, y, z);
          if (to_core[i] <= reach * reach && field[v] < 0) taken.push_back(uint32_t(v));
        }
    if (double(taken.size()) < peeling.least_voxels) break;
    for (uint32_t v : taken) labels[v] = region;
    depths.push_back(depth);

    // Eq. 6: what is left lies outside the region, and is no deeper than its distance to it.
    const auto in_region = [&](size_t v) { return labels[v] == region; };
    const Box near = bounds(grid, taken, deepest / grid.spacing + 1, in_region);
    const std::vector<float> to_region = squared_distance(grid, near, in_region);
    i = 0;
    for (int x = near.lower[0]; x < near.upper[0]; ++x)
      for (int y = near.lower[1]; y < near.upper[1]; ++y)
        for (int z = near.lower[2]; z < near.upper[2]; ++z, ++i) {
          float& f = field[grid.at(x, y, z)];
          f = std::max(f, (0.5f - std::sqrt(to_region[i])) * grid.spacing);
        }
  }
  return depths;
}

}  // namespace partwright
