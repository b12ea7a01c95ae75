#include "integrators/control/switching.h"

#include <algorithm>
#include <cmath>

#include "integrators/control/zero-inl.h"

namespace porthos::integrators {
namespace {

class Switched final : public Integrator {
 public:
  Switched(std::unique_ptr<Integrator> inner, const phs::Model& model, double h,
           std::unique_ptr<Switches> switches, const SwitchOptions& how, const Options& o)
      : Integrator(inner->declaration(), inner->kept_model() ? *inner->kept_model() : model, h, o),
        inner_(std::move(inner)),
        switches_(std::move(switches)),
        how_(how),
        before_(model.description(), std::vector<double>(n_)),
        start_(before_),
        trial_(before_),
        x_(n_),
        angles_(before_.turns.size()),
        now_(switches_->count()),
        sign_(now_.size()),
        work_(inner_->port_work().size()) {
    keep_model(inner_->kept_model());
    if (inner_->varies()) sampler_.go_by_the_clock();
    for (int i = 0; i <= how_.samples + 1; ++i) samples_.emplace_back(now_.size());
  }

  Outcome step(State& s) override {
    keep(s);
    const Outcome o = inner_->step(s);
    if (o != Outcome::ok || !switched(s)) return whole(o);
    const double t = before_.time(h_), h = varies() ? s.time(h_) - t : h_;
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
    if (o != Outcome::ok || !switched(s)) return whole(o);
    const Outcome parts = in_parts(s, before_.time(h_), h);
    if (parts != Outcome::ok) return undone(parts, s);
    s.step_off_the_grid(h_, h);
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
    return parts;
  }
  Outcome advance(double t, double h, State& s) override {
    keep(s);
    const Outcome o = inner_->advance_with_port_work(t, h, s);
    if (o != Outcome::ok || !switched(s)) return whole(o);
    const Outcome parts = in_parts(s, t, h);
    if (parts != Outcome::ok) s = before_;
    return parts;
  }
  double time(const State& s) const override { return inner_->time(s); }
  void tell_turns(const State& s) override {
    Integrator::tell_turns(s);
    inner_->tell_turns(s);
  }
  bool interpolate(const State& after, double theta, std::span<double> x) const override {
    return whole_ && inner_->interpolate(after, theta, x);
  }
  void carry(Archive& a) override { inner_->carry(a); }
  std::string remark() const override { return inner_->remark(); }
  std::span<const double> port_work() const override { return work_; }
  bool integrates_power() const override { return inner_->integrates_power(); }
  bool sees_inside() const override { return inner_->sees_inside(); }
  bool varies() const override { return inner_->varies(); }
  Cost cost() const override { return inner_->cost(); }
  void set_cost(const Cost& c) override { inner_->set_cost(c); }

 private:
  struct Point {
    double at = 0, g = 0;
  };

  void keep(const State& s) {
    before_ = start_ = s;
    memory_.clear();
    inner_->save(memory_);
    values(s.x, s.lo, s.turns, now_);
    for (size_t k = 0; k < now_.size(); ++k) sign_[k] = sign_of(now_[k]);
  }
  /// The step was one part, or failed.
  Outcome whole(Outcome o) {
    whole_ = true;
    std::copy(inner_->port_work().begin(), inner_->port_work().end(), work_.begin());
    return o;
  }
  Outcome undone(Outcome o, State& s) {
    s = before_;
    inner_->sampler().take_back();
    return o;
  }
  /// Back to the start of the current part.
  void go_back(State& s) {
    s = start_;
    inner_->restore(memory_);
  }

