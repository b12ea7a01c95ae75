#include "integrators/control/step_control.h"

#include <cmath>
#include <optional>

#include "integrators/control/controlled.h"
#include "integrators/methods/manifold.h"
#include "phs/system/reactions.h"
#include "phs/system/time_transform.h"

namespace porthos::integrators {
namespace {

using phs::State;

[[noreturn]] void refuse_own_steps(const std::string& method) {
  throw InvalidArgument("method '" + method +
                        "' chooses its steps itself: step control is for methods of a fixed step");
}

const Declaration& controllable(const std::string& method) {
  const Declaration& d = declaration_of(method);
  if (d.rival) refuse_own_steps(method);
  return d;
}

class TimeTransformed final : public Controlled {
 public:
  TimeTransformed(Declaration d, const std::string& method, const phs::Model& model, double h,
                  const Options& o, const ControlOptions& control)
      : Controlled(std::move(d), model, h, o, control),
        transformed_(model, *scale_),
        lossless_(model.description().traits.lossless && model.description().traits.autonomous),
        autonomous_(model.description().traits.autonomous),
        exact_(model.instantiate<long double>()),
        exact_turns_(model.description()),
        exact_x_(n_),
        ext_(transformed_.description(), std::vector<double>(n_ + 2)),
        end_(ext_),
        inside_(n_ + 2) {
    inner_ = make_integrator(method, transformed_, h, o);
    plain_ = make_integrator(method, model, h, o);
    by_ = inner_.get();
    fresh_ = inner_->memory();
    const size_t rows = size_t(model.description().constraint_count());
    if (rows == 0) return;
    manifold_.emplace(*system_, rows, cost_);
    impulse_.resize(rows);
  }

  Outcome chosen_step(State& s) override {
    if (!continues(s)) begin(s);
    load(s);
    inner_->tell_turns(s);
    const double t_before = s.time(h_);
    if (port_work_aside()) {
      Controlled::tell_turns(s);
      port_work_.before(*system_, t_before, h_, s.x, s.lo);
    }
    const Outcome o = inner_->advance(0.0, h_, ext_);
    if (o != Outcome::ok) return o;
    by_ = inner_.get();
    for (size_t i = 0; i < n_; ++i) {
      const size_t k = transformed_.position(i);
      s.x[i] = ext_.x[k];
      s.lo[i] = ext_.lo[k];
    }
    if (manifold_) keep_rates(s);
    const size_t t = transformed_.time_at();
    taken_ = (ext_.x[t] - began_) + ext_.lo[t];
    if (autonomous_)
      s.step_off_the_grid(h_, taken_);  // t began at 0
    else {
      s.origin = ext_.x[t];
      s.origin_lo = ext_.lo[t];
      s.origin_step = ++s.step;
    }
    energy_ = ext_.x[transformed_.energy_at()];
    energy_lo_ = ext_.lo[transformed_.energy_at()];
    if (port_work_aside()) port_work_.after(*system_, t_before, s.time(h_) - t_before, s.x, s.lo);
    ++cost_.steps;
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
    last_ = s;
    have_last_ = true;
    last_was_plain_ = false;
    return o;
  }

  /// In physical time: the method itself. A lossless system keeps its p_t; others need a new one.
  Outcome advance(double t, double h, State& s) override {
    const bool ours = continues(s);
    const Outcome o = plain_->advance(t, h, s);
    if (o != Outcome::ok) return o;
    by_ = plain_.get();
    taken_ = h;
    last_was_plain_ = true;
    if (ours && lossless_)
      leave(s);
    else
      have_last_ = false;
    return o;
  }
  void tell_turns(const State& s) override {
    Controlled::tell_turns(s);
    plain_->tell_turns(s);
    inner_->tell_turns(s);
  }

  bool interpolate(const State& after, double theta, std::span<double> x) const override {
    if (last_was_plain_) return plain_->interpolate(after, theta, x);
    if (!have_last_) return false;
    State& end = end_;
    std::vector<double>& z = inside_;
    end = ext_;
    for (size_t i = 0; i < n_; ++i) {
      const size_t k = transformed_.position(i);
      end.x[k] = after.x[i];
      end.lo[k] = after.lo[i];
    }
    const size_t t = transformed_.time_at();
    const double aim = began_ + theta * (end.x[t] - began_);
    // t grows with tau: regula falsi (Illinois) for the fraction of tau.
    double a = 0, fa = began_ - aim, b = 1, fb = end.x[t] - aim, tau = theta;
    for (int i = 0; i < 60; ++i) {
      if (!inner_->interpolate(end, tau, z)) return false;
      const double f = z[t] - aim;
      if (f == 0 || std::fabs(f) <= 0x1p-50 * std::fabs(end.x[t] - began_)) break;
      if ((f > 0) == (fb > 0)) {
        b = tau;
        fb = f;
        fa *= 0.5;
      } else {
        a = tau;
        fa = f;
        fb *= 0.5;
      }
      const double next = (a * fb - b * fa) / (fb - fa);
      if (next == tau || !(next > a && next < b)) break;
      tau = next;
    }
    for (size_t i = 0; i < n_; ++i) x[i] = z[transformed_.position(i)];
    return true;
  }

