// The switches of a run with rigid contacts: impacts, closed contacts, where they open, slide or
// stick.
#include <fmt/format.h>

#include <algorithm>

#include "contact/detail/endings.h"
#include "contact/detail/exact_rows.h"
#include "contact/detail/held_system.h"
#include "contact/detail/resting_forces.h"
#include "contact/detail/rough_impact.h"
#include "contact/detail/thresholds.h"

namespace porthos::contact {
namespace {

using integrators::Outcome;
using phs::Quad;

/// The depth of a free gap, or minus how hard a closed one is pressed. Then of every gap with
/// friction: while it slides minus its slip, while it sticks the friction that it lacks for that.
class RigidSwitches final : public HeldSwitches<RestingModel> {
 public:
  RigidSwitches(std::shared_ptr<RestingModel> model, std::shared_ptr<const phs::Model> part,
                const std::shared_ptr<const phs::Model>& kept, double h)
      : HeldSwitches(std::move(model), std::move(part), kept, h),
        at_(contacts_),
        exact_(contacts_),
        forces_(contacts_),
        impact_(at_.count()),
        rough_(at_.rows()),
        rubbing_(at_.rubbing()),
        used_(at_.count()),
        last_(at_.count()),
        slipped_(rubbing_.size(), NAN),
        low_(at_.count()),
        loss_at_(powers_of(contacts_.rigid(), ".impact")) {
    for (size_t k = 0; k < at_.count(); ++k) {
      const auto& own = contacts_.rigid()[at_.rigid(k)];
      e_.push_back(own.restitution);
      mu_.push_back(own.friction);
    }
    lambda_.reserve(at_.rows());
    jumped_.reserve(100 * at_.count());
  }

  size_t count() const override { return soft_->count() + at_.count() + rubbing_.size(); }

  void at(double t, std::span<const double> x, std::span<const double> turns,
          std::span<double> value) override {
    const size_t soft = soft_->count(), rubs = soft + at_.count();
    if (soft > 0) soft_->at(t, x, turns, value.first(soft));
    turn(turns);
    t_ = t;
    at_.place(x.first(nq_));
    for (size_t k = 0; k < at_.count(); ++k)
      value[soft + k] = -at_.gap(k) - (closed()[k].lifts() ? lifted : 0);
    std::fill(value.begin() + long(rubs), value.end(), -1.0);
    if (!model_->holds_any()) return;
    free_->field(t, x, {}, dx_);
    forces_.hold(x, dx_, closed());
    for (size_t k = 0; k < at_.count(); ++k)
      if (closed()[k]) value[soft + k] = -forces_.pressed(k);
    if (!rubs_any()) return;
    at_.move(x.first(nq_), x.subspan(nq_, nq_));
    for (size_t j = 0; j < rubbing_.size(); ++j) {
      const Touching& own = closed()[rubbing_[j]];
      if (own.slides()) value[rubs + j] = -dot(at_.slip(rubbing_[j]), own.along);
      if (own.sticks()) value[rubs + j] = forces_.strained(j);
    }
  }
  /// At the time and state of the last at().
  void rates(std::span<const double> x, std::span<const double> turns,
             std::span<double> rate) override {
    turn(turns);
    at_.place(x.first(nq_));
    at_.move(x.first(nq_), x.subspan(nq_, nq_));
    const size_t rubs = soft_->count() + at_.count();
    for (size_t k = 0; k < at_.count(); ++k)
      rate[soft_->count() + k] = closed()[k] ? 0 : -at_.rate(k);
    for (size_t j = 0; j < rubbing_.size(); ++j) {
      const Touching& own = closed()[rubbing_[j]];
      double& r = rate[rubs + j];
      r = own.slides() ? -dot(forces_.slip_rate(j), own.along) : 0;
      // What has just begun to slip does not stop at the same instant: its rate may be rounding.
      if (slipped_[j] == t_) r = std::min(r, 0.0);
    }
  }
  void begin_step(double t, State& s) override {
    for (size_t k = 0; k < at_.count(); ++k) last_[k] = closed()[k].lifts() ? t : -HUGE_VAL;
    jumped_.clear();
    trouble_.clear();
    impacts_ = slips_ = 0;
    if (!std::isnan(began_)) step_ = t - began_;
    began_ = t;
    if (rubbing_.empty()) return;
    for (Touching& each : closed()) each.singular = false;
    if (!model_->loses_any()) return;
    turn(turns_of(s));
    evaluate(t, s);
    for (size_t j = 0; j < rubbing_.size(); ++j)
      if (closed()[rubbing_[j]].slides()) aim(j);
  }

