#include "triangle_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel.hpp"

namespace partwright {
namespace {

constexpr int LEAF = 4;       // triangles of a leaf, at most
constexpr int DEEPEST = 64;   // nodes that wait on the way down: halves of 2^31 triangles are half as deep
constexpr int TOGETHER = 64;  // points of one work item
// What a plane's distance may be wrong by, as a share, before its triangle is left out: that of a sliver's plane is rounded.
constexpr double ROUNDED = 1e-6;

using Vector = std::array<double, 3>;

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double to_segment(const Vector& from_start, const Vector& along) {
  const double length = dot(along, along);
  const double share = length > 0 ? std::clamp(dot(from_start, along) / length, 0.0, 1.0) : 0.0;
  const Vector off{from_start[0] - share * along[0], from_start[1] - share * along[1], from_start[2] - share * along[2]};
  return dot(off, off);
}

// The least of `best` and the triangle's squared distance. The edges are always asked: what a sliver's plane says of a foot
// point near them is rounded.
double to_triangle(const std::array<Vector, 3>& corners, const Vector& point, double best) {
  const Vector ab = minus(corners[1], corners[0]), bc = minus(corners[2], corners[1]), ca = minus(corners[0], corners[2]);
  const Vector from_a = minus(point, corners[0]);
  const Vector normal = cross(ab, bc);
  const double square = dot(normal, normal);
  if (square > 0) {
    const double height = dot(from_a, normal), plane = height * height / square;
    if (plane * (1 - ROUNDED) > best) return best;
    const Vector from_b = minus(point, corners[1]), from_c = minus(point, corners[2]);
    if (dot(cross(ab, from_a), normal) >= 0 && dot(cross(bc, from_b), normal) >= 0 && dot(cross(ca, from_c), normal) >= 0)
      return std::min(best, plane);
    return std::min({best, to_segment(from_a, ab), to_segment(from_b, bc), to_segment(from_c, ca)});
  }
  return std::min({best, to_segment(from_a, ab), to_segment(minus(point, corners[1]), bc),
                   to_segment(minus(point, corners[2]), ca)});
}

// x and z where an edge passes the row y. The two triangles at an edge ask with its ends in the same order, so they are told
// the same to the bit.
std::array<double, 2> at_row(const Vector& start, const Vector& end, double y) {
  const double share = (y - start[1]) / (end[1] - start[1]);
  return {start[0] + share * (end[0] - start[0]), start[2] + share * (end[2] - start[2])};
}

// +1 where a line upwards from the point passes a triangle that faces up, -1 where it faces down, else 0. Intervals are
// half-open, so that a line through an edge or a corner passes exactly what it must.
int32_t passed(const std::array<Vector, 3>& corners, const Vector& point) {
  std::array<int, 3> order{0, 1, 2};
  bool even = true;
  const auto sort = [&](int i, int j) {
    if (corners[order[i]][1] > corners[order[j]][1]) {
      std::swap(order[i], order[j]);
      even = !even;
    }
  };
  sort(0, 1);
  sort(1, 2);
  sort(0, 1);
  const Vector &low = corners[order[0]], &mid = corners[order[1]], &high = corners[order[2]];
  if (!(low[1] <= point[1] && point[1] < high[1])) return 0;
  const auto [x_long, z_long] = at_row(low, high, point[1]);
  const bool upper = point[1] >= mid[1];
  const auto [x_short, z_short] = at_row(upper ? mid : low, upper ? high : mid, point[1]);
  if (!(std::min(x_long, x_short) <= point[0] && point[0] < std::max(x_long, x_short))) return 0;
  const double share = std::clamp((point[0] - x_long) / (x_short - x_long), 0.0, 1.0);
  if (!(point[2] < z_long + share * (z_short - z_long))) return 0;
  return (x_long < x_short) == even ? 1 : -1;
}

Vector at(const double* place) { return {place[0], place[1], place[2]}; }

}  // namespace

struct TriangleTree::Item {
  std::array<float, 3> middle;
  int32_t index;
};

TriangleTree::TriangleTree(const double* vertices, const int64_t* faces, int64_t count) {
  if (count == 0) return;
  std::vector<Item> items(count);
  for (int64_t f = 0; f < count; ++f) {
    const double *a = vertices + 3 * faces[3 * f], *b = vertices + 3 * faces[3 * f + 1], *c = vertices + 3 * faces[3 * f + 2];
    for (int k = 0; k < 3; ++k) items[f].middle[k] = float((a[k] + b[k] + c[k]) / 3);
    items[f].index = int32_t(f);
  }
  nodes_.reserve(count);
  build(items, 0, int32_t(count));
  triangles_.resize(count);
  for (int64_t i = 0; i < count; ++i)
    for (int corner = 0; corner < 3; ++corner)
      triangles_[i].corners[corner] = at(vertices + 3 * faces[3 * items[i].index + corner]);
  // Children come after their parents.
  constexpr float far = std::numeric_limits<float>::infinity();
  for (size_t n = nodes_.size(); n-- > 0;) {
    Node& node = nodes_[n];
    if (node.count == 0) {
      const Node &one = nodes_[n + 1], &other = nodes_[node.first];
      for (int k = 0; k < 3; ++k) {
        node.low[k] = std::min(one.low[k], other.low[k]);
        node.high[k] = std::max(one.high[k], other.high[k]);
      }
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      double low = far, high = -far;
      for (int32_t i = node.first; i < node.first + node.count; ++i)
        for (const Vector& corner : triangles_[i].corners) {
          low = std::min(low, corner[k]);
          high = std::max(high, corner[k]);
        }
      node.low[k] = std::nextafter(float(low), -far);
      node.high[k] = std::nextafter(float(high), far);
    }
  }
}

// Halves by the middles of the triangles, across the longest side of their box.
void TriangleTree::build(std::vector<Item>& items, int32_t first, int32_t last) {
  const size_t node = nodes_.size();
  nodes_.push_back({{}, {}, first, last - first});
  if (last - first <= LEAF) return;
  std::array<float, 3> low = items[first].middle, high = low;
  for (int32_t i = first + 1; i < last; ++i)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], items[i].middle[k]);
      high[k] = std::max(high[k], items[i].middle[k]);
    }
  int along = 0;
  for (int k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[along] - low[along]) along = k;
  const int32_t half = first + (last - first) / 2;
  std::nth_element(items.begin() + first, items.begin() + half, items.begin() + last, [along](const Item& a, const Item& b) {
    return a.middle[along] != b.middle[along] ? a.middle[along] < b.middle[along] : a.index < b.index;
  });
  build(items, first, half);
  nodes_[node].first = int32_t(nodes_.size());
  nodes_[node].count = 0;
  build(items, half, last);
}

