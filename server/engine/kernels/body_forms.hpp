// Part of the kernel body: the constants of one line and of one splat of a brick.
#pragma once

#include "server/engine/kernels/body_prepare.hpp"

namespace windsplat::engine::kernels {
namespace {

inline Ribbon ribbon_at(const LineStyle& line, const Ribbons& r, int l) {
  Ribbon out = {r.x[l],
                r.y[l],
                r.ux[l],
                r.uy[l],
                r.wx[l],
                r.wy[l],
                r.w0[l],
                r.depth_ratio[l],
                r.bend[l],
                {r.tail[l][0], r.tail[l][1], r.tail[l][2]},
                {r.rise[l][0], r.rise[l][1], r.rise[l][2]},
                r.depth[l],
                r.depth_rise[l],
                0,
                0,
                0,
                0,
                0,
                0,
                1,
                0,
                1,
                &line};
  const int style = style_of(line);
  if (style == style_chain || line.moving != 0) {
    out.phase = r.phase[l];
    out.phase_rise = r.phase_rise[l];
  }
  if (style == style_chain) {
    out.cut_x = r.cut_x[l];
    out.cut_y = r.cut_y[l];
    out.end_x = r.end_x[l];
    out.end_y = r.end_y[l];
    out.end_most = r.end_most[l];
    out.whole = r.whole[l];
    out.whole_rise = r.whole_rise[l];
  }
  return out;
}

inline NearForm near_form_at(const Prepared& p, int l) {
  const NearSplats& s = p.near_splats;
  NearForm out = {};
  out.x = p.middle_x;
  out.y = p.middle_y;
  for (int a = 0; a < 3; ++a) {
    out.centre[a] = s.centre[a][l];
    out.ahead[a] = s.ahead[a][l];
    out.right[a] = s.right[a][l];
    out.down[a] = s.down[a][l];
  }
  out.d2_least = p.splats.d2_least[l];
  return out;
}

template <bool Perspective>
inline SplatForm form_at(const Splats& s, int l) {
  SplatForm out = {};
  out.x = s.x[l];
  out.y = s.y[l];
  out.xx = s.xx[l];
  out.xy = s.xy[l];
  out.yy = s.yy[l];
  out.d0 = s.d0[l];
  out.bx = s.bx[l];
  out.by = s.by[l];
  if (Perspective) {
    out.ex = s.ex[l];
    out.ey = s.ey[l];
    out.b0 = s.b0[l];
    out.dx = s.dx[l];
    out.dy = s.dy[l];
    out.dxx = s.dxx[l];
    out.dxy = s.dxy[l];
    out.dyy = s.dyy[l];
    out.d2_least = s.d2_least[l];
  }
  return out;
}

template <bool Perspective>
inline Splat splat_at(const Prepared& p, int l) {
  Splat out = {};
  if (Perspective && has(p.splats.near, l)) {
    out.near_form = near_form_at(p, l);
  } else {
    out.form = form_at<Perspective>(p.splats, l);
  }
  if (Perspective) {
    out.z = p.positions.z[l];
    out.near = p.near;
  }
  out.strength = p.splats.strength[l];
  for (int c = 0; c < 3; ++c) out.color[c] = p.densities.color[l][c];
  return out;
}

}  // namespace
}  // namespace windsplat::engine::kernels
