#pragma once
#include <memory>

#include "integrators/methods/discrete_gradient.h"
#include "integrators/methods/invariant_gradients.h"
#include "integrators/methods/mean_gradient.h"

namespace porthos::integrators {

/// f̄(x0, δ) = (J - R)(m) ∇̄H(x0, x0 + δ) plus the system's sources, at m = x0 + δ/2
/// (System::rate). x1 = x0 + h f̄ is then the step of a discrete gradient method (see
/// discrete_gradient.h).
template <class T>
class DiscreteField {
 public:
  using Rule = DiscreteGradientRule;

  /// invariants: those to conserve; null: none
  DiscreteField(Rule rule, const phs::Model& model, phs::System<T>& system, bool lanes,
                std::shared_ptr<const InvariantGradients> invariants, int most_panels = 81)
      : rule_(rule),
        n_(size_t(model.description().nx)),
        system_(system),
        mean_(model, system, lanes, most_panels),
        invariants_(std::move(invariants)),
        x_(n_),
        lo_(n_),
        zero_(n_, T(0.0)),
        gradient_(n_),
        middle_(n_),
        part_(n_),
        offset_(n_),
        panels_(2 * n_) {
    if (invariants_) symmetries_.assign(invariants_->count(), std::vector<T>(n_));
  }

  void tell_turns(const std::vector<std::int64_t>& turns) { mean_.tell_turns(turns); }

  /// x0 = x + lo
  void start_at(std::span<const T> x, std::span<const T> lo) {
    std::copy(x.begin(), x.end(), x_.begin()), std::copy(lo.begin(), lo.end(), lo_.begin());
    mean_.start_at(x, lo);
    for (size_t k = 0; k < n_; ++k) middle_[k] = x_[k] + lo_[k];
    system_.gradient(middle_, gradient_);
    ++evaluations_;
    if (rule_ == Rule::gonzalez) H0_ = system_.hamiltonian(middle_);
    std::fill(panels_.begin(), panels_.end(), 1);
  }
  /// f̄, with the middle of the step at time t.
  void operator()(T t, std::span<const T> delta, std::span<T> f) {
    discrete_gradient(delta);
    for (size_t k = 0; k < n_; ++k) middle_[k] = x_[k] + (lo_[k] + T(0.5) * delta[k]);
    system_.rate(t, middle_, gradient_, f);
  }
  /// ∇̄H of the last evaluation; before the first, ∇H(x0).
  std::span<const T> efforts() const { return gradient_; }
  /// The works of the last evaluated step: powers at ∇̄H, so that the balance closes for any H.
  void book(T t, T h, PortWork<T>& works) {
    works.restart();
    works.add_at(system_, t, h, middle_, gradient_);
  }

  /// ∇̄H of the last evaluation, at δ, is linear in ∇H at its points: w · ∇̄H is the sum of
  /// c · ∇H(z) over the calls take(z, c). Sizes nx.
  template <class Take>
  void each_part(std::span<const T> delta, std::span<const T> w, const Take& take) {
    std::vector<T> c(n_);
    const auto add = [&](T factor, std::span<const T> along) {
      return [&, factor, along](std::span<const T> z, T weight) {
        for (size_t k = 0; k < n_; ++k) c[k] = factor * weight * along[k];
        take(z, std::span<const T>(c));
      };
    };
    if (rule_ == Rule::mean_value)
      return mean_.each_point(zero_, delta, panels_[0], add(T(1.0), w));
    if (rule_ == Rule::gonzalez) {
      const T along = dot(w, part_) * per_length2_;
      mean_.each_point(zero_, delta, panels_[0], add(along, delta));
      for (size_t k = 0; k < n_; ++k) middle_[k] = x_[k] + (lo_[k] + T(0.5) * delta[k]);
      for (size_t k = 0; k < n_; ++k) c[k] = w[k] - along * delta[k];
      return take(std::span<const T>(middle_), std::span<const T>(c));
    }
    std::vector<T> axis(n_, T(0.0));
    each_slope(delta, rule_ == Rule::itoh_abe2, [&](size_t i, int& panels, T weight) {
      axis[i] = w[i];
      mean_.each_point(offset_, part_, panels, add(weight, axis));
      axis[i] = T(0.0);
    });
  }

  /// Evaluations of ∇H or the field since the last call.
  int evaluations() { return std::exchange(evaluations_, 0) + mean_.evaluations(); }

 private:
  /// gradient_ = ∇̄H(x0, x0 + δ)
  void discrete_gradient(std::span<const T> delta) {
    double scale = 0;  // of the terms of ∇H · δ
    for (size_t k = 0; k < n_; ++k) scale = std::max(scale, magnitude(gradient_[k] * delta[k]));
    if (rule_ == Rule::gonzalez) {
      const bool resolved = mean_.along(zero_, delta, scale, panels_[0]);
      correct_middle(delta, resolved);
    } else if (rule_ == Rule::mean_value) {
      mean_.along(zero_, delta, scale, panels_[0]);
      for (size_t k = 0; k < n_; ++k) gradient_[k] = mean_.middle(k) + mean_.excess(k);
    } else {
      coordinate_slopes(delta, scale, rule_ == Rule::itoh_abe2);
    }
  }

