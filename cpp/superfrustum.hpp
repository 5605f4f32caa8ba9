// The SuperFrustum: signed distance and its derivatives with respect to the point and all parameters.
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

// The derivatives come in three steps, each a loop of its own over a block of points: one loop with all of it has
// more control flow than compilers turn into selects. Steps hand over through rows of a scratch array in which
// neighbouring points are STRIDE-1 and rows are `stride` apart.
enum Scratch { LX, LY, LZ, BX, BZ, BX_X, BX_Z, BX_H, BX_THETA, BZ_X, BZ_Z, BZ_H, BZ_THETA,
               Q, Q_DX, Q_DY, GQ, GZ, F_H, F_E, F_TOP, F_BOTTOM, VALUE, SCRATCH_ROWS };

// Step 1. Local coordinates, and the bent coordinates with their derivatives by x, z, h and theta.
PW_INLINE void bend_step(const Part& p, float px, float py, float pz, float* out, int stride) {
  float x, y, z;
  to_local(p, px, py, pz, x, y, z);
  const float az = std::fabs(z), sign_z = std::copysign(1.f, z);
  const float a = p.curvature, k = p.cos_theta, sn = p.sin_theta, hc = p.chord;
  const float s = az * a, c = k - x * a;
  const float length2 = s * s + c * c, length = std::sqrt(length2);
  const float inv_l = 1.f / std::max(length, 1e-6f), inv_l2 = inv_l * inv_l;
  const float phi = angle(s, c);
  const float live = p.h >= MIN_CHORD ? 1.f : 0.f;
  const float rho2 = x * x + z * z - hc * hc;
  const float inv_d = 1.f / (length + 1);
  const float ax = (rho2 * a - 2 * x * k) * inv_d;
  const float a_theta = k / hc, k_theta = -sn;
  const float c_theta = k_theta - x * a_theta, s_theta = az * a_theta;
  const float l_theta = (c * c_theta + s * s_theta) * inv_l;
  const float l_h = (s * az - c * x) * inv_l * p.dcurvature_dh;
  const float ax_theta = (rho2 * a_theta - 2 * x * k_theta - ax * l_theta) * inv_d;
  const float ax_h = (-2 * hc * a * live + rho2 * p.dcurvature_dh - ax * l_h) * inv_d;
  const float az_h = (phi - s * k * inv_l2) / p.theta * live;
  // z' = sinc * z * A with A = atan2(s, c)/s: its derivative by s cancels for small angles; there it is a series.
  const float inv_c = 1.f / std::max(c, 1e-12f), inv_s = 1.f / std::max(s, 1e-12f);
  const float u = s * inv_c, u2 = std::min(u * u, 0.0625f);
  const float series = (((((12.f / 13.f) * u2 - 10.f / 11.f) * u2 + 8.f / 9.f) * u2 - 6.f / 7.f) * u2 + 4.f / 5.f) * u2 - 2.f / 3.f;
  const bool shallow = u < 0.25f;  // c <= 0 makes u huge
  const float near_ratio = atan_ratio(u2) * inv_c, far_ratio = phi * inv_s;
  const float near_slope = u * series * inv_c * inv_c, far_slope = (c * inv_l2 - far_ratio) * inv_s;
  const float ratio = shallow ? near_ratio : far_ratio;
  const float ratio_s = shallow ? near_slope : far_slope;
  const float az_theta = az * (p.dsinc * ratio + p.sinc * (ratio_s * s_theta - inv_l2 * c_theta));
  const float arc_x_x = -c * inv_l, arc_x_z = s * inv_l, arc_z_x = p.sinc * s * inv_l2, arc_z_z = p.sinc * c * inv_l2;
  const float arc_z = phi * p.arc_scale;
  // Beyond the arc the axis goes straight on.
  const float beyond = az - hc;
  const float line_x = beyond * sn - x * k, line_z = hc + x * sn + beyond * k;
  const float line_x_theta = x * sn + beyond * k, line_z_theta = x * k - beyond * sn;
  const float line_x_h = -sn * live, line_z_h = (1 - k) * live;
  const bool arc = phi <= p.theta;
  out[LX * stride] = x;
  out[LY * stride] = y;
  out[LZ * stride] = z;
  out[BX * stride] = arc ? ax : line_x;
  out[BX_X * stride] = arc ? arc_x_x : -k;
  out[BX_Z * stride] = sign_z * (arc ? arc_x_z : sn);
  out[BX_H * stride] = arc ? ax_h : line_x_h;
  out[BX_THETA * stride] = arc ? ax_theta : line_x_theta;
  out[BZ * stride] = sign_z * (arc ? arc_z : line_z);
  out[BZ_X * stride] = sign_z * (arc ? arc_z_x : sn);
  out[BZ_Z * stride] = arc ? arc_z_z : k;
  out[BZ_H * stride] = sign_z * (arc ? az_h : line_z_h);
  out[BZ_THETA * stride] = sign_z * (arc ? az_theta : line_z_theta);
}

