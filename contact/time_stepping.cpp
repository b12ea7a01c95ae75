#include "contact/time_stepping.h"

#include <fmt/format.h>

#include "contact/detail/cones.h"
#include "integrators/core/run_model.h"
#include "integrators/methods/discrete_field.h"

namespace porthos::contact {
namespace {

using integrators::Outcome;
using Base = integrators::BasicIntegrator<double>;

class TimeStepping final : public integrators::Integrator {
 public:
  TimeStepping(const phs::Model& model, const ContactModel& contacts, double h,
               const integrators::Options& o)
      : Base(integrators::declaration_of("moreau"), model, h, o),
        nq_(size_t(contacts.mechanism().nq())),
        rigid_(contacts.rigid()),
        field_(integrators::DiscreteGradientRule::mean_value, model, *system_, o.lanes, nullptr),
        contacts_(contacts),
        cones_(contacts),
        keeper_(model.description()),
        last_(contacts_.most_remembered()),
        delta_(n_),
        next_(n_),
        start_(n_),
        point_(n_),
        q_dot_(nq_),
        change_(nq_) {
    const auto& powers = model.description().powers;
    for (const auto& each : rigid_)
      for (size_t a = 0; a < powers.size(); ++a)
        if (powers[a].name == each.name + ".impact") loss_at_.push_back(a);
    for (const auto& b : model.description().blocks)
      if (b.kind == phs::BlockKind::rotation && b.momentum >= 0)
        rotations_.push_back({size_t(b.at), size_t(b.momentum)});
  }

  void tell_turns(const phs::State& s) override {
    Base::tell_turns(s);
    field_.tell_turns(s.turns);
    keeper_.when_changed(
        s.turns, [&](std::span<const double> angles) { contacts_.set_turn_angles(angles); });
  }

  Outcome advance(double t, double h, phs::State& s) override {
    trouble_.clear();
    jumps_.clear();
    for (size_t k = 0; k < n_; ++k) start_[k] = s.x[k] + s.lo[k];
    field_.start_at(s.x, s.lo);
    const auto rates = field_.efforts().subspan(nq_, nq_);  // ∂H/∂p at the start
    std::copy(rates.begin(), rates.end(), q_dot_.begin());
    const Outcome o = solve(t, h);
    cost_.evaluations += field_.evaluations();
    if (o != Outcome::ok) return o;
    if (!contacts_.points.empty() && gains(cones_.reached())) {
      trouble_ = fmt::format("the contacts do {:.1e} J of work in a step, expected none", work_);
      return Outcome::failed;
    }
    book(t, h);
    for (size_t k = 0; k < n_; ++k) phs::compensated_add(s.x[k], s.lo[k], delta_[k]);
    for (const auto& r : rotations_) normalise(r, s);
    return Outcome::ok;
  }

  void carry(Archive& a) override {
    for (auto& [gap, P] : last_)
      for (double* x : {&gap, &P.x, &P.y, &P.z}) a(*x);
  }
  std::string remark() const override {
    if (!trouble_.empty() || worst_ == 0) return trouble_;
    return fmt::format("sweeps over the contacts, to {:.0e} of their velocities", worst_);
  }
  bool integrates_power() const override { return true; }
  std::span<const integrators::Jump> jumps() const override { return jumps_; }

 private:
  /// Sweeps without contacts that foresee the end of the step, and sweeps that move the contacts'
  /// rows to its middle; after these the rows stay, and the sweeps contract.
  static constexpr int foreseeing = 2, placing = 3;
  /// A change of δ, relative, below which impulses stay.
  static constexpr double nearest = 10 * Cones::least_residual;
  /// Of the residual times impulses and velocities: a step that gains more fails.
  static constexpr double most_gain = 1e3;

  struct Impulse {
    double gap = 0x1p60;  ///< none
    Vec3d P{0, 0, 0};
  };

