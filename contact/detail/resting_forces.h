#pragma once
#include "contact/detail/coulomb.h"
#include "contact/detail/rigid_gaps.h"
#include "contact/rigid.h"

namespace porthos::contact {

/// The forces of closed contacts at a state x whose field without them is dx: normal ones, and
/// friction where a contact has it, see Coulomb.
class RestingForces {
 public:
  explicit RestingForces(const ContactModel& model)
      : nq_(size_t(model.mechanism().nq())),
        rigid_(model.rigid()),
        moving_(model),
        at_(model),
        impact_(moving_.count()),
        coulomb_(moving_.rows()),
        along_(2 * nq_),
        plastic_(moving_.count(), 0.0),
        pressed_(moving_.count(), 0.0),
        lambda_(moving_.rows(), 0.0),
        rubbing_at_(at_.gaps.rubbing()) {
    rubs_.reserve(rubbing_at_.size());
    rubs_of_.assign(rubbing_at_.size(), none);
    across_.resize(rubbing_at_.size());
    const auto& powers = model.description().powers;
    for (const size_t k : rubbing_at_)
      for (size_t a = 0; a < powers.size(); ++a)
        if (powers[a].name == rigid_[at_.gaps.rigid(k)].name + ".friction") lost_at_.push_back(a);
  }

  void set_turn_angles(std::span<const double> angles) {
    angles_.assign(angles.begin(), angles.end());
    moving_.set_turn_angles(angles_);
    at_.gaps.set_turn_angles(angles);
  }
  /// Adds Gᵀλ to dx. @param x  begins with q and p, dx as well; touching: one for each gap
  void hold(std::span<const double> x, std::span<double> dx, std::vector<Touching>& touching) {
    at_.rows.clear();
    for (size_t k = 0; k < touching.size(); ++k)
      if (touching[k]) at_.rows.push_back(k);
    rubs_.clear();
    if (at_.rows.empty()) return;
    const auto q = x.first(nq_), p = x.subspan(nq_, nq_);
    at_.gaps.place(q);
    normals_ = at_.rows.size();
    if (!rubbing_at_.empty()) list_rubs(q, p, touching);
    // Rates of the rows' v = G M⁻¹ p along dx, by a dual number
    for (size_t i = 0; i < 2 * nq_; ++i) along_[i] = phs::Dual{x[i], dx[i]};
    const auto moving = std::span<const phs::Dual>(along_);
    moving_.place(moving.first(nq_));
    moving_.move(moving.first(nq_), moving.subspan(nq_, nq_));
    at_.evaluate(q, p);
    scale_ = 0;
    for (size_t i = 0; i < at_.rows.size(); ++i) {
      at_.v[i] = moving_.rate(at_.rows[i]).d;
      scale_ = std::max(scale_, std::fabs(at_.v[i]));
    }
    const auto lambda = rubs_.empty() ? press() : rub(touching);
    const size_t m = at_.rows.size();
    for (size_t i = 0; i < m; ++i) {
      const double w = at_.W[i * (m + 1)];
      // Of several that press on one body some may bear nothing, and none may: an acceleration of
      // rounding does not open them.
      if (i < normals_)
        pressed_[at_.rows[i]] = (lambda[i] * w + rounding()) - std::max(at_.v[i], 0.0);
      const auto g = at_.gradient(i);
      for (size_t j = 0; j < nq_; ++j) dx[nq_ + j] += lambda[i] * g[j];
    }
  }
  /// Of a closed gap after hold(): positive while it is pressed, negative where it would open.
  double pressed(size_t k) const { return pressed_[k]; }

  // --- of gap rubbing()[j] after hold(), where it is closed --------------------------------------
  /// |λ_t| - μ λ_n in accelerations, positive where sticking needs more friction than there is. The
  /// margins keep a body at rest for which friction is just enough, or that nothing loads.
  double strained(size_t j) const {
    const Rubbing& r = of(j);
    return (std::hypot(lambda_[r.across], lambda_[r.across + 1]) -
            (1 + 1e-12) * r.mu * lambda_[r.normal]) *
               weight(r.normal) -
           1e-13 * scale_ - 1e-15;
  }
  /// Whether its friction is one of several that would do.
  bool shared(size_t j) const { return coulomb_.shared(of(j).normal); }
  /// The rate at which friction alone takes the slip down [m/s²].
  double braked(size_t j) const { return of(j).mu * lambda_[of(j).normal] * weight(of(j).across); }
  /// Change of the slip, by both directions, world axes [m/s²].
  Vec3d slip_rate(size_t j) const {
    const size_t r = of(j).across;
    return at_.v[r] * across_[j][0] + at_.v[r + 1] * across_[j][1];
  }
  /// The friction on B, world axes [N].
  Vec3d friction(size_t j) const {
    const size_t r = of(j).across;
    return lambda_[r] * across_[j][0] + lambda_[r + 1] * across_[j][1];
  }
  /// Adds what friction takes to the powers at efforts e [W].
  void add_losses(std::span<const double> e, std::span<double> powers) const {
    for (size_t j = 0; j < rubs_of_.size(); ++j) {
      if (rubs_of_[j] == none || of(j).sticks) continue;
      const size_t r = of(j).across;
      const auto g = at_.gradient(r);
      double v = 0;
      for (size_t i = 0; i < nq_; ++i) v += g[i] * e[nq_ + i];
      powers[lost_at_[j]] -= lambda_[r] * v;
    }
  }

