#include "chains.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace partwright {

namespace {

constexpr double SAME = 1e-9, ON_A_LINE = 1e-12;

}  // namespace

Circle circle_through(const double* points, int64_t count) {
  double mx = 0, my = 0;
  for (int64_t i = 0; i < count; ++i) mx += points[2 * i], my += points[2 * i + 1];
  mx /= count, my /= count;
  double xx = 0, xy = 0, yy = 0, px = 0, py = 0;
  for (int64_t i = 0; i < count; ++i) {
    const double x = points[2 * i] - mx, y = points[2 * i + 1] - my, square = x * x + y * y;
    xx += x * x, xy += x * y, yy += y * y, px += x * square, py += y * square;
  }
  const double determinant = xx * yy - xy * xy, infinity = std::numeric_limits<double>::infinity();
  if (determinant <= ON_A_LINE * (xx + yy) * (xx + yy)) return {mx, my, infinity, infinity};
  const double cx = (yy * px - xy * py) / (2 * determinant), cy = (xx * py - xy * px) / (2 * determinant);
  const double radius = std::sqrt((xx + yy) / count + cx * cx + cy * cy);
  double off = 0;
  for (int64_t i = 0; i < count; ++i) {
    const double x = points[2 * i] - mx - cx, y = points[2 * i + 1] - my - cy;
    off = std::max(off, std::abs(std::sqrt(x * x + y * y) - radius));
  }
  return {mx + cx, my + cy, radius, off};
}

std::vector<int64_t> open_line(const double* points, int64_t count, double tolerance) {
  if (count < 2) return std::vector<int64_t>(count, 0);
  std::vector<int64_t> kept{0, count - 1};
  std::vector<std::pair<int64_t, int64_t>> left{{0, count - 1}};
  while (!left.empty()) {
    const auto [a, b] = left.back();
    left.pop_back();
    const double ax = points[2 * a], ay = points[2 * a + 1], wx = points[2 * b] - ax, wy = points[2 * b + 1] - ay;
    const double length = wx * wx + wy * wy;
    double farthest = tolerance * tolerance;
    int64_t worst = -1;
    for (int64_t i = a + 1; i < b; ++i) {
      double x = points[2 * i] - ax, y = points[2 * i + 1] - ay;
      const double share = length > SAME * SAME ? std::clamp((x * wx + y * wy) / length, 0.0, 1.0) : 0.0;
      x -= share * wx, y -= share * wy;
      if (x * x + y * y > farthest) farthest = x * x + y * y, worst = i;
    }
    if (worst < 0) continue;
    kept.push_back(worst);
    left.push_back({a, worst});
    left.push_back({worst, b});
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace partwright