  /// δ, and the impulses.
  Outcome solve(double t, double h) {
    std::fill(delta_.begin(), delta_.end(), 0.0);
    contacts_.points.clear();
    for (int k = 0; k < foreseeing; ++k) {
      field_(t + 0.5 * h, delta_, next_);
      for (size_t i = 0; i < n_; ++i) delta_[i] = h * next_[i];
    }
    for (size_t i = 0; i < n_; ++i) point_[i] = start_[i] + delta_[i];
    contacts_.choose(q_of(start_), q_of(point_), h, [&](std::uint64_t k) { return last(k); });
    cones_.begin(contacts_);
    measure();
    int placed = 0;
    for (double near = std::max(nearest, options_.iteration_tolerance);;) {
      Outcome o = iterate(t, h, near, placed);
      if (o == Outcome::ok) o = settle(t, h);
      // Impulses that are wanted less exactly may do work: then more exactly.
      if (o != Outcome::ok || near == nearest || !gains(Cones::least_residual)) return o;
      near = std::max(nearest, 0.1 * near);
    }
  }
  /// δ and the impulses until changes of δ are below `near`. placed: sweeps that moved the rows
  Outcome iterate(double t, double h, double near, int& placed) {
    double change = 1, enough = 1;
    double least = near;  // of changes that matter
    for (int sweep = 0; !contacts_.points.empty() && std::max(change, enough) > least; ++sweep) {
      if (sweep == options_.max_sweeps) return Outcome::not_converged;
      const bool places = placed < placing;
      if (places) {
        for (size_t i = 0; i < nq_; ++i) point_[i] = start_[i] + 0.5 * delta_[i];
        contacts_.place(q_of(point_), q_dot_);
        ++placed;
      }
      evaluate(t, h);
      enough = 0.01 * change;
      if (!push(std::max(0.1 * near, enough))) return Outcome::not_converged;
      add_impulses();
      const auto moved = move();
      if (!moved.finite) return Outcome::not_finite;
      change = places ? 1 : moved.change;
      if (cones_.stalled()) least = std::max(least, 100 * cones_.reached());
    }
    return Outcome::ok;
  }
  /// δ for these impulses, to rounding: the balance closes as far as that.
  Outcome settle(double t, double h) {
    integrators::Stagnation end = integrators::Stagnation::of<double>();
    end.restart();
    for (int sweep = 0; sweep < options_.max_sweeps; ++sweep) {
      evaluate(t, h);
      add_impulses();
      using Verdict = integrators::Stagnation::Verdict;
      const Verdict verdict = end.after(move());
      if (verdict == Verdict::not_finite) return Outcome::not_finite;
      if (verdict == Verdict::diverges) return Outcome::not_converged;
      if (verdict != Verdict::go_on) return Outcome::ok;
    }
    return end.settled() ? Outcome::ok : Outcome::not_converged;
  }
  void evaluate(double t, double h) {
    ++cost_.sweeps;
    field_(t + 0.5 * h, delta_, next_);
    for (double& x : next_) x *= h;
  }
  void add_impulses() {
    const auto p = std::span(next_).subspan(nq_, nq_);
    for (const auto& each : contacts_.points) contacts_.add_momenta(each, p);
  }
  /// The impulses where next_ is h times the field. @return whether they are found
  bool push(double enough) {
    for (size_t i = 0; i < nq_; ++i) change_[i] = next_[nq_ + i] - delta_[nq_ + i];
    for (const auto& each : contacts_.points) contacts_.add_momenta(each, change_);
    for (double& x : change_) x *= 0.5;
    contacts_.free_velocities(field_.efforts().subspan(nq_, nq_), change_);
    const bool found = cones_.solve(contacts_, enough);
    if (cones_.stalled()) worst_ = std::max(worst_, cones_.reached());
    if (!found)
      trouble_ = fmt::format(
          "the {} contacts have the residual {:.1e} after {} sweeps, expected {:.0e}",
          contacts_.points.size(), cones_.reached(), Cones::most_sweeps, Cones::accepted);
    return found;
  }
  /// The sizes of positions and of momenta, those that the free step adds included.
  void measure() {
    size_ = {1e-300, 1e-300};
    for (size_t k = 0; k < n_; ++k)
      size_[is_momentum(k)] =
          std::max({size_[is_momentum(k)], std::fabs(start_[k]), std::fabs(delta_[k])});
  }
  size_t is_momentum(size_t k) const { return k >= nq_ && k < 2 * nq_; }
  /// δ becomes next_.
  integrators::Sweep move() {
    integrators::Sweep s;
    for (size_t k = 0; k < n_; ++k) {
      const double step = std::fabs(next_[k] - delta_[k]);
      delta_[k] = next_[k];
      if (!(step < HUGE_VAL)) s.finite = false;
      if (step > 0) s.changed = true;
      s.change = std::max(s.change, step / size_[is_momentum(k)]);
    }
    return s;
  }