  void carry(Archive& a) override {
    carry_state(a);
    a(energy_);
    a(energy_lo_);
    inner_->carry(a);
    plain_->carry(a);
  }

 private:
  /// The method makes G ∂K/∂p = 0, which is G v = 0 only as far as K = 0. Of all momenta that
  /// differ by Gᵀμ, which are one state of the constrained system, this takes those with G v = 0.
  void keep_rates(State& s) {
    Controlled::tell_turns(s);
    manifold_->bring_momenta_back(0.0, s, impulse_);
  }
  /// p_t = -H in extended precision, as a double and a low word.
  void begin(const State& s) {
    for (size_t i = 0; i < n_; ++i) exact_x_[i] = (long double)s.x[i] + s.lo[i];
    exact_turns_.synchronise(s, *exact_);
    const long double H = exact_->hamiltonian(exact_x_);
    energy_ = -double(H);
    energy_lo_ = double(-H - (long double)energy_);
    inner_->restore(fresh_);
  }
  void load(const State& s) {
    for (size_t i = 0; i < n_; ++i) {
      const size_t k = transformed_.position(i);
      ext_.x[k] = s.x[i];
      ext_.lo[k] = s.lo[i];
    }
    const size_t t = transformed_.time_at(), e = transformed_.energy_at();
    ext_.x[t] = ext_.lo[t] = 0;
    if (!autonomous_)
      phs::two_sum(s.origin, s.origin_lo + double(s.step - s.origin_step) * h_, ext_.x[t],
                   ext_.lo[t]);
    began_ = ext_.x[t];
    ext_.x[e] = energy_;
    ext_.lo[e] = energy_lo_;
  }

  phs::TimeTransformedModel transformed_;
  bool lossless_, autonomous_, last_was_plain_ = false;
  std::unique_ptr<phs::System<long double>> exact_;
  TurnKeeper<long double> exact_turns_;
  std::vector<long double> exact_x_;
  std::optional<Manifold<double>> manifold_;  ///< of constraints
  std::vector<double> impulse_;
  State ext_;                           ///< of the transformed system
  mutable State end_;                   ///< of interpolate()
  mutable std::vector<double> inside_;  ///< likewise
  double energy_ = 0, energy_lo_ = 0, began_ = 0;
  std::vector<double> fresh_;
};

class Reversible final : public Controlled {
 public:
  Reversible(Declaration d, const std::string& method, const phs::Model& model, double h,
             const Options& o, const ControlOptions& control)
      : Controlled(std::move(d), model, h, o, control),
        sigma_(scale_->instantiate<double>()),
        x_(n_),
        e_(n_),
        f_(n_),
        push_(n_),
        gradient_(n_),
        sigma_turns_(model.description()) {
    if (!model.description().constraints.empty()) reactions_.emplace(model);
    inner_ = make_integrator(method, model, h, o);
    by_ = inner_.get();
  }

  Outcome chosen_step(State& s) override {
    tell_turns(s);
    begin_if_new(s);
    const double half = rho_ + 0.5 * h_ * G_, h = h_ / half;
    const Outcome o = move(half, h_, h, s);
    if (o != Outcome::ok) return o;
    s.step_off_the_grid(h_, h);
    ++cost_.steps;
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
    last_ = s;
    have_last_ = true;
    return o;
  }

  /// A given h is a step with another eps = h rho_{n+1/2}; rho continues as if that eps were
  /// chosen.
  Outcome advance(double, double h, State& s) override {
    begin_if_new(s);
    const double half = rho_ / (1 - 0.5 * h * G_);
    const Outcome o = move(half, h * half, h, s);
    if (o == Outcome::ok) leave(s);
    return o;
  }
  void tell_turns(const State& s) override {
    Controlled::tell_turns(s);
    inner_->tell_turns(s);
    sigma_turns_.when_changed(
        s.turns, [&](std::span<const double> angles) { sigma_->set_turn_angles(angles); });
  }