  Outcome jump(size_t k, double t, State& s, std::span<double> works) override {
    k -= soft_->count();
    if (k >= at_.count()) return slip_or_stick(k - at_.count(), t, s);
    if (++impacts_ == 5000) half_ = t;
    if (impacts_ > 9999) return ends_crowded(k, t);
    if (closed()[k]) {
      closed()[k].state = Touching::State::lifts;
      last_[k] = t;
      return Outcome::ok;
    }
    exact_.place(s);
    if (double(exact_.gaps.gap(k)) < -most_overlap) return ends(k, endings::missed);
    auto& rows = exact_.rows;
    rows.clear();
    for (size_t j = 0; j < at_.count(); ++j)
      if (j == k || closed()[j] || double(exact_.gaps.gap(j)) <= touching) rows.push_back(j);
    const size_t normals = rows.size();
    add_across([](size_t) { return true; });
    exact_.evaluate();
    auto& v = exact_.v;
    Quad fastest(0.0), of_slip(0.0);
    bool bounces = false;
    for (size_t i = 0; i < normals; ++i) {
      const size_t j = rows[i];
      const double approach = -double(v[i]);
      const double least = closed()[j].lifts() ? touching : least_height;
      // One that moves apart but came to 0 is pressed, and flies less than rounding.
      low_[i] = !closed()[j] && (approach < 0 ? j == k : height(approach, t - last_[j]) < least);
      bounces = bounces || (approach > 0 && !low_[i] && !closed()[j]);
      fastest = std::max(fastest, v[i] < Quad(0.0) ? -v[i] : v[i]);
    }
    for (size_t i = 0; i < normals; ++i) {
      if (bounces) low_[i] = 0;
      used_[i] = low_[i] ? 0 : e_[rows[i]];
    }
    for (const Rubbing& r : exact_.rubs) of_slip = std::max(of_slip, v[r.across]);
    const auto used = std::span<const double>(used_).first(normals);
    const bool rough = !exact_.rubs.empty();
    if (rough && !rough_.solve(exact_.W, v, used, exact_.rubs)) return ends(k, endings::presses);
    if (!rough) impact_.solve(exact_.W, v, used, contacts_.rigid()[at_.rigid(k)].simultaneous);
    const auto impulses = rough ? rough_.impulses() : impact_.impulses();
    exact_.push(s, impulses);
    for (size_t i = 0; i < normals; ++i) {
      Touching& own = closed()[rows[i]];
      const bool leaves = v[i] > Quad(1e-15) * fastest;
      const bool closes = (own && !leaves) || (low_[i] && (!leaves || rows[i] == k));
      if (closes || own) own.state = closes ? Touching::State::slides : Touching::State::open;
    }
    for (const Rubbing& r : exact_.rubs) {
      Touching& own = closed()[rows[r.normal]];
      const double slip = std::hypot(double(v[r.across]), double(v[r.across + 1]));
      if (own && !(slip > 1e-13 * double(fastest + of_slip))) own.state = Touching::State::sticks;
    }
    for (size_t i = 0; i < normals; ++i) {
      last_[rows[i]] = t;
      if (impulses[i] > Quad(0.0))
        book(i, t, rough ? rough_.normal_loss(i) : double(impact_.losses()[i]),
             rough ? rough_.friction_loss(i) : 0, works);
    }
    settle(s);
    return rough ? settle_slips(t, s) : Outcome::ok;
  }

