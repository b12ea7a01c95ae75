#pragma once
#include "contact/detail/cone_newton.h"

namespace porthos::contact {

/// The impulses of a step by non-smooth Gauss-Seidel: one contact after another gets the exact
/// impulse of its cone, in a fixed order, until none would change a velocity by more than a wanted
/// part of the largest (Jean 1999; Acary, Brogliato 2008, 13.7.4). Where that takes long, a small
/// cluster of contacts is given to ConeNewton, and the sweeps judge what it found.
///
/// The law is one of mean velocities u over the step, with u⁻ that at its start:
///   0 <= u_n - (1 - e) min(u⁻_n, 0)/2 ⊥ P_n >= 0: u⁺_n = 2 u_n - u⁻_n = -e u⁻_n, as Newton says
///   P_t against u⁺_t, so a contact that sticks has u⁺_t = 0
/// The work of the normal impulse, P_n u_n, is thus never positive. Friction would do work in a
/// step in which a load turns a slip round: there P_t is against u_t itself (`damps` is false).
class Cones {
 public:
  static constexpr double least_residual = 1e-11;  ///< that is asked for
  /// An approach below this part of the largest velocity is none: at rest it is what the residual
  /// left, and corners of one body would contradict each other about it.
  static constexpr double quiet = 1e-8;
  /// Taken where the wanted residual is not reached in most_sweeps.
  static constexpr double accepted = 1e-2;
  static constexpr int most_sweeps = 1000;
  static constexpr int patience = 50;  ///< sweeps before Newton's method

  explicit Cones(const ContactModel& model)
      : rigid_(model.rigid()), v_(size_t(model.mechanism().nv())), unit_(v_.size()) {}

  /// At the start of a step: all clusters damp.
  void begin(const StepContacts& contacts) { clusters_.assign(contacts.clusters(), {}); }
  /// From the points' free velocities and impulses, which it changes, to `residual`, relative.
  /// @return whether it is reached
  bool solve(StepContacts& contacts, double residual) {
    scale_ = 0;
    for (auto& each : contacts.points) {
      for (const Vec3d& u : {each.before, each.free, each.cone.times(each.in_axes(each.impulse))})
        scale_ = std::max(scale_, norm(u));
      each.along = {0, 0, 0};
      auto& cluster = clusters_[each.cluster];
      cluster.open = true;
      cluster.last_square = 0;
    }
    if (!std::isfinite(scale_)) return false;
    for (auto& each : contacts.points) each.target = target(each);
    wanted_ = residual * scale_;
    std::fill(v_.begin(), v_.end(), 0.0);
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
      for (auto& each : clusters_) each.reached = each.square = each.work = 0;
      reached_ = 0;
      for (auto& each : contacts.points)
        if (clusters_[each.cluster].open) renew(contacts, each);
      for (auto& each : clusters_) {
        each.reached = std::sqrt(each.reached);
        reached_ = std::max(reached_, each.reached);
      }
      if (reached_ <= wanted_ && settle(contacts)) return true;
      if (sweep % patience == patience - 1) finish(contacts);
      go_on(contacts);
    }
    return reached_ <= accepted * scale_;
  }
  /// Whether the last solve() took what most_sweeps had reached.
  bool stalled() const { return reached_ > wanted_; }
  /// That of the last solve(), relative.
  double reached() const { return scale_ > 0 ? reached_ / scale_ : 0.0; }
  /// The largest velocity then [m/s].
  double scale() const { return scale_; }

 private:
  /// The mean velocity that the law is about.
  Vec3d target(const StepContacts::Point& each) const {
    const double e = rigid_[each.rigid].restitution;
    const Vec3d& before = each.before;
    double normal = each.ahead < 0 ? each.ahead : 0.5 * (1 - e) * std::min(before.x, 0.0);
    if (normal > -quiet * scale_) normal = 0;
    const double slip = clusters_[each.cluster].damps ? 0.5 : 0;
    return {normal, slip * before.y, slip * before.z};
  }
  void renew(const StepContacts& contacts, StepContacts::Point& each) {
    const Vec3d before = each.in_axes(each.impulse);
    const Vec3d b = each.free + contacts.rates(each, v_) - each.cone.times(before) - each.target;
    const Vec3d next = each.cone.impulse(b), d = next - before;
    each.moved = each.in_world(d);
    if (d.x == 0 && d.y == 0 && d.z == 0) return;
    contacts.add_rates(each, d, v_);
    each.impulse = each.in_world(next);
    Cluster& cluster = clusters_[each.cluster];
    cluster.square += dot(d, d);
    const Vec3d u = each.cone.times(d);
    cluster.reached = std::max(cluster.reached, dot(u, u));
  }
  /// What the sweeps do not end, Newton's method does, where a cluster is small.
  void finish(StepContacts& contacts) {
    for (size_t k = 0; k < clusters_.size(); ++k) {
      if (!(clusters_[k].open && clusters_[k].reached > wanted_)) continue;
      newton_.clear();
      bool room = true;
      for (auto& each : contacts.points) {
        if (each.cluster != k) continue;
        room = room && newton_.add(each, rigid_[each.rigid].friction);
      }
      if (room && newton_.solve(contacts, 0.1 * wanted_, v_, unit_)) clusters_[k].last_square = 0;
    }
  }
  /// Along the conjugate direction of the sweeps, as if they were gradients (Silcowitz-Hansen,
  /// Niebe, Erleben 2010).
  void go_on(StepContacts& contacts) {
    for (Cluster& each : clusters_) {
      each.open = each.open && each.reached > wanted_;
      if (!each.open) continue;
      const double ratio = each.last_square > 0 ? each.square / each.last_square : 0;
      each.beta = ratio < 1.001 ? std::min(ratio, 1.0) : 0;
      each.last_square = each.square;
    }
    for (auto& each : contacts.points) {
      const Cluster& cluster = clusters_[each.cluster];
      if (!cluster.open) continue;
      const Vec3d more = cluster.beta * each.along;
      each.along = more + each.moved;
      if (cluster.beta == 0) continue;
      each.impulse = each.impulse + more;
      contacts.add_rates(each, each.in_axes(more), v_);
    }
  }
  /// At the end: where the friction of a cluster does work the cluster ceases to damp, and is open
  /// again. @return whether there is none
  bool settle(StepContacts& contacts) {
    for (const auto& each : contacts.points) {
      if (each.rows == 1) continue;
      const Vec3d P = each.in_axes(each.impulse), u = each.free + contacts.rates(each, v_);
      clusters_[each.cluster].work += P.y * u.y + P.z * u.z - 10 * wanted_ * std::hypot(P.y, P.z);
    }
    bool done = true;
    for (Cluster& each : clusters_) {
      if (!each.damps || !(each.work > 0)) continue;
      each = {.damps = false, .open = true, .reached = HUGE_VAL};
      done = false;
    }
    if (!done)
      for (auto& each : contacts.points) each.target = target(each);
    return done;
  }

  /// Contacts that can press on each other.
  struct Cluster {
    bool damps = true, open = false;               ///< open: not solved yet
    double reached = 0;                            ///< change of velocity in the last sweep
    double square = 0, last_square = 0, beta = 0;  ///< of conjugate directions
    double work = 0;                               ///< of friction
  };
  const std::vector<ContactModel::Rigid>& rigid_;
  std::vector<Cluster> clusters_;
  ConeNewton newton_;
  std::vector<double> v_, unit_;  ///< what the changes of impulses do to joint rates
  double scale_ = 0, wanted_ = 0, reached_ = 0;
};

}  // namespace porthos::contact