 private:
  static constexpr size_t none = size_t(-1);
  double rounding() const { return 1e-10 * scale_ + 1e-13; }  // [m/s² | rad/s²]

  const Rubbing& of(size_t j) const { return rubs_[rubs_of_[j]]; }
  double weight(size_t row) const { return at_.W[row * (at_.rows.size() + 1)]; }

  /// The directions across every closed gap with friction, as rows behind the normals.
  void list_rubs(std::span<const double> q, std::span<const double> p,
                 const std::vector<Touching>& touching) {
    std::fill(rubs_of_.begin(), rubs_of_.end(), none);
    bool moved = false;
    for (size_t j = 0; j < rubbing_at_.size(); ++j) {
      const size_t k = rubbing_at_[j];
      const Touching& now = touching[k];
      if (!now) continue;
      Vec3d along = now.along;
      if (now.slides() && now.turns) {
        if (!moved) at_.gaps.move(q, p);
        moved = true;
        const Vec3d slip = at_.gaps.slip(k);
        if (dot(slip, slip) > 0) along = slip;
      }
      across_[j] = directions_across(at_.gaps.normal(k), along);
      at_.gaps.set_across(j, across_[j]);
      std::array<Vec3<phs::Dual>, 2> dual;
      for (size_t i = 0; i < 2; ++i)
        dual[i] = {phs::Dual(across_[j][i].x), phs::Dual(across_[j][i].y),
                   phs::Dual(across_[j][i].z)};
      moving_.set_across(j, dual);
      const size_t normal =
          size_t(std::find(at_.rows.begin(), at_.rows.end(), k) - at_.rows.begin());
      rubs_of_[j] = rubs_.size();
      rubs_.push_back({normal, at_.rows.size(), rigid_[at_.gaps.rigid(k)].friction, now.sticks()});
      at_.rows.push_back(at_.gaps.across(j, 0));
      at_.rows.push_back(at_.gaps.across(j, 1));
    }
  }
  std::span<const double> press() {
    impact_.solve(at_.W, at_.v, std::span(plastic_).first(at_.rows.size()), Simultaneous::moreau);
    return impact_.impulses();
  }
  std::span<const double> rub(std::vector<Touching>& touching) {
    const size_t m = at_.rows.size();
    const auto lambda = std::span(lambda_).first(m);
    if (!coulomb_.solve(at_.W, at_.v, normals_, rubs_, lambda)) {
      touching[at_.rows[coulomb_.jammed()]].singular = true;
      std::fill(lambda.begin(), lambda.end(), NAN);
    }
    for (size_t i = 0; i < m; ++i)
      for (size_t k = 0; k < m; ++k) at_.v[i] += at_.W[i * m + k] * lambda[k];
    return lambda;
  }

  size_t nq_, normals_ = 0;
  double scale_ = 0;  ///< the largest acceleration that is held
  const std::vector<ContactModel::Rigid>& rigid_;
  RigidGaps<phs::Dual> moving_;
  RigidRows<double> at_;
  RigidImpact<double> impact_;
  Coulomb coulomb_;
  std::vector<phs::Dual> along_, angles_;
  std::vector<double> plastic_, pressed_, lambda_;
  std::vector<size_t> rubbing_at_;  ///< the gaps with friction
  std::vector<Rubbing> rubs_;       ///< of those that are closed
  std::vector<size_t> rubs_of_;     ///< of gap rubbing()[j], its place in rubs_
  std::vector<size_t> lost_at_;     ///< of gap rubbing()[j], the power of its friction
  std::vector<std::array<Vec3d, 2>> across_;
};

}  // namespace porthos::contact
