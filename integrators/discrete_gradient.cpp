#include "integrators/discrete_gradient.h"

#include <algorithm>
#include <cmath>

#include "integrators/catalogue.h"
#include "integrators/stagnation.h"

namespace porthos::integrators {
namespace {

/// The implicit equation δ = F(δ), solved by sweeps to stagnation from the increment of the step before.
template <class T>
class DiscreteGradient : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using typename Base::State;

 public:
  DiscreteGradient(const Declaration& d, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o),
        stagnation_(Stagnation::of<T>(o.iteration_tolerance)),
        x0_(n_),
        x1_(n_),
        mid_(n_),
        delta_(n_, T(0.0)),
        before_(n_, T(0.0)),
        next_(n_),
        gradient_(n_),
        work_(n_) {}

  Outcome advance(T t, T h, State& s) override {
    double size = 0;
    for (size_t i = 0; i < n_; ++i)
      x0_[i] = s.x[i] + s.lo[i], size = std::max(size, magnitude(x0_[i]));
    H0_ = system_->hamiltonian(x0_);
    const T ratio = h_before_ == T(0.0) ? T(0.0) : h / h_before_;
    for (size_t i = 0; i < n_; ++i) delta_[i] = ratio * before_[i];
    const Outcome o = solve(t, h, size);
    if (o != Outcome::ok) return o;
    for (size_t i = 0; i < n_; ++i) phs::compensated_add(s.x[i], s.lo[i], delta_[i]);
    before_.swap(delta_), h_before_ = h;
    return Outcome::ok;
  }

  std::vector<double> memory() const override {
    std::vector<double> m{phs::to_double(h_before_)};
    for (const T& d : before_) m.push_back(phs::to_double(d));
    return m;
  }
  void restore(std::span<const double> m) override {
    require_size("memory of a discrete gradient method", m.size(), n_ + 1);
    h_before_ = T(m[0]);
    for (size_t i = 0; i < n_; ++i) before_[i] = T(m[i + 1]);
  }

 protected:
  using Base::cost_, Base::n_, Base::options_, Base::system_;

  /// next = F(δ), given x0, x1 = x0 + δ and their midpoint.
  virtual void increment(T t, T h, std::span<T> next) = 0;

  /// out += h (J - R)(mid) e
  void add_structure(T h, std::span<const T> e, std::span<T> out) {
    system_->apply_structure(mid_, e, work_);
    for (size_t i = 0; i < n_; ++i) out[i] += h * work_[i];
    if (system_->description().traits.lossless) return;
    system_->apply_dissipation(mid_, e, work_);
    for (size_t i = 0; i < n_; ++i) out[i] -= h * work_[i];
  }

  Stagnation stagnation_;
  std::vector<T> x0_, x1_, mid_, delta_, before_, next_, gradient_, work_;
  T H0_ = T(0.0), h_before_ = T(0.0);

 private:
  Outcome solve(T t, T h, double size) {
    stagnation_.restart();
    for (int sweep = 1; sweep <= options_.max_sweeps; ++sweep) {
      for (size_t i = 0; i < n_; ++i)
        x1_[i] = x0_[i] + delta_[i], mid_[i] = x0_[i] + T(0.5) * delta_[i];
      increment(t, h, next_);
      ++cost_.sweeps;
      double change = 0, total = 0;
      for (size_t i = 0; i < n_; ++i) {
        const double move = magnitude(next_[i] - delta_[i]);
        change = std::max(change, move), total += move;
      }
      delta_.swap(next_);
      using enum Stagnation::Verdict;
      switch (stagnation_.after({.finite = total<HUGE_VAL, .changed = change> 0,
                                 .change = change / std::max(size, 1e-300)})) {
        case not_finite:
          return Outcome::not_finite;
        case diverges:
          return Outcome::not_converged;
        case exact:
        case stagnated:
          return Outcome::ok;
        case go_on:
          break;
      }
    }
    return stagnation_.settled() ? Outcome::ok : Outcome::not_converged;
  }
};

template <class T>
class Gonzalez final : public DiscreteGradient<T> {
  using Base = DiscreteGradient<T>;
  using Base::add_structure, Base::cost_, Base::delta_, Base::gradient_, Base::H0_, Base::mid_,
      Base::n_, Base::system_, Base::x1_;

