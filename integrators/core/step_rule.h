#pragma once
#include <span>
#include <vector>

#include "integrators/core/entry.h"
#include "integrators/core/integrator.h"
#include "integrators/core/lane_integrator.h"
#include "integrators/core/lane_set.h"

/// A method written once, for one state or one state per SIMD lane. It is a template over the
/// scalar T: double, Dual or Quad for one state, the Pack of LaneIntegrator for lanes. Its members:
///   Rule(const Workplace<T>&)
///   integrates_power               whether round() writes the step's works to Workplace::works
///   LaneSet begin(lanes, at)  sets first values for a step of these lanes; returns those that fail
///   Ended round(lanes, at)    one round of work for all lanes; returns the steps that ended. If
///                             a step failed, the lane's memory is that before the step
///   T move(k)                 what a finished step adds to number k of its state
///   void forget(lanes, at)    drops what earlier steps left; the field is finite in these lanes
///   void carry(archive, lane) the memory of a lane; it is loaded for one state only
/// It does not branch on a T: select(mask_of<T>(lanes), a, b) distinguishes lanes.
namespace porthos::integrators {

/// The start of a step.
template <class T>
struct StepStart {
  T t, h;
  std::span<const T> x, lo;
};

/// The objects that a method uses; the integrator owns them.
template <class T>
struct Workplace {
  const phs::Model& model;
  phs::System<T>& system;
  const Options& options;
  PortWork<T>& port_work;
  Cost& cost;
};

/// The integrator of one state.
template <template <class> class Rule, class T>
class OneState : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;

 public:
  OneState(const Declaration& d, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o),
        rule_({model, *this->system_, this->options_, this->port_work_, this->cost_}) {}

  Outcome advance(T t, T h, typename Base::State& s) override {
    const StepStart<T> at{t, h, s.x, s.lo};
    rule_.begin(1, at);
    Ended e;
    while (!e.any()) e = rule_.round(1, at);
    if (!e.done) {
      rule_.forget(1, at);
      return e.not_finite ? Outcome::not_finite : Outcome::not_converged;
    }
    for (size_t k = 0; k < this->n_; ++k) phs::compensated_add(s.x[k], s.lo[k], rule_.move(k));
    return Outcome::ok;
  }

  void carry(Archive& a) override { rule_.carry(a, 0); }
  bool integrates_power() const override { return Rule<T>::integrates_power; }

 protected:
  Rule<T> rule_;
};

/// One state per lane, by a rule over LaneIntegrator::Lanes. more: further constructor arguments of
/// the rule.
template <class Rule>
class StatePerLane final : public LaneIntegrator {
 public:
  template <class... More>
  StatePerLane(const phs::Model& model, double h, const Options& o, const More&... more)
      : LaneIntegrator(model, h, o),
        rule_({model, *system_, options_, ended_port_work_, cost_}, more...) {}

  std::vector<double> memory(int lane) const override {
    std::vector<double> m;
    Archive a(m);
    const_cast<Rule&>(rule_).carry(a, lane);
    return m;
  }

 private:
  StepStart<Lanes> at() const { return {t_, Lanes(h_), x_, lo_}; }
  void forget(Set lanes) override { rule_.forget(lanes, at()); }
  Set begin(Set lanes) override { return rule_.begin(lanes, at()); }
  Ended round(Set lanes) override {
    const Ended e = rule_.round(lanes, at());
    if (!e.done) return e;
    const auto done = mask_of<Lanes>(e.done);
    for (size_t k = 0; k < n_; ++k) {
      Lanes x = x_[k], lo = lo_[k];
      phs::compensated_add(x, lo, rule_.move(k));
      x_[k] = select(done, x, x_[k]);
      lo_[k] = select(done, lo, lo_[k]);
    }
    return e;
  }

  Rule rule_;
};

/// The catalogue entry of a rule, for every scalar and for lanes. One: its OneState.
template <template <class> class Rule, template <class> class One>
Entry entry_by_rule(Declaration declaration) {
  return with_lanes(
      entry(std::move(declaration),
            []<class T>(const Declaration& d, const phs::Model& m, T h, const Options& o) {
              return std::make_unique<One<T>>(d, m, h, o);
            }),
      [](const Declaration&, const phs::Model& m, double h, const Options& o) {
        return std::make_unique<StatePerLane<Rule<LaneIntegrator::Lanes>>>(m, h, o);
      });
}

}  // namespace porthos::integrators
