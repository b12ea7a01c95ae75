#pragma once
#include "contact/detail/rigid_gaps.h"
#include "contact/rigid.h"

namespace porthos::contact {

/// The forces of closed contacts at a state x whose field without them is dx.
class RestingForces {
 public:
  explicit RestingForces(const ContactModel& model)
      : nq_(size_t(model.mechanism().nq())),
        moving_(model),
        at_(model),
        impact_(moving_.count()),
        along_(2 * nq_),
        plastic_(moving_.count(), 0.0),
        pressed_(moving_.count(), 0.0) {}

  void set_turn_angles(std::span<const double> angles) {
    angles_.assign(angles.begin(), angles.end());
    moving_.set_turn_angles(angles_);
    at_.gaps.set_turn_angles(angles);
  }
  /// Adds Gᵀλ to dx. @param x  begins with q and p, dx as well; closed: one for each gap
  void hold(std::span<const double> x, std::span<double> dx, const std::vector<char>& closed) {
    at_.rows.clear();
    for (size_t k = 0; k < closed.size(); ++k)
      if (closed[k]) at_.rows.push_back(k);
    if (at_.rows.empty()) return;
    // g'' = d/dt (G M⁻¹ p) along dx, by a dual number
    for (size_t i = 0; i < 2 * nq_; ++i) along_[i] = phs::Dual{x[i], dx[i]};
    const auto moving = std::span<const phs::Dual>(along_);
    moving_.place(moving.first(nq_));
    moving_.move(moving.first(nq_), moving.subspan(nq_, nq_));
    at_.gaps.place(x.first(nq_));
    at_.evaluate(x.first(nq_), x.subspan(nq_, nq_));
    double scale = 0;
    for (size_t i = 0; i < at_.rows.size(); ++i) {
      at_.v[i] = moving_.rate(at_.rows[i]).d;
      scale = std::max(scale, std::fabs(at_.v[i]));
    }
    impact_.solve(at_.W, at_.v, std::span(plastic_).first(at_.rows.size()), Simultaneous::moreau);
    const auto lambda = impact_.impulses();
    for (size_t i = 0; i < at_.rows.size(); ++i) {
      const double w = at_.W[i * (at_.rows.size() + 1)];
      // Of several that press on one body some may bear nothing, and none may: an acceleration of
      // rounding does not open them.
      pressed_[at_.rows[i]] = (lambda[i] * w + rounding(scale)) - std::max(at_.v[i], 0.0);
      const auto g = at_.gradient(i);
      for (size_t j = 0; j < nq_; ++j) dx[nq_ + j] += lambda[i] * g[j];
    }
  }
  /// Of a closed gap after hold(): positive while it is pressed, negative where it would open.
  double pressed(size_t k) const { return pressed_[k]; }

 private:
  static double rounding(double scale) { return 1e-10 * scale + 1e-13; }  // [m/s² | rad/s²]

  size_t nq_;
  RigidGaps<phs::Dual> moving_;
  RigidRows<double> at_;
  RigidImpact<double> impact_;
  std::vector<phs::Dual> along_, angles_;
  std::vector<double> plastic_, pressed_;
};

}  // namespace porthos::contact
