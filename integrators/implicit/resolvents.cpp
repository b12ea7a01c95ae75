#include "integrators/implicit/resolvents.h"

#include <algorithm>

#include "phs/linear_algebra/lane_lu.h"

namespace porthos::integrators {
namespace {

using phs::Dual, phs::Pack4;
using C = phs::Complex4;

class FieldInDuals final : public DualField {
 public:
  explicit FieldInDuals(const phs::Model& model)
      : system_(model.instantiate<Dual>()), keeper_(model.description()) {}
  void tell_turns(const std::vector<std::int64_t>& turns) override {
    keeper_.synchronise(turns, *system_);
  }
  int operator()(double t, std::span<const Dual> x, std::span<Dual> f) override {
    system_->field(Dual(t), x, {}, f);
    return 1;
  }

 private:
  std::unique_ptr<phs::System<Dual>> system_;
  TurnKeeper<Dual> keeper_;
};

/// J v at a frozen point, v real.
class JacobianProduct {
 public:
  JacobianProduct(DualField& field, size_t nx) : field_(field), x_(nx), f_(nx) {}

  void freeze(double t, std::span<const double> x) {
    t_ = t;
    std::copy(x.begin(), x.end(), x_.begin());
  }
  template <class In, class Out>
  void operator()(In v, Out Jv) {
    for (size_t i = 0; i < x_.size(); ++i) x_[i].d = v(i);
    evaluations += field_(t_, x_, f_);
    for (size_t i = 0; i < x_.size(); ++i) Jv(i, f_[i].d);
  }

  std::int64_t evaluations = 0;

 private:
  DualField& field_;
  double t_ = 0;
  std::vector<Dual> x_, f_;
};

class Dense final : public DualResolvent {
 public:
  Dense(DualField& field, size_t nx) : jacobian_(field, nx), lu_(nx) {}

  std::int64_t evaluations() const override { return jacobian_.evaluations; }

  void factor(double t, std::span<const double> x, const C& z) override {
    jacobian_.freeze(t, x);
    for (size_t j = 0; j < lu_.size(); ++j)
      jacobian_([j](size_t i) { return i == j ? 1.0 : 0.0; },
                [&](size_t i, double d) { lu_.entry(i, j) = C(i == j ? 1.0 : 0.0) - d * z; });
    lu_.factor();
  }
  void solve(std::span<C> r) override { lu_.solve(r); }

 private:
  JacobianProduct jacobian_;
  phs::LaneLu lu_;
};

class Krylov final : public DualResolvent {
  static constexpr size_t most = 40;  ///< iterations of one solve
  static constexpr double tolerance = 1e-3;

 public:
  Krylov(DualField& field, size_t nx, phs::Resolvent* about)
      : jacobian_(field, nx), about_(about), n_(nx), basis_((most + 1) * n_), direction_(n_) {}

  std::int64_t evaluations() const override { return jacobian_.evaluations; }

  void factor(double t, std::span<const double> x, const C& z) override {
    jacobian_.freeze(t, x);
    z_ = z;
    if (about_) about_->factor(t, x, z);
  }

  void solve(std::span<C> r) override {
    const Pack4 start = norm(r.data());
    for (int lane = 0; lane < 4; ++lane) in_use_[lane] = start[lane] > 0;
    scale(r.data(), &basis_[0], start);
    std::fill(std::begin(g_), std::end(g_), C(0.0));
    g_[0] = {start, Pack4(0.0)};
    size_t m = 0;
    while (m < most && !converged(g_[m], start)) {
      std::copy_n(&basis_[m * n_], n_, direction_.begin());
      if (about_) about_->solve(direction_);
      C* const w = &basis_[(m + 1) * n_];
      apply(direction_.data(), w);
      for (size_t k = 0; k <= m; ++k) {  // modified Gram-Schmidt
        const C* const v = &basis_[k * n_];
        C h(0.0);
        for (size_t i = 0; i < n_; ++i) h += v[i].conj() * w[i];
        for (size_t i = 0; i < n_; ++i) w[i] -= h * v[i];
        h_[m][k] = h;
      }
      const Pack4 length = norm(w);
      scale(w, w, length);
      for (size_t k = 0; k < m; ++k) turn(k, h_[m][k], h_[m][k + 1]);
      make_turn(m, h_[m][m], length);
      g_[m + 1] = -(s_[m] * g_[m]);
      g_[m] = c_[m].conj() * g_[m];
      ++m;
    }
    C y[most];
    for (size_t k = m; k-- > 0;) {
      C sum = g_[k];
      for (size_t j = k + 1; j < m; ++j) sum -= h_[j][k] * y[j];
      y[k] = quotient(sum, h_[k][k]);
    }
    for (size_t i = 0; i < n_; ++i) {
      C sum(0.0);
      for (size_t k = 0; k < m; ++k) sum += y[k] * basis_[k * n_ + i];
      r[i] = sum;
    }
    if (about_) about_->solve(r);
  }

