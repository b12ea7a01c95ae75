// Checks that take steps and states of their own, in addition to the run.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "integrators/control/event.h"
#include "phs/system/check.h"
#include "scene/assemble/parts.h"
#include "scene/run/state_distance.h"
#include "scene/run/verdict.h"

namespace porthos::scene {
namespace {

using integrators::Claim;
using integrators::Declaration;
using integrators::Outcome;

constexpr std::int64_t steps_beside = 100;
/// Steps forwards and backwards by a symmetric method leave rounding only, far below this limit; by
/// a method that is not symmetric they leave far more.
constexpr double symmetry_limit = 1e-9;

/// Whether a pass would be meaningless: all checks made hold with any step.
bool tells_nothing(const RunReport& r) {
  return !r.checks.empty() &&
         std::none_of(r.checks.begin(), r.checks.end(), [](const Check& c) { return c.telling; });
}

/// Makes the current time the origin of the clock, so that steps of another size continue from
/// there.
void take_as_origin(phs::State& s, double h) {
  const double n = double(s.step - s.origin_step), p = n * h;
  double sum, rest;
  phs::two_sum(s.origin, p, sum, rest);
  s.origin = sum;
  s.origin_lo += rest + std::fma(n, h, -p);
  s.origin_step = s.step;
}

class Beside {
 public:
  Beside(RunReport& r, const Scene& scene, const Assembly& a)
      : r_(r),
        scene_(scene),
        a_(a),
        method_(integrators::declaration_of(scene.method)),
        fixed_(scene.step_control == integrators::StepControl::fixed),
        steps_(
            std::clamp<std::int64_t>(std::llround(scene.duration / scene.step), 1, steps_beside)) {}

  void step_halving() {
    const char* const name = "step_halving";
    const bool fails = std::ranges::any_of(r_.checks, [](const Check& c) { return !c.pass; });
    attempt(name, scene_.verify.step_halving.value_or(usual_step_halving), [&] {
      StateScale scale(a_.model->description());
      const auto whole = go(scale, scene_.step, steps_);
      if (!whole) return HUGE_VAL;
      const auto half = method_.rival ? go(scale, scene_.step, steps_, 0.01 * scene_.rtol)
                        : fixed_      ? go(scale, scene_.step / 2, 2 * steps_)
                                      : go_to(scale, whole->time);
      return half ? apart(scale, whole->place, half->place) : HUGE_VAL;
    });
    if (!scene_.verify.step_halving)
      r_.notes.push_back(fmt::format(
          "{} {} all that was checked with any step{}: the motion is judged by step_halving, {} "
          "steps against {} of half the size",
          method_.name, fails ? "is declared to keep" : "keeps", fails ? ", and does not" : "",
          steps_, 2 * steps_));
  }

  void axioms() {
    try {
      const auto report = phs::check(*a_.model, {.sizes = sizes()});
      take(report, "");
      // A system that needs the splitting contains a port-Hamiltonian system that does not.
      if (a_.spacecraft && std::any_of(report.axioms.begin(), report.axioms.end(), [](auto& x) {
            return x.axiom == "field" && !x.applies();
          })) {
        auto inner = sizes();
        inner.resize(a_.spacecraft->internal_size());
        take(phs::check(a_.spacecraft->internal(), {.sizes = inner}), " (internal motion)");
      }
    } catch (const std::bad_alloc&) {
      throw;  // it says nothing about the system
    } catch (const std::exception& why) {
      failed("axioms", 0, why.what());
    }
  }

  void symmetry() {
    const char* const name = "symmetry";
    std::erase_if(r_.not_applicable, [&](const auto& n) { return n.name == name; });
    const auto& traits = a_.model->description().traits;
    if (method_.symmetric != Claim::holds)
      return cannot(name, fmt::format("{} is not a symmetric method", method_.name));
    if (!traits.lossless)
      return cannot(name, "the system loses energy: backwards in time its losses would grow");
    if (!a_.model->holds().empty())
      return cannot(name, "a controller is sampled: on the way back it would see other instants");
    if (!fixed_ && !switches_of(scene_).empty())
      return cannot(
          name,
          "steps are cut short where thrust switches or a move begins or ends, and on the way back "
          "others are");
    if (scene_.orbit && !reversible(*scene_.orbit))
      return cannot(name, "drag and rods act by the velocity: backwards in time they would drive");
    double limit = scene_.verify.symmetry.value_or(symmetry_limit);
    attempt(name, limit, [&] {
      const auto [off, of_rounding] = forth_and_back();
      if (100 * of_rounding > limit) {
        limit = 100 * of_rounding;
        r_.notes.push_back(fmt::format(
            "symmetry: the motion makes {:.2g} of one rounding at the turn, a hundred times that "
            "is the limit",
            of_rounding));
      }
      return off;
    });
  }

 private:
  template <class F>
  void attempt(const char* name, const double& limit, F value_of) {
    try {
      const double value = value_of();
      r_.checks.push_back(
          {name, value, limit, value <= limit, std::string(name) == "step_halving"});
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& why) {
      failed(name, limit, why.what());
    }
  }
  void failed(const std::string& name, double limit, const char* why) {
    r_.checks.push_back({name, NAN, limit, false});
    r_.notes.push_back(fmt::format("{} could not be checked: {}", name, why));
  }
  void cannot(const std::string& name, const std::string& why) {
    std::erase_if(r_.not_applicable, [&](const auto& n) { return n.name == name; });
    r_.not_applicable.push_back({name, why});
  }

