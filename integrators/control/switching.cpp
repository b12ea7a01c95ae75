#include "integrators/control/switching.h"

#include <algorithm>
#include <cmath>

#include "integrators/control/switch_search-inl.h"

namespace porthos::integrators {
namespace {

class Switched final : public Integrator {
 public:
  Switched(std::unique_ptr<Integrator> inner, const phs::Model& model, double h,
           std::unique_ptr<Switches> switches, const SwitchOptions& how, const Options& o)
      : Integrator(inner->declaration(), inner->kept_model() ? *inner->kept_model() : model, h, o),
        inner_(std::move(inner)),
        how_(how),
        before_(model.description(), std::vector<double>(n_)),
        start_(before_),
        trial_(before_),
        search_(std::move(switches), *inner_, how, model.description()),
        work_(inner_->port_work().size()) {
    keep_model(inner_->kept_model());
    if (inner_->varies()) sampler_.go_by_the_clock();
  }

  Outcome step(State& s) override {
    keep(s);
    const Outcome o = inner_->step(s);
    const double t = before_.time(h_), h = o == Outcome::ok && varies() ? s.time(h_) - t : h_;
    if (o != Outcome::ok || !switched(s, t, h)) return whole(o, s);
    const Outcome parts = in_parts(s, t, h);
    if (parts != Outcome::ok) return undone(parts, s);
    if (varies())
      s.step_off_the_grid(h_, h);
    else
      ++s.step;
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
    return parts;
  }
  Outcome step_by(State& s, double h) override {
    keep(s);
    const Outcome o = inner_->step_by(s, h);
    if (o != Outcome::ok || !switched(s, before_.time(h_), h)) return whole(o, s);
    const Outcome parts = in_parts(s, before_.time(h_), h);
    if (parts != Outcome::ok) return undone(parts, s);
    s.step_off_the_grid(h_, h);
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
    return parts;
  }
  Outcome advance(double t, double h, State& s) override {
    keep(s, t);
    const Outcome o = inner_->advance_with_port_work(t, h, s);
    if (o != Outcome::ok || !switched(s, t, h)) return whole(o, s);
    const Outcome parts = in_parts(s, t, h);
    if (parts != Outcome::ok) {
      s = before_;
      restore_both(before_memory_);
    }
    return named(parts);
  }
  double time(const State& s) const override { return inner_->time(s); }
  void tell_turns(const State& s) override {
    Integrator::tell_turns(s);
    inner_->tell_turns(s);
  }
  bool interpolate(const State& after, double theta, std::span<double> x) const override {
    return whole_ && inner_->interpolate(after, theta, x);
  }
  void carry(Archive& a) override {
    inner_->carry(a);
    search_.switches->carry(a);
  }
  std::span<const Jump> jumps() const override { return search_.switches->jumped(); }
  std::string remark() const override { return trouble_.empty() ? inner_->remark() : trouble_; }
  std::span<const double> port_work() const override { return work_; }
  bool integrates_power() const override { return inner_->integrates_power(); }
  bool sees_inside() const override { return inner_->sees_inside(); }
  bool varies() const override { return inner_->varies(); }
  Cost cost() const override { return inner_->cost(); }
  void set_cost(const Cost& c) override { inner_->set_cost(c); }

 private:
  using Found = SwitchSearch::Found;
  using Point = SwitchSearch::Point;

  void keep(State& s) { keep(s, s.time(h_)); }
  void keep(State& s, double t) {
    search_.switches->begin_step(t, s);
    before_ = start_ = s;
    memory_.clear();
    save_both(memory_);
    before_memory_ = memory_;
    own_memory_.reserve(memory_.size());
    search_.begin_part(s, t);
    for (size_t k = 0; k < search_.now.size(); ++k)
      search_.sign[k] = search_.switches->jumps(k) ? -1 : sign_of(search_.now[k]);
  }
  void save_both(std::vector<double>& m) const {
    inner_->save(m);
    save_carried(*search_.switches, m);
  }
  void restore_both(std::span<const double> m) {
    std::vector<double>& own = own_memory_;
    own.clear();
    save_carried(*search_.switches, own);
    inner_->restore(m.first(m.size() - own.size()));
    load_carried(*search_.switches, m.last(own.size()), "memory of the switches");
  }
  /// The step was one part, or failed.
  Outcome whole(Outcome o, State& s) {
    whole_ = true;
    std::copy(inner_->port_work().begin(), inner_->port_work().end(), work_.begin());
    if (o == Outcome::ok) search_.switches->settle(s);
    return named(o);
  }
  /// The outcome of a step, with what the switches know of it.
  Outcome named(Outcome o) {
    trouble_ = o == Outcome::ok ? "" : search_.switches->trouble();
    return trouble_.empty() ? o : Outcome::jammed;
  }
  Outcome undone(Outcome o, State& s) {
    s = before_;
    restore_both(before_memory_);
    inner_->sampler().take_back();
    return named(o);
  }
  /// Back to the start of the current part.
  void go_back(State& s) {
    s = start_;
    restore_both(memory_);
  }

  bool switched(const State& after, double t, double h) {
    Found any;
    return search_.earliest(start_, after, t, h, any);
  }

