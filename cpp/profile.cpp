#include "profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel.hpp"

namespace partwright {
namespace {

constexpr double STRAIGHT = 1e-9;  // a bulge that is smaller is none
constexpr int64_t BATCH = 1024;    // points of one work item

struct Nearest {
  double distance;   // without sign
  int64_t side;
  double along;      // of a straight side, from its beginning to its end; of an arc -1, or 0 and 1 at its ends
};

double squared(double x, double y) { return x * x + y * y; }

Nearest nearest_of(const Outline& outline, double x, double y) {
  Nearest best{std::numeric_limits<double>::infinity(), -1, 0};
  for (size_t k = 0; k < outline.sides.size(); ++k) {
    const Side& s = outline.sides[k];
    if (!s.counts) continue;
    double distance, along;
    const double px = x - s.cx, py = y - s.cy;
    if (s.radius == 0) {
      const double dx = s.bx - s.ax, dy = s.by - s.ay;
      along = std::clamp(((x - s.ax) * dx + (y - s.ay) * dy) / squared(dx, dy), 0.0, 1.0);
      distance = std::sqrt(squared(x - s.ax - along * dx, y - s.ay - along * dy));
    } else {
      const double reach = std::sqrt(squared(px, py));
      if (px * s.mx + py * s.my >= reach * s.cosine) {
        along = -1;
        distance = std::abs(reach - s.radius);
      } else {
        const double begin = squared(x - s.ax, y - s.ay), end = squared(x - s.bx, y - s.by);
        along = begin <= end ? 0 : 1;
        distance = std::sqrt(std::min(begin, end));
      }
    }
    if (distance < best.distance) best = {distance, int64_t(k), along};
  }
  return best;
}

// By the pieces that a ray towards +x meets.
bool is_inside(const Outline& outline, double x, double y) {
  bool inside = false;
  for (const Piece& p : outline.pieces) {
    if (!(p.low <= y && y < p.high)) continue;
    bool meets;
    if (p.square == 0)
      meets = x < p.ax + (y - p.ay) * (p.bx - p.ax) / (p.by - p.ay);
    else if (p.right)
      meets = x < p.cx || squared(x - p.cx, y - p.cy) < p.square;
    else
      meets = x < p.cx && squared(x - p.cx, y - p.cy) > p.square;
    inside ^= meets;
  }
  return inside;
}

void add_straight(Outline& outline, double ax, double ay, double bx, double by) {
  if (ay == by) return;
  outline.pieces.push_back({std::min(ay, by), std::max(ay, by), ax, ay, bx, by, 0, 0, 0, false});
}

// The arc cut at its highest and lowest points.
void add_arc(Outline& outline, const Side& s) {
  const double turn = 4 * std::atan(s.bulge), start = std::atan2(s.ay - s.cy, s.ax - s.cx), end = start + turn;
  const double half = std::acos(-1.0) / 2, low = std::min(start, end), high = std::max(start, end);
  std::vector<double> cuts{low};
  for (int k = int(std::ceil((low - half) / (2 * half))); half + 2 * half * k < high; ++k) {
    const double at = half + 2 * half * k;
    if (at > low) cuts.push_back(at);
  }
  cuts.push_back(high);
  // Ends are the very corners: pieces that meet there have to agree on its height.
  const double first = start < end ? s.ay : s.by, last = start < end ? s.by : s.ay;
  double y = first;
  for (size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double middle = (cuts[i] + cuts[i + 1]) / 2;
    const double next = i + 2 == cuts.size() ? last : s.cy + s.radius * (std::sin(cuts[i + 1]) > 0 ? 1 : -1);
    if (y != next)
      outline.pieces.push_back({std::min(y, next), std::max(y, next), 0, 0, 0, 0, s.cx, s.cy, s.radius * s.radius,
                                std::cos(middle) > 0});
    y = next;
  }
}

}  // namespace

Outline outline_of(const double* corners, const std::vector<int64_t>& starts, const uint8_t* counts) {
  Outline result;
  for (size_t loop = 0; loop + 1 < starts.size(); ++loop)
    for (int64_t i = starts[loop]; i < starts[loop + 1]; ++i) {
      const int64_t j = i + 1 < starts[loop + 1] ? i + 1 : starts[loop];
      const double *a = corners + 3 * i, *b = corners + 3 * j;
      Side s{a[0], a[1], b[0], b[1], a[2], 0, 0, 0, 0, 0, 0, i, j, counts[i] != 0};
      if (std::abs(s.bulge) > STRAIGHT) {
        const double vx = (s.bx - s.ax) / 2, vy = (s.by - s.ay) / 2, k = (1 - s.bulge * s.bulge) / (2 * s.bulge);
        const double half = std::sqrt(squared(vx, vy)), side = s.bulge > 0 ? 1 : -1;
        s.cx = (s.ax + s.bx) / 2 - k * vy;
        s.cy = (s.ay + s.by) / 2 + k * vx;
        s.radius = half * (1 + s.bulge * s.bulge) / (2 * std::abs(s.bulge));
        s.mx = side * vy / half;
        s.my = -side * vx / half;
        s.cosine = std::cos(2 * std::atan(std::abs(s.bulge)));
        add_arc(result, s);
      } else {
        add_straight(result, s.ax, s.ay, s.bx, s.by);
      }
      result.sides.push_back(s);
    }
  return result;
}

void profile_distances(const Outline& outline, const double* points, int64_t count, double* out, int threads) {
  parallel_for((count + BATCH - 1) / BATCH, threads, [&](int64_t item) {
    for (int64_t i = item * BATCH; i < std::min(count, (item + 1) * BATCH); ++i) {
      const double x = points[2 * i], y = points[2 * i + 1], d = nearest_of(outline, x, y).distance;
      out[i] = is_inside(outline, x, y) ? -d : d;
    }
  });
}

void profile_gradients(const Outline& outline, const double* points, const double* upstream, int64_t count,
                       int64_t corners, double* out, double* by_point, int threads) {
  const int64_t items = (count + BATCH - 1) / BATCH;
  std::vector<double> sums(size_t(items * corners * 3), 0.0);
  parallel_for(items, threads, [&](int64_t item) {
    double* total = sums.data() + item * corners * 3;
    for (int64_t i = item * BATCH; i < std::min(count, (item + 1) * BATCH); ++i) {
      const double x = points[2 * i], y = points[2 * i + 1];
      const Nearest near = nearest_of(outline, x, y);
      const double sign = is_inside(outline, x, y) ? -1 : 1;
      double nx = 0, ny = 0;  // of the distance without sign, by the point
      if (near.side >= 0) {
        const Side& s = outline.sides[size_t(near.side)];
        double *a = total + 3 * s.first, *b = total + 3 * s.last;
        const double w = sign * upstream[i];
        if (near.along >= 0) {
          const double fx = s.ax + near.along * (s.bx - s.ax), fy = s.ay + near.along * (s.by - s.ay);
          if (near.distance > 0) nx = (x - fx) / near.distance, ny = (y - fy) / near.distance;
          a[0] -= w * (1 - near.along) * nx;
          a[1] -= w * (1 - near.along) * ny;
          b[0] -= w * near.along * nx;
          b[1] -= w * near.along * ny;
        } else {
          const double reach = std::sqrt(squared(x - s.cx, y - s.cy)), out_ = reach > s.radius ? 1 : -1;
          if (reach > 0) nx = out_ * (x - s.cx) / reach, ny = out_ * (y - s.cy) / reach;
          // d = out (|p - c| - r): by way of the centre and of the radius.
          const double bulge = s.bulge, k = (1 - bulge * bulge) / (2 * bulge), dk = -(1 + bulge * bulge) / (2 * bulge * bulge);
          const double vx = (s.bx - s.ax) / 2, vy = (s.by - s.ay) / 2, half = std::sqrt(squared(vx, vy));
          const double grow = (1 + bulge * bulge) / (2 * std::abs(bulge)), side = bulge > 0 ? 1 : -1;
          const double rx = -out_ * grow * vx / (2 * half), ry = -out_ * grow * vy / (2 * half);
          const double tx = -k * ny / 2, ty = k * nx / 2;  // what (b - a) / 2 turned does to the centre
          a[0] += w * (-nx / 2 - tx - rx);
          a[1] += w * (-ny / 2 - ty - ry);
          b[0] += w * (-nx / 2 + tx + rx);
          b[1] += w * (-ny / 2 + ty + ry);
          a[2] += w * (dk * (nx * vy - ny * vx) - out_ * half * side * (bulge * bulge - 1) / (2 * bulge * bulge));
        }
      }
      by_point[2 * i] = sign * nx;
      by_point[2 * i + 1] = sign * ny;
    }
  });
  std::fill(out, out + corners * 3, 0.0);
  for (int64_t item = 0; item < items; ++item)
    for (int64_t j = 0; j < corners * 3; ++j) out[j] += sums[size_t(item * corners * 3 + j)];
}

}  // namespace partwright
