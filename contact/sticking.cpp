// The switches of a run with dry friction: where joints stop, and where they break away.
#include "contact/sticking.h"

#include <algorithm>
#include <cmath>

#include "contact/detail/held_system.h"
#include "contact/detail/sticking_forces.h"

namespace porthos::contact {
namespace {

using integrators::Outcome;

/// Of a joint that slides, minus its speed; of one that sticks, |λ|/breakaway - 1.
class StickSwitches final : public HeldSwitches<StickingModel> {
 public:
  StickSwitches(std::shared_ptr<StickingModel> model, std::shared_ptr<const phs::Model> part,
                const std::shared_ptr<const phs::Model>& kept, double h)
      : HeldSwitches(std::move(model), std::move(part), kept, h),
        joints_(contacts_.placed_dry()),
        forces_(contacts_),
        free_dx_(dx_.size()),
        p_change_(nq_),
        places_(joints_.size()),
        slips_at_(powers_of(contacts_.dry(), ".slips")) {
    jumped_.reserve(100 * joints_.size());
  }

  size_t count() const override { return soft_->count() + joints_.size(); }

  void at(double t, std::span<const double> x, std::span<const double> turns,
          std::span<double> value) override {
    const size_t soft = soft_->count();
    if (soft > 0) soft_->at(t, x, turns, value.first(soft));
    turn(turns);
    t_ = t;
    has_field_ = false;
    if (model_->holds_any()) evaluate(x);
    const auto v = forces_.rates(x);
    for (size_t k = 0; k < joints_.size(); ++k)
      value[soft + k] = slides()[k] != 0 ? -slides()[k] * v[joints_[k].v]
                                         : std::fabs(forces_.lambda(k)) / forces_.breakaway(k) - 1;
  }
  /// At the time and state of the last at().
  void rates(std::span<const double> x, std::span<const double>, std::span<double> rate) override {
    std::fill(rate.begin(), rate.end(), 0.0);
    if (std::all_of(slides().begin(), slides().end(), [](int s) { return s == 0; })) return;
    if (!has_field_) evaluate(x);
    const auto a = forces_.accelerations(x, dx_);
    for (size_t k = 0; k < joints_.size(); ++k) {
      double& r = rate[soft_->count() + k];
      r = slides()[k] == 0 ? 0 : -slides()[k] * a[k];
      // What has just broken away does not stop at the same instant: there a may be rounding.
      if (places_[k].slipped == t_) r = std::min(r, 0.0);
    }
  }
  void begin_step(double t, State& s) override {
    jumped_.clear();
    if (!begun_) begin(t, s);
    settle(s);
  }

  /// A joint stops or breaks away; then those at rest find together what they do.
  Outcome jump(size_t k, double t, State& s, std::span<double> works) override {
    k -= soft_->count();
    turn(turns_of(s));
    t_ = t;
    sum(s);
    before_ = slides();
    if (slides()[k] != 0) {
      slides()[k] = 0;
      before_[k] = 0;
      places_[k] = {s.x[joints_[k].q], s.lo[joints_[k].q], turns_at(s, k), places_[k].slipped};
      settle(s);
      sum(s);
    } else {
      evaluate(x_);
      slides()[k] = forces_.lambda(k) > 0 ? -1 : 1;
    }
    free_->field(t, x_, {}, free_dx_);
    release(x_);
    for (size_t j = 0; j < joints_.size(); ++j) {
      if (before_[j] != 0 || slides()[j] == 0) continue;
      places_[j].slipped = t;
      const size_t power = slips_at_[j];
      jumped_.push_back({t, power, 0});
      if (!works.empty()) works[power] += 1;
    }
    return Outcome::ok;
  }
  /// Takes the angles of joints that stick back to where they stopped, and their rates to 0.
  void settle(State& s) override {
    if (!model_->holds_any()) return;
    for (size_t k = 0; k < joints_.size(); ++k) {
      if (slides()[k] != 0) continue;
      Place& at = places_[k];
      double &x = s.x[joints_[k].q], &lo = s.lo[joints_[k].q];
      if (std::isnan(at.x) || at.turns != turns_at(s, k)) {  // the first time, or it was wrapped
        at.x = x;
        at.lo = lo;
        at.turns = turns_at(s, k);
      }
      x = at.x;
      lo = at.lo;
    }
    turn(turns_of(s));
    sum(s);
    forces_.stop(x_, slides(), p_change_);
    for (size_t i = 0; i < nq_; ++i)
      if (p_change_[i] != 0) phs::compensated_add(s.x[nq_ + i], s.lo[nq_ + i], p_change_[i]);
  }
  void carry(Archive& a) override {
    a(begun_);
    for (int& s : slides()) a(s, -1, 1);
    for (Place& p : places_) {
      a(p.x);
      a(p.lo);
      a(p.turns);
      a(p.slipped);
    }
  }

