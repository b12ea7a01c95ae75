#include "mechanics/resolvent.h"

#include "mechanics/detail/joint_jacobian.h"
#include "mechanics/detail/tree_linearisation.h"
#include "mechanics/detail/unpivoted_lu.h"

// Variations here are co-moving: they are those of components in the body's own frame, written in
// world axes. A displacement of the child by the twist ζ changes the quantities that cross the
// joint: δ(X V) = -ζ × X V and  δ(Xᵀ h) = Xᵀ (ζ ×* h).
//
// A joint of one freedom, S in world axes, δq = r_q + z δv:
//   s_i = s_λ + (S, 0) δv + β δq                        β = (V × S, γ × S_ω)
//   f_up = f_i + η δq                                   η = (S ×* h, S ×* g)
//   r_p - z K r_q = ℓ·f_i - z δV_i·(S ×* h) + (z²K + z d + J) δv     ℓ = (S - z V × S, -z S)
// The last line is δp - z δp' = r_p with p = Sᵀh + J v (J the rotor's inertia) and p' = Sᵀ(g - V ×*
// h) - K q - d v.

namespace porthos::mechanics {
namespace {

using C = phs::Complex4;

template <bool weight>
class TreeResolvent final : public phs::Resolvent, TreeLinearisation<weight> {
  using Tree = TreeLinearisation<weight>;
  using Tree::m_, Tree::turn_angle_, Tree::nq_, Tree::w_, Tree::bodies_;
  using Tree::move_to, Tree::shift_of_s, Tree::shift_of_f;
  static constexpr int rows = Tree::rows, cols = Tree::cols;
  using typename Tree::Body, typename Tree::Up, typename Tree::Down;

  /// A joint of one freedom; its S, β and η in world axes.
  struct Hinge {
    Motion<double> S, VxS;
    std::array<double, cols> beta;
    Down sigma, SP;  ///< SP: Sᵀ of δh_i's part in P
    Up kappa, chi;
    C D_inverse, sigma_beta, e, Sc;
    double stiffness = 0, damping = 0, rotor_inertia = 0;
  };
  /// Any other joint, with the unknowns u = (δq, δp, δv):
  ///   s_i = s_λ + B u,   f_up = f_i + H u,   G u + Λ f_i + Ω s_i = (r_q, r_p, 0),
  /// hence N u = r - Λ c - W s_λ with W = Λ P + Ω and N = G + W B.
  struct General {
    int size = 0;
    std::vector<C> N, Lambda, W, K;  ///< K = P B + H;  W ends as N⁻¹ W
    std::vector<double> B, H;
    std::vector<C> u;
  };

 public:
  TreeResolvent(const Mechanism& m, const std::vector<double>& turn_angle)
      : Tree(m, turn_angle),
        c_(bodies_.size()),
        s_(bodies_.size()),
        hinge_(m.nodes().size()),
        general_(m.nodes().size()) {
    for (size_t i = 0; i < bodies_.size(); ++i)
      visit_joint(m.nodes()[i].type, [&](auto J) {
        if constexpr (decltype(J)::nv > 1) {
          General& j = general_[i];
          const size_t n = size_t(j.size = 2 * decltype(J)::nq + decltype(J)::nv);
          j.N.resize(n * n);
          j.Lambda.resize(n * rows);
          j.W.resize(n * cols);
          j.K.resize(n * rows);
          j.B.resize(n * cols);
          j.H.resize(n * rows);
          j.u.resize(n);
        }
      });
    for (size_t i = 0; i < bodies_.size(); ++i)
      hinge_[i].rotor_inertia = m.nodes()[i].rotor_inertia;
    for (size_t i = 0; i < bodies_.size(); ++i)
      for (const auto& p : m.joint_properties())
        if (p.q == m.nodes()[i].q && !general_[i].size) {
          hinge_[i].stiffness = p.stiffness;
          hinge_[i].damping = p.damping;
        }
  }

  bool exact() const override { return true; }

  void factor(double, std::span<const double> x, const C& z) override {
    z_ = z;
    move_to(x);
    const double *q = x.data(), *p = x.data() + nq_;
    const auto& nodes = m_.nodes();
    for (size_t i = nodes.size(); i-- > 0;)
      visit_joint(nodes[i].type, [&](auto J) {
        if constexpr (decltype(J)::nv == 1)
          eliminate_hinge(i);
        else
          eliminate_general<decltype(J)>(i, q + nodes[i].q, p + nodes[i].q);
      });
  }