double TriangleTree::box_squared(const Node& node, const double* point) const {
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double off = std::max({double(node.low[k]) - point[k], point[k] - double(node.high[k]), 0.0});
    square += off * off;
  }
  return square;
}

double TriangleTree::squared_distance(const double* place) const {
  struct Waiting {
    int32_t node;
    double square;
  };
  const Vector point = at(place);
  double best = std::numeric_limits<double>::infinity();
  std::array<Waiting, DEEPEST> waiting;
  int count = 0;
  if (!nodes_.empty()) waiting[count++] = {0, 0.0};
  while (count > 0) {
    const auto [index, square] = waiting[--count];
    if (square >= best) continue;
    const Node& node = nodes_[index];
    if (node.count > 0) {
      for (int32_t i = node.first; i < node.first + node.count; ++i) best = to_triangle(triangles_[i].corners, point, best);
      continue;
    }
    Waiting near{index + 1, box_squared(nodes_[index + 1], place)}, far{node.first, box_squared(nodes_[node.first], place)};
    if (far.square < near.square) std::swap(near, far);
    if (far.square < best) waiting[count++] = far;
    if (near.square < best) waiting[count++] = near;
  }
  return best;
}

int32_t TriangleTree::winding(const double* place) const {
  const Vector point = at(place);
  std::array<int32_t, DEEPEST> waiting;
  int count = 0;
  int32_t sum = 0;
  if (!nodes_.empty()) waiting[count++] = 0;
  while (count > 0) {
    const int32_t index = waiting[--count];
    const Node& node = nodes_[index];
    if (place[0] < node.low[0] || place[0] > node.high[0] || place[1] < node.low[1] || place[1] > node.high[1] ||
        place[2] > node.high[2])
      continue;
    if (node.count > 0) {
      for (int32_t i = node.first; i < node.first + node.count; ++i) sum += passed(triangles_[i].corners, point);
      continue;
    }
    waiting[count++] = node.first;
    waiting[count++] = index + 1;
  }
  return sum;
}

void TriangleTree::squared_distances(const double* points, int64_t count, double* out, int threads) const {
  parallel_for((count + TOGETHER - 1) / TOGETHER, threads, [&](int64_t item) {
    for (int64_t i = item * TOGETHER; i < std::min(count, (item + 1) * TOGETHER); ++i) out[i] = squared_distance(points + 3 * i);
  });
}

void TriangleTree::windings(const double* points, int64_t count, int32_t* out, int threads) const {
  parallel_for((count + TOGETHER - 1) / TOGETHER, threads, [&](int64_t item) {
    for (int64_t i = item * TOGETHER; i < std::min(count, (item + 1) * TOGETHER); ++i) out[i] = winding(points + 3 * i);
  });
}

}  // namespace partwright