 private:
  /// Where a joint stuck, and when it last broke away.
  struct Place {
    double x = NAN, lo = 0, turns = 0, slipped = NAN;
  };

  std::vector<int>& slides() { return model_->held(); }

  void turn(std::span<const double> turns) {
    if (is_turned(turns)) forces_.set_turn_angles(angles_);
  }
  double turns_at(const State& s, size_t k) const {
    return joints_[k].turn < 0 ? 0 : double(s.turns[size_t(joints_[k].turn)]);
  }
  /// The field at t_, and the forces that hold.
  void evaluate(std::span<const double> x) {
    free_->field(t_, x, {}, dx_);
    model_->push(std::span<double>(dx_));
    if (model_->holds_any()) forces_.hold(x, dx_, slides());
    has_field_ = true;
  }
  /// A run begins: joints without a rate, but for rounding, stick if that holds them. Others may
  /// move fast, or nothing may: a rate that friction stops in 1e-14 s is rounding, too.
  void begin(double t, const State& s) {
    begun_ = true;
    t_ = t;
    turn(turns_of(s));
    sum(s);
    const auto rates = forces_.rates(x_);
    const std::vector<double> v(rates.begin(), rates.end());
    double fastest = 0;
    for (const double each : v) fastest = std::max(fastest, std::fabs(each));
    before_.assign(joints_.size(), 1);
    for (size_t k = 0; k < joints_.size(); ++k) {
      before_[k] = 0;
      forces_.stop(x_, before_, p_change_);
      before_[k] = 1;
      const double own = v[joints_[k].v], impulse = std::fabs(p_change_[joints_[k].q]);
      const bool rests =
          std::fabs(own) <= 1e-14 * fastest || impulse <= 1e-14 * forces_.breakaway(k);
      slides()[k] = rests ? 0 : own > 0 ? 1 : -1;
    }
    free_->field(t_, x_, {}, free_dx_);
    release(x_);
  }
  /// Of the joints at rest lets slide what its friction does not hold, where free_dx_ is the field
  /// of free_. One that slides pulls less, so others may follow.
  void release(std::span<const double> x) {
    while (model_->holds_any()) {
      dx_ = free_dx_;
      model_->push(std::span<double>(dx_));
      if (!forces_.release(x, dx_, slides())) return;
    }
  }

  const std::vector<ContactModel::PlacedJoint>& joints_;
  StickingForces forces_;
  double t_ = 0;  ///< of the last at()
  std::vector<double> free_dx_, p_change_;
  std::vector<int> before_;
  std::vector<Place> places_;
  std::vector<size_t> slips_at_;  ///< of each joint, the power that counts its slips
  bool begun_ = false, has_field_ = false;
};

}  // namespace

std::unique_ptr<integrators::Integrator> with_dry_friction(
    const phs::Model& whole, const ContactModel& contacts, double h,
    const std::function<std::unique_ptr<integrators::Integrator>(const phs::Model&)>& make) {
  return held_run<StickingModel, StickSwitches>(whole, contacts, h, make);
}

}  // namespace porthos::contact
