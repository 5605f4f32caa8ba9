#include "hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace partwright {
namespace {

constexpr int BITS = 38;              // of the grid along the longest side: differences of its points are exact
constexpr double NEAR = 0x1p4;        // of the grid, 1e-10 of the size: points no farther out of the hull than this are let be
constexpr double ROUNDING = 2e-15;    // of the sum of magnitudes: more than rounding can do to a determinant

using Place = std::array<double, 3>;

Place minus(const Place& a, const Place& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double dot(const Place& a, const Place& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Place cross(const Place& a, const Place& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A sum of doubles without rounding (Shewchuk 1997): components that do not overlap, the smallest first.
class ExactSum {
 public:
  void add(double value) {
    for (int i = 0; i < count_; ++i) {
      const double sum = value + terms_[i], other = sum - value;
      terms_[i] = (value - (sum - other)) + (terms_[i] - other);
      value = sum;
    }
    terms_[count_++] = value;
  }
  void add_product(double a, double b, double c) {
    const double high = a * b, low = std::fma(a, b, -high);
    for (double part : {high, low}) {
      const double product = part * c;
      add(std::fma(part, c, -product));
      add(product);
    }
  }
  int sign() const {
    for (int i = count_; i-- > 0;)
      if (terms_[i] != 0) return terms_[i] > 0 ? 1 : -1;
    return 0;
  }

 private:
  double terms_[24];
  int count_ = 0;
};

int exact_sign(const Place& a, const Place& b, const Place& c) {
  ExactSum sum;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    sum.add_product(a[j], b[k], c[i]);
    sum.add_product(-a[k], b[j], c[i]);
  }
  return sum.sign();
}

struct Face {
  std::array<int, 3> corner, next;  // next: the face beyond the side from each corner to the one after it
  Place place, first, second;       // a corner, and the sides from it
  Place normal, bound;              // not of unit length; bound: the sum of magnitudes that each component is of
  double length;                    // of the normal
  int outside = -1, farthest = -1;  // a list of the points above it, and the farthest of them
  double reach = 0;                 // how far that is
  int visit = -1;
  bool gone = false;
};

// Quickhull (Barber, Dobkin and Huhdanpaa 1996) over points of an integer grid.
class Quickhull {
 public:
  // near: how far out of the hull points may stay.
  Quickhull(std::vector<Place> points, double near)
      : points_(std::move(points)), near_(near), after_(points_.size(), -1), start_(points_.size(), -1) {}

  bool run() {
    if (!simplex()) return false;
    do {
      while (!waiting_.empty()) {
        const int face = waiting_.back();
        waiting_.pop_back();
        if (!faces_[face].gone && faces_[face].reach > near_) raise(face);
      }
    } while (overlooked());
    return true;
  }

  std::vector<std::array<int64_t, 3>> faces() const {
    std::vector<std::array<int64_t, 3>> found;
    for (const Face& face : faces_)
      if (!face.gone) found.push_back({face.corner[0], face.corner[1], face.corner[2]});
    return found;
  }

  double volume() const {
    double six = 0;
    for (const Face& face : faces_)
      if (!face.gone) six += dot(face.normal, minus(face.place, middle_));
    return six / 6;
  }

  // Corners where at least three flat faces meet.
  std::vector<int64_t> extreme() const {
    std::vector<int> flat(faces_.size());
    std::iota(flat.begin(), flat.end(), 0);
    const auto root = [&flat](int face) {
      while (flat[face] != face) face = flat[face] = flat[flat[face]];
      return face;
    };
    for (size_t f = 0; f < faces_.size(); ++f) {
      if (faces_[f].gone) continue;
      for (int other : faces_[f].next)
        for (int corner : faces_[other].corner)
          if (other < int(f) && corner != faces_[f].corner[0] && corner != faces_[f].corner[1] && corner != faces_[f].corner[2] &&
              above(faces_[f], corner) == 0)
            flat[root(other)] = root(int(f));
    }
    std::vector<std::array<int, 3>> met(points_.size(), {-1, -1, -1});
    for (size_t f = 0; f < faces_.size(); ++f) {
      if (faces_[f].gone) continue;
      for (int corner : faces_[f].corner)
        for (int& one : met[corner]) {
          if (one == root(int(f))) break;
          if (one < 0) {
            one = root(int(f));
            break;
          }
        }
    }
    std::vector<int64_t> found;
    for (size_t i = 0; i < met.size(); ++i)
      if (met[i][2] >= 0) found.push_back(int64_t(i));
    return found;
  }

 private:
  // Above 0 for points outside of the face's plane, 0 in it: as far as the sign goes, exact.
  double above(const Face& face, int point) const {
    const Place from = minus(points_[point], face.place);
    const double height = dot(face.normal, from);
    const double most = ROUNDING * (face.bound[0] * std::abs(from[0]) + face.bound[1] * std::abs(from[1]) +
                                    face.bound[2] * std::abs(from[2]));
    if (std::abs(height) > most || most == 0) return height;
    return exact_sign(face.first, face.second, from);
  }

  int add_face(int a, int b, int c) {
    Face face;
    face.corner = {a, b, c};
    face.place = points_[a];
    face.first = minus(points_[b], face.place);
    face.second = minus(points_[c], face.place);
    face.normal = cross(face.first, face.second);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      face.bound[i] = std::abs(face.first[j] * face.second[k]) + std::abs(face.first[k] * face.second[j]);
    }
    face.length = std::sqrt(dot(face.normal, face.normal));
    faces_.push_back(face);
    return int(faces_.size()) - 1;
  }

  bool simplex() {
    const int count = int(points_.size());
    if (count < 4) return false;
    std::array<int, 4> base{};
    std::array<int, 6> ends{};
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < 3; ++k) {
        if (points_[i][k] < points_[ends[2 * k]][k]) ends[2 * k] = i;
        if (points_[i][k] > points_[ends[2 * k + 1]][k]) ends[2 * k + 1] = i;
      }
    double best = 0;
    for (int a : ends)
      for (int b : ends) {
        const Place along = minus(points_[b], points_[a]);
        if (dot(along, along) > best) best = dot(along, along), base[0] = a, base[1] = b;
      }
    if (best == 0) return false;
    const Place along = minus(points_[base[1]], points_[base[0]]);
    best = 0;
    for (int i = 0; i < count; ++i) {
      const Place across = cross(along, minus(points_[i], points_[base[0]]));
      if (dot(across, across) > best) best = dot(across, across), base[2] = i;
    }
    if (best == 0) return false;
    const int face = add_face(base[0], base[1], base[2]);
    best = 0;
    for (int i = 0; i < count; ++i) {
      const double height = std::abs(above(faces_[face], i));
      if (height > best) best = height, base[3] = i;
    }
    if (best == 0) return false;
    if (above(faces_[face], base[3]) > 0) std::swap(base[1], base[2]);
    faces_.clear();
    const auto [a, b, c, d] = base;
    add_face(a, b, c), add_face(a, d, b), add_face(b, d, c), add_face(c, d, a);
    const std::array<int, 3> next[4] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
    for (int f = 0; f < 4; ++f) faces_[f].next = next[f];
    for (int k = 0; k < 3; ++k) middle_[k] = (points_[a][k] + points_[b][k] + points_[c][k] + points_[d][k]) / 4;
    for (int i = 0; i < count; ++i) assign(i, 0);
    for (int f = 0; f < 4; ++f) waiting_.push_back(f);
    return true;
  }

  // Into the list of a face that it is above, of those from `first` on; out of sight where there is none.
  void assign(int point, int first) {
    for (int f = first; f < int(faces_.size()); ++f) {
      const double height = above(faces_[f], point);
      if (height > 0) return list(point, f, height / faces_[f].length);
    }
  }

  // Points that are near to the face in whose list they are may be farther out of another one.
  bool overlooked() {
    if (near_ == 0) return false;
    std::vector<int> left;
    for (Face& face : faces_) {
      if (face.gone) continue;
      for (int point = face.outside; point >= 0; point = after_[point]) left.push_back(point);
      face.outside = face.farthest = -1;
      face.reach = 0;
    }
    for (int point : left) {
      int most = -1;
      double reach = 0;
      for (int f = 0; f < int(faces_.size()); ++f) {
        if (faces_[f].gone) continue;
        const double height = above(faces_[f], point) / faces_[f].length;
        if (height > reach) most = f, reach = height;
      }
      if (most < 0) continue;
      list(point, most, reach);
      if (reach > near_) waiting_.push_back(most);
    }
    return !waiting_.empty();
  }

  void list(int point, int at, double height) {
    Face& face = faces_[at];
    after_[point] = face.outside;
    face.outside = point;
    if (height > face.reach) face.farthest = point, face.reach = height;
  }

  // What the farthest point of a face sees goes, and faces from the edge of that to the point come.
  void raise(int from) {
    const int eye = faces_[from].farthest;
    visible_.assign(1, from);
    faces_[from].visit = eye;
    edge_.clear();
    for (size_t i = 0; i < visible_.size(); ++i) {
      const int at = visible_[i];
      for (int k = 0; k < 3; ++k) {
        const int other = faces_[at].next[k];
        if (faces_[other].visit == eye) continue;
        if (above(faces_[other], eye) > 0) {
          faces_[other].visit = eye;
          visible_.push_back(other);
        } else {
          edge_.push_back({faces_[at].corner[k], faces_[at].corner[(k + 1) % 3], other});
        }
      }
    }
    const int first = int(faces_.size());
    for (const auto& [a, b, other] : edge_) {
      const int fresh = add_face(a, b, eye);
      faces_[fresh].next[0] = other;
      for (int k = 0; k < 3; ++k)
        if (faces_[other].corner[k] == b && faces_[other].corner[(k + 1) % 3] == a) faces_[other].next[k] = fresh;
      start_[a] = fresh;
      waiting_.push_back(fresh);
    }
    for (size_t i = 0; i < edge_.size(); ++i) {
      const int fresh = first + int(i), following = start_[edge_[i][1]];
      faces_[fresh].next[1] = following;
      faces_[following].next[2] = fresh;
    }
    for (int gone : visible_) {
      faces_[gone].gone = true;
      for (int point = faces_[gone].outside; point >= 0;) {
        const int following = after_[point];
        if (point != eye) assign(point, first);
        point = following;
      }
    }
  }

  std::vector<Place> points_;
  double near_;
  std::vector<int> after_, start_, waiting_, visible_;
  std::vector<std::array<int, 3>> edge_;
  std::vector<Face> faces_;
  Place middle_{};
};

struct Grid {
  Place lower;
  double scale;