  bool interpolate(const State& after, double theta, std::span<double> x) const override {
    return inner_->interpolate(after, theta, x);
  }

  void carry(Archive& a) override {
    carry_state(a);
    a(rho_);
    a(G_);
    inner_->carry(a);
  }

 private:
  void begin_if_new(const State& s) {
    if (continues(s)) return;
    have_last_ = false;
    evaluate(s.time(h_), s);
    rho_ = 1 / value_;
  }
  /// One step of the method by h = eps / half; advances rho to its end.
  Outcome move(double half, double eps, double h, State& s) {
    if (!(half > 0) || !std::isfinite(half)) return Outcome::failed;
    const double t = s.time(h_);
    if (port_work_aside()) port_work_.before(*system_, t, h, s.x, s.lo);
    const Outcome o = inner_->advance(t, h, s);
    if (o != Outcome::ok) return o;
    if (port_work_aside()) port_work_.after(*system_, t, h, s.x, s.lo);
    by_ = inner_.get();
    taken_ = h;
    evaluate(t + h, s);
    rho_ = half + 0.5 * eps * G_;
    return o;
  }
  /// sigma and G = -(∂sigma · f) / sigma at a state.
  void evaluate(double t, const State& s) {
    for (size_t i = 0; i < n_; ++i) x_[i] = s.x[i] + s.lo[i];
    system_->gradient(x_, e_);
    system_->field(t, x_, {}, f_);
    ++cost_.evaluations;
    if (reactions_) {
      reactions_->at(t, x_, s.turns);
      reactions_->forces(push_);
      for (size_t i = 0; i < n_; ++i) f_[i] -= push_[i];
    }
    value_ = sigma_->with_gradient(x_, e_, gradient_);
    double slope = 0;
    for (size_t i = 0; i < n_; ++i) slope += gradient_[i] * f_[i];
    G_ = -slope / value_;
  }

  std::unique_ptr<phs::TimeScale<double>> sigma_;
  std::optional<phs::Reactions> reactions_;  ///< of constraints
  std::vector<double> x_, e_, f_, push_, gradient_;
  TurnKeeper<double> sigma_turns_;
  double rho_ = 1, G_ = 0, value_ = 1;
};

/// A step control on the model of its run.
template <class Control>
std::unique_ptr<Integrator> make(Declaration d, const std::string& method, const phs::Model& model,
                                 double h, const Options& o, const ControlOptions& control) {
  // refuses what the method cannot take
  if (make_integrator(method, model, h, o)->varies()) refuse_own_steps(method);
  const OfRun run(model);
  auto made = std::make_unique<Control>(std::move(d), method, *run.model, h, o, control);
  made->keep_model(run.kept);
  return made;
}

}  // namespace

std::unique_ptr<Integrator> make_time_transformed(const std::string& method,
                                                  const phs::Model& model, double h,
                                                  const ControlOptions& control, const Options& o) {
  Declaration d = controllable(method);
  d.title += ", constant steps of a transformed time";
  d.passivity_exact = d.passivity_exact == Claim::holds ? Claim::unknown : d.passivity_exact;
  if (d.quadratic_invariants == Claim::holds) d.quadratic_invariants = Claim::unknown;
  d.source += "; Hairer, Lubich, Wanner 2006, VIII.2.1";
  return make<TimeTransformed>(std::move(d), method, model, h, o, control);
}

std::unique_ptr<Integrator> make_reversible(const std::string& method, const phs::Model& model,
                                            double h, const ControlOptions& control,
                                            const Options& o) {
  Declaration d = controllable(method);
  if (d.symmetric != Claim::holds)
    throw InvalidArgument("method '" + method +
                          "' is not symmetric: the reversible step control needs one that is");
  d.title += ", reversible step control";
  d.symplectic = Claim::fails;
  d.source += "; Hairer, Soderlind 2005, SIAM J. Sci. Comput. 26";
  return make<Reversible>(std::move(d), method, model, h, o, control);
}

std::unique_ptr<Integrator> make_controlled(StepControl kind, const std::string& method,
                                            const phs::Model& model, double h,
                                            const ControlOptions& control, const Options& o) {
  if (kind == StepControl::fixed) return make_integrator(method, model, h, o);
  const auto made = kind == StepControl::reversible ? make_reversible : make_time_transformed;
  return made(method, model, h, control, o);
}

}  // namespace porthos::integrators