// Step 2. Cross-section: distance and its derivatives by the two offsets.
PW_INLINE void section_step(const Part& p, float* s, int stride) {
  const float dx = std::fabs(s[BX * stride]) - p.half_x + p.round_radius;
  const float dy = std::fabs(s[LY * stride]) - p.half_y + p.round_radius;
  const float ox = std::max(dx, 0.f), oy = std::max(dy, 0.f);
  const float corner = std::sqrt(ox * ox + oy * oy), inv = 1.f / std::max(corner, 1e-20f);
  const float to_x = dx > dy ? 1.f : 0.f, round_x = ox * inv, round_y = oy * inv;
  s[Q * stride] = std::min(std::max(dx, dy), 0.f) + corner - p.round_radius;
  s[Q_DX * stride] = corner > 0 ? round_x : to_x;
  s[Q_DY * stride] = corner > 0 ? round_y : 1 - to_x;
}

// Step 3. Profile: the nearest of the four edges gives the direction (gq, gz), and how its two ends move with
// e, the inner corners and h gives the rest.
template <bool HOLLOW>
PW_INLINE void profile_step(const Part& p, float* s, int stride) {
  const float q = s[Q * stride], z = s[BZ * stride];
  const float far = -1e30f;
  const float top_in = HOLLOW ? p.inner_top : far, bottom_in = HOLLOW ? p.inner_bottom : far;
  const float up = z - p.h, down = z + p.h, height = 2 * p.h;
  const float tq = q - std::min(std::max(q, top_in), p.e), bq = q - std::min(std::max(q, bottom_in), 0.f);
  const float so = clamp01((q * p.e + down * height) * p.outer_inverse);
  const float oq = q - so * p.e, oz = down - so * height;
  const float left_of_outer = p.e * down - q * height;
  float inside = std::fabs(z) < p.h ? 1.f : 0.f;
  inside = left_of_outer > 0 ? inside : 0.f;

  // Start with the top edge; a nearer edge replaces all of it. On an edge itself the difference vector has no
  // direction, so the edge's normal stands in for it.
  const float up_side = up >= 0 ? 1.f : -1.f, down_side = down >= 0 ? 1.f : -1.f;
  float d2 = tq * tq + up * up;
  float inv = 1.f / std::sqrt(std::max(d2, 1e-37f));
  float nq = tq * inv, nz = tq == 0 ? up_side : up * inv;
  const float past_e = tq > 0 ? nq : 0.f, past_in = tq < 0 ? nq : 0.f;
  float f_e = -past_e, f_top = -past_in, f_bottom = 0, f_h = -nz;

  const float bottom2 = bq * bq + down * down;
  inv = 1.f / std::sqrt(std::max(bottom2, 1e-37f));
  const float b_nq = bq * inv, b_nz = bq == 0 ? down_side : down * inv;
  const float b_in = bq < 0 ? -b_nq : 0.f;
  const bool bottom = bottom2 < d2;
  nq = bottom ? b_nq : nq;
  nz = bottom ? b_nz : nz;
  f_e = bottom ? 0.f : f_e;
  f_top = bottom ? 0.f : f_top;
  f_bottom = bottom ? b_in : f_bottom;
  f_h = bottom ? b_nz : f_h;
  d2 = std::min(d2, bottom2);

  const float outer2 = oq * oq + oz * oz;
  inv = 1.f / std::sqrt(std::max(outer2, 1e-37f));
  const float outer_side = (left_of_outer > 0 ? -1.f : 1.f) * p.outer_length_inverse;
  const float on_outer = so * (1 - so);
  const float o_nq = on_outer > 0 ? outer_side * height : oq * inv, o_nz = on_outer > 0 ? -outer_side * p.e : oz * inv;
  const bool outer = outer2 < d2;
  nq = outer ? o_nq : nq;
  nz = outer ? o_nz : nz;
  f_e = outer ? -so * o_nq : f_e;
  f_top = outer ? 0.f : f_top;
  f_bottom = outer ? 0.f : f_bottom;
  f_h = outer ? (1 - 2 * so) * o_nz : f_h;
  d2 = std::min(d2, outer2);

  if (HOLLOW) {
    const float rq = q - p.inner_bottom;
    const float si = clamp01((rq * p.inner_run + down * height) * p.inner_inverse);
    const float iq = rq - si * p.inner_run, iz = down - si * height;
    const float right_of_inner = rq * height - p.inner_run * down;
    inside = right_of_inner > 0 ? inside : 0.f;
    const float inner2 = iq * iq + iz * iz;
    inv = 1.f / std::sqrt(std::max(inner2, 1e-37f));
    const float inner_side = (right_of_inner > 0 ? 1.f : -1.f) * p.inner_length_inverse;
    const float on_inner = si * (1 - si);
    const float i_nq = on_inner > 0 ? inner_side * height : iq * inv, i_nz = on_inner > 0 ? -inner_side * p.inner_run : iz * inv;
    const bool inner = inner2 < d2;
    nq = inner ? i_nq : nq;
    nz = inner ? i_nz : nz;
    f_e = inner ? 0.f : f_e;
    f_top = inner ? -si * i_nq : f_top;
    f_bottom = inner ? -(1 - si) * i_nq : f_bottom;
    f_h = inner ? (1 - 2 * si) * i_nz : f_h;
    d2 = std::min(d2, inner2);
  }
  const float side = 1 - 2 * inside;
  s[GQ * stride] = side * nq;
  s[GZ * stride] = side * nz;
  s[F_E * stride] = side * f_e;
  s[F_TOP * stride] = side * f_top;
  s[F_BOTTOM * stride] = side * f_bottom;
  s[F_H * stride] = side * f_h;
  s[VALUE * stride] = side * std::sqrt(d2) - p.dilation;
}