  /// Takes the gaps of closed contacts and their rates back to 0, along M⁻¹Gᵀ; so the slips of
  /// those that stick.
  void settle(State& s) override {
    const bool any = model_->holds_any();
    if (!any && !model_->lifts_any()) return;
    exact_.place(s);
    for (size_t k = 0; k < at_.count(); ++k)
      if (Touching& own = closed()[k]; own.lifts() && double(exact_.gaps.gap(k)) > touching)
        own.state = Touching::State::open;
    if (!any) return;
    auto& rows = exact_.rows;
    rows.clear();
    exact_.rubs.clear();
    for (size_t j = 0; j < at_.count(); ++j)
      if (closed()[j]) rows.push_back(j);
    exact_.evaluate();
    for (size_t i = 0; i < rows.size(); ++i) exact_.v[i] = exact_.gaps.gap(rows[i]);
    exact_.solve();
    exact_.pull(s, exact_.v);
    exact_.place(s);
    add_across([this](size_t k) { return closed()[k].sticks(); });
    exact_.evaluate();
    exact_.solve();
    lambda_.assign(exact_.v.begin(), exact_.v.end());
    for (Quad& l : lambda_) l = -l;
    exact_.push(s, lambda_);
  }
  void carry(Archive& a) override {
    for (size_t k = 0; k < at_.count(); ++k) {
      Touching& own = closed()[k];
      int state = int(own.state);
      a(state, 0, 3);
      own.state = Touching::State(state);
      if (!(mu_[k] > 0)) continue;
      for (double* x : {&own.along.x, &own.along.y, &own.along.z}) a(*x);
      a(own.turns);
    }
    if (rubbing_.empty()) return;
    a(slipped_);
    a(began_);
  }
  std::string trouble() const override {
    for (size_t k = 0; k < at_.count() && trouble_.empty(); ++k)
      if (model_->held()[k].singular) ends(k, endings::presses);
    return trouble_;
  }