 public:
  using Base::Base;

 private:
  /// h f(m) is the midpoint rule; α δ is what it lacks. α |δ| is of the order of the rounding of H over |δ| and falls out
  /// of sight below that of ∇H(m) itself; at rest there is nothing to correct.
  void increment(T t, T h, std::span<T> next) override {
    system_->field(t + T(0.5) * h, mid_, {}, next);
    system_->gradient(mid_, gradient_);
    ++cost_.evaluations;
    T along(0.0), norm2(0.0);
    for (size_t i = 0; i < n_; ++i) {
      next[i] = h * next[i];
      along += gradient_[i] * delta_[i], norm2 += delta_[i] * delta_[i];
    }
    if (!(magnitude(norm2) > 0)) return;
    const T alpha = (system_->hamiltonian(x1_) - H0_ - along) / norm2;
    for (size_t i = 0; i < n_; ++i) gradient_[i] = alpha * delta_[i];
    add_structure(h, gradient_, next);
  }
};

template <class T>
class ItohAbe final : public DiscreteGradient<T> {
  using Base = DiscreteGradient<T>;
  using Base::add_structure, Base::cost_, Base::delta_, Base::gradient_, Base::H0_, Base::mid_,
      Base::n_, Base::system_, Base::x0_, Base::x1_;

 public:
  ItohAbe(const Declaration& d, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o), path_(n_), slope_(n_), quotient_(n_) {}

 private:
  void increment(T t, T h, std::span<T> next) override {
    // What drives the system besides (J - R) ∇H, at the midpoint.
    system_->field(t + T(0.5) * h, mid_, {}, next);
    system_->gradient(mid_, gradient_);
    for (size_t i = 0; i < n_; ++i) next[i] = h * next[i], gradient_[i] = -gradient_[i];
    add_structure(h, gradient_, next);

    path_ = x0_;
    T H = H0_;
    for (size_t i = 0; i < n_; ++i) {
      const T from = path_[i];
      // Below the cube root of rounding the derivative halfway, off by δ²/24, says more than a quotient, off by u|H|/δ.
      const double least = 4 * std::cbrt(unit_roundoff<T>) * std::max(1.0, magnitude(from));
      if (magnitude(x1_[i] - from) < least) {
        path_[i] = T(0.5) * (from + x1_[i]);
        system_->gradient(path_, slope_);
        quotient_[i] = slope_[i];
        path_[i] = x1_[i];
        H = system_->hamiltonian(path_);
      } else {
        path_[i] = x1_[i];
        const T here = system_->hamiltonian(path_);
        quotient_[i] = (here - H) / (x1_[i] - from);
        H = here;
      }
    }
    cost_.evaluations += std::int64_t(n_);
    add_structure(h, quotient_, next);
  }

  std::vector<T> path_, slope_, quotient_;
};

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_gonzalez(const Declaration& d, const phs::Model& m, T h,
                                                  const Options& o) {
  return std::make_unique<Gonzalez<T>>(d, m, h, o);
}
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_itoh_abe(const Declaration& d, const phs::Model& m, T h,
                                                  const Options& o) {
  return std::make_unique<ItohAbe<T>>(d, m, h, o);
}

}  // namespace

Entries discrete_gradient_entries() {
  return {entry({.name = "gonzalez",
                 .title = "midpoint discrete gradient: H exactly",
                 .family = "Energy-preserving",
                 .order = 2,
                 .symmetric = Claim::holds,
                 .energy_exact = Claim::holds,
                 .passivity_exact = Claim::holds,
                 .source = "Gonzalez 1996, J. Nonlinear Sci. 6:449, eq. (13)"},
                PORTHOS_MAKER(make_gonzalez)),
          entry({.name = "itoh_abe",
                 .title = "coordinate increment discrete gradient: H exactly",
                 .family = "Energy-preserving",
                 .order = 1,
                 .energy_exact = Claim::holds,
                 .passivity_exact = Claim::holds,
                 .quadratic_invariants = Claim::unknown,
                 .needs = {.linear_state = true},
                 .source = "Itoh, Abe 1988, J. Comput. Phys. 76:85"},
                PORTHOS_MAKER(make_itoh_abe))};
}

}  // namespace porthos::integrators