// Step 4. Chain rule into the FIELD_DERIVATIVES.
PW_INLINE void chain_step(const Part& p, const float* s, float* out, int stride) {
  const float x = s[LX * stride], y = s[LY * stride], z = s[LZ * stride];
  const float gq = s[GQ * stride], gz = s[GZ * stride], q_dx = s[Q_DX * stride], q_dy = s[Q_DY * stride];
  const float f_bx = gq * std::copysign(q_dx, s[BX * stride]);
  const float f_round = gq * (q_dx + q_dy - 1);
  const float f_e = s[F_E * stride], f_top = s[F_TOP * stride], f_bottom = s[F_BOTTOM * stride];
  const float f_m = f_e * (p.taper - 1) + f_top * (p.taper * p.onion - 1) + f_bottom * (p.onion - 1) + f_round * p.roundness;
  const float fx = f_bx * s[BX_X * stride] + gz * s[BZ_X * stride];
  const float fy = gq * std::copysign(q_dy, y);
  const float fz = f_bx * s[BX_Z * stride] + gz * s[BZ_Z * stride];
  const float* r = p.to_local;
  out[D_TX * stride] = -(r[0] * fx + r[3] * fy + r[6] * fz);
  out[D_TY * stride] = -(r[1] * fx + r[4] * fy + r[7] * fz);
  out[D_TZ * stride] = -(r[2] * fx + r[5] * fy + r[8] * fz);
  out[D_WX * stride] = fy * z - fz * y;
  out[D_WY * stride] = fz * x - fx * z;
  out[D_WZ * stride] = fx * y - fy * x;
  out[D_SX * stride] = -0.5f * gq * q_dx + p.share_x * f_m;
  out[D_SY * stride] = -0.5f * gq * q_dy + p.share_y * f_m;
  out[D_SZ * stride] = 0.5f * (s[F_H * stride] + f_bx * s[BX_H * stride] + gz * s[BZ_H * stride]);
  out[D_ROUNDNESS * stride] = f_round * p.m;
  out[D_DILATION * stride] = -1.f;
  out[D_TAPER * stride] = p.m * (f_e + f_top * p.onion);
  out[D_BULGE * stride] = HALF_PI * (f_bx * s[BX_THETA * stride] + gz * s[BZ_THETA * stride]);
  out[D_ONION * stride] = p.m * (f_top * p.taper + f_bottom);
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
