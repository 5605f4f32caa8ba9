// The SuperFrustum: its parameters and signed distance (its derivatives: superfrustum_derivatives.hpp).
//
// Everything here is straight-line code with selects instead of branches, so that a loop over points
// vectorises. The slow, readable reference is partwright/fields/reference.py; docs/superfrustum.md explains
// the formula.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#if defined(__GNUC__)
#define PW_INLINE inline __attribute__((always_inline))
#else
#define PW_INLINE inline
#endif

namespace partwright {

// One row of the parameter array: translation, rotation quaternion, size, shape, the blend with which the part joins
// the fold, and whether it is added (+1) or subtracted (-1) there.
#define PW_COLUMNS(NAME)                                                                                          \
  NAME(TX) NAME(TY) NAME(TZ) NAME(QW) NAME(QX) NAME(QY) NAME(QZ) NAME(SX) NAME(SY) NAME(SZ) NAME(ROUNDNESS)       \
  NAME(DILATION) NAME(TAPER) NAME(BULGE) NAME(ONION) NAME(BLEND) NAME(SIGN)

// What a step moves and derivatives are taken with respect to: translation, a local rotation vector w with
// R <- R exp(w), and from the size on the columns themselves, but for the sign.
#define PW_TANGENT(NAME)                                                                                          \
  NAME(TX) NAME(TY) NAME(TZ) NAME(WX) NAME(WY) NAME(WZ) NAME(SX) NAME(SY) NAME(SZ) NAME(ROUNDNESS)                \
  NAME(DILATION) NAME(TAPER) NAME(BULGE) NAME(ONION) NAME(BLEND)

// Python's names come from these two tables, by way of bindings.cpp.
#define PW_COLUMN(name) name,
enum Column { PW_COLUMNS(PW_COLUMN) COLUMNS };
#undef PW_COLUMN

#define PW_DERIVATIVE(name) D_##name,
enum Derivative { PW_TANGENT(PW_DERIVATIVE) DERIVATIVES, FIELD_DERIVATIVES = D_BLEND };
#undef PW_DERIVATIVE

// Below this chord the arc has no direction; the bend treats a shorter chord as this long.
constexpr float MIN_CHORD = 1e-6f;
constexpr float HALF_PI = 1.57079632679489662f;
constexpr float PI = 3.14159265358979324f;

// What depends on the part alone, computed once in double precision.
struct Part {
  float centre[3];
  float to_local[9];  // rows of R^T
  float half_x, half_y, h, m, round_radius, roundness, dilation, taper, onion;
  float theta, sin_theta, cos_theta, curvature, sinc, dsinc, arc_scale, dcurvature_dh;
  float chord;        // h as the bend sees it
  float e, inner_top, inner_bottom;
  float outer_inverse, inner_inverse, outer_length_inverse, inner_length_inverse, inner_run;
  float share_x, share_y;  // dm/dsx and dm/dsy
  float low[3], high[3];   // corners of a box that holds the part, in its frame, but for the dilation
  float blend, sign;
  bool bent, hollow;
};

inline Part prepare(const float* row) {
  Part p;
  double w = row[QW], x = row[QX], y = row[QY], z = row[QZ];
  double n = std::sqrt(w * w + x * x + y * y + z * z);
  w /= n; x /= n; y /= n; z /= n;
  const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                       2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                       2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
  for (int i = 0; i < 3; ++i) {
    p.centre[i] = row[TX + i];
    for (int j = 0; j < 3; ++j) p.to_local[3 * i + j] = float(r[3 * j + i]);
  }
  const double sx = row[SX], sy = row[SY], sz = row[SZ], t = row[TAPER], o = row[ONION];
  const double h = sz / 2, m = std::min(sx, sy) / 2;
  p.half_x = float(sx / 2); p.half_y = float(sy / 2); p.h = float(h); p.m = float(m);
  // m = min(sx, sy)/2; where both are equal each gets half.
  p.share_x = sx < sy ? 0.5f : sx > sy ? 0.f : 0.25f;
  p.share_y = 0.5f - p.share_x;
  p.roundness = row[ROUNDNESS]; p.round_radius = float(row[ROUNDNESS] * m);
  p.dilation = row[DILATION]; p.taper = float(t); p.onion = float(o);
  p.blend = row[BLEND]; p.sign = row[SIGN] < 0 ? -1.f : 1.f;

  const double chord = std::max(h, double(MIN_CHORD));
  const double theta = std::max(double(row[BULGE]) * (PI / 2), 1e-20);
  const double s = std::sin(theta), c = std::cos(theta);
  p.chord = float(chord); p.theta = float(theta); p.sin_theta = float(s); p.cos_theta = float(c);
  p.curvature = float(s / chord);
  p.dcurvature_dh = h >= MIN_CHORD ? float(-s / (chord * chord)) : 0.f;
  p.sinc = float(s / theta);
  p.dsinc = theta > 1e-3 ? float((theta * c - s) / (theta * theta)) : float(-theta / 3);
  p.arc_scale = float(chord / theta);
  p.bent = row[BULGE] > 0;

  p.e = float((t - 1) * m);
  p.inner_top = float(m * (t * o - 1));
  p.inner_bottom = float(m * (o - 1));
  p.hollow = std::max(1.0, t) * m * o > row[DILATION];
  const double run = (t - 1) * m, inner_run = m * o * (t - 1);
  const double outer2 = run * run + sz * sz, inner2 = inner_run * inner_run + sz * sz;
  p.inner_run = float(inner_run);
  // A bend's ends stay where they are, but for their turn; its middle goes towards -x.
  const double wider = std::max(double(p.e), 0.0), x_most = sx / 2 + wider, y_most = sy / 2 + wider;
  const double aside = p.bent ? h * std::tan(theta / 2) : 0, along = p.bent ? h + x_most * s : h;
  const double low[3] = {-x_most - aside, -y_most, -along}, high[3] = {x_most, y_most, along};
  for (int i = 0; i < 3; ++i) {
    p.low[i] = float(low[i]);
    p.high[i] = float(high[i]);
  }
  p.outer_inverse = float(1 / std::max(outer2, 1e-30));
  p.inner_inverse = float(1 / std::max(inner2, 1e-30));
  p.outer_length_inverse = float(1 / std::sqrt(std::max(outer2, 1e-30)));
  p.inner_length_inverse = float(1 / std::sqrt(std::max(inner2, 1e-30)));
  return p;
}

// The largest bulge of a part of these sx and sz: an arc tighter than half the section's width folds through its
// own centre.
inline float tightest_bulge(float width, float height) {
  return std::asin(std::min(1.f, height / std::max(width, 1e-6f))) / HALF_PI;
}

// The sum of two numbers that are not negative, and a number less another: of products, which are rounded first and not
// fused with the sum, as another use of each forbids. Values are then the same to the bit whether or not a compiler
// takes least and greatest numbers as one instruction (values.cpp).
PW_INLINE float sum_of(float a, float b) { return std::max(std::max(a + b, a), b); }
PW_INLINE float less(float a, float b) { return std::min(a - b, std::max(b, 1e30f)); }

PW_INLINE float clamp01(float v) { return std::min(std::max(v, 0.f), 1.f); }

// atan(t)/t as a polynomial in t^2 on [0, 1]; relative error 1.5e-8, so small angles keep their digits.
PW_INLINE float atan_ratio(float t2) {
  float p = 0.00284988575f;
  p = p * t2 - 0.0160686135f;
  p = p * t2 + 0.0426914943f;
  p = p * t2 - 0.0750429243f;
  p = p * t2 + 0.10640933f;
  p = p * t2 - 0.142036442f;
  p = p * t2 + 0.199926194f;
  p = p * t2 - 0.333330733f;
  return p * t2 + 0.999999985f;
}

// atan2(s, c) for s >= 0.
PW_INLINE float angle(float s, float c) {
  const float a = std::fabs(c);
  const float big = std::max(std::max(a, s), 1e-30f), small = std::min(a, s);
  const float t = small / big;
  float r = t * atan_ratio(t * t);
  r = s > a ? HALF_PI - r : r;
  return c < 0 ? PI - r : r;
}

PW_INLINE void to_local(const Part& p, float px, float py, float pz, float& x, float& y, float& z) {
  const float dx = px - p.centre[0], dy = py - p.centre[1], dz = pz - p.centre[2];
  x = p.to_local[0] * dx + p.to_local[1] * dy + p.to_local[2] * dz;
  y = p.to_local[3] * dx + p.to_local[4] * dy + p.to_local[5] * dz;
  z = p.to_local[6] * dx + p.to_local[7] * dy + p.to_local[8] * dz;
}

// Distance to the rounded cross-section.
PW_INLINE float cross_section(const Part& p, float x, float y) {
  const float dx = std::fabs(x) - p.half_x + p.round_radius;
  const float dy = std::fabs(y) - p.half_y + p.round_radius;
  const float ox = std::max(dx, 0.f), oy = std::max(dy, 0.f);
  return std::min(std::max(dx, dy), 0.f) + std::sqrt(sum_of(ox * ox, oy * oy)) - p.round_radius;
}

// Signed distance to the profile quad in the (q, z) plane; a closed hole has no inner edge.
template <bool HOLLOW>
PW_INLINE float profile(const Part& p, float q, float z) {
  const float far = -1e30f;
  const float top_in = HOLLOW ? p.inner_top : far, bottom_in = HOLLOW ? p.inner_bottom : far;
  const float up = z - p.h, down = z + p.h, height = 2 * p.h;
  const float tq = q - std::min(std::max(q, top_in), p.e);
  const float bq = q - std::min(std::max(q, bottom_in), 0.f);
  float d2 = std::min(tq * tq + up * up, bq * bq + down * down);
  const float so = clamp01((q * p.e + down * height) * p.outer_inverse);
  const float oq = less(q, so * p.e), oz = less(down, so * height);
  d2 = std::min(d2, oq * oq + oz * oz);
  bool inside = (std::fabs(z) < p.h) & (q * height < p.e * down);
  if (HOLLOW) {
    const float rq = q - p.inner_bottom;
    const float si = clamp01((rq * p.inner_run + down * height) * p.inner_inverse);
    const float iq = less(rq, si * p.inner_run), iz = less(down, si * height);
    d2 = std::min(d2, iq * iq + iz * iz);
    inside = inside & (rq * height > p.inner_run * down);
  }
  const float d = std::sqrt(d2);
  return inside ? -d : d;
}

template <bool BENT, bool HOLLOW>
PW_INLINE float value(const Part& p, float px, float py, float pz) {
  float x, y, z;
  to_local(p, px, py, pz, x, y, z);
  if (BENT) {
    const float az = std::fabs(z);
    const float s = az * p.curvature, c = p.cos_theta - x * p.curvature;
    const float length = std::sqrt(s * s + c * c);
    const float phi = angle(s, c);
    const float arc_x = ((x * x + z * z - p.chord * p.chord) * p.curvature - 2 * x * p.cos_theta) / (length + 1);
    const float arc_z = phi * p.arc_scale;
    const float beyond = az - p.chord;
    const float line_x = beyond * p.sin_theta - x * p.cos_theta;
    const float line_z = p.chord + x * p.sin_theta + beyond * p.cos_theta;
    const bool arc = phi <= p.theta;
    x = arc ? arc_x : line_x;
    z = std::copysign(1.f, z) * (arc ? arc_z : line_z);
  }
  return profile<HOLLOW>(p, cross_section(p, x, y), z) - p.dilation;
}

// Polynomial smooth minimum of a fold so far and the next part, as weights: dU/da = w, dU/db = 1 - w. The blend
// comes with sharpness = 1/(2k); a plain minimum is one so sharp that w is 0 or 1 (1/2 where both are equal).
inline float sharpness(float k) { return k > 1e-9f ? 0.5f / k : 1e30f; }

PW_INLINE float smooth_weight(float a, float b, float sharpness) { return clamp01(0.5f + (b - a) * sharpness); }

// Where b is no nearer than the blend, a itself and not its roundings: a part that is too far to be felt may then be
// left out to the bit.
PW_INLINE float smooth_minimum(float a, float b, float k, float w) {
  return w < 1 ? b + (a - b) * w - k * w * (1 - w) : a;
}

}  // namespace partwright
