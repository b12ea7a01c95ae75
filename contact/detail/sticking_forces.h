#pragma once
#include <algorithm>
#include <limits>

#include "contact/contact.h"
#include "contact/detail/stick_slip.h"
#include "mechanics/hamiltonian_field.h"

namespace porthos::contact {

/// The frictions of dry joints at a state x whose field without those that stick is dx. Both begin
/// with q and p of the mechanism. Allocates nothing after construction.
class StickingForces {
 public:
  explicit StickingForces(const ContactModel& model)
      : joints_(model.placed_dry()),
        m_(model.mechanism()),
        nq_(size_t(m_.nq())),
        w_(m_),
        moving_(m_),
        solver_(joints_.size()),
        along_(2 * nq_),
        unit_(nq_, 0.0),
        a_(joints_.size()),
        lambda_(joints_.size(), 0.0) {
    rows_.reserve(joints_.size());
    W_.reserve(joints_.size() * joints_.size());
    right_.reserve(joints_.size());
    bounds_.reserve(joints_.size());
    for (const DryFriction& f : model.dry()) breakaway_.push_back(f.holds());
  }
  void set_turn_angles(std::span<const double> angles) {
    std::copy(angles.begin(), angles.end(), w_.turn_angle.begin());
    std::copy(angles.begin(), angles.end(), moving_.turn_angle.begin());
  }
  double breakaway(size_t k) const { return breakaway_[k]; }

  /// M⁻¹ p, of every freedom. Valid until the next call of another function.
  std::span<const double> rates(std::span<const double> x) {
    mechanics::rates_from_momenta<double>(m_, w_, x.first(nq_), x.subspan(nq_, nq_));
    return w_.rate;
  }
  /// v' of the dry joints along dx, by a dual number.
  std::span<const double> accelerations(std::span<const double> x, std::span<const double> dx) {
    for (size_t i = 0; i < 2 * nq_; ++i) along_[i] = phs::Dual{x[i], dx[i]};
    const auto moving = std::span<const phs::Dual>(along_);
    mechanics::rates_from_momenta<phs::Dual>(m_, moving_, moving.first(nq_),
                                             moving.subspan(nq_, nq_));
    for (size_t k = 0; k < joints_.size(); ++k) a_[k] = moving_.rate[joints_[k].v].d;
    return a_;
  }
  /// Adds to dx the forces λ that keep v' = 0 where `slides` is 0.
  void hold(std::span<const double> x, std::span<double> dx, const std::vector<int>& slides) {
    solve(x, dx, slides, std::numeric_limits<double>::infinity());
    // Where all are at rest nothing is left but rounding, on which no iteration would agree. Joints
    // that turn and that slide are compared by f² W.
    const auto size = [&](size_t i, double f) { return f * f * W_[i * (rows_.size() + 1)]; };
    double largest = 0;
    for (size_t i = 0; i < rows_.size(); ++i)
      largest = std::max(largest, size(i, lambda_[rows_[i]]));
    for (size_t i = 0; i < rows_.size(); ++i) {
      double& p = dx[nq_ + joints_[rows_[i]].q];
      p += lambda_[rows_[i]];
      if (size(i, p) <= 1e-28 * largest) p = 0;
    }
  }
  /// The same with |λ| <= (1 + 1e-12) breakaway: joints that this does not hold begin to slide.
  /// @return  whether any does
  bool release(std::span<const double> x, std::span<const double> dx, std::vector<int>& slides) {
    solve(x, dx, slides, 1 + 1e-12);  // so that a joint which breaks away does so once
    bool any = false;
    for (size_t i = 0; i < rows_.size(); ++i) {
      slides[rows_[i]] = -solver_.bound(i);
      any = any || slides[rows_[i]] != 0;
    }
    return any;
  }
  double lambda(size_t k) const { return lambda_[k]; }
  /// Takes the rates of the joints that stick back to 0. @param p_change  gets what to add to p
  void stop(std::span<const double> x, const std::vector<int>& slides, std::span<double> p_change) {
    gather(x.first(nq_), slides);
    const auto v = rates(x);
    right_.clear();
    for (const size_t k : rows_) right_.push_back(v[joints_[k].v]);
    bounds_.assign(rows_.size(), std::numeric_limits<double>::infinity());
    const auto impulse = solver_.solve(W_, right_, bounds_);
    std::fill(p_change.begin(), p_change.end(), 0.0);
    for (size_t i = 0; i < rows_.size(); ++i) p_change[joints_[rows_[i]].q] = impulse[i];
  }

 private:
  /// The joints that stick, and W of them.
  void gather(std::span<const double> q, const std::vector<int>& slides) {
    rows_.clear();
    for (size_t k = 0; k < joints_.size(); ++k)
      if (slides[k] == 0) rows_.push_back(k);
    const size_t m = rows_.size();
    W_.resize(m * m);
    for (size_t i = 0; i < m; ++i) {
      double& push = unit_[joints_[rows_[i]].q];
      push = 1;
      mechanics::rates_from_momenta<double>(m_, w_, q, unit_);
      push = 0;
      for (size_t j = 0; j < m; ++j) W_[i * m + j] = w_.rate[joints_[rows_[j]].v];
    }
  }
  void solve(std::span<const double> x, std::span<const double> dx, const std::vector<int>& slides,
             double bound) {
    accelerations(x, dx);
    gather(x.first(nq_), slides);
    right_.clear();
    bounds_.clear();
    for (const size_t k : rows_) {
      right_.push_back(a_[k]);
      bounds_.push_back(bound * breakaway_[k]);
    }
    const auto lambda = solver_.solve(W_, right_, bounds_);
    for (size_t i = 0; i < rows_.size(); ++i) lambda_[rows_[i]] = lambda[i];
  }

  const std::vector<ContactModel::PlacedJoint>& joints_;
  const mechanics::Mechanism& m_;
  size_t nq_;
  mechanics::Workspace<double> w_;
  mechanics::Workspace<phs::Dual> moving_;
  StickSlip solver_;
  std::vector<phs::Dual> along_;
  std::vector<double> unit_, a_, lambda_, breakaway_;
  std::vector<double> W_, right_, bounds_;  ///< of the joints in rows_
  std::vector<size_t> rows_;
};

}  // namespace porthos::contact
