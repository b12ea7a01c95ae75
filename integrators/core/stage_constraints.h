#pragma once
#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "integrators/core/stage_lanes.h"
#include "phs/system/state.h"
#include "phs/system/system.h"

namespace porthos::integrators {

/// A system's constraints at up to V points at once: as lanes if T is double, otherwise one after
/// another, with the same bits.
template <class T, int V>
class StageConstraints {
 public:
  using Lanes = StageLanes<T, V>;

  /// model: a constrained one
  StageConstraints(const phs::Model& model, bool lanes) {
    if constexpr (std::is_same_v<T, double>)
      if (lanes) {
        system_of_lanes_ = model.template instantiate<Lanes>();
        all_ = system_of_lanes_->constraints();
        wide_.reserve(size_t(model.description().nx));
        return;
      }
    (void)lanes;
    system_ = model.template instantiate<T>();
    for (int i = 0; i < V; ++i) each_.push_back(system_->constraints());
    point_.resize(size_t(model.description().nx));
    push_.resize(point_.size());
    row_.resize(size_t(each_[0]->count()));
  }

  /// angles: 2π·turns of the angle blocks
  void set_turn_angles(std::span<const T> angles) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) {
        wide_.resize(angles.size());
        for (size_t k = 0; k < angles.size(); ++k) wide_[k] = Lanes(angles[k]);
        return all_->set_turn_angles(wide_);
      }
    for (auto& rows : each_) rows->set_turn_angles(angles);
  }

  /// The times of rows that move.
  void set_times(const Lanes& t, int used) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) return all_->set_time(t);
    for (int i = 0; i < used; ++i) each_[size_t(i)]->set_time(t[i]);
  }
  /// The first `used` points; lanes beyond them must hold a point too.
  void place(std::span<const Lanes> x, std::span<Lanes> g, int used) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) return all_->place(x, g);
    for (int i = 0; i < used; ++i) {
      for (size_t k = 0; k < point_.size(); ++k) point_[k] = x[k][i];
      each_[size_t(i)]->place(point_, row_);
      for (size_t r = 0; r < row_.size(); ++r) g[r].set(i, row_[r]);
    }
  }
  void forces(std::span<const Lanes> lambda, std::span<Lanes> Bl, int used) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) return all_->forces(lambda, Bl);
    for (int i = 0; i < used; ++i) {
      for (size_t r = 0; r < row_.size(); ++r) row_[r] = lambda[r][i];
      each_[size_t(i)]->forces(row_, push_);
      for (size_t k = 0; k < push_.size(); ++k) Bl[k].set(i, push_[k]);
    }
  }
  /// g' at the efforts e where place() was: Bᵀe + ∂g/∂t.
  void slips(std::span<const Lanes> e, std::span<Lanes> g_dot, int used) {
    if constexpr (std::is_same_v<T, double>)
      if (all_) {
        all_->rates(e, g_dot);
        return all_->add_drift(g_dot);
      }
    for (int i = 0; i < used; ++i) {
      for (size_t k = 0; k < point_.size(); ++k) point_[k] = e[k][i];
      each_[size_t(i)]->rates(point_, row_);
      each_[size_t(i)]->add_drift(row_);
      for (size_t r = 0; r < row_.size(); ++r) g_dot[r].set(i, row_[r]);
    }
  }
  /// ∂g/∂t.
  void drifts(std::span<Lanes> g_dot, int used) {
    std::fill(g_dot.begin(), g_dot.end(), Lanes(T(0.0)));
    if constexpr (std::is_same_v<T, double>)
      if (all_) return all_->add_drift(g_dot);
    for (int i = 0; i < used; ++i) {
      std::fill(row_.begin(), row_.end(), T(0.0));
      each_[size_t(i)]->add_drift(row_);
      for (size_t r = 0; r < row_.size(); ++r) g_dot[r].set(i, row_[r]);
    }
  }

 private:
  std::unique_ptr<phs::System<T>> system_;
  std::unique_ptr<phs::System<Lanes>> system_of_lanes_;
  std::unique_ptr<phs::Constraints<Lanes>> all_;
  std::vector<std::unique_ptr<phs::Constraints<T>>> each_;
  std::vector<T> point_, push_, row_;
  std::vector<Lanes> wide_;
};

}  // namespace porthos::integrators