  Place moved(const double* p) const {
    return {std::rint((p[0] - lower[0]) * scale), std::rint((p[1] - lower[1]) * scale), std::rint((p[2] - lower[2]) * scale)};
  }
};

// scale: 0 where all points are one
Grid grid_of(const double* points, int64_t count) {
  Place lower, upper;
  lower.fill(std::numeric_limits<double>::infinity());
  upper.fill(-std::numeric_limits<double>::infinity());
  for (int64_t i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], points[3 * i + k]);
      upper[k] = std::max(upper[k], points[3 * i + k]);
    }
  const double size = std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]});
  return {lower, size > 0 ? std::ldexp(1.0, BITS - 1 - std::ilogb(size)) : 0.0};
}

double hull_volume(const std::vector<double>& points) {
  return convex_hull(points.data(), int64_t(points.size() / 3), false).volume;
}

}  // namespace

Hull convex_hull(const double* points, int64_t count, bool plain) {
  if (count < 4) return {};
  const Grid grid = grid_of(points, count);
  if (grid.scale == 0) return {};
  std::vector<Place> moved(count);
  for (int64_t i = 0; i < count; ++i) moved[i] = grid.moved(points + 3 * i);
  Quickhull hull(moved, plain ? NEAR : 0);
  if (!hull.run()) return {};
  Hull found{hull.faces(), hull.volume() / std::pow(grid.scale, 3)};
  if (plain) {
    const std::vector<int64_t> extreme = hull.extreme();
    std::vector<Place> kept(extreme.size());
    for (size_t i = 0; i < kept.size(); ++i) kept[i] = moved[extreme[i]];
    Quickhull plainer(std::move(kept), 0);
    plainer.run();
    found.faces = plainer.faces();
    for (auto& face : found.faces)
      for (int64_t& corner : face) corner = extreme[corner];
  }
  return found;
}