 private:
  /// w = (I - z J) d, with one product each for the real and the imaginary part of every lane in
  /// use.
  void apply(const C* d, C* w) {
    std::copy_n(d, n_, w);
    for (int lane = 0; lane < 4; ++lane) {
      const double re = z_.re[lane], im = z_.im[lane];
      if (!in_use_[lane]) continue;
      jacobian_([&](size_t i) { return d[i].re[lane]; },
                [&](size_t i, double Jd) {
                  w[i].re.set(lane, w[i].re[lane] - re * Jd);
                  w[i].im.set(lane, w[i].im[lane] - im * Jd);
                });
      if (im == 0) continue;  // a real eigenvalue has a real solution
      jacobian_([&](size_t i) { return d[i].im[lane]; },
                [&](size_t i, double Jd) {
                  w[i].re.set(lane, w[i].re[lane] + im * Jd);
                  w[i].im.set(lane, w[i].im[lane] - re * Jd);
                });
    }
  }
  Pack4 norm(const C* a) const {
    Pack4 sum(0.0);
    for (size_t i = 0; i < n_; ++i) sum += a[i].norm2();
    return sqrt(sum);
  }
  /// b = a / length; a zero lane stays zero.
  void scale(const C* a, C* b, Pack4 length) const {
    const Pack4 zero(0.0), one(1.0);
    const Pack4 s = select(length > zero, one / select(length > zero, length, one), zero);
    for (size_t i = 0; i < n_; ++i) b[i] = {s * a[i].re, s * a[i].im};
  }
  static C quotient(const C& a, const C& b) {
    const Pack4 zero(0.0), one(1.0), n = b.norm2();
    const Pack4 s = select(n > zero, one / select(n > zero, n, one), zero);
    const C q = a * b.conj();
    return {s * q.re, s * q.im};
  }
  static bool converged(const C& g, Pack4 start) {
    for (int lane = 0; lane < 4; ++lane)
      if (g.norm2()[lane] > tolerance * tolerance * start[lane] * start[lane]) return false;
    return true;
  }
  /// The Givens rotation that maps (a, b), b >= 0, to (√(|a|² + b²), 0); a becomes that.
  void make_turn(size_t k, C& a, Pack4 b) {
    const C length{sqrt(a.norm2() + b * b), Pack4(0.0)};
    c_[k] = quotient(a, length);
    s_[k] = quotient({b, Pack4(0.0)}, length);
    a = length;
  }
  void turn(size_t k, C& a, C& b) const {
    const C t = c_[k].conj() * a + s_[k] * b;
    b = c_[k] * b - s_[k] * a;
    a = t;
  }

  JacobianProduct jacobian_;
  phs::Resolvent* about_;
  size_t n_;
  C z_;
  bool in_use_[4];
  std::vector<C> basis_, direction_;
  C h_[most][most + 1], g_[most + 1], c_[most], s_[most];
};

}  // namespace

std::unique_ptr<DualField> field_in_duals(const phs::Model& model) {
  return std::make_unique<FieldInDuals>(model);
}
std::unique_ptr<DualResolvent> make_dense_resolvent(DualField& field, size_t nx) {
  return std::make_unique<Dense>(field, nx);
}
std::unique_ptr<DualResolvent> make_krylov_resolvent(DualField& field, size_t nx,
                                                     phs::Resolvent* about) {
  return std::make_unique<Krylov>(field, nx, about);
}

}  // namespace porthos::integrators
