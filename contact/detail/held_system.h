#pragma once
#include <algorithm>
#include <vector>

#include "contact/contact.h"
#include "integrators/control/switching.h"
#include "integrators/core/run_model.h"
#include "phs/system/forwarding.h"

namespace porthos::contact {

/// The system of a run in which something holds: `Forces` of a state and its field are found in
/// double, lane by lane, and added to the field. Model has whole(), contacts(), what holds as
/// held() and holds_any(), and may push() what acts beside it.
template <class T, class Model, class Forces>
class HeldSystem final : public phs::Forwarding<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;
  using Base = phs::Forwarding<T>;

 public:
  explicit HeldSystem(const Model& model)
      : Base(model.whole().template instantiate<T>(), model.description()),
        model_(model),
        n_(2 * size_t(model.contacts().mechanism().nq())),
        x_(n_),
        dx_(n_),
        field_(size_t(model.description().nx)),
        lost_(model.description().powers.size()) {
    forces_.reserve(size_t(phs::lanes<T>));  // a copy would lose the capacities
    for (int l = 0; l < phs::lanes<T>; ++l) forces_.emplace_back(model.contacts());
  }
  std::unique_ptr<phs::System<T>> clone() const override {
    return this->alike(std::make_unique<HeldSystem>(model_));
  }
  void field(T t, In x, In u, Out dx) override {
    Base::field(t, x, u, dx);
    hold(x, dx);
  }
  void rate(T t, In x, In e, Out dx) override {
    Base::rate(t, x, e, dx);
    hold(x, dx);
  }
  void powers(T t, In x, In e, Out values) override {
    Base::powers(t, x, e, values);
    if constexpr (requires(Forces & f, std::span<double> v) { f.add_losses(v, v); }) {
      if (!model_.loses_any()) return;
      Base::field(t, x, {}, field_);
      for (int l = 0; l < phs::lanes<T>; ++l) {
        Forces& forces = hold_lane(x, field_, l);
        for (size_t i = 0; i < n_; ++i) x_[i] = in_lane(e[i], l);
        std::fill(lost_.begin(), lost_.end(), 0.0);
        forces.add_losses(x_, lost_);
        for (size_t a = 0; a < lost_.size(); ++a)
          if (lost_[a] != 0) add(values[a], l, lost_[a]);
      }
    }
  }
  void set_turn_angles(In angles) override {
    Base::set_turn_angles(angles);
    const size_t own = size_t(model_.contacts().mechanism().angle_count());
    std::vector<double> lane(own);
    for (int l = 0; l < phs::lanes<T>; ++l) {
      for (size_t i = 0; i < own; ++i) lane[i] = in_lane(angles[i], l);
      forces_[size_t(l)].set_turn_angles(lane);
    }
  }

 private:
  static double in_lane(const T& x, int l) {
    if constexpr (phs::is_pack<T>)
      return x[l];
    else
      return phs::to_double(x);
  }
  /// The field of a lane with what holds in it, into dx_.
  Forces& hold_lane(In x, In dx, int l) {
    for (size_t i = 0; i < n_; ++i) {
      x_[i] = in_lane(x[i], l);
      dx_[i] = in_lane(dx[i], l);
    }
    forces_[size_t(l)].hold(x_, dx_, model_.held());
    return forces_[size_t(l)];
  }
  void hold(In x, Out dx) {
    model_.push(dx);
    if (!model_.holds_any()) return;
    for (int l = 0; l < phs::lanes<T>; ++l) {
      hold_lane(x, dx, l);
      for (size_t i = n_ / 2; i < n_; ++i)
        if (const double added = dx_[i] - in_lane(dx[i], l); added != 0) add(dx[i], l, added);
    }
  }
  static void add(T& x, int l, double y) {
    if constexpr (phs::is_pack<T>)
      x.set(l, x[l] + y);
    else
      x = x + T(y);
  }

  const Model& model_;
  std::vector<Forces> forces_;  ///< by lane: they know its turns
  size_t n_;
  std::vector<double> x_, dx_;
  std::vector<T> field_;
  std::vector<double> lost_;
};