 private:
  std::vector<Touching>& closed() { return model_->held(); }
  bool rubs_any() {
    return std::any_of(rubbing_.begin(), rubbing_.end(),
                       [&](size_t k) { return bool(closed()[k]); });
  }
  void turn(std::span<const double> turns) {
    if (!is_turned(turns)) return;
    at_.set_turn_angles(angles_);
    forces_.set_turn_angles(angles_);
  }
  template <class Wanted>
  void add_across(Wanted wanted) {
    if (rubbing_.empty()) return exact_.rubs.clear();
    exact_.add_across(mu_, wanted, [this](size_t k) { return closed()[k].along; });
  }
  Outcome ends(size_t k, const char* why) const {
    trouble_ = fmt::format(fmt::runtime(why), contacts_.rigid()[at_.rigid(k)].name);
    return Outcome::jammed;
  }
  Outcome ends_crowded(size_t k, double t) {
    bool others = false;
    for (size_t j = 0; j < at_.count(); ++j)
      others = others || (at_.rigid(j) != at_.rigid(k) && last_[j] > began_);
    return ends(k, endings::crowded(others, t - half_, t - began_).c_str());
  }
  /// The forces at a state.
  void evaluate(double t, const State& s) {
    sum(s);
    free_->field(t, x_, {}, dx_);
    forces_.hold(x_, dx_, closed());
    at_.place(std::span<const double>(x_).first(nq_));
    at_.move(std::span<const double>(x_).first(nq_), std::span<const double>(x_).subspan(nq_, nq_));
  }
  /// After evaluate(): friction is along the slip.
  void aim(size_t j) {
    Touching& own = closed()[rubbing_[j]];
    const Vec3d slip = at_.slip(rubbing_[j]);
    const double speed = norm(slip);
    own.turns = speed > steps_to_stop * step_ * forces_.braked(j);
    if (speed > 0) own.along = (1 / speed) * slip;
  }
  /// A slip has come to 0, or sticking needs more friction than there is.
  Outcome slip_or_stick(size_t j, double t, State& s) {
    if (++slips_ > 100 * rubbing_.size()) return ends(rubbing_[j], endings::chatters);
    evaluate(t, s);
    Touching& own = closed()[rubbing_[j]];
    if (own.sticks()) {
      if (forces_.shared(j)) return ends(rubbing_[j], endings::undecided);
      slide(j, t, s);
    } else if (norm(at_.slip(rubbing_[j])) > no_slip * forces_.braked(j)) {
      aim(j);  // it has only turned
      return Outcome::ok;
    } else {
      own.state = Touching::State::sticks;
      settle(s);
    }
    return settle_slips(t, s);
  }
  /// After jumps: contacts that slide do so along their slips, and those at rest that friction does
  /// not hold begin to.
  Outcome settle_slips(double t, State& s) {
    evaluate(t, s);
    for (size_t j = 0; j < rubbing_.size(); ++j) {
      Touching& own = closed()[rubbing_[j]];
      if (!own.slides() || slipped_[j] == t) continue;
      aim(j);
      if (!(norm(at_.slip(rubbing_[j])) <= no_slip * forces_.braked(j))) continue;
      own.state = Touching::State::sticks;  // another has stopped it
      settle(s);
      evaluate(t, s);
    }
    for (size_t j = 0; j < rubbing_.size(); ++j) {
      if (!closed()[rubbing_[j]].sticks() || !(forces_.strained(j) > 0)) continue;
      if (forces_.shared(j)) return ends(rubbing_[j], endings::undecided);
      slide(j, t, s);
      j = size_t(-1);  // the others may bear more
    }
    return Outcome::ok;
  }
  /// What has stuck begins to slide, where the forces are those of the state: along a unit vector
  /// u that its change of slip is along, too.
  void slide(size_t j, double t, const State& s) {
    Touching& own = closed()[rubbing_[j]];
    const Vec3d f = forces_.friction(j);
    own = {Touching::State::slides, (-1 / norm(f)) * f};
    slipped_[j] = t;
    for (int k = 0; k < 100; ++k) {
      evaluate(t, s);
      const double braked = forces_.braked(j);
      const Vec3d u = own.along + (0.5 / braked) * forces_.slip_rate(j);
      if (!(braked > 0) || !(dot(u, u) > 0)) return;
      const Vec3d next = (1 / norm(u)) * u, moved = next - own.along;
      own.along = next;
      if (!(norm(moved) > 1e-15)) return;
    }
  }
  void book(size_t row, double t, double loss, double rubbed, std::span<double> works) {
    const size_t j = exact_.rows[row], power = loss_at_[at_.rigid(j)];
    jumped_.push_back({t, power, loss});
    if (works.empty()) return;
    works[power] += loss;
    works[power + 1] += 1;
    if (rubbed > 0) works[power + 2] += rubbed;
  }

  RigidGaps<double> at_;
  ExactRows exact_;
  RestingForces forces_;
  RigidImpact<Quad> impact_;
  RoughImpact rough_;
  std::vector<size_t> rubbing_;  ///< the gaps with friction
  std::vector<Quad> lambda_;
  std::vector<double> e_, mu_;   ///< of each gap
  std::vector<double> used_;     ///< restitutions of an impact
  std::vector<double> last_;     ///< of each gap, the time of its last impact in this step
  std::vector<double> slipped_;  ///< of rubbing_[j], when it last began to slip from rest
  std::vector<char> low_;        ///< of each row of an impact, whether its contact closes
  std::vector<size_t> loss_at_;  ///< of each rigid contact, its power; the next one counts, and
                                 ///< the one after it is that of friction
  /// Times of the last at(), of the start of this step, and of the 5000th jump in it.
  double t_ = 0, began_ = NAN, half_ = 0;
  size_t impacts_ = 0, slips_ = 0;  ///< of this step: at gaps, and between slip and stick
  mutable std::string trouble_;
};

}  // namespace

std::unique_ptr<integrators::Integrator> with_rigid_contacts(
    const phs::Model& whole, const ContactModel& contacts, double h,
    const std::function<std::unique_ptr<integrators::Integrator>(const phs::Model&)>& make) {
  contacts.check_friction_of_events();
  return held_run<RestingModel, RigidSwitches>(whole, contacts, h, make);
}

}  // namespace porthos::contact
