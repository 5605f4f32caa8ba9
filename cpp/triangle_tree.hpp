// Triangles in a tree of boxes: how far from them points are, and how often they wind around points, in double precision.
// shapes/distance.py is its face.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace partwright {

class TriangleTree {
 public:
  // Of corners (V, 3) and triangles (F, 3) of them, F > 0.
  TriangleTree(const double* vertices, const int64_t* faces, int64_t count);

  // Squared distance of points (count, 3) to the nearest triangle.
  void squared_distances(const double* points, int64_t count, double* out, int threads) const;

  // How often the triangles, which have no open edge, wind around points (count, 3): an exact whole number, whatever slivers
  // they have. It is counted upwards from the point as shapes/winding.py does for grids.
  void windings(const double* points, int64_t count, int32_t* out, int threads) const;

 private:
  struct Triangle {
    std::array<std::array<double, 3>, 3> corners;
  };
  // Rounded outwards. A leaf holds triangles `first` to `first + count`; of another node the one child is the next node, and
  // `first` the other one.
  struct Node {
    std::array<float, 3> low, high;
    int32_t first, count;
  };
  struct Item;

  void build(std::vector<Item>& items, int32_t first, int32_t last);
  double box_squared(const Node& node, const double* point) const;
  double squared_distance(const double* point) const;
  int32_t winding(const double* point) const;

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace partwright