  /// ∇H(m) + (H(x1) - H(x0) - ∇H(m)·δ) v / (v·δ), where v is δ minus its part along the symmetries.
  void correct_middle(std::span<const T> delta, bool resolved) {
    for (size_t k = 0; k < n_; ++k) gradient_[k] = mean_.middle(k);
    std::vector<T>& v = part_;
    std::copy(delta.begin(), delta.end(), v.begin());
    find_symmetries(delta);
    for (const auto& z : symmetries_) remove(z, v);
    const T remainder = remainder_of_H(delta, resolved);
    // Where ε = |v|/|δ| is small, as in a spin with little nutation, the remainder falls like ε² (H
    // has a critical point on the invariants' level there). Its rounding u would be amplified to
    // u/ε, so the correction is faded out at ε = κ.
    const T length2 = dot(v, v), kappa2 = T(256 * unit_roundoff<T>) * dot(delta, delta);
    per_length2_ = T(0.0);
    if (!(length2 > T(0.0))) return;
    per_length2_ = T(1.0) / (length2 + kappa2 * (kappa2 / length2));
    const T factor = remainder / (length2 + kappa2 * (kappa2 / length2));
    for (size_t k = 0; k < n_; ++k) gradient_[k] += factor * v[k];
  }

  /// J∇C at the middle for every invariant C, made orthogonal to each other. H does not change
  /// along them, and C(x1) - C(x0) = ∇C(m)·δ = -h ∇̄H·J∇C(m) vanishes with the part of ∇̄H along
  /// them.
  void find_symmetries(std::span<const T> delta) {
    for (size_t k = 0; k < n_; ++k) middle_[k] = x_[k] + (lo_[k] + T(0.5) * delta[k]);
    for (size_t i = 0; i < symmetries_.size(); ++i) {
      auto& z = symmetries_[i];
      (*invariants_)(i, std::span<const T>(middle_), std::span<T>(offset_));
      system_.apply_structure(middle_, offset_, z);
      const double before = magnitude(dot(z, z));
      for (size_t j = 0; j < i; ++j) remove(symmetries_[j], z);
      if (!(magnitude(dot(z, z)) > 1e-16 * before)) std::fill(z.begin(), z.end(), T(0.0));
    }
  }
  static T dot(std::span<const T> a, std::span<const T> b) {
    T sum(0.0);
    for (size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
  }
  /// Removes the part of v along z.
  static void remove(const std::vector<T>& z, std::vector<T>& v) {
    const T length2 = dot(z, z);
    if (!(length2 > T(0.0))) return;
    const T along = dot(z, v) / length2;
    for (size_t k = 0; k < v.size(); ++k) v[k] -= along * z[k];
  }
  /// H(x1) - H(x0) - ∇H(m)·δ as an integral, unless the difference itself shows that H is not
  /// smooth. Nothing else shows a kink between two nodes.
  T remainder_of_H(std::span<const T> delta, bool resolved) {
    for (size_t k = 0; k < n_; ++k) middle_[k] = x_[k] + (lo_[k] + delta[k]);
    const T H1 = system_.hamiltonian(middle_);
    T difference = H1 - H0_, integral(0.0);
    double terms = magnitude(H0_) + magnitude(H1);
    for (size_t k = 0; k < n_; ++k) {
      difference -= gradient_[k] * delta[k];
      integral += mean_.excess(k) * delta[k];
      terms += magnitude(gradient_[k]) * magnitude(x_[k]);
    }
    const double rounding = 16 * unit_roundoff<T> * terms;
    return resolved && !(magnitude(difference - integral) > rounding) ? integral : difference;
  }

  /// Slopes for one coordinate after another from x0 to x1; both_ways: the mean over this order and
  /// its reverse.
  void coordinate_slopes(std::span<const T> delta, double scale, bool both_ways) {
    std::fill(gradient_.begin(), gradient_.end(), T(0.0));
    each_slope(delta, both_ways, [&](size_t i, int& panels, T weight) {
      mean_.along(offset_, part_, scale, panels);
      gradient_[i] += weight * (mean_.middle(i) + mean_.excess(i));
    });
  }
  /// Calls at(i, panels, weight) for the segments from x0 to x1, each along a coordinate i: from
  /// x0 + offset_ by part_.
  template <class At>
  void each_slope(std::span<const T> delta, bool both_ways, const At& at) {
    std::fill(part_.begin(), part_.end(), T(0.0));
    for (size_t way = 0; way < (both_ways ? 2U : 1U); ++way) {
      std::fill(offset_.begin(), offset_.end(), T(0.0));
      for (size_t a = 0; a < n_; ++a) {
        const size_t i = way == 0 ? a : n_ - 1 - a;
        part_[i] = delta[i];
        at(i, panels_[way * n_ + i], T(both_ways ? 0.5 : 1.0));
        part_[i] = T(0.0);
        offset_[i] = delta[i];
      }
    }
  }

  Rule rule_;
  size_t n_;
  phs::System<T>& system_;
  MeanGradient<T> mean_;
  std::shared_ptr<const InvariantGradients> invariants_;
  std::vector<std::vector<T>> symmetries_;
  std::vector<T> x_, lo_;
  T H0_ = T(0.0), per_length2_ = T(0.0);  ///< the second: of the last correction
  std::vector<T> zero_, gradient_, middle_, part_, offset_;
  std::vector<int> panels_;  ///< of each segment, in this step
  int evaluations_ = 0;
};

}  // namespace porthos::integrators
