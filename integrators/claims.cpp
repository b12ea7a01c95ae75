#include "integrators/claims.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "integrators/catalogue.h"

namespace porthos::integrators {
namespace {

using Vec = std::vector<double>;

/// Energy and invariants of states from value + low word.
class ClaimGauge {
 public:
  explicit ClaimGauge(const phs::Model& model)
      : system_(model.instantiate<long double>()),
        turns_(model.description()),
        values_(size_t(model.description().invariant_count())) {}
  long double energy(const phs::State& s) { return system_->hamiltonian(load(s)); }
  const std::vector<long double>& invariants(const phs::State& s) {
    system_->invariants(load(s), values_);
    return values_;
  }

 private:
  const std::vector<long double>& load(const phs::State& s) {
    x_.assign(s.x.begin(), s.x.end());
    for (size_t i = 0; i < x_.size(); ++i) x_[i] += s.lo[i];
    turns_.synchronise(s.turns, *system_);
    return x_;
  }
  std::unique_ptr<phs::System<long double>> system_;
  TurnKeeper<long double> turns_;
  std::vector<long double> x_, values_;
};

/// Of a tangent in two steps: beyond, its products are rounding.
constexpr double most_growth = 1e5;

/// The defect up to a step that failed: one that small may just have come too early.
double if_it_tells(double defect) { return defect > 1e-6 ? defect : NAN; }

/// The largest |a - b| / (1 + |b|) of their numbers, with low words.
double distance(const phs::State& a, const phs::State& b) {
  double worst = 0;
  for (size_t k = 0; k < b.x.size(); ++k) {
    const double off = (a.x[k] - b.x[k]) + (a.lo[k] - b.lo[k]);
    worst = std::fmax(worst, std::fabs(off) / (1 + std::fabs(b.x[k])));
  }
  return worst;
}

/// A tolerance that sets the error of a method may hide a false claim: its steps are loose here.
Options loosely(const std::string& method, Options o = {}) {
  if (declaration_of(method).order == 0) o.rtol = o.atol = 1e-5;
  return o;
}

/// x after some steps, angles not wrapped; none if a step fails.
template <class T>
std::optional<std::vector<T>> end_of(const std::string& method, const phs::Model& model,
                                     const phs::State& start, T h, int steps) {
  phs::BasicState<T> s(model.description(), {start.x.begin(), start.x.end()});
  const auto made = make_basic_integrator<T>(method, model, h,
                                             loosely(method, {.max_sweeps = 400, .wrap = false}));
  for (int i = 0; i < steps; ++i)
    if (made->step(s) != Outcome::ok) return {};
  for (size_t k = 0; k < s.x.size(); ++k) s.x[k] += s.lo[k];
  return s.x;
}

/// How far 20 steps of h end from 40 of h/2, over their size or 1; NaN if a step fails.
double error_of_step(const std::string& method, const phs::Model& model, const phs::State& start,
                     double h) {
  const auto coarse = end_of<double>(method, model, start, h, 20),
             fine = end_of<double>(method, model, start, h / 2, 40);
  if (!coarse || !fine) return NAN;
  double worst = 0;
  for (size_t k = 0; k < fine->size(); ++k)
    worst = std::fmax(worst, std::fabs((*coarse)[k] - (*fine)[k]) / (1 + std::fabs((*fine)[k])));
  return worst;
}

/// The defect of steps of h, and of 3 h and 6 h as far as these resolve the motion.
struct Shown {
  double defect = 0, error = 0;  ///< the largest
  /// A false claim shows by less than the error: here by less than the bound.
  bool tells(double bound) const { return defect > bound || !(0.01 * error <= bound); }
};
template <class Error, class Defect>
Shown shown_by(double h, Error error, Defect defect) {
  constexpr double resolved = 0.01;
  Shown shown{defect(h), error(h)};
  for (const double factor : {3.0, 6.0}) {
    const double off = std::isnan(shown.defect) ? NAN : error(factor * h);
    const double here = off < resolved ? defect(factor * h) : NAN;
    if (std::isnan(here)) break;
    shown = {std::fmax(shown.defect, here), std::fmax(shown.error, off)};
  }
  return shown;
}

template <class T>
MeasuredOrder order_in(const std::string& method, const phs::Model& model, const phs::State& start,
                       double h, double rounding) {
  constexpr int most_steps = 256;
  constexpr double settled = 0.05;
  std::optional<std::vector<T>> before;
  double error_before = NAN, order_before = NAN, order = NAN;
  MeasuredOrder found{NAN};
  for (int steps = 1; steps <= most_steps; steps *= 2) {
    auto now = end_of<T>(method, model, start, T(4 * h) / T(steps), steps);
    double error = NAN;
    if (now && before) {
      error = 0;
      for (size_t k = 0; k < now->size(); ++k) {
        const T moved = phs::abs((*now)[k] - (*before)[k]) / (T(1.0) + phs::abs((*now)[k]));
        error = std::fmax(error, phs::to_double(moved));
      }
      found.exact = error <= rounding && std::isnan(found.order);
      if (!(error > rounding)) break;
    }
    order_before = order;
    order = std::log2(error_before / error);
    if (!std::isnan(order)) found = {order, 16 * h / steps, 8 * h / steps};
    if (steps >= 32 && std::fabs(order - order_before) < settled) break;
    error_before = error;
    before = std::move(now);
  }
  if (std::isnan(order)) found.order = order_before;
  return found;
}

}  // namespace

SymplecticDefect symplectic_defect(const std::string& method, const phs::Model& model,
                                   const Vec& start, const std::vector<Vec>& tangents, double h) {
  std::vector<Vec> images, moved;
  SymplecticDefect defect;
  for (const auto& u : tangents) {
    phs::BasicState<phs::Dual> s(model.description(), {start.begin(), start.end()});
    for (size_t i = 0; i < u.size(); ++i) s.x[i].d = u[i];
    const auto integrator =
        make_basic_integrator<phs::Dual>(method, model, phs::Dual(h), loosely(method));
    bool ok = true;
    for (int i = 0; i < 2; ++i) ok = ok && integrator->step(s) == Outcome::ok;
    if (!ok) {
      ++defect.failed;
      continue;
    }
    Vec image;
    for (size_t i = 0; i < u.size(); ++i) image.push_back(s.x[i].d + s.lo[i].d);
    images.push_back(image);
    moved.push_back(u);
  }
  defect.worst = symplectic_defect(moved, images);
  for (const Vec& image : images)
    for (const double x : image) defect.growth = std::fmax(defect.growth, std::fabs(x));
  return defect;
}

double symmetry_defect(const std::string& method, const phs::Model& model, const phs::State& start,
                       double h) {
  phs::State s = start;
  for (const double step : {h, -h}) {
    s.step = 0;
    const auto made = make_integrator(method, model, step, loosely(method, {.wrap = false}));
    for (int i = 0; i < 20; ++i)
      if (made->step(s) != Outcome::ok) return NAN;
  }
  return distance(s, start);
}

InvariantDefect invariant_defect(const std::string& method, const phs::Model& model,
                                 const phs::State& start, double h) {
  ClaimGauge gauge(model);
  const auto first = gauge.invariants(start);
  InvariantDefect worst;
  for (const double factor : {1.0, 4.0}) {
    phs::State s = start;
    const auto made = make_integrator(method, model, factor * h, loosely(method));
    bool whole = true;
    for (int i = 0; i < 300 && whole; ++i) whole = made->step(s) == Outcome::ok;
    if (!whole && factor > 1) return worst;
    const auto& end = gauge.invariants(s);
    for (const auto& i : model.description().invariants) {
      double size = 1, change = 0;
      for (size_t k = size_t(i.at); k < size_t(i.at + i.size); ++k) {
        size = std::fmax(size, double(std::fabs(first[k])));
        change = std::fmax(change, double(std::fabs(end[k] - first[k])));
      }
      double& of = i.degree == 1 ? worst.linear : worst.quadratic;
      if (i.degree <= 2) of = std::fmax(of, change / size);
    }
    if (!whole) return {if_it_tells(worst.linear), if_it_tells(worst.quadratic)};
  }
  return worst;
}

double energy_defect(const std::string& method, const phs::Model& model, const phs::State& start,
                     double h) {
  ClaimGauge gauge(model);
  const auto& powers = model.description().powers;
  const auto H0 = gauge.energy(start);
  double worst = 0;
  for (const double factor : {1.0, 3.0, 6.0}) {
    phs::State s = start;
    const auto made = make_integrator(method, model, factor * h, loosely(method));
    double here = 0;
    long double works = 0, size = std::fabs(H0);
    for (int i = 0; i < 100; ++i) {
      if (made->step(s) != Outcome::ok) return factor > 1 ? worst : if_it_tells(here);
      for (size_t a = 0; a < powers.size(); ++a) {
        if (powers[a].kind == phs::PowerKind::observed) continue;
        const double work = made->port_work()[a];
        works += powers[a].kind == phs::PowerKind::supplied ? work : -work;
        size += std::fabs(work);
      }
      here = std::fmax(here, double(std::fabs((gauge.energy(s) - H0 - works) / size)));
    }
    worst = std::fmax(worst, here);
  }
  return worst;
}

double restart_defect(const std::string& method, const phs::Model& model, const phs::State& start,
                      double h) {
  phs::State whole = start, parts = start;
  auto made = make_integrator(method, model, h, loosely(method));
  for (int i = 0; i < 20; ++i)
    if (made->step(whole) != Outcome::ok) return NAN;
  made = make_integrator(method, model, h, loosely(method));
  for (int i = 0; i < 20; ++i) {
    if (i == 10) {
      const auto memory = made->memory();
      made = make_integrator(method, model, h, loosely(method));
      made->restore(memory);
    }
    if (made->step(parts) != Outcome::ok) return NAN;
  }
  return distance(parts, whole);
}

MeasuredOrder measured_order(const std::string& method, const phs::Model& model,
                             const phs::State& start, double h) {
  return entry_of(method).make_quad ? order_in<phs::Quad>(method, model, start, h, 1e-26)
                                    : order_in<double>(method, model, start, h, 1e-12);
}

ClaimReport check_claims(const std::string& method, const phs::Model& model, const Vec& start,
                         double h) {
  const phs::Description& d = model.description();
  require_size("start of check_claims", start.size(), size_t(d.nx));
  const Declaration& m = declaration_of(method);
  const bool varies = make_integrator(method, model, h)->varies();  // refuses what does not fit
  const phs::State s(d, start);
  ClaimReport r{.method = method, .system = d.name, .step = h, .claims = {}};
  const auto add = [&](const char* claim, bool declared, double bound, const std::string& why_not,
                       const char* how, const auto& measure) {
    r.claims.push_back({claim, declared, 0, bound, why_not, how});
    auto& c = r.claims.back();
    if (why_not.empty()) c.measured = measure();
    if (std::isnan(c.measured)) c.why_not = "its steps break down, try a shorter one";
  };
  const std::string moving = d.traits.autonomous ? "" : "the system depends on time";
  const std::string open = !moving.empty() ? moving
                           : d.traits.lossless && d.powers.empty()
                               ? ""
                               : "the system gains or loses energy";
  const bool quadratic =
      std::ranges::any_of(d.invariants, [](const auto& i) { return i.degree == 2; });
  const auto holds = [](Claim c) { return c == Claim::holds; };
  const std::string no_order = m.order == 0 ? "a tolerance sets it"
                               : varies     ? "the method chooses its steps itself"
                                            : "";
  add("order", m.order > 0, m.order - 0.5, no_order, "", [&] {
    const auto found = measured_order(method, model, s, h);
    char steps[80];
    std::snprintf(steps, sizeof steps, "from the errors of steps %g s and %g s", found.coarse,
                  found.fine);
    r.claims.back().how = steps;
    if (found.exact)
      r.claims.back().why_not = "its error is no more than rounding: take another start";
    return found.exact ? 0 : found.order;
  });
  const auto longest = [&](const auto& defect) {
    const auto shown = shown_by(
        h, [&](double step) { return error_of_step(method, model, s, step); }, defect);
    auto& c = r.claims.back();
    if (c.declared && !shown.tells(c.bound)) c.why_not = "the step is too short to tell";
    return shown.defect;
  };
  add("symmetric", holds(m.symmetric), 1e-10, moving,
      "after 20 steps forth and 20 back, of h, 3 h or 6 h", [&] {
        return longest([&](double step) { return symmetry_defect(method, model, s, step); });
      });
  add("symplectic", holds(m.symplectic), 1e-11,
      !open.empty()                 ? open
      : !d.traits.canonical         ? "the state is not (q, p) in two halves"
      : !entry_of(method).make_dual ? "the method works in double only"
                                    : "",
      "of the form dq ∧ dp over two steps of h, 3 h or 6 h", [&] {
        const auto along = tangents(model, start);
        return longest([&](double step) {
          const auto defect = symplectic_defect(method, model, start, along, step);
          return defect.failed || defect.growth > most_growth ? NAN : defect.worst;
        });
      });
  add("quadratic invariants", holds(m.quadratic_invariants), 1e-12,
      !open.empty() ? open
      : quadratic   ? ""
                    : "the system declares none",
      "of their size within 300 steps, of h or 4 h",
      [&] { return invariant_defect(method, model, s, h).quadratic; });
  add("energy", holds(m.energy_exact), 1e-11, open, "of H within 100 steps, of h, 3 h or 6 h",
      [&] { return energy_defect(method, model, s, h); });
  const bool rigid = m.needs.contacts;
  add("passivity", holds(m.passivity_exact), 1e-11,
      rigid               ? "impacts take energy beside the works"
      : !d.powers.empty() ? ""
      : d.traits.lossless ? "nothing is supplied or lost"
                          : "the system names no losses",
      "of H less the works within 100 steps, of h, 3 h or 6 h",
      [&] { return energy_defect(method, model, s, h); });
  add("resumable", m.resumable, 0, "", "of 20 steps, taken up again after the tenth",
      [&] { return restart_defect(method, model, s, h); });
  return r;
}

}  // namespace porthos::integrators