  void solve(std::span<C> r) override {
    const auto& nodes = m_.nodes();
    for (Up& c : c_) c.fill(C(0.0));
    for (size_t i = nodes.size(); i-- > 0;) {
      const size_t q = size_t(nodes[i].q);
      Up up = c_[i];
      if (general_[i].size)
        reduce_general(i, &r[q], &r[nq_ + q], up);
      else
        reduce_hinge(hinge_[i], r[q], r[nq_ + q], up);
      if (nodes[i].parent >= 0)
        for (int a = 0; a < rows; ++a) c_[size_t(nodes[i].parent)][a] += up[a];
    }
    for (size_t i = 0; i < nodes.size(); ++i) {
      const size_t q = size_t(nodes[i].q);
      Down& s = s_[i];
      if (nodes[i].parent >= 0)
        s = s_[size_t(nodes[i].parent)];
      else
        s.fill(C(0.0));
      if (general_[i].size)
        expand_general(i, &r[q], &r[nq_ + q], s);
      else
        expand_hinge(hinge_[i], r[q], r[nq_ + q], s);
    }
  }

 private:
  // --- joints of one freedom ---------------------------------------------------------------------
  void eliminate_hinge(size_t i) {
    const Node& n = m_.nodes()[i];
    Hinge& j = hinge_[i];
    Body& b = bodies_[i];
    auto S = passes::zero_motion<double>();
    visit_joint(n.type, [&](auto J) {
      if constexpr (decltype(J)::nv == 1) decltype(J)::template add<0>(n, 1.0, S);
    });
    j.S = b.E.to_parent(S);
    j.VxS = cross(b.V, j.S);
    j.beta = shift_of_s(i, j.S);
    const auto eta = shift_of_f(i, j.S);

    Up ell;
    for (int k = 0; k < 6; ++k) {
      ell[size_t(k)] = C(j.S[k]) - j.VxS[k] * z_;
      if constexpr (weight) ell[size_t(6 + k)] = -j.S[k] * z_;
    }
    for (size_t k = 0; k < cols; ++k) {
      C sum = k < 6 ? -eta[k] * z_ : C(0.0), momentum(0.0);
      for (size_t a = 0; a < rows; ++a) {
        sum += ell[a] * b.P[a][k];
        if (a < 6) momentum += j.S[int(a)] * b.P[a][k];
      }
      j.sigma[k] = sum;
      j.SP[k] = momentum;
    }
    for (size_t a = 0; a < rows; ++a) {
      C along(0.0), shifted(eta[a]);
      for (size_t k = 0; k < cols; ++k) {
        if (k < 6) along += j.S[int(k)] * b.P[a][k];
        shifted += j.beta[k] * b.P[a][k];
      }
      j.chi[a] = shifted;
      j.kappa[a] = along + z_ * shifted;
    }
    C sigma_S(0.0);
    j.sigma_beta = C(0.0);
    for (size_t k = 0; k < cols; ++k) {
      if (k < 6) sigma_S += j.S[int(k)] * j.sigma[k];
      j.sigma_beta += j.beta[k] * j.sigma[k];
    }
    const C D =
        sigma_S + z_ * (j.sigma_beta + j.stiffness * z_ + C(j.damping)) + C(j.rotor_inertia);
    j.D_inverse = D.inverse();
    if (n.parent < 0) return;
    auto& P = bodies_[size_t(n.parent)].P;
    for (size_t a = 0; a < rows; ++a) {
      const C scaled = j.kappa[a] * j.D_inverse;
      for (size_t k = 0; k < cols; ++k) P[a][k] += b.P[a][k] - scaled * j.sigma[k];
    }
  }
  void reduce_hinge(Hinge& j, const C& r_q, const C& r_p, Up& c) const {
    C straight(0.0), turned(0.0);
    for (int k = 0; k < 6; ++k) {
      straight += j.S[k] * c[size_t(k)];
      turned += j.VxS[k] * c[size_t(k)];
      if constexpr (weight) turned += j.S[k] * c[size_t(6 + k)];
    }
    j.Sc = straight;
    j.e = j.D_inverse *
          (r_p - j.stiffness * (z_ * r_q) - (straight - z_ * turned) - r_q * j.sigma_beta);
    for (size_t a = 0; a < rows; ++a) c[a] += r_q * j.chi[a] + j.kappa[a] * j.e;
  }
  void expand_hinge(const Hinge& j, C& r_q, C& r_p, Down& s) const {
    C sum(0.0);
    for (size_t k = 0; k < cols; ++k) sum += j.sigma[k] * s[k];
    const C v = j.e - j.D_inverse * sum, q = r_q + z_ * v;
    for (int k = 0; k < cols; ++k)
      s[size_t(k)] += (k < 6 ? j.S[k] * v : C(0.0)) + j.beta[size_t(k)] * q;
    r_q = q;
    r_p = j.Sc + j.rotor_inertia * v;
    for (size_t k = 0; k < cols; ++k) r_p += j.SP[k] * s[k];
  }

