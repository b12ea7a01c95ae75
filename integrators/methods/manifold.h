#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "integrators/methods/step_rows.h"
#include "phs/system/state.h"

namespace porthos::integrators {

/// The manifold of a system's constraints at the ends of steps, and the ways back to it: positions
/// along M⁻¹B to g = 0, momenta along B to Bᵀe + ∂g/∂t = 0.
template <class T>
class Manifold {
  using State = phs::BasicState<T>;
  struct Pair {
    size_t q, p;
  };

 public:
  /// system: with m > 0 rows; it must outlive this object. So must cost, which counts gradients
  Manifold(phs::System<T>& system, size_t m, Cost& cost)
      : system_(system),
        cost_(cost),
        rows_(system, m),
        x_(size_t(system.description().nx)),
        e_(x_.size()),
        e_at_rest_(x_.size()),
        push_(x_.size()),
        row_(m, T(0.0)),
        slip_(m, T(0.0)),
        drift_(m, T(0.0)) {
    for (const auto& b : system.description().blocks) {
      if (b.momentum < 0) continue;
      for (int k = 0; k < b.size; ++k) pairs_.push_back({size_t(b.at + k), size_t(b.momentum + k)});
      if (b.kind == phs::BlockKind::rotation) turns_.push_back({size_t(b.at), size_t(b.momentum)});
    }
  }

  /// The rows at the start of a step, then at its end.
  StepRows<T>& rows() { return rows_; }
  const StepRows<T>& rows() const { return rows_; }

  /// Moves positions to g = 0 at time t, with the factors at the start of the step, because off the
  /// manifold dependent rows look independent. So it converges linearly, by a ratio of order h.
  /// @return whether it reached rounding
  bool bring_positions_back(const T& t, State& state) {
    rows_->set_time(t);
    double last = HUGE_VAL;
    for (int i = 0; i < 200; ++i) {
      place(state);
      const double gap = largest(row_), rounding = 64 * unit_roundoff<T> * size_of_positions();
      const bool near = gap <= rounding;
      if (gap == 0 || !(gap < (near ? 0.5 : 0.95) * last)) return near;
      last = gap;
      rows_->solve(row_);
      move_along(state);
    }
    return false;
  }
  /// Adds to momenta what makes Bᵀe + ∂g/∂t = 0 at time t, until what remains is a rounding of the
  /// rates, or until it settles. Once is enough where e is linear in the momenta and the rows are
  /// well conditioned. Factors the rows there. @param impulse  written: the multipliers of that
  void bring_momenta_back(const T& t, State& state, std::span<T> impulse) {
    rows_->set_time(t);
    rows_.move_to(state.x);
    std::fill(impulse.begin(), impulse.end(), T(0.0));
    double last = HUGE_VAL;
    for (int i = 0;; ++i) {
      slips_at(state);
      const double now = largest(slip_);
      const bool settled = i >= 2 && (i >= 8 || !(now < 0.01 * last));
      if (settled || (i >= 1 && now <= 8 * unit_roundoff<T> * largest_rate())) break;
      last = now;
      std::copy(slip_.begin(), slip_.end(), row_.begin());
      rows_->solve(row_);
      rows_->forces(row_, push_);
      for (size_t r = 0; r < row_.size(); ++r) impulse[r] = impulse[r] + row_[r];
      for (const auto& [q, p] : pairs_) phs::compensated_add(state.x[p], state.lo[p], -push_[p]);
    }
    rows_.keep_at(state.x);
  }
  /// Bᵀe + ∂g/∂t that remained, and ∂g/∂t.
  std::span<const T> slip() const { return slip_; }
  std::span<const T> drift() const { return drift_; }

 private:
  static double largest(const std::vector<T>& x) {
    double most = 0;
    for (const T& a : x) most = std::max(most, magnitude(a));
    return most;
  }
  /// Of the positions, in e_.
  double largest_rate() const {
    double most = 0;
    for (const auto& [q, p] : pairs_) most = std::max(most, double(magnitude(e_[p])));
    return most;
  }
  double size_of_positions() const {
    double most = 1;
    for (const auto& [q, p] : pairs_) most = std::max(most, double(magnitude(x_[q])));
    return most;
  }
  void read(const State& state) {
    for (size_t k = 0; k < x_.size(); ++k) x_[k] = state.x[k] + state.lo[k];
  }
  /// row_ = g at the state.
  void place(const State& state) {
    read(state);
    rows_->place(x_, row_);
  }
  void slips_at(const State& state) {
    read(state);
    system_.gradient(x_, e_);
    ++cost_.evaluations;
    rows_->rates(e_, slip_);
    std::fill(drift_.begin(), drift_.end(), T(0.0));
    rows_->add_drift(drift_);
    for (size_t r = 0; r < slip_.size(); ++r) slip_[r] = slip_[r] + drift_[r];
  }
  /// q ← q - M⁻¹ B row_, where M⁻¹ is the change of ∂H/∂p with p: of momenta of the usual size, so
  /// that a part of ∂H/∂p that does not depend on p leaves no rounding.
  void move_along(State& state) {
    rows_->forces(row_, push_);
    const double most = largest(push_);
    if (!(most > 1e-290) || !std::isfinite(most)) return;
    const T scale(std::exp2(-std::floor(std::log2(most))));
    for (const auto& [q, p] : pairs_) x_[p] = T(0.0);
    system_.gradient(x_, e_at_rest_);
    for (const auto& [q, p] : pairs_) x_[p] = scale * push_[p];
    system_.gradient(x_, e_);
    cost_.evaluations += 2;
    for (const auto& [q, p] : pairs_) e_[q] = (e_at_rest_[p] - e_[p]) / scale;
    for (const auto& turn : turns_) keep_lift(state, turn);
    for (const auto& [q, p] : pairs_) phs::compensated_add(state.x[q], state.lo[q], e_[q]);
  }
  /// The move δ of a quaternion ξ, in e_, without a change of |ξ|; its momentum π keeps ξ·π.
  void keep_lift(State& state, const Pair& turn) {
    T growth(0.0), along(0.0);
    for (size_t k = 0; k < 4; ++k) {
      const T &xi = state.x[turn.q + k], &move = e_[turn.q + k];
      growth = growth + move * (T(2.0) * xi + move);
      along = along + move * state.x[turn.p + k];
    }
    for (size_t k = 0; k < 4; ++k) {
      const T xi = state.x[turn.q + k] + e_[turn.q + k];
      e_[turn.q + k] = e_[turn.q + k] - T(0.5) * growth * xi;
      phs::compensated_add(state.x[turn.p + k], state.lo[turn.p + k], -(along * xi));
    }
  }

  phs::System<T>& system_;
  Cost& cost_;
  StepRows<T> rows_;
  std::vector<Pair> pairs_;  ///< positions and their momenta
  std::vector<Pair> turns_;  ///< offsets of quaternions and of theirs
  std::vector<T> x_, e_, e_at_rest_, push_, row_, slip_, drift_;
};

}  // namespace porthos::integrators
