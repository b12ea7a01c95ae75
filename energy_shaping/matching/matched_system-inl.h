#pragma once
#include "energy_shaping/matching/matched_loop.h"
#include "phs/linear_algebra/dense.h"

namespace porthos::energy_shaping {

template <class T>
class MatchedSystem final : public LoopSystem<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit MatchedSystem(const MatchedLoop& loop)
      : loop_(loop),
        shaping_(loop.shaping()),
        plant_(loop.plant().instantiate<T>()),
        n_(size_t(shaping_.size())),
        m_(loop.actuated().size()),
        nu_(size_t(loop.plant().description().nu)),
        kind_(shaping_.skew_kind()),
        friction_(!loop.plant().description().traits.lossless) {
    for (const auto& g : shaping_.gains()) k_.push_back(T(g.value));
    for (auto* v : {&Md_, &L_, &Minv_, &A_, &J2_, &DA_}) v->resize(n_ * n_, T(0.0));
    for (auto* v : {&w_, &dV_, &r_, &s_}) v->resize(n_);
    dMd_.resize(n_ * n_ * n_);
    G_.resize(n_ * m_);
    Kv_.resize(m_ * m_);
    for (auto* v : {&x_, &e_, &ed_, &f_}) v->resize(2 * n_);
    u_.resize(nu_);
    a_.resize(m_);
    b_.resize(m_);
    GG_.resize(m_ * m_);
    LG_.resize(m_ * m_);
    if (kind_ == Skew::solved) {
      Q_.resize(n_ * n_);
      B_.resize(n_ * n_);
      v_.resize(n_);
      g_.resize(n_);
    }
  }

  const phs::Description& description() const override { return loop_.description(); }
  std::unique_ptr<phs::System<T>> clone() const override {
    auto copy = std::make_unique<MatchedSystem>(loop_);
    copy->k_ = k_;
    return copy;
  }
  std::span<T> gains() override { return k_; }

  T hamiltonian(In x) override {
    const In q = x.first(n_);
    shaping_.mass(q, k_, Md_, {});
    phs::dense::cholesky(n_, Md_.data(), L_.data());
    phs::dense::solve(n_, L_.data(), x.data() + n_, w_.data());
    return T(0.5) * phs::dense::dot(n_, w_.data(), x.data() + n_) + shaping_.potential(q, k_, {});
  }
  void stored(In x, Out values) override {
    const T H = hamiltonian(x), V = shaping_.potential(x.first(n_), k_, {});
    values[0] = H - V;
    values[1] = V;
  }
  void gradient(In x, Out e) override {
    target_mass(x);
    target_gradient(x, e);
  }

  void field(T, In x, In u, Out dx) override {
    target_mass(x);
    target_gradient(x, ed_);
    structure(x, true);
    structure_times(ed_, dx);
    subtract_damping(ed_, dx);
    if (u.empty()) return;
    phs::dense::multiply(n_, m_, G_.data(), u.data(), r_.data());
    for (size_t i = 0; i < n_; ++i) dx[n_ + i] = dx[n_ + i] + r_[i];
  }
  void rate(T, In x, In e, Out dx) override {
    target_mass(x);
    structure(x, true);
    structure_times(e, dx);
    subtract_damping(e, dx);
  }
  void apply_structure(In x, In e, Out Je) override {
    target_mass(x);
    structure(x, true);
    structure_times(e, Je);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    target_mass(x);
    structure(x, false);
    for (auto& y : Re) y = T(0.0);
    subtract_damping(e, Re);
    for (size_t i = 0; i < n_; ++i) Re[n_ + i] = -Re[n_ + i];
  }
  void apply_input(In x, In u, Out Gu) override {
    input_matrix(x);
    for (size_t i = 0; i < n_; ++i) Gu[i] = T(0.0);
    phs::dense::multiply(n_, m_, G_.data(), u.data(), Gu.data() + n_);
  }
  void output(In x, In e, Out y) override {
    input_matrix(x);
    phs::dense::multiply_transposed(n_, m_, G_.data(), e.data() + n_, y.data());
  }
  void powers(T, In x, In e, Out values) override {
    apply_dissipation(x, e, f_);
    values[0] = phs::dense::dot(n_, e.data() + n_, f_.data() + n_);
  }
  void invariants(In, Out) override {}

  void law(T, In x, Out u) override {
    forces(x);
    for (T& y : u) y = T(0.0);
    least_squares(f_.data() + n_, a_.data());
    phs::dense::multiply_transposed(n_, m_, G_.data(), w_.data(), b_.data());
    for (size_t j = 0; j < m_; ++j) {
      T s = a_[j];
      for (size_t k = 0; k < m_; ++k) s = s - Kv_[j * m_ + k] * b_[k];
      u[size_t(loop_.actuated()[j])] = s;
    }
  }