  void take(const phs::CheckReport& report, const char* of) {
    for (const auto& x : report.axioms) {
      const std::string name = "axiom: " + x.axiom + of;
      const auto known = [&](const Check& c) { return c.name == "axiom: " + x.axiom; };
      if (*of && std::any_of(r_.checks.begin(), r_.checks.end(), known)) continue;
      if (x.applies())
        r_.checks.push_back({name, x.worst, x.limit, x.holds(), false});
      else
        cannot(name, x.why_not);
    }
  }

  /// The size of the motion for each block: the larger of start and end, or 1 for angles and for
  /// values that stayed at 0.
  std::vector<double> sizes() const {
    const phs::Description& d = a_.model->description();
    std::vector<double> size(size_t(d.nx), 1.0);
    const auto fill = [&](int at, int n) {
      double largest = 0;
      for (const phs::State* s : {&a_.initial, &std::as_const(r_.final_state)})
        for (int k = at; k < at + n && size_t(k) < s->x.size(); ++k)
          largest = std::max(largest, std::fabs(s->x[size_t(k)]));
      if (largest > 0) std::fill_n(size.begin() + at, n, largest);
    };
    for (const auto& b : d.blocks) {
      if (b.kind == phs::BlockKind::linear) fill(b.at, b.size);
      if (b.momentum >= 0) fill(b.momentum, b.size);
    }
    return size;
  }

  static double apart(const StateScale& scale, const std::vector<long double>& a,
                      const std::vector<long double>& b) {
    return distance(scale, a, b);
  }
  std::vector<long double> place(const phs::State& s) const {
    return unwrapped(a_.model->description(), s);
  }

  struct End {
    std::vector<long double> place;
    double time;
  };
  /// The start for steps of another size: a phase behind an event begins at its own time.
  phs::State start(double h) const {
    phs::State s = a_.initial;
    if (s.step == 0 || h == scene_.step) return s;
    if (s.origin_step == 0)  // sampled controllers count steps from time 0
      s.step = std::llround(double(s.step) * scene_.step / h);
    else
      take_as_origin(s, scene_.step);
    return s;
  }
  /// The end of n steps of h from the start; empty if one fails.
  std::optional<End> go(StateScale& scale, double h, std::int64_t n, double rtol = 1) const {
    Scene with = scene_;
    with.rtol = std::max(std::min(rtol, with.rtol), 2.3e-16);  // a rival's minimum
    phs::State s = start(h);
    const auto integrator = make_integrator(with, *a_.model, h);
    if (!forward(scale, *integrator, s, n)) return {};
    return End{place(s), integrator->time(s)};
  }
  /// Steps chosen by the step control, half as long everywhere; the last one ends exactly at
  /// `time`.
  std::optional<End> go_to(StateScale& scale, double time) const {
    Scene finer = scene_;
    if (finer.control_rate == 0) finer.control_rate = 1 / scene_.step;
    phs::State s = start(scene_.step / 2);
    integrators::EventStepper stepper(
        *a_.model, [&] { return make_integrator(finer, *a_.model, scene_.step / 2); }, {});
    for (scale.see(s.x); stepper.time(s) < time; scale.see(s.x))
      if (stepper.step(s, time).outcome != Outcome::ok) return {};
    return End{place(s), time};
  }
  static bool forward(StateScale& scale, integrators::Integrator& i, phs::State& s,
                      std::int64_t n) {
    for (scale.see(s.x); n > 0; --n) {
      if (i.step(s) != Outcome::ok) return false;
      scale.see(s.x);
    }
    return true;
  }

  /// Steps with h and then with -h: the distance from the start. Infinite if a step fails.
  struct Return {
    double off;          ///< from the start
    double of_rounding;  ///< effect of a rounding error at the turn after the way back
  };
  Return forth_and_back() const {
    StateScale scale(a_.model->description());
    phs::State s = a_.initial;
    const auto forth = make_integrator(scene_, *a_.model, scene_.step);
    if (!forward(scale, *forth, s, steps_)) return {HUGE_VAL, 0};
    take_as_origin(s, scene_.step);
    phs::State rounded = s;
    for (size_t k = 0; k < s.x.size(); ++k) rounded.x[k] *= 1 + (k % 2 ? 1 : -1) * 0x1p-52;
    const auto come_back = [&](phs::State& from) {
      const auto back = make_integrator(scene_, *a_.model, -scene_.step);
      // A method with step control repeats its steps only with its memory.
      if (!fixed_) back->restore(forth->memory());
      return forward(scale, *back, from, steps_);
    };
    if (!come_back(s)) return {HUGE_VAL, 0};
    const double off = apart(scale, place(s), place(a_.initial));
    return {off, come_back(rounded) ? apart(scale, place(rounded), place(s)) : 0};
  }

  bool reversible(const OrbitScene& o) const {
    return !o.environment.atmosphere && a_.spacecraft->parts().torquers.empty();
  }

  RunReport& r_;
  const Scene& scene_;
  const Assembly& a_;
  const Declaration& method_;
  const bool fixed_;
  const std::int64_t steps_;
};

}  // namespace

bool has_more_to_judge(const RunReport& r, const Scene& scene, bool all) {
  return all || scene.verify.step_halving || tells_nothing(r);
}

void judge_beside(RunReport& r, const Scene& scene, const Assembly& a, bool all) {
  Beside beside(r, scene, a);
  if (scene.verify.step_halving || tells_nothing(r)) beside.step_halving();
  if (!all) return;
  beside.axioms();
  beside.symmetry();
}

}  // namespace porthos::scene
