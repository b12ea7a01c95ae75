#include "integrators/control/energy_monitor.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>

namespace porthos::integrators {
namespace {

template <class... A>
std::string text_of(const char* form, A... a) {
  char text[256];
  std::snprintf(text, sizeof text, form, a...);
  return text;
}

void require_limit(const char* name, double x) {
  if (x != 0 && !(x >= 1e-14 && std::isfinite(x)))
    throw InvalidArgument(
        text_of("the monitor's %s is %g, expected 0 (not watched) or 1e-14 and more", name, x));
}

}  // namespace

const char* to_string(OnViolation a) {
  switch (a) {
    case OnViolation::warn:
      return "warn";
    case OnViolation::stop:
      return "stop";
    case OnViolation::repeat:
      return "repeat";
  }
  return "unknown";
}

OnViolation on_violation_of(const std::string& name) {
  for (const auto a : {OnViolation::warn, OnViolation::stop, OnViolation::repeat})
    if (name == to_string(a)) return a;
  throw InvalidArgument("unknown action '" + name + "', expected one of warn, stop, repeat");
}

EnergyMonitor::EnergyMonitor(std::unique_ptr<Integrator> inner, const phs::Model& model, double h,
                             MonitorOptions monitor, const Options& o)
    : Integrator(inner->declaration(), inner->kept_model() ? *inner->kept_model() : model, h, o),
      inner_(std::move(inner)),
      monitor_(std::move(monitor)),
      scale_(model.description()),
      before_(model.description(), std::vector<double>(n_)),
      port_work_sum_(model.description().powers.size()),
      x_(n_),
      stored_(model.description().storages.size()) {
  keep_model(inner_->kept_model());
  require_limit("limit", monitor_.limit);
  require_limit("step_limit", monitor_.step_limit);
  const bool repeats = monitor_.action == OnViolation::repeat;
  if (repeats && monitor_.step_limit == 0)
    throw InvalidArgument("the monitor repeats steps without a step_limit, expected both");
  if (inner_->varies()) sampler_.go_by_the_clock();
  if (monitor_.limit == 0 && monitor_.step_limit == 0 && !monitor_.watch && !monitor_.project)
    throw InvalidArgument(
        "the monitor has nothing to watch, expected a limit, a step_limit or project");
  if (!o.port_work && !port_work_sum_.empty())
    throw InvalidArgument("the monitor needs the method's ledger, expected Options::port_work");
  for (const auto& a : model.description().powers)
    signs_.push_back(a.kind == phs::PowerKind::supplied     ? 1
                     : a.kind == phs::PowerKind::dissipated ? -1
                                                            : 0);
  if (!monitor_.project) return;
  project_ = std::make_unique<EnergyProjection>(model, monitor_.keeps ? *monitor_.keeps : model);
}

double EnergyMonitor::energy(const State& s) {
  Integrator::tell_turns(s);
  for (size_t i = 0; i < n_; ++i) x_[i] = s.x[i] + s.lo[i];
  system_->stored(x_, stored_);
  double sum = 0;
  for (const double e : stored_) sum += e;
  return sum;
}

void EnergyMonitor::begin(const State& s) {
  account_ = {};
  account_.began = 1;
  account_.H0 = energy(s);
  scale_.see(stored_);
}

/// The ledger including the works of the step to this state.
EnergyMonitor::Account EnergyMonitor::booked(const State& s) {
  Account b = account_;
  for (size_t a = 0; a < port_work_sum_.size(); ++a) {
    phs::compensated_add(b.income, b.income_lo, signs_[a] * port_work_sum_[a]);
    b.turned_over += std::fabs(signs_[a] * port_work_sum_[a]);
  }
  b.defect = ((energy(s) - b.H0) - b.income) - b.income_lo;
  scale_J_ = std::max(scale_.value_with(stored_), b.turned_over);
  if (monitor_.scale_J > 0) scale_J_ = monitor_.scale_J;
  if (!(scale_J_ > 0)) scale_J_ = 1;
  rounding_ = 1e-15 * scale_.size(stored_);
  return b;
}

bool EnergyMonitor::beyond(double defect, double limit) const {
  return limit > 0 && !(std::fabs(defect) <= std::max(limit * scale_J_, rounding_));
}

bool EnergyMonitor::step_holds(const Account& after) const {
  const double added = after.defect - (project_ ? 0.0 : account_.defect);
  return !beyond(added, monitor_.step_limit);
}

std::string EnergyMonitor::fault(const Account& after, const State& s) {
  if (!std::isfinite(after.defect)) return "the energy is not finite";
  if (!step_holds(after))
    return text_of("the step adds %.2e to the relative residual of the balance (limit %.2e)",
                   (after.defect - (project_ ? 0.0 : account_.defect)) / scale_J_,
                   monitor_.step_limit);
  if (beyond(after.defect, monitor_.limit))
    return text_of("the relative residual of the balance is %.2e (limit %.2e)",
                   after.defect / scale_J_, monitor_.limit);
  if (monitor_.watch) {
    for (size_t i = 0; i < n_; ++i) x_[i] = s.x[i] + s.lo[i];
    return monitor_.watch(inner_->time(s), x_);
  }
  return {};
}

void EnergyMonitor::note(const std::string& why, double defect) {
  if (report_.violations++ == 0) report_.first_s = inner_->time(before_);
  report_.last = why;
  if (std::isfinite(defect)) report_.worst = std::max(report_.worst, std::fabs(defect) / scale_J_);
}

void EnergyMonitor::keep(const State& s) {
  if (account_.began == 0) begin(s);
  before_ = s;
  memory_before_.clear();
  inner_->save(memory_before_);
}

void EnergyMonitor::go_back(State& s) {
  s = before_;
  inner_->restore(memory_before_);
}

Outcome EnergyMonitor::refuse(State& s, Outcome o, const std::string& why) {
  report_.last = why;
  go_back(s);
  inner_->sampler().take_back();
  return o == Outcome::ok ? Outcome::failed : o;
}

Outcome EnergyMonitor::accept(State& s, const Account& after, bool whole) {
  account_ = after;
  whole_ = whole;
  scale_.see(stored_);
  if (!project_) return Outcome::ok;
  const double off = std::fabs(after.defect);
  if (off <= std::max(1e-16 * scale_J_, 0.1 * rounding_)) return Outcome::ok;
  if ((*project_)(*system_, s, (account_.H0 + account_.income) + account_.income_lo)) {
    ++report_.projected;
    report_.moved_J += off;
    whole_ = false;
    account_.defect = 0;
  } else {
    ++report_.out_of_reach;
  }
  return Outcome::ok;
}

Outcome EnergyMonitor::step(State& s) { return take(s, h_, true); }
Outcome EnergyMonitor::step_by(State& s, double h) { return take(s, h, false); }

Outcome EnergyMonitor::take(State& s, double h, bool on_grid) {
  keep(s);
  Outcome o = on_grid ? inner_->step(s) : inner_->step_by(s, h);
  std::string why;
  Account after = account_;
  if (o == Outcome::ok) {
    std::copy_n(inner_->port_work().begin(), port_work_sum_.size(), port_work_sum_.begin());
    after = booked(s);
    why = fault(after, s);
    if (why.empty()) return accept(s, after, true);
    if (!std::isfinite(after.defect)) o = Outcome::not_finite;
  } else {
    why = "the step ended with: " + std::string(to_string(o));
    // It undid the readings of its sampled controllers; the repetition needs them.
    if (sampler_.any()) sampler_.renew(*system_, turns_, s.time(h_), s);
  }
  note(why, o == Outcome::ok ? after.defect : NAN);
  if (monitor_.action == OnViolation::repeat)
    return on_grid && inner_->varies() ? again(s, size_of_step_to(s), false) : again(s, h, on_grid);
  if (monitor_.action == OnViolation::stop || o != Outcome::ok) return refuse(s, o, why);
  return accept(s, after, true);
}

/// The size of the step to s; if no step was taken, the longest.
double EnergyMonitor::size_of_step_to(const State& s) const {
  const bool known = s.step != before_.step;
  if (!known) return h_;
  if (before_.origin_step != before_.step) return s.time(h_) - before_.time(h_);
  return (s.origin - before_.origin) + (s.origin_lo - before_.origin_lo);
}

Outcome EnergyMonitor::again(State& s, double h, bool on_grid) {
  const double t = before_.time(h_);
  std::string why = report_.last;
  for (int k = 1; k <= monitor_.most_halvings; ++k) {
    const int parts = 1 << k;
    go_back(s);
    std::fill(port_work_sum_.begin(), port_work_sum_.end(), 0.0);
    Outcome o = Outcome::ok;
    for (int i = 0; i < parts && o == Outcome::ok; ++i) {
      o = inner_->advance_with_port_work(t + h * i / parts, h / parts, s);
      for (size_t a = 0; a < port_work_sum_.size(); ++a)
        port_work_sum_[a] += inner_->port_work()[a];
    }
    if (o != Outcome::ok) continue;
    const Account after = booked(s);
    if (!std::isfinite(after.defect) || !step_holds(after)) continue;
    if (on_grid)
      ++s.step;
    else
      s.step_off_the_grid(h_, h);
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
    why = fault(after, s);
    if (!why.empty()) break;  // shorter steps cannot correct an earlier defect
    ++report_.repeated;
    return accept(s, after, false);
  }
  return refuse(s, Outcome::failed, why);
}

std::string EnergyMonitor::text() const {
  const auto& r = report_;
  std::string text;
  if (r.violations > 0)
    text = text_of("energy monitor: %lld step%s beyond its limits, the first from t = %g s",
                   (long long)r.violations, r.violations == 1 ? "" : "s", r.first_s);
  if (r.repeated > 0) text += text_of("; %lld taken again in smaller parts", (long long)r.repeated);
  if (r.violations > 0) text += "; the last: " + r.last;
  if (!project_) return text;
  text += text.empty() ? "energy monitor: " : "; ";
  text += text_of("%lld steps moved to the energy of the ledger, %.3g J in all",
                  (long long)r.projected, r.moved_J);
  if (r.out_of_reach > 0)
    text +=
        text_of(", %lld could not be: no motion left to take it from", (long long)r.out_of_reach);
  return text;
}

void EnergyMonitor::carry(Archive& a) {
  auto account = std::bit_cast<std::array<double, sizeof(Account) / sizeof(double)>>(account_);
  a(std::span<double>(account));
  account_ = std::bit_cast<Account>(account);
  auto& r = report_;
  a(r.violations, 0);
  a(r.repeated, 0);
  a(r.first_s);
  a(r.worst);
  a(r.projected, 0);
  a(r.out_of_reach, 0);
  a(r.moved_J);
  if (a.loads() && r.violations > 0) r.last = "before this run was continued";
  scale_.carry(a);
  inner_->carry(a);
}

}  // namespace porthos::integrators