  // --- for the checks (double, Dual) -------------------------------------------------------------
  /// The force that the law must provide: ∂H/∂q - M_d M⁻¹ ∂H_d/∂q + J2 ∂H_d/∂p in f_[n…]; the sizes
  /// of its terms in s_.
  void forces(In x) {
    plant_->gradient(x, e_);
    target_mass(x);
    target_gradient(x, ed_);
    structure(x, true);
    phs::dense::multiply_transposed(n_, n_, A_.data(), ed_.data(), f_.data() + n_);
    phs::dense::multiply(n_, n_, J2_.data(), w_.data(), r_.data());
    for (size_t i = 0; i < n_; ++i) {
      s_[i] = phs::abs(e_[i]) + phs::abs(f_[n_ + i]) + phs::abs(r_[i]);
      f_[n_ + i] = e_[i] - f_[n_ + i] + r_[i];
    }
  }
  In force() const { return In(f_).subspan(n_); }
  In force_sizes() const { return s_; }
  /// f - G (GᵀG)⁻¹Gᵀ f
  void off_input(std::span<T> f) {
    least_squares(f.data(), a_.data());
    for (size_t i = 0; i < n_; ++i)
      for (size_t j = 0; j < m_; ++j) f[i] = f[i] - G_[i * m_ + j] * a_[j];
  }
  void evaluate(In x) {
    target_mass(x);
    structure(x, true);
  }
  In target_mass_matrix() const { return Md_; }
  In inverse_mass() const { return Minv_; }
  In kv() const { return Kv_; }
  In skew_matrix() const { return J2_; }
  In input() const { return G_; }
  In friction() const { return DA_; }

 private:
  /// M_d, ∂M_d, its factor, w = M_d⁻¹p.
  void target_mass(In x) {
    shaping_.mass(x.first(n_), k_, Md_, dMd_);
    phs::dense::cholesky(n_, Md_.data(), L_.data());
    phs::dense::solve(n_, L_.data(), x.data() + n_, w_.data());
  }
  void target_gradient(In x, Out e) {
    (void)shaping_.potential(x.first(n_), k_, dV_);
    for (size_t k = 0; k < n_; ++k) {
      e[k] =
          dV_[k] - T(0.5) * phs::dense::form(n_, w_.data(), dMd_.data() + k * n_ * n_, w_.data());
      e[n_ + k] = w_[k];
    }
  }
  void input_matrix(In x) {
    for (size_t j = 0; j < m_; ++j) {
      for (T& u : u_) u = T(0.0);
      u_[size_t(loop_.actuated()[j])] = T(1.0);
      plant_->apply_input(x, u_, f_);
      for (size_t i = 0; i < n_; ++i) G_[i * m_ + j] = f_[n_ + i];
    }
  }
  /// M⁻¹, A = M⁻¹M_d, G, Kv, D A; J2 too if asked.
  void structure(In x, bool with_skew) {
    for (size_t i = 0; i < n_; ++i) x_[i] = x[i];
    for (size_t j = 0; j < n_; ++j) {
      for (size_t i = 0; i < n_; ++i) x_[n_ + i] = T(i == j ? 1.0 : 0.0);
      plant_->gradient(x_, f_);
      for (size_t i = 0; i < n_; ++i) Minv_[i * n_ + j] = f_[n_ + i];
    }
    phs::dense::multiply(n_, n_, n_, Minv_.data(), Md_.data(), A_.data());
    input_matrix(x);
    damping(x);
    if (!with_skew || kind_ == Skew::zero) return;
    if (kind_ == Skew::given)
      shaping_.skew(x.first(n_), x.subspan(n_), k_, J2_);
    else
      solve_skew(x);
  }
  void damping(In x) {
    shaping_.damping(x.first(n_), k_, Kv_);
    if (!friction_) return;
    for (size_t j = 0; j < n_; ++j) {  // D A e_j, by the plant's own R
      for (size_t i = 0; i < n_; ++i) {
        x_[i] = T(0.0);
        x_[n_ + i] = A_[i * n_ + j];
      }
      plant_->apply_dissipation(x, x_, f_);
      for (size_t i = 0; i < n_; ++i) DA_[i * n_ + j] = f_[n_ + i];
    }
  }
  void structure_times(In e, Out Je) {
    phs::dense::multiply(n_, n_, A_.data(), e.data() + n_, Je.data());
    phs::dense::multiply_transposed(n_, n_, A_.data(), e.data(), Je.data() + n_);
    for (size_t i = 0; i < n_; ++i) {
      T s = -Je[n_ + i];
      for (size_t j = 0; j < n_; ++j) {
        if (kind_ != Skew::zero) s = s + J2_[i * n_ + j] * e[n_ + j];
        if (friction_) s = s - T(0.5) * (DA_[i * n_ + j] - DA_[j * n_ + i]) * e[n_ + j];
      }
      Je[n_ + i] = s;
    }
  }
  void subtract_damping(In e, Out dx) {
    phs::dense::multiply_transposed(n_, m_, G_.data(), e.data() + n_, a_.data());
    phs::dense::multiply(m_, m_, Kv_.data(), a_.data(), b_.data());
    for (size_t i = 0; i < n_; ++i) {
      T s(0.0);
      for (size_t j = 0; j < m_; ++j) s = s + G_[i * m_ + j] * b_[j];
      if (friction_)
        for (size_t j = 0; j < n_; ++j)
          s = s + T(0.5) * (DA_[i * n_ + j] + DA_[j * n_ + i]) * e[n_ + j];
      dx[n_ + i] = dx[n_ + i] - s;
    }
  }
  /// a = (GᵀG)⁻¹Gᵀ f
  void least_squares(const T* f, T* a) {
    for (size_t i = 0; i < m_; ++i)
      for (size_t j = 0; j < m_; ++j) {
        T s(0.0);
        for (size_t k = 0; k < n_; ++k) s = s + G_[k * m_ + i] * G_[k * m_ + j];
        GG_[i * m_ + j] = s;
      }
    phs::dense::cholesky(m_, GG_.data(), LG_.data());
    phs::dense::multiply_transposed(n_, m_, G_.data(), f, a);
    phs::dense::solve(m_, LG_.data(), a, a);
  }