  /// The mean velocities of the last sweep. @return whether contacts do work with them, beyond what
  /// a residual leaves
  bool gains(double residual) {
    std::fill(change_.begin(), change_.end(), 0.0);
    contacts_.free_velocities(field_.efforts().subspan(nq_, nq_), change_);
    double size = 0;
    work_ = 0;
    for (const auto& each : contacts_.points) {
      work_ += dot(each.in_axes(each.impulse), each.free);
      size += norm(each.impulse) * cones_.scale();
    }
    return work_ > most_gain * std::max(Cones::least_residual, residual) * size;
  }
  /// The works, in the last sweep's mean velocities, and what is carried.
  void book(double t, double h) {
    if (port_work_.any()) field_.book(t + 0.5 * h, h, port_work_);
    for (const auto& each : contacts_.points) {
      const size_t power = loss_at_[each.rigid];
      const Vec3d P = each.in_axes(each.impulse), &u = each.free;
      const bool begins = P.x > 0 && norm(last(each.gap)) == 0;
      if (begins) jumps_.push_back({t + h, power, -P.x * u.x});
      if (!port_work_.any()) continue;
      port_work_.add(power, -P.x * u.x);
      if (begins) port_work_.add(power + 1, 1);
      if (each.rows == 3) port_work_.add(power + 2, -(P.y * u.y + P.z * u.z));
    }
    std::fill(last_.begin(), last_.end(), Impulse{});
    size_t n = 0;
    for (const auto& each : contacts_.points)
      if (norm(each.impulse) > 0 && n < last_.size()) last_[n++] = {double(each.gap), each.impulse};
  }
  /// The impulse of a gap in the last step.
  Vec3d last(std::uint64_t gap) const {
    const auto at =
        std::lower_bound(last_.begin(), last_.end(), double(gap),
                         [](const Impulse& each, double number) { return each.gap < number; });
    return at != last_.end() && at->gap == double(gap) ? at->P : Vec3d{0, 0, 0};
  }
  /// |ξ| = 1 and ξ·π = 0 again, which leaves H as it is.
  void normalise(const std::pair<size_t, size_t>& at, phs::State& s) const {
    double square = 0, along = 0;
    for (size_t k = 0; k < 4; ++k) {
      const double x = s.x[at.first + k], lo = s.lo[at.first + k];
      square += std::fma(x, x, k == 0 ? -1.0 : 0.0) + 2 * x * lo;
      along += x * s.x[at.second + k];
    }
    const double length = std::sqrt(1 + square), less = square / (1 + length);  // |ξ| - 1
    along /= 1 + square;
    for (size_t k = 0; k < 4; ++k) {
      const double x = s.x[at.first + k], p = s.x[at.second + k];
      phs::compensated_add(s.x[at.first + k], s.lo[at.first + k], -less / length * x);
      phs::compensated_add(s.x[at.second + k], s.lo[at.second + k], less * p - length * along * x);
    }
  }
  std::span<const double> q_of(const std::vector<double>& x) const {
    return std::span(x).first(nq_);
  }

  size_t nq_;
  const std::vector<ContactModel::Rigid>& rigid_;
  integrators::DiscreteField<double> field_;
  StepContacts contacts_;
  Cones cones_;
  integrators::TurnKeeper<double> keeper_;
  std::vector<Impulse> last_;     ///< those of the last step, by gap
  std::array<double, 2> size_{};  ///< of positions, of momenta
  std::vector<double> delta_, next_, start_, point_, q_dot_, change_;
  std::vector<size_t> loss_at_;  ///< of each rigid contact, its power; the next one counts, and the
                                 ///< one after it is that of friction
  std::vector<std::pair<size_t, size_t>> rotations_;  ///< where ξ and π begin
  std::vector<integrators::Jump> jumps_;
  std::string trouble_;
  double worst_ = 0;  ///< residual of a step
  double work_ = 0;   ///< of the contacts in a step [J]
};

void check(const ContactModel& contacts) {
  const auto refuse = [](const std::string& name, const char* what) {
    throw InvalidArgument(
        fmt::format("'{}' {}, and method 'moreau' does not look for the instant: "
                    "expected law = \"rigid\" or \"smooth\"",
                    name, what));
  };
  for (const auto& c : contacts.contacts())
    if (c.law.switches()) refuse(c.name, "has a force that begins at the touch");
  for (const auto& s : contacts.stops())
    if (s.law.switches()) refuse(s.name, "has a force that begins at the touch");
  if (!contacts.dry().empty()) refuse(contacts.dry().front().name, "sticks and slides");
}

}  // namespace

std::unique_ptr<integrators::Integrator> with_time_stepping(const phs::Model& whole,
                                                            const ContactModel& contacts, double h,
                                                            const integrators::Options& options) {
  check(contacts);
  if (!std::isfinite(h) || h == 0)
    throw InvalidArgument(fmt::format("step is {} s, expected a finite number other than 0", h));
  const integrators::OfRun run(whole);
  auto method = std::make_unique<TimeStepping>(*run.model, contacts, h, options);
  method->keep_model(run.kept);
  return method;
}

}  // namespace porthos::contact
