#pragma once
#include <memory>
#include <span>
#include <vector>

#include "energy_shaping/laws/potential_loop.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/rnea.h"
#include "phs/linear_algebra/dense.h"

namespace porthos::energy_shaping {

/// The system of a PotentialLoop.
template <class T>
class ShapedSystem final : public LoopSystem<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;
  using Mat3 = mechanics::Mat3<T>;
  using Vec3 = mechanics::Vec3<T>;
  using Parts = PotentialLoop::Parts;

 public:
  explicit ShapedSystem(const PotentialLoop& loop)
      : loop_(loop),
        p_(loop.parts()),
        m_(loop.mechanical().mechanism()),
        w_(m_),
        plant_(loop.mechanical().template instantiate<T>()),
        nq_(size_t(m_.nq())),
        nv_(size_t(m_.nv())),
        nu_(size_t(loop.mechanical().description().nu)),
        poses_(m_.nodes().size()),
        J_(6 * nv_),
        e_(2 * nq_),
        still_(2 * nq_),
        lift_(2 * nq_),
        tau_(nv_),
        y_(nu_),
        u_(nu_) {
    if (p_.zero_momentum) {
      M_.resize(nv_ * nv_);
      A_.resize(6 * nv_);
      Tb_.resize(7 * 6);
      q_dot_.resize(nq_);
    }
  }
  const phs::Description& description() const override { return loop_.description(); }
  std::unique_ptr<phs::System<T>> clone() const override {
    return std::make_unique<ShapedSystem>(loop_);
  }

  T hamiltonian(In x) override { return plant_->hamiltonian(x) + shaped(x); }
  void stored(In x, Out values) override {
    const T total = hamiltonian(x);
    halt(x);
    const T potential = plant_->hamiltonian(still_) + shaped(x);
    values[0] = total - potential;
    values[1] = potential;
  }
  void gradient(In x, Out e) override {
    plant_->gradient(x, e);
    forces(x);
    plant_->apply_input(x, u_, lift_);  // -∂U/∂q, lifted for quaternions
    for (size_t i = 0; i < nq_; ++i) e[i] = e[i] - lift_[nq_ + i];
    if (!p_.compensate) return;
    halt(x);
    plant_->gradient(still_, lift_);
    for (size_t i = 0; i < nq_; ++i) e[i] = e[i] - lift_[i];
  }
  void field(T t, In x, In u, Out dx) override {
    gradient(x, e_);
    rate(t, x, e_, dx);
    if (u.empty()) return;
    plant_->apply_input(x, u, lift_);
    for (size_t i = 0; i < 2 * nq_; ++i) dx[i] = dx[i] + lift_[i];
  }
  void rate(T, In x, In e, Out dx) override {
    apply_structure(x, e, dx);
    damp(x, e);
    for (size_t i = 0; i < nq_; ++i) dx[nq_ + i] = dx[nq_ + i] - lift_[nq_ + i];
  }
  void apply_structure(In x, In e, Out Je) override {
    plant_->apply_structure(x, e, Je);
    if (!p_.zero_momentum) return;
    follow(x);
    const size_t bq = p_.base_q, bv = p_.base_v;
    // q_b' = T A v_j, p_b' = 0, and the transpose in the joints' rows.
    for (size_t i = 0; i < 7; ++i) {
      T s(0.0);
      for (size_t a = 0; a < 6; ++a) s = s + Tb_[i * 6 + a] * base_rate(e, a);
      Je[bq + i] = s;
      Je[nq_ + bq + i] = T(0.0);
    }
    for (size_t a = 0; a < 6; ++a) {
      T g(0.0);
      for (size_t i = 0; i < 7; ++i) g = g + Tb_[i * 6 + a] * e[bq + i];
      for (const auto& c : m_.coordinates())
        if (size_t(c.v) < bv || size_t(c.v) >= bv + 6)
          Je[nq_ + size_t(c.q)] = Je[nq_ + size_t(c.q)] - A_[a * nv_ + size_t(c.v)] * g;
    }
  }
  void apply_dissipation(In x, In e, Out Re) override {
    damp(x, e);
    for (size_t i = 0; i < nq_; ++i) {
      Re[i] = T(0.0);
      Re[nq_ + i] = lift_[nq_ + i];
    }
  }
  void apply_input(In x, In u, Out Gu) override { plant_->apply_input(x, u, Gu); }
  void output(In x, In e, Out y) override { plant_->output(x, e, y); }
  void powers(T, In x, In e, Out values) override {
    damp(x, e);
    T sum(0.0);
    for (size_t i = 0; i < nq_; ++i) sum = sum + e[nq_ + i] * lift_[nq_ + i];
    values[0] = sum;
  }
  void invariants(In x, Out values) override { plant_->invariants(x, values); }