  /// The kinetic equation with one unactuated direction v, Gᵀv = 0, is wᵀQ w + 2 vᵀJ2 w = 0 in w =
  /// M_d⁻¹p, and Q is known. With B = S - Q/2, S skew and B v = 0, which is possible if and only if
  /// vᵀQ v = 0, r = wᵀB solves it, and
  /// J2 = (v r - rᵀvᵀ)/|v|² has vᵀJ2 = r.
  void solve_skew(In x) {
    const size_t n = n_;
    if (n == 2) {
      v_[0] = -G_[1];
      v_[1] = G_[0];
    } else {  // 3 × 2
      v_[0] = G_[2] * G_[5] - G_[4] * G_[3];
      v_[1] = G_[4] * G_[1] - G_[0] * G_[5];
      v_[2] = G_[0] * G_[3] - G_[2] * G_[1];
    }
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j <= i; ++j) Q_[i * n + j] = kinetic_form(x, i, j);
      for (size_t j = 0; j < i; ++j) {  // polarisation
        Q_[i * n + j] = T(0.5) * (Q_[i * n + j] - Q_[j * n + j]);
      }
    }
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < i; ++j) {
        Q_[i * n + j] = Q_[i * n + j] - T(0.5) * Q_[i * n + i];
        Q_[j * n + i] = Q_[i * n + j];
      }
    const T vv = phs::dense::dot(n, v_.data(), v_.data());
    phs::dense::multiply(n, n, Q_.data(), v_.data(), r_.data());  // 2 bb
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j)
        B_[i * n + j] = T(0.5) * ((r_[i] * v_[j] - v_[i] * r_[j]) / vv - Q_[i * n + j]);
    phs::dense::multiply_transposed(n, n, B_.data(), w_.data(), r_.data());
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j) J2_[i * n + j] = (v_[i] * r_[j] - r_[i] * v_[j]) / vv;
  }
  /// wᵀQ w at w = e_i + e_j (w = e_i where j = i).
  T kinetic_form(In x, size_t i, size_t j) {
    const size_t n = n_;
    for (size_t a = 0; a < n; ++a) {
      x_[a] = x[a];
      x_[n + a] = i == j ? Md_[a * n + i] : Md_[a * n + i] + Md_[a * n + j];
    }
    plant_->gradient(x_, f_);
    for (size_t a = 0; a < n; ++a) {
      g_[a] = f_[a];
      x_[n + a] = T(0.0);
    }
    plant_->gradient(x_, f_);
    // (A v)ᵀ = vᵀM_d M⁻¹
    phs::dense::multiply(n, n, A_.data(), v_.data(), r_.data());
    T sum(0.0);
    for (size_t k = 0; k < n; ++k) {
      const T* d = dMd_.data() + k * n * n;
      const T bend = i == j ? d[i * n + i] : d[i * n + i] + T(2.0) * d[i * n + j] + d[j * n + j];
      sum = sum + v_[k] * T(2.0) * (g_[k] - f_[k]) + r_[k] * bend;
    }
    return sum;
  }

  const MatchedLoop& loop_;
  const Shaping& shaping_;
  std::unique_ptr<phs::System<T>> plant_;
  size_t n_, m_, nu_;
  Skew kind_;
  bool friction_;
  std::vector<T> k_, Md_, dMd_, L_, Minv_, A_, J2_, DA_, G_, Kv_, GG_, LG_, Q_, B_, v_, g_;
  std::vector<T> w_, dV_, r_, s_, x_, e_, ed_, f_, u_, a_, b_;
};

}  // namespace porthos::energy_shaping
