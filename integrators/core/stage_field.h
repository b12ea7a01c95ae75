#pragma once
#include <memory>
#include <span>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/core/stage_lanes.h"

namespace porthos::integrators {

/// A system evaluated at up to V points at once: as lanes if T is double, otherwise one after
/// another, with the same bits. `used` is the number of points. Lanes beyond it must hold a point
/// too; they return the value of the last one.
template <class T, int V>
class StageField {
 public:
  using Lanes = StageLanes<T, V>;

  /// one: the evaluator of single points; the integrator owns it and sets its turns
  StageField(const phs::Model& model, phs::System<T>& one, bool lanes)
      : one_(one),
        turns_(model.description()),
        point_(size_t(model.description().nx)),
        value_(point_.size()) {
    if constexpr (std::is_same_v<T, double>)
      if (lanes) all_ = model.template instantiate<Lanes>();
    (void)lanes;
  }

  void tell_turns(const std::vector<std::int64_t>& turns) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) turns_.synchronise(turns, *all_);
    (void)turns;
  }

  /// F_i = f(t + dt_i, Y_i)
  void field(T t, const Lanes& dt, std::span<const Lanes> Y, std::span<Lanes> F, int used = V) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) return all_->field(Lanes(t) + dt, Y, {}, F);
    each(Y, F, used, [&](int i) { one_.field(t + dt[i], point_, {}, value_); });
  }
  /// Calls `take` for the powers(a, i) of the first `used` points, where the field is F; E is
  /// scratch.
  template <class Take>
  void powers(T t, const Lanes& dt, std::span<const Lanes> Y, std::span<const Lanes> F,
              std::span<Lanes> E, int used, Take take) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) {
        powers_.resize(one_.description().powers.size());
        all_->efforts(Lanes(t) + dt, Y, F, E);
        all_->powers(Lanes(t) + dt, Y, E, powers_);
        for (int i = 0; i < used; ++i)
          for (size_t a = 0; a < powers_.size(); ++a) take(a, i, powers_[a][i]);
        return;
      }
    rate_.resize(point_.size());
    power_.resize(one_.description().powers.size());
    for (int i = 0; i < used; ++i) {
      for (size_t k = 0; k < point_.size(); ++k) {
        point_[k] = Y[k][i];
        rate_[k] = F[k][i];
      }
      one_.efforts(t + dt[i], point_, rate_, value_);
      one_.powers(t + dt[i], point_, value_, power_);
      for (size_t a = 0; a < power_.size(); ++a) take(a, i, power_[a]);
    }
  }
  /// E_i = ∂H/∂x(Y_i), where the field is F.
  void efforts(T t, const Lanes& dt, std::span<const Lanes> Y, std::span<const Lanes> F,
               std::span<Lanes> E, int used = V) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) return all_->efforts(Lanes(t) + dt, Y, F, E);
    rate_.resize(point_.size());
    each(Y, E, used, [&](int i) {
      for (size_t k = 0; k < point_.size(); ++k) rate_[k] = F[k][i];
      one_.efforts(t + dt[i], point_, rate_, value_);
    });
  }
  /// E_i = ∂H/∂x(Y_i)
  void gradient(std::span<const Lanes> Y, std::span<Lanes> E, int used = V) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) return all_->gradient(Y, E);
    each(Y, E, used, [&](int) { one_.gradient(point_, value_); });
  }

 private:
  template <class Evaluate>
  void each(std::span<const Lanes> Y, std::span<Lanes> out, int used, Evaluate evaluate) {
    for (int i = 0; i < used; ++i) {
      for (size_t k = 0; k < point_.size(); ++k) point_[k] = Y[k][i];
      evaluate(i);
      for (size_t k = 0; k < point_.size(); ++k) out[k].set(i, value_[k]);
    }
    for (int i = used; i < V; ++i)
      for (size_t k = 0; k < point_.size(); ++k) out[k].set(i, value_[k]);
  }

  phs::System<T>& one_;
  std::unique_ptr<phs::System<Lanes>> all_;
  TurnKeeper<Lanes> turns_;
  std::vector<T> point_, value_, rate_, power_;
  std::vector<Lanes> powers_;
};

}  // namespace porthos::integrators
