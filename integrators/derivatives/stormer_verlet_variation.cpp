#include "integrators/derivatives/stormer_verlet_variation.h"

#include <algorithm>
#include <cmath>

#include "integrators/core/turns.h"
#include "integrators/implicit/step_solver.h"
#include "integrators/methods/unit_quaternions.h"
#include "phs/scalars/pack.h"
#include "phs/system/linearised.h"

namespace porthos::integrators {
namespace {

using Lanes = phs::Pack4;

double dot4(const double* a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/// The stages are lanes 0 and 1; the others repeat the second.
class StormerVerletVariation final : public StepVariation {
 public:
  StormerVerletVariation(const phs::Model& model, Side side)
      : n_(size_t(model.description().nx) / 2),
        adjoint_(side == Side::adjoint),
        linear_(linearise_run<Lanes>(model)),
        turns_(model.description()),
        x_(2 * n_, Lanes(0.0)),
        f_(x_),
        y_(x_),
        F_(x_),
        running_(x_),
        first_(2 * n_),
        mid_(2 * n_),
        extra_(n_, 0.0) {
    const auto system = model.instantiate<double>();
    for (const auto& r : UnitQuaternions<double>(*system).all)
      rotations_.push_back({.q = r.q, .kappa = r.kappa});
    gradient_.resize(parameters().size());
    if (adjoint_) differentiate_kappa(model);
  }

  void at(const StepPiece& step, const std::vector<std::int64_t>& turns) override {
    turns_.when_changed(turns, [&](std::span<const Lanes> a) { linear_->set_turn_angles(a); });
    h_ = step.h;
    a_ = step.h / 2;
    Lanes time(step.t + step.h);
    time.set(0, step.t);
    gather(step.Y, x_);
    linear_->at(time, x_, f_);
    for (size_t i = 0; i < rotations_.size(); ++i) {
      Rotation& r = rotations_[i];
      r.lambda = step.multipliers[i];
      Lanes along(0.0);
      for (size_t k = 0; k < 4; ++k) along += xi(r, k) * pi(r, k);
      for (size_t k = 0; k < 4; ++k) {
        r.start[k] = xi(r, k)[0];
        r.end[k] = xi(r, k)[1];
        const double force = f_[n_ + r.q + k][1] - r.kappa * along[1] * pi(r, k)[1];
        r.kicked[k] = pi(r, k)[1] + a_ * force;
      }
      r.along = along;
      r.norm2 = dot4(r.end, r.end);
    }
  }

  Outcome advance(TwoWords& v, std::span<const double> running) override {
    runs_ = !running.empty();
    if (runs_) gather(running, running_);
    ++cost_.steps;
    first_.assign(v.x.begin(), v.x.end());
    for (size_t k = 0; k < 2 * n_; ++k) first_[k] += v.lo[k];
    std::fill(extra_.begin(), extra_.end(), 0.0);
    for (Rotation& r : rotations_)
      if (adjoint_)
        through_projection(r);
      else
        for (size_t k = 0; k < 4; ++k) extra_[r.q + k] = -a_ * r.lambda * first_[r.q + k];
    std::copy(first_.begin(), first_.end(), mid_.begin());
    if (const Outcome o = solve(); o != Outcome::ok) return o;
    if (adjoint_)
      end_adjoint(v);
    else
      end_tangent(v);
    return Outcome::ok;
  }

  void add_gradient(TwoWords& gradient) override {
    std::fill(gradient_.begin(), gradient_.end(), Lanes(0.0));
    Lanes weight(0.0);
    weight.set(0, a_);
    weight.set(1, a_);
    linear_->add_gradient(weight, gradient_);
    for (size_t a = 0; a < gradient_.size(); ++a) {
      double sum = gradient_[a][0] + gradient_[a][1];
      for (const Rotation& r : rotations_) sum += r.by_kappa * r.kappa_gradient[a];
      gradient.add(a, sum);
    }
  }
  /// The multipliers add nothing: those of the adjoint make it stationary by them.
  double by_size() const override {
    Lanes sum(0.0);
    for (size_t k = 0; k < 2 * n_; ++k) sum += y_[k] * f_[k];
    for (const Rotation& r : rotations_)
      for (size_t k = 0; k < 4; ++k)
        sum += Lanes(r.kappa) * r.along * (y_[r.q + k] * xi(r, k) - y_[n_ + r.q + k] * pi(r, k));
    return a_ * (sum[0] + sum[1]);
  }
  const std::vector<std::string>& parameters() const override { return linear_->parameters(); }
  const Cost& cost() const override { return cost_; }

 private:
  struct Rotation {
    size_t q;  ///< as UnitQuaternions
    double kappa, lambda = 0;
    Lanes along{0.0};                         ///< ξ·π at the stages
    double start[4] = {}, end[4] = {};        ///< ξ, ξ'
    double kicked[4] = {}, norm2 = 1;         ///< p½ + a f_1p; |ξ'|²
    double given[4] = {}, by_end[4] = {};     ///< λp' and e
    double by_kappa = 0;                      ///< a ∂(Σ ℓ_iᵀ f)/∂κ
    std::vector<double> kappa_gradient = {};  ///< ∂κ/∂θ
  };
  const Lanes& xi(const Rotation& r, size_t k) const { return x_[r.q + k]; }
  const Lanes& pi(const Rotation& r, size_t k) const { return x_[n_ + r.q + k]; }

  void gather(std::span<const double> stages, std::vector<Lanes>& lanes) const {
    for (size_t k = 0; k < 2 * n_; ++k) {
      lanes[k] = Lanes(stages[2 * n_ + k]);
      lanes[k].set(0, stages[k]);
    }
  }

  /// F = G y, or Gᵀ y, and `running`.
  void multiply() {
    ++cost_.sweeps;
    adjoint_ ? linear_->transpose_times(y_, F_) : linear_->times(y_, F_);
    for (const Rotation& r : rotations_) {
      const size_t q = r.q, p = n_ + r.q;
      Lanes s(0.0);  // δ(ξ·π), or its cotangent without κ
      for (size_t k = 0; k < 4; ++k)
        s += adjoint_ ? xi(r, k) * y_[q + k] - pi(r, k) * y_[p + k]
                      : y_[q + k] * pi(r, k) + xi(r, k) * y_[p + k];
      const Lanes kappa(r.kappa);
      for (size_t k = 0; k < 4; ++k) {
        const Lanes of_q = adjoint_ ? pi(r, k) : xi(r, k), of_p = adjoint_ ? xi(r, k) : pi(r, k),
                    sign(adjoint_ ? 1.0 : -1.0);
        F_[q + k] += kappa * (s * of_q + r.along * y_[q + k]);
        F_[p + k] += kappa * (sign * s * of_p - r.along * y_[p + k]);
      }
    }
    for (size_t k = 0; k < 2 * n_ && runs_; ++k) F_[k] += running_[k];
  }

  /// The unknowns: mid_ = (δq', δp½), or (m_q, m_p), and the multipliers.
  Outcome solve() {
    const auto guess = [](bool) {};
    const auto sweep = [&](double& distance) {
      distance = 0;
      fill();
      multiply();
      return adjoint_ ? sweep_adjoint() : sweep_tangent();
    };
    const auto finish = [&] {
      fill();
      multiply();
    };
    q_ = p_ = {};
    Iterating iteration(Stagnation::of<double>());
    const Iterated end = iterate(Iteration{guess, sweep, [] {}, [] { return 0.0; }, finish},
                                 iteration, false, Options{}.max_sweeps);
    return end.outcome;
  }
  /// y from the unknowns and what is given.
  void fill() {
    for (size_t q = 0, p = n_; q < n_; ++q, ++p) {
      y_[q] = Lanes(mid_[q]);
      y_[p] = Lanes(mid_[p]);
      if (adjoint_)
        for (int lane = 1; lane < 4; ++lane) y_[p].set(lane, first_[p]);
      else
        y_[q].set(0, first_[q]);
    }
  }

  Sweep sweep_tangent() {
    for (size_t q = 0, p = n_; q < n_; ++q, ++p) {
      q_.to(mid_[q], first_[q] + a_ * (F_[q][0] + F_[q][1]));
      p_.to(mid_[p], first_[p] + a_ * F_[p][0] + extra_[q]);
    }
    for (Rotation& r : rotations_) {
      const double d = 2 * dot4(r.end, &mid_[r.q]) / (h_ * h_ * r.kappa);
      for (size_t k = 0; k < 4; ++k) {
        const double kick = -a_ * d * r.start[k];
        extra_[r.q + k] += kick;
        mid_[n_ + r.q + k] += kick;
        mid_[r.q + k] += h_ * r.kappa * kick;
      }
    }
    return moves();
  }
  void end_tangent(TwoWords& v) {
    for (size_t q = 0, p = n_; q < n_; ++q, ++p) {
      v.add(q, a_ * (F_[q][0] + F_[q][1]));
      v.add(p, a_ * (F_[p][0] + F_[p][1]));
      v.add(p, extra_[q]);
    }
    for (const Rotation& r : rotations_) {
      const double* turn = &v.x[r.q];
      const double radial = dot4(r.end, r.kicked) / r.norm2,
                   along = (dot4(r.end, &v.x[n_ + r.q]) + dot4(turn, r.kicked) -
                            2 * radial * dot4(r.end, turn)) /
                           r.norm2;
      for (size_t k = 0; k < 4; ++k) v.add(n_ + r.q + k, -(along * r.end[k] + radial * turn[k]));
    }
  }

  /// λp' → c, and e, on a quaternion.
  void through_projection(Rotation& r) {
    double* const p = &first_[n_ + r.q];
    std::copy(p, p + 4, r.given);
    const double radial = dot4(r.end, r.kicked) / r.norm2, along = dot4(r.end, p) / r.norm2;
    for (size_t k = 0; k < 4; ++k) {
      r.by_end[k] = 2 * radial * along * r.end[k] - radial * p[k] - along * r.kicked[k];
      first_[r.q + k] += r.by_end[k];
      p[k] -= along * r.end[k];
    }
  }
  Sweep sweep_adjoint() {
    for (size_t q = 0, p = n_; q < n_; ++q, ++p) {
      q_.to(mid_[q], first_[q] + a_ * F_[q][1] + extra_[q]);
      p_.to(mid_[p], first_[p] + a_ * (F_[p][0] + F_[p][1]));
    }
    for (Rotation& r : rotations_) {
      const double d = -dot4(r.start, &mid_[n_ + r.q]) / (h_ * r.kappa);
      for (size_t k = 0; k < 4; ++k) {
        extra_[r.q + k] += d * r.end[k];
        mid_[r.q + k] += d * r.end[k];
        mid_[n_ + r.q + k] += h_ * r.kappa * d * r.start[k];
      }
    }
    return moves();
  }
  void end_adjoint(TwoWords& v) {
    for (size_t q = 0, p = n_; q < n_; ++q, ++p) {
      v.add(q, a_ * (F_[q][0] + F_[q][1]));
      v.add(q, extra_[q]);
      v.add(p, a_ * (F_[p][0] + F_[p][1]));
    }
    for (Rotation& r : rotations_) {
      Lanes by(0.0);
      for (size_t k = 0; k < 4; ++k) {
        by += xi(r, k) * y_[r.q + k] - pi(r, k) * y_[n_ + r.q + k];
        v.add(r.q + k, r.by_end[k] - a_ * r.lambda * mid_[n_ + r.q + k]);
        v.add(n_ + r.q + k, first_[n_ + r.q + k] - r.given[k]);
      }
      by = by * r.along;
      r.by_kappa = a_ * (by[0] + by[1]);
    }
  }

  /// ∂κ/∂θ, where κ is a third of the sum of numbers of the field (UnitQuaternions).
  void differentiate_kappa(const phs::Model& model) {
    const auto linear = linearise_run<double>(model);
    std::vector<double> x(2 * n_, 0.0), f(x), of(x), out(x);
    for (const Rotation& r : rotations_) x[r.q] = 1;
    for (Rotation& r : rotations_) {
      r.kappa_gradient.assign(parameters().size(), 0.0);
      for (size_t k = 1; k < 4; ++k) {
        x[n_ + r.q + k] = of[r.q + k] = 1;
        linear->at(0.0, x, f);
        linear->transpose_times(of, out);
        linear->add_gradient(1.0 / 3, r.kappa_gradient);
        x[n_ + r.q + k] = of[r.q + k] = 0;
      }
    }
  }

  /// The largest move of coordinates or momenta in a sweep, and their largest size in any sweep:
  /// where the solution is zero, as along a quaternion, moves do not get small against itself.
  struct Largest {
    double move = 0, size = 0;
    void to(double& x, double value) {
      const double by = std::fabs(value - x);
      if (!(by <= move)) move = by;  // takes a NaN over
      size = std::max({size, std::fabs(x), std::fabs(value)});
      x = value;
    }
    double relative() const { return move == 0 ? 0 : move / size; }
  };
  Sweep moves() {
    const double change = std::max(q_.relative(), p_.relative());
    const bool finite = q_.move + p_.move < HUGE_VAL;
    const Sweep sweep{.finite = finite, .changed = change != 0, .change = change};
    q_.move = p_.move = 0;
    return sweep;
  }

  size_t n_;  ///< numbers in q
  bool adjoint_, runs_ = false;
  double h_ = 0, a_ = 0;
  std::unique_ptr<phs::Linearised<Lanes>> linear_;
  TurnKeeper<Lanes> turns_;
  std::vector<Lanes> x_, f_, y_, F_, running_, gradient_;
  std::vector<double> first_;        ///< δx before the step, or (λq' + e, c)
  std::vector<double> mid_, extra_;  ///< unknowns; what the multipliers add to δp½, or to m_q
  std::vector<Rotation> rotations_;
  Largest q_, p_;
  Cost cost_;
};

}  // namespace

std::unique_ptr<StepVariation> make_stormer_verlet_variation(const phs::Model& model,
                                                             StepVariation::Side side) {
  return std::make_unique<StormerVerletVariation>(model, side);
}

}  // namespace porthos::integrators