  /// g of a switch after a part of length `h`, by the method itself; NaN if that fails.
  double tried(size_t k, double t, double h) {
    go_back(trial_);
    trial_outcome_ = inner_->advance(t, h, trial_);
    if (trial_outcome_ != Outcome::ok) return NAN;
    search_.values(t + h, trial_.x, trial_.lo, trial_.turns, search_.now);
    return search_.now[k];
  }
  /// The length, relative to `rest`, of the part that ends where a switch passes 0.
  double end_of_part(const Found& f, const State& after, double t, double rest) {
    Point a = f.a, b = f.b;
    if (a.g == 0) return a.at;
    const auto of = [&](double value, double at) { return f.returns ? value / at : value; };
    const double first = guess_zero(
        a, b, [&](double at) { return of(search_.inside(f.index, after, at, t, rest), at); });
    // The dense output is less accurate than a step: its signs are checked.
    const auto g = [&](double at) { return of(tried(f.index, t, at * rest), at); };
    if (a.at > 0 && sign_of(a.g = g(a.at)) != search_.sign[f.index])
      a = {0, search_.samples[0][f.index]};
    if (b.at < 1 && sign_of(b.g = g(b.at)) == search_.sign[f.index])
      b = {1, search_.samples[size_t(search_.last())][f.index]};
    if (trial_outcome_ != Outcome::ok) return 0;
    if (sign_of(a.g) != search_.sign[f.index]) return a.at;
    if (b.g == 0 || sign_of(b.g) == search_.sign[f.index]) return b.at;
    return refine_zero(a, b, first, how_.most_trials, g).at;
  }
  /// The step of size h from before_ again, in parts.
  Outcome in_parts(State& s, double t, double h) {
    whole_ = false;
    std::fill(work_.begin(), work_.end(), 0.0);
    go_back(s);
    double done = 0;
    for (int part = 1, jumps = 0;;) {
      const double rest = h - done;
      start_ = s;
      memory_.clear();
      save_both(memory_);
      search_.begin_part(s, t + done);
      Found next;
      if (next.index = search_.at_once(); next.index < search_.now.size()) {
        if (++jumps > how_.most_jumps) return Outcome::failed;
        if (const Outcome o = search_.switches->jump(next.index, t + done, s, work_);
            o != Outcome::ok)
          return o;
        continue;
      }
      Outcome o = inner_->advance_with_port_work(t + done, rest, s);
      if (o != Outcome::ok) return o;
      if (part >= how_.most_parts || !search_.earliest(start_, s, t + done, rest, next)) {
        book();
        search_.switches->settle(s);
        return o;
      }
      trial_outcome_ = Outcome::ok;
      double at = std::min(1.0, end_of_part(next, s, t + done, rest));
      if (trial_outcome_ != Outcome::ok) return trial_outcome_;
      for (size_t others = 0; at > 0; ++others) {
        go_back(s);
        o = inner_->advance_with_port_work(t + done, at * rest, s);
        if (o != Outcome::ok) return o;
        if (others > search_.now.size() || !search_.overtaken(s, t + done + at * rest, at, next))
          break;
        at = end_of_part(next, s, t + done, rest);
        if (trial_outcome_ != Outcome::ok) return trial_outcome_;
      }
      if (at > 0) {
        book();
        done += at * rest;
        search_.switches->settle(s);
      } else {
        go_back(s);
      }
      search_.values(t + done, s.x, s.lo, s.turns, search_.now);
      // A peak of the dense output may be none of the step.
      const bool jump = search_.switches->jumps(next.index) && search_.now[next.index] > -1e-10;
      if (at >= 1 && !jump) return o;
      if (jump) {
        if (++jumps > how_.most_jumps) return Outcome::failed;
        o = search_.switches->jump(next.index, t + done, s, work_);
        if (o != Outcome::ok || at >= 1) return o;
      } else {
        ++part;
      }
      search_.values(t + done, s.x, s.lo, s.turns, search_.now);
      for (size_t k = 0; k < search_.sign.size(); ++k)
        search_.sign[k] = search_.switches->jumps(k) ? -1 : sign_of(search_.now[k]);
      if (!jump) search_.sign[next.index] = sign_of(next.b.g);
    }
  }
  void book() {
    for (size_t a = 0; a < work_.size(); ++a) work_[a] += inner_->port_work()[a];
  }

  std::unique_ptr<Integrator> inner_;
  SwitchOptions how_;
  State before_, start_, trial_;  ///< starts of the step and of the part
  SwitchSearch search_;
  std::vector<double> memory_, before_memory_, own_memory_;  ///< of both at start_ and before_
  std::vector<double> work_;
  std::string trouble_;
  Outcome trial_outcome_ = Outcome::ok;
  bool whole_ = true;  ///< the last step was one part
};

}  // namespace

std::unique_ptr<Integrator> make_switched(std::unique_ptr<Integrator> inner,
                                          const phs::Model& model, double h,
                                          std::unique_ptr<Switches> switches,
                                          const SwitchOptions& how, const Options& options) {
  if (switches->count() == 0) return inner;
  return std::make_unique<Switched>(std::move(inner), model, h, std::move(switches), how, options);
}

}  // namespace porthos::integrators
