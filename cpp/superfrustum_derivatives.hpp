// The SuperFrustum's derivatives with respect to the point and all parameters: straight-line code, as its value.
#pragma once

#include "superfrustum.hpp"

namespace partwright {

// They come in four steps, each a loop of its own over a block of points: one loop with all of it has
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

}  // namespace partwright