/// The switches of a run in which something holds: those of the model's soft contacts come first.
template <class Model>
class HeldSwitches : public integrators::Switches {
 public:
  bool jumps(size_t k) const final { return k >= soft_->count(); }
  std::span<const integrators::Jump> jumped() const final { return jumped_; }

 protected:
  /// part: the model as a part of a run, or null; kept: what the method keeps of it; h: its step
  HeldSwitches(std::shared_ptr<Model> model, std::shared_ptr<const phs::Model> part,
               const std::shared_ptr<const phs::Model>& kept, double h)
      : step_(h),
        model_(std::move(model)),
        contacts_(model_->contacts()),
        soft_(contacts_.depths()),
        nq_(size_t(contacts_.mechanism().nq())),
        angles_(size_t(contacts_.mechanism().angle_count())),
        dx_(size_t(model_->whole().description().nx)),
        x_(dx_.size()),
        part_(std::move(part)) {
    const auto* const run = dynamic_cast<const integrators::RunModel*>(kept.get());
    free_ = run ? integrators::RunModel(model_->whole(), *run).template instantiate<double>()
                : model_->whole().template instantiate<double>();
  }
  /// Of everything in a list that has a name, its power "<name><ending>".
  template <class List>
  std::vector<size_t> powers_of(const List& list, const char* ending) const {
    std::vector<size_t> at;
    const auto& powers = model_->whole().description().powers;
    for (const auto& each : list)
      for (size_t a = 0; a < powers.size(); ++a)
        if (powers[a].name == each.name + ending) at.push_back(a);
    return at;
  }
  /// Tells free_ the turns. @return whether they are new
  bool is_turned(std::span<const double> turns) {
    if (std::equal(angles_.begin(), angles_.end(), turns.begin()) && told_) return false;
    told_ = true;
    std::copy_n(turns.begin(), angles_.size(), angles_.begin());
    free_->set_turn_angles(turns);
    return true;
  }

  /// A state's 2π·turns. Valid until the next call.
  std::span<const double> turns_of(const State& s) {
    all_angles_.resize(s.turns.size());
    for (size_t i = 0; i < s.turns.size(); ++i)
      all_angles_[i] = double(s.turns[i]) * phs::two_pi_hi;
    return all_angles_;
  }
  /// Its numbers as doubles, into x_.
  void sum(const State& s) {
    for (size_t i = 0; i < x_.size(); ++i) x_[i] = s.x[i] + s.lo[i];
  }

  double step_;  ///< of the method, as last known [s]
  std::shared_ptr<Model> model_;
  const ContactModel& contacts_;
  std::unique_ptr<integrators::Switches> soft_;
  size_t nq_;
  std::vector<double> angles_, dx_, x_;
  std::vector<integrators::Jump> jumped_;
  /// The field in which nothing holds, with what the controllers hold in this run.
  std::unique_ptr<phs::System<double>> free_;

 private:
  std::shared_ptr<const phs::Model> part_;
  std::vector<double> all_angles_;
  bool told_ = false;
};

/// A method for the run of `whole` whose switches are those of a Model of it.
template <class Model, class Switches, class Make>
std::unique_ptr<integrators::Integrator> held_run(const phs::Model& whole,
                                                  const ContactModel& contacts, double h,
                                                  const Make& make) {
  auto model = std::make_shared<Model>(whole, contacts);
  // A part of a run that has sampled controllers keeps what they hold there.
  const auto* const run = dynamic_cast<const integrators::RunModel*>(&whole);
  std::shared_ptr<const phs::Model> part;
  if (run) part = std::make_shared<integrators::RunModel>(*model, *run);
  auto method = make(part ? *part : *model);
  auto switches = std::make_unique<Switches>(model, part, method->kept_model(), h);
  return integrators::make_switched(std::move(method), part ? *part : *model, h,
                                    std::move(switches));
}

}  // namespace porthos::contact