  void law(T, In x, Out u) override {
    (void)wanted(x);
    plant_->gradient(x, e_);
    plant_->output(x, e_, y_);
    for (auto& v : u) v = T(0.0);
    for (size_t j = 0; j < nv_; ++j)
      if (p_.actuated[j]) u[j] = tau_[j] - T(p_.damping[j]) * y_[j];
  }

  /// Generalised force of springs and compensation per unit of v. With zero momentum that of the
  /// base is made by the joints.
  In wanted(In x) {
    forces(x);
    if (p_.zero_momentum) {
      follow(x);
      for (size_t a = 0; a < 6; ++a) {
        T& of_base = tau_[p_.base_v + a];
        for (size_t j = 0; j < nv_; ++j)
          if (j < p_.base_v || j >= p_.base_v + 6) tau_[j] = tau_[j] + A_[a * nv_ + j] * of_base;
        of_base = T(0.0);
      }
    }
    add_compensation(x);
    return tau_;
  }

 private:
  void halt(In x) {
    for (size_t i = 0; i < nq_; ++i) {
      still_[i] = x[i];
      still_[nq_ + i] = T(0.0);
    }
  }
  mechanics::Transform<T> pose_of(const Parts::Pose& p) const {
    return mechanics::body_pose<T>(m_, p.frame, poses_);
  }
  /// U(q), minus V where it is compensated.
  T shaped(In x) {
    T U(0.0);
    for (const auto& s : p_.joints) {
      const T d = x[s.q] - T(s.rest);
      const T half = phs::sin(T(0.5) * d);
      U = U + (s.periodic ? T(2 * s.stiffness) * half * half : T(0.5 * s.stiffness) * d * d);
    }
    for (const auto& c : m_.coordinates())
      if (c.nq == 1) U = U - T(p_.constant[size_t(c.v)]) * x[size_t(c.q)];
    if (!p_.poses.empty())
      mechanics::forward_kinematics<T>(m_, w_, x.first(nq_), std::span(poses_));
    for (const auto& p : p_.poses) {
      const auto X = pose_of(p);
      const Vec3 d = X.r - Vec3(p.spring.position);
      U = U + T(0.5 * p.spring.stiffness) * dot(d, d);
      // tr(A (1 - R_dᵀR)) = Σ a_i (1 - d_i·r_i) = ½ Σ a_i |d_i - r_i|², columns d_i and r_i: no
      // cancellation near R_d
      const Mat3 D(p.spring.attitude);
      for (int i = 0; i < 3; ++i) {
        const Vec3 off = column(D, i) - column(X.R, i);
        U = U + T(0.5 * p.spring.attitude_stiffness[i]) * dot(off, off);
      }
    }
    if (!p_.compensate) return U;
    halt(x);
    return U - plant_->hamiltonian(still_);
  }
  static Vec3 column(const Mat3& m, int i) { return i == 0 ? m.x : i == 1 ? m.y : m.z; }

