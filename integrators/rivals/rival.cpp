#include "integrators/rivals/rival.h"
#include "phs/scalars/derivative.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

namespace porthos::integrators {
namespace {

Options without_wrap(Options o) {
  o.wrap = false;
  return o;
}

constexpr double round_off = std::numeric_limits<double>::epsilon();

void require_tolerance(const Declaration& d, const char* name, double value, bool ok,
                       const char* expected) {
  if (ok && std::isfinite(value)) return;
  char number[32];
  std::snprintf(number, sizeof number, "%g", value);
  throw InvalidArgument("method '" + d.name + "': " + name + " is " + number +
                        ", expected a finite number " + expected);
}

bool all_finite(std::span<const double> x) {
  return std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

Rival::Rival(const Declaration& d, const phs::Model& model, double h, const Options& o)
    : Integrator(d, model, h, without_wrap(o)), y_(n_), dual_turns_(model.description()) {
  require_tolerance(d, "rtol", o.rtol, o.rtol >= round_off,
                    "of at least 2.2e-16, the unit round-off");
  // It has the unit of the state, so no lower bound suits every system.
  require_tolerance(d, "atol", o.atol, o.atol > 0, "above 0");
}

void Rival::tell_turns(const phs::State& s) {
  Integrator::tell_turns(s);
  if (dual_system_) dual_turns_.synchronise(s, *dual_system_);
}

Outcome Rival::advance(double t, double h, phs::State& s) {
  for (size_t i = 0; i < n_; ++i) y_[i] = s.x[i] + s.lo[i];
  if (!all_finite(y_)) return Outcome::not_finite;
  const bool continued = continues(t, h, s) && !jumps_at(options_.instants, t) && goes_on();
  from_ = t + hair(t, h);
  to_ = t + h - hair(t, h);
  if (h < 0) std::swap(from_, to_);
  running_ = false;
  not_finite_ = 0;
  last_finite_ = true;
  remark_.clear();

  bool ok = continued || start(t, h);
  ok = ok && go_to(t + h);
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  if (!ok) return hopeless() || !last_finite_ ? Outcome::not_finite : Outcome::failed;
  if (!all_finite(y_)) return Outcome::not_finite;

  s.x = y_;
  std::fill(s.lo.begin(), s.lo.end(), 0.0);
  left_ = s;
  left_at_ = t + h;
  backwards_ = h < 0;
  running_ = true;
  return Outcome::ok;
}

bool Rival::continues(double t, double h, const phs::State& s) const {
  // The clock of a state is origin + n h, the library's clock is a sum: they differ by rounding.
  const double rounding = 1e-15 * (std::fabs(t) + std::fabs(h) + std::fabs(s.origin));
  return running_ && (h < 0) == backwards_ && std::fabs(t - left_at_) <= rounding &&
         s.x == left_.x && s.lo == left_.lo && s.turns == left_.turns;
}

bool Rival::field(double t, const double* y, double* dy) noexcept {
  const auto evaluate = [&] {
    ++cost_.evaluations;
    system_->field(inside(t), {y, n_}, {}, {dy, n_});
  };
  return guarded(evaluate, dy, n_);
}

bool Rival::use_duals(const phs::Model& model) {
  dual_system_ = model.instantiate<phs::Dual>();
  dual_x_.assign(n_, phs::Dual(0.0));
  dual_f_.resize(n_);
  try {
    dual_system_->field(0.0, dual_x_, {}, dual_f_);
  } catch (const InvalidArgument&) {  // a user's system without an explicit gradient
    dual_system_.reset();
  } catch (...) {  // x = 0 may be no valid state of this system
  }
  return dual_system_ != nullptr;
}

void Rival::dual_field(phs::Dual t) {
  ++cost_.evaluations;
  dual_system_->field(t, dual_x_, {}, dual_f_);
}

bool Rival::jacobian(double t, const double* y, double* J) noexcept {
  const auto columns = [&] {
    for (size_t j = 0; j < n_; ++j) dual_x_[j] = phs::Dual(y[j]);
    phs::along_each(dual_x_, [&](size_t j) {
      dual_field(inside(t));
      for (size_t i = 0; i < n_; ++i) J[i + n_ * j] = dual_f_[i].d;
    });
  };
  return guarded(columns, J, n_ * n_);
}

bool Rival::time_derivative(double t, const double* y, double* dfdt) noexcept {
  std::fill(dfdt, dfdt + n_, 0.0);
  if (system_->description().traits.autonomous) return true;
  const auto column = [&] {
    for (size_t i = 0; i < n_; ++i) dual_x_[i] = phs::Dual(y[i]);
    dual_field({inside(t), 1.0});
    for (size_t i = 0; i < n_; ++i) dfdt[i] = dual_f_[i].d;
  };
  return guarded(column, dfdt, n_);
}

}  // namespace porthos::integrators