  void values(std::span<const double> x, std::span<const double> lo,
              const std::vector<std::int64_t>& turns, std::vector<double>& g) {
    for (size_t i = 0; i < n_; ++i) x_[i] = lo.empty() ? x[i] : x[i] + lo[i];
    for (size_t k = 0; k < angles_.size(); ++k) angles_[k] = phs::two_pi_hi * double(turns[k]);
    switches_->at(x_, angles_, g);
  }
  /// Values at the sample points of a part that ended at `after`; those without dense output are
  /// NaN.
  void sample(const State& after) {
    const int last = how_.samples + 1;
    values(start_.x, start_.lo, start_.turns, samples_[0]);
    values(after.x, after.lo, after.turns, samples_[size_t(last)]);
    inside_.resize(n_);
    for (int i = 1; i < last; ++i) {
      auto& g = samples_[size_t(i)];
      if (inner_->interpolate(after, double(i) / last, inside_))
        values(inside_, {}, after.turns, g);
      else
        std::fill(g.begin(), g.end(), NAN);
    }
  }
  struct Found {
    size_t index = 0;
    Point a, b;
  };
  /// The earliest interval between samples in which a switch passes 0, of the one that does so
  /// first by the secants; false if none does.
  bool earliest(const State& after, Found& found) {
    sample(after);
    const int last = how_.samples + 1;
    double first = HUGE_VAL;
    for (size_t k = 0; k < now_.size(); ++k) {
      Point a{0, samples_[0][k]};
      if (sign_of(a.g) != sign_[k]) a.g = 0;  // it has just passed 0 here
      for (int i = 1; i <= last; ++i) {
        const Point b{double(i) / last, samples_[size_t(i)][k]};
        if (std::isnan(b.g)) continue;
        if (sign_of(b.g) == sign_[k] || b.g == 0) {
          a = b;
          continue;
        }
        const double at = a.g == 0 ? a.at : secant(a, b);
        if (at < first) {
          first = at;
          found = {k, a, b};
        }
        break;
      }
    }
    return first < HUGE_VAL;
  }
  bool switched(const State& after) {
    Found any;
    return earliest(after, any);
  }

  /// g of a switch after a part of length `h`, by the method itself; NaN if that fails.
  double tried(size_t k, double t, double h) {
    go_back(trial_);
    trial_outcome_ = inner_->advance(t, h, trial_);
    if (trial_outcome_ != Outcome::ok) return NAN;
    values(trial_.x, trial_.lo, trial_.turns, now_);
    return now_[k];
  }
  /// The length, relative to `rest`, of the part that ends where a switch passes 0.
  double end_of_part(const Found& f, const State& after, double t, double rest) {
    Point a = f.a, b = f.b;
    if (a.g == 0) return a.at;
    const double first = guess_zero(a, b, [&](double at) {
      if (!inner_->interpolate(after, at, inside_)) return double(NAN);
      values(inside_, {}, after.turns, now_);
      return now_[f.index];
    });
    // The dense output is less accurate than a step: its signs are checked.
    const auto g = [&](double at) { return tried(f.index, t, at * rest); };
    if (a.at > 0 && sign_of(a.g = g(a.at)) != sign_[f.index]) a = {0, samples_[0][f.index]};
    if (b.at < 1 && sign_of(b.g = g(b.at)) == sign_[f.index])
      b = {1, samples_[samples_.size() - 1][f.index]};
    if (trial_outcome_ != Outcome::ok) return 0;
    if (sign_of(a.g) != sign_[f.index]) return a.at;
    if (b.g == 0 || sign_of(b.g) == sign_[f.index]) return b.at;
    return refine_zero(a, b, first, how_.most_trials, g).at;
  }

  /// The step of size h from before_ again, in parts.
  Outcome in_parts(State& s, double t, double h) {
    whole_ = false;
    std::fill(work_.begin(), work_.end(), 0.0);
    go_back(s);
    double done = 0;
    for (int part = 1;; ++part) {
      const double rest = h - done;
      start_ = s;
      memory_.clear();
      inner_->save(memory_);
      Outcome o = inner_->advance_with_port_work(t + done, rest, s);
      if (o != Outcome::ok) return o;
      Found next;
      if (part == how_.most_parts || !earliest(s, next)) {
        book();
        return o;
      }
      trial_outcome_ = Outcome::ok;
      const double at = end_of_part(next, s, t + done, rest);
      if (trial_outcome_ != Outcome::ok) return trial_outcome_;
      if (at >= 1) {
        book();
        return o;
      }
      go_back(s);
      if (at > 0) {
        o = inner_->advance_with_port_work(t + done, at * rest, s);
        if (o != Outcome::ok) return o;
        book();
        done += at * rest;
      }
      values(s.x, s.lo, s.turns, now_);
      for (size_t k = 0; k < sign_.size(); ++k) sign_[k] = sign_of(now_[k]);
      sign_[next.index] = sign_of(next.b.g);
    }
  }
  void book() {
    for (size_t a = 0; a < work_.size(); ++a) work_[a] += inner_->port_work()[a];
  }

  std::unique_ptr<Integrator> inner_;
  std::unique_ptr<Switches> switches_;
  SwitchOptions how_;
  State before_, start_, trial_;  ///< starts of the step and of the part
  std::vector<double> memory_;    ///< of the inner method at start_
  std::vector<double> x_, inside_, angles_, now_;
  std::vector<int> sign_;  ///< of each switch behind start_
  std::vector<std::vector<double>> samples_;
  std::vector<double> work_;
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