void split_hull_volumes(const Mesh& mesh, const double* planes, int64_t count, double slack, double* out) {
  std::vector<double> height(mesh.vertex_count), between;
  std::vector<char> above(mesh.vertex_count), below(mesh.vertex_count);
  std::vector<double> sides[2];
  for (int64_t p = 0; p < count; ++p) {
    const double* plane = planes + 4 * p;
    double highest = -std::numeric_limits<double>::infinity(), lowest = -highest;
    for (int64_t i = 0; i < mesh.vertex_count; ++i) {
      const double* v = mesh.vertices + 3 * i;
      height[i] = v[0] * plane[0] + v[1] * plane[1] + v[2] * plane[2] - plane[3];
      highest = std::max(highest, height[i]);
      lowest = std::min(lowest, height[i]);
    }
    if (highest < slack || lowest > -slack) {
      out[p] = std::numeric_limits<double>::infinity();
      continue;
    }
    // Of what lies in the plane, each side has the corners of its own triangles.
    std::fill(above.begin(), above.end(), 0);
    std::fill(below.begin(), below.end(), 0);
    for (int64_t f = 0; f < mesh.face_count; ++f) {
      const int64_t* corner = mesh.faces + 3 * f;
      const double top = std::max({height[corner[0]], height[corner[1]], height[corner[2]]});
      const double bottom = std::min({height[corner[0]], height[corner[1]], height[corner[2]]});
      for (int k = 0; k < 3; ++k) {
        if (top > slack) above[corner[k]] = 1;
        if (bottom < -slack) below[corner[k]] = 1;
      }
    }
    for (auto& side : sides) side.clear();
    for (int64_t i = 0; i < mesh.vertex_count; ++i) {
      const double* v = mesh.vertices + 3 * i;
      if (above[i] && height[i] >= -slack) sides[0].insert(sides[0].end(), v, v + 3);
      if (below[i] && height[i] <= slack) sides[1].insert(sides[1].end(), v, v + 3);
    }
    for (int64_t e = 0; e < mesh.edge_count; ++e) {
      const int64_t a = mesh.edges[2 * e], b = mesh.edges[2 * e + 1];
      if (height[a] * height[b] >= 0) continue;
      const double share = height[a] / (height[a] - height[b]);
      for (int k = 0; k < 3; ++k) {
        const double from = mesh.vertices[3 * a + k], to = mesh.vertices[3 * b + k];
        for (auto& side : sides) side.push_back(from + share * (to - from));
      }
    }
    out[p] = hull_volume(sides[0]) + hull_volume(sides[1]);
  }
}

}  // namespace partwright
