#pragma once
#include "mechanics/passes-inl.h"

namespace porthos::mechanics {

/// The Jacobian of one joint's functions, by duals: of (q', p') with respect to its arguments, of
/// its momentum μ(q, p), and of its placement, as the child's displacement twist ζ in its own axes.
struct JointJacobian {
  using Dual = phs::Dual;
  static constexpr int most_q = 7, most_v = 6;
  struct Row {
    double q[most_q], p[most_q], v[most_v], V[6], h[6], load[most_v];
  };
  Row rate[2 * most_q];
  double mu_q[most_v][most_q], mu_p[most_v][most_q];
  Motion<double> displacement[most_q];

  template <class J>
  void of(const Node& n, const double* q, const double* p, const double* v, const Motion<double>& V,
          const Force<double>& h, const Force<double>& g, double turn) {
    Dual dq[J::nq], dp[J::nq], dv[J::nv], load[J::nv];
    Motion<Dual> dV;
    Force<Dual> dh;
    for (int k = 0; k < J::nq; ++k) {
      dq[k] = q[k];
      dp[k] = p[k];
    }
    for (int k = 0; k < J::nv; ++k) dv[k] = v[k];
    unroll<J::nv>([&](auto k) { load[k] = J::template project<k>(n, g); });
    for (int k = 0; k < 6; ++k) {
      dV[k] = V[k];
      dh[k] = h[k];
    }

    const auto along = [&](Dual& x, auto entry) {
      x.d = 1;
      Dual q_dot[J::nq], p_dot[J::nq];
      if constexpr (J::lifted) {
        J::field(dq, dp, dv, dV, dh, load, q_dot, p_dot);
      } else {
        J::rates(dq, dv, q_dot);
        const Force<Dual> gyroscopic = cross(dV, dh);
        unroll<J::nv>([&](auto k) { p_dot[k] = load[k] - J::template project<k>(n, gyroscopic); });
      }
      for (int i = 0; i < J::nq; ++i) {
        entry(rate[i]) = q_dot[i].d;
        entry(rate[J::nq + i]) = p_dot[i].d;
      }
      x.d = 0;
    };
    for (int k = 0; k < J::nq; ++k) {
      along(dq[k], [k](Row& r) -> double& { return r.q[k]; });
      along(dp[k], [k](Row& r) -> double& { return r.p[k]; });
    }
    for (int k = 0; k < J::nv; ++k) {
      along(dv[k], [k](Row& r) -> double& { return r.v[k]; });
      along(load[k], [k](Row& r) -> double& { return r.load[k]; });
    }
    for (int k = 0; k < 6; ++k) {
      along(dV[k], [k](Row& r) -> double& { return r.V[k]; });
      along(dh[k], [k](Row& r) -> double& { return r.h[k]; });
    }
    for (int k = 0; k < J::nq; ++k) {
      Dual mu[J::nv];
      dp[k].d = 1;
      J::momentum(dq, dp, mu);
      dp[k].d = 0;
      for (int i = 0; i < J::nv; ++i) mu_p[i][k] = mu[i].d;
      dq[k].d = 1;
      J::momentum(dq, dp, mu);
      for (int i = 0; i < J::nv; ++i) mu_q[i][k] = mu[i].d;
      const auto X = passes::place<J>(n, dq, Dual(turn));
      dq[k].d = 0;
      const auto &x = X.R.x, &y = X.R.y, &z = X.R.z;  // R_ᵀ δR = [ζ_ω ×]
      const auto slope = [](const Vec3<Dual>& a, const Vec3<Dual>& b) {
        return a.x.v * b.x.d + a.y.v * b.y.d + a.z.v * b.z.d;
      };
      displacement[k] = {{slope(z, y), slope(x, z), slope(y, x)},
                         {slope(x, X.r), slope(y, X.r), slope(z, X.r)}};
    }
  }
};

}  // namespace porthos::mechanics