  // --- joints of several freedoms ----------------------------------------------------------------
  template <class J>
  void eliminate_general(size_t i, const double* q, const double* p) {
    linearise<J>(i, q, p);
    condense<2 * J::nq + J::nv>(i);
  }
  /// Fills B and H; puts G into N, and Ω into W; fills Λ.
  template <class J>
  void linearise(size_t i, const double* q, const double* p) {
    const Node& n = m_.nodes()[i];
    General& j = general_[i];
    const Body& b = bodies_[i];
    constexpr size_t nq = J::nq, nv = J::nv, size = 2 * nq + nv;
    jacobian_.of<J>(n, q, p, w_.rate.data() + n.v, w_.V[i], b.E.to_child(b.h), b.E.to_child(b.g),
                    n.turn >= 0 ? turn_angle_[size_t(n.turn)] : 0.0);
    std::array<Motion<double>, nv> S;
    unroll<J::nv>([&](auto k) {
      auto own = passes::zero_motion<double>();
      J::template add<k>(n, 1.0, own);
      S[k] = b.E.to_parent(own);
    });
    std::fill(j.B.begin(), j.B.end(), 0.0);
    std::fill(j.H.begin(), j.H.end(), 0.0);
    for (size_t k = 0; k < nq; ++k) {
      const auto zeta = b.E.to_parent(jacobian_.displacement[k]);
      const auto beta = shift_of_s(i, zeta);
      const auto eta = shift_of_f(i, zeta);
      for (size_t a = 0; a < cols; ++a) j.B[a * size + k] = beta[a];
      for (size_t a = 0; a < rows; ++a) j.H[a * size + k] = eta[a];
    }
    for (size_t k = 0; k < nv; ++k)
      for (size_t a = 0; a < 6; ++a) j.B[a * size + 2 * nq + k] = S[k][int(a)];

    std::fill(j.N.begin(), j.N.end(), C(0.0));
    std::fill(j.W.begin(), j.W.end(), C(0.0));
    std::fill(j.Lambda.begin(), j.Lambda.end(), C(0.0));
    for (size_t r = 0; r < 2 * nq; ++r) {
      const auto& d = jacobian_.rate[r];
      j.N[r * size + r] = C(1.0);
      for (size_t k = 0; k < nq; ++k) {
        j.N[r * size + k] -= d.q[k] * z_;
        j.N[r * size + nq + k] -= d.p[k] * z_;
      }
      for (size_t k = 0; k < nv; ++k) j.N[r * size + 2 * nq + k] -= d.v[k] * z_;
      const auto by_V = b.E.to_parent(Force<double>{{d.V[0], d.V[1], d.V[2]},  //
                                                    {d.V[3], d.V[4], d.V[5]}});
      const auto by_h = b.E.to_parent(Motion<double>{{d.h[0], d.h[1], d.h[2]},  //
                                                     {d.h[3], d.h[4], d.h[5]}});
      for (size_t a = 0; a < 6; ++a) {
        j.W[r * cols + a] -= by_V[int(a)] * z_;
        j.Lambda[r * rows + a] -= by_h[int(a)] * z_;
        if constexpr (weight)
          for (size_t k = 0; k < nv; ++k)
            j.Lambda[r * rows + 6 + a] -= (d.load[k] * S[k][int(a)]) * z_;
      }
    }
    for (size_t k = 0; k < nv; ++k) {  // Sᵀ δh_i = δμ
      const size_t r = 2 * nq + k;
      for (size_t a = 0; a < 6; ++a) j.Lambda[r * rows + a] = C(S[k][int(a)]);
      for (size_t c = 0; c < nq; ++c) {
        j.N[r * size + c] = C(-jacobian_.mu_q[k][c]);
        j.N[r * size + nq + c] = C(-jacobian_.mu_p[k][c]);
      }
    }
  }
  /// Computes N, W and K from G, Λ, Ω, B and H; adds to P of the parent.
  template <size_t size>
  void condense(size_t i) {
    const Node& n = m_.nodes()[i];
    General& j = general_[i];
    const Body& b = bodies_[i];
    for (size_t r = 0; r < size; ++r) {
      for (size_t k = 0; k < cols; ++k)
        for (size_t a = 0; a < rows; ++a) j.W[r * cols + k] += j.Lambda[r * rows + a] * b.P[a][k];
      for (size_t c = 0; c < size; ++c)
        for (size_t k = 0; k < cols; ++k)
          j.N[r * size + c] += j.B[k * size + c] * j.W[r * cols + k];
    }
    for (size_t a = 0; a < rows; ++a)
      for (size_t c = 0; c < size; ++c) {
        C sum(j.H[a * size + c]);
        for (size_t k = 0; k < cols; ++k) sum += j.B[k * size + c] * b.P[a][k];
        j.K[a * size + c] = sum;
      }
    decompose(j.N, size);
    for (size_t k = 0; k < cols; ++k) {
      for (size_t r = 0; r < size; ++r) j.u[r] = j.W[r * cols + k];
      substitute(j.N, size, j.u);
      for (size_t r = 0; r < size; ++r) j.W[r * cols + k] = j.u[r];
    }
    if (n.parent < 0) return;
    auto& P = bodies_[size_t(n.parent)].P;
    for (size_t a = 0; a < rows; ++a)
      for (size_t k = 0; k < cols; ++k) {
        C sum = b.P[a][k];
        for (size_t r = 0; r < size; ++r) sum -= j.K[a * size + r] * j.W[r * cols + k];
        P[a][k] += sum;
      }
  }
  void reduce_general(size_t i, const C* r_q, const C* r_p, Up& c) {
    General& j = general_[i];
    const size_t size = size_t(j.size), nq = coordinates(i);
    for (size_t r = 0; r < size; ++r) {
      C sum = r < nq ? r_q[r] : r < 2 * nq ? r_p[r - nq] : C(0.0);
      for (size_t a = 0; a < rows; ++a) sum -= j.Lambda[r * rows + a] * c[a];
      j.u[r] = sum;
    }
    substitute(j.N, size, j.u);
    for (size_t a = 0; a < rows; ++a)
      for (size_t r = 0; r < size; ++r) c[a] += j.K[a * size + r] * j.u[r];
  }
  void expand_general(size_t i, C* r_q, C* r_p, Down& s) {
    General& j = general_[i];
    const size_t size = size_t(j.size), nq = coordinates(i);
    for (size_t r = 0; r < size; ++r)
      for (size_t k = 0; k < cols; ++k) j.u[r] -= j.W[r * cols + k] * s[k];
    for (size_t k = 0; k < cols; ++k)
      for (size_t r = 0; r < size; ++r) s[k] += j.B[k * size + r] * j.u[r];
    for (size_t k = 0; k < nq; ++k) {
      r_q[k] = j.u[k];
      r_p[k] = j.u[nq + k];
    }
  }
  size_t coordinates(size_t i) const {
    size_t nq = 0;
    visit_joint(m_.nodes()[i].type, [&](auto J) { nq = size_t(decltype(J)::nq); });
    return nq;
  }

  std::vector<Up> c_;    ///< f_i = P s_i + c
  std::vector<Down> s_;  ///< separate from the bodies: a solve does not read P
  std::vector<Hinge> hinge_;
  std::vector<General> general_;
  JointJacobian jacobian_;
  C z_;
};

}  // namespace

std::unique_ptr<phs::Resolvent> make_resolvent(const Mechanism& m,
                                               const std::vector<double>& turn_angle) {
  if (m.has_gravity()) return std::make_unique<TreeResolvent<true>>(m, turn_angle);
  return std::make_unique<TreeResolvent<false>>(m, turn_angle);
}

}  // namespace porthos::mechanics