  /// -∂U/∂q (without the compensation) per unit of v in tau_ and, as inputs of the joints' ports,
  /// in u_.
  void forces(In x) {
    for (size_t j = 0; j < nv_; ++j) tau_[j] = T(p_.constant[j]);
    for (const auto& s : p_.joints) {
      const T d = x[s.q] - T(s.rest);
      tau_[s.v] = tau_[s.v] - T(s.stiffness) * (s.periodic ? phs::sin(d) : d);
    }
    if (!p_.poses.empty())
      mechanics::forward_kinematics<T>(m_, w_, x.first(nq_), std::span(poses_));
    for (const auto& p : p_.poses) {
      const auto X = pose_of(p);
      const Vec3 f = X.R.tmul(T(-p.spring.stiffness) * (X.r - Vec3(p.spring.position)));
      // moment = Σ a_i r_i × d_i, in the body's axes
      const Mat3 D(p.spring.attitude);
      Vec3 n{T(0.0), T(0.0), T(0.0)};
      for (int i = 0; i < 3; ++i)
        n += T(p.spring.attitude_stiffness[i]) * cross(column(X.R, i), column(D, i));
      n = X.R.tmul(n);
      mechanics::jacobian<T>(m_, w_, x.first(nq_), p.frame, mechanics::JacobianAxes::body,
                             std::span(J_));
      for (size_t j = 0; j < nv_; ++j)
        for (int k = 0; k < 3; ++k)
          tau_[j] = tau_[j] + J_[6 * j + size_t(k)] * n[k] + J_[6 * j + 3 + size_t(k)] * f[k];
    }
    for (size_t j = 0; j < nu_; ++j) u_[j] = j < nv_ ? tau_[j] : T(0.0);
  }
  /// What cancels gravity and the springs of the joints, to tau_; uses y_.
  void add_compensation(In x) {
    if (!p_.compensate) return;
    mechanics::rnea<T>(m_, w_, x.first(nq_), {}, {}, {}, Out(y_).first(nv_));
    for (const auto& j : m_.joint_properties())
      y_[size_t(j.v)] = y_[size_t(j.v)] + T(j.stiffness) * (x[size_t(j.q)] - T(j.rest));
    for (size_t j = 0; j < nv_; ++j) tau_[j] = tau_[j] + y_[j];
  }
  /// G Kd Gᵀ e and the plant's own R e, in lift_.
  void damp(In x, In e) {
    plant_->output(x, e, y_);
    for (size_t j = 0; j < nu_; ++j) u_[j] = j < nv_ ? T(p_.damping[j]) * y_[j] : T(0.0);
    plant_->apply_input(x, u_, lift_);
    plant_->apply_dissipation(x, e, still_);
    for (size_t i = 0; i < nq_; ++i) lift_[nq_ + i] = lift_[nq_ + i] + still_[nq_ + i];
  }
  /// A = -M_bb⁻¹M_bj and T, the base's coordinate rates per unit of its twist.
  void follow(In x) {
    mechanics::crba<T>(m_, w_, x.first(nq_), std::span(M_));
    const size_t b = p_.base_v;
    T Mbb[36], L[36], column[6];
    for (size_t i = 0; i < 6; ++i)
      for (size_t j = 0; j < 6; ++j) Mbb[i * 6 + j] = M_[(b + i) + nv_ * (b + j)];
    phs::dense::cholesky(size_t(6), Mbb, L);
    for (size_t j = 0; j < nv_; ++j) {
      for (size_t i = 0; i < 6; ++i) column[i] = -M_[(b + i) + nv_ * j];
      phs::dense::solve(size_t(6), L, column, column);
      for (size_t i = 0; i < 6; ++i) A_[i * nv_ + j] = column[i];
    }
    for (size_t a = 0; a < 6; ++a) {
      for (T& v : tau_scratch()) v = T(0.0);
      tau_scratch()[b + a] = T(1.0);
      mechanics::coordinate_rates<T>(m_, x.first(nq_), In(tau_scratch()), Out(q_dot_));
      for (size_t i = 0; i < 7; ++i) Tb_[i * 6 + a] = q_dot_[p_.base_q + i];
    }
  }
  std::vector<T>& tau_scratch() { return J_; }  // 6 nv numbers, free between poses
  /// Component a of A v_j at the efforts e.
  T base_rate(In e, size_t a) const {
    T s(0.0);
    for (const auto& c : m_.coordinates())
      if (size_t(c.v) < p_.base_v || size_t(c.v) >= p_.base_v + 6)
        s = s + A_[a * nv_ + size_t(c.v)] * e[nq_ + size_t(c.q)];
    return s;
  }

  const PotentialLoop& loop_;
  const Parts& p_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::unique_ptr<phs::System<T>> plant_;
  size_t nq_, nv_, nu_;
  std::vector<mechanics::Transform<T>> poses_;
  std::vector<T> J_, e_, still_, lift_, tau_, y_, u_, M_, A_, Tb_, q_dot_;
};

}  // namespace porthos::energy_shaping
