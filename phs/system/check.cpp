#include "phs/system/check.h"
#include "phs/scalars/derivative.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/random_state.h"

namespace porthos::phs {
namespace {

using Vec = std::vector<double>;

double dot(const Vec& a, const Vec& b) {
  double s = 0;
  for (size_t i = 0; i < a.size(); ++i) s += a[i] * b[i];
  return s;
}
double norm(const Vec& a) { return std::sqrt(dot(a, a)); }
Vec sub(Vec a, const Vec& b) {
  for (size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}
/// |a| over its scale, with 0/0 = 0; a NaN counts as infinite.
double relative(double a, double scale) {
  if (std::isnan(a) || std::isnan(scale)) return INFINITY;
  return a == 0 ? 0 : std::fabs(a) / std::max(scale, 1e-300);
}

class Checker {
 public:
  Checker(const Model& m, const CheckOptions& o)
      : d_(m.description()),
        o_(o),
        rng_(o.seed),
        f_(m.instantiate<double>()),
        dual_(m.instantiate<Dual>()) {}

  CheckReport run() {
    if (!o_.sizes.empty()) require_size("sizes of the numbers", o_.sizes.size(), size_t(d_.nx));
    for (int k = 0; k < o_.samples; ++k) sample();
    for (const char* axiom : {"rate", "efforts", "field", "power balance"})
      if (!refusal_.empty()) untried(axiom, refusal_);
    if (!d_.traits.autonomous)
      untried("rate", "sources drive the system: its rate is more than (J - R) e");
    return report_;
  }
  CheckReport run_traits() {
    for (int k = 0; k < o_.samples; ++k) traits(random_state());
    return report_;
  }
  double third_difference() {
    for (int k = 0; k < o_.samples; ++k) quadratic(random_state());
    return report_.axioms[0].worst;
  }

 private:
  Vec random(int n) {
    Vec v(static_cast<size_t>(n));
    for (auto& x : v) x = o_.spread * normal_(rng_);
    return v;
  }
  Vec random_state() {
    Vec x = phs::random_state(d_, o_.spread, rng_);
    if (o_.sizes.empty()) return x;
    for (size_t i = 0; i < x.size(); ++i) x[i] *= o_.sizes[i];
    for (const auto& b : d_.blocks)  // unit quaternions stay
      if (b.kind == BlockKind::rotation)
        for (size_t i = size_t(b.at); i < size_t(b.at + b.size); ++i) x[i] /= o_.sizes[i];
    return x;
  }

  void sample() {
    const Vec x = random_state(), a = random(d_.nx), b = random(d_.nx), u = random(d_.nu);
    const size_t n = x.size();
    Vec Ja(n), Jb(n), Ra(n), Rb(n), e(n), Je(n), Re(n), Gu(n), dx(n), y(u.size());

    f_->apply_structure(x, a, Ja);
    f_->apply_structure(x, b, Jb);
    note("J skew", x, relative(dot(a, Jb) + dot(b, Ja), norm(a) * norm(Jb) + norm(b) * norm(Ja)));
    f_->apply_dissipation(x, a, Ra);
    f_->apply_dissipation(x, b, Rb);
    note("R symmetric", x,
         relative(dot(a, Rb) - dot(b, Ra), norm(a) * norm(Rb) + norm(b) * norm(Ra)));
    note("R >= 0", x, dissipation_defect(x));
    traits(x);
    if (d_.traits.quadratic) quadratic(x);

    f_->gradient(x, e);
    if (const Vec g = dual_gradient(x); !g.empty())
      note(
          "gradient", x,
          relative(norm(sub(e, g)), norm(e) + norm(g) + rounding_of_gradient(x, e) / o_.tolerance));

    f_->apply_structure(x, e, Je);
    f_->apply_dissipation(x, e, Re);
    f_->apply_input(x, u, Gu);
    f_->output(x, e, y);
    storages(x);
    invariants(x);
    if (!refusal_.empty()) return;
    try {
      motion(x, u, e, Je, Re, Gu, y);
    } catch (const InvalidArgument& why) {
      refusal_ = why.what();
    }
  }

  /// A bound for the rounding error of a gradient: a hundred times the effect of one rounding of
  /// each number of the state. It keeps a state with ill-conditioned masses from failing the check.
  double rounding_of_gradient(Vec x, const Vec& e) {
    Vec moved(x.size());
    f_->gradient(nudged(std::move(x)), moved);
    return 100 * norm(sub(moved, e));
  }
  static Vec nudged(Vec x) {
    for (size_t i = 0; i < x.size(); ++i) x[i] *= 1 + (i % 2 ? 1 : -1) * 0x1p-52;
    return x;
  }

  /// J e = (e_p, -e_q), and the slope ∂H/∂q·a must not depend on p.
  void traits(const Vec& x) {
    const size_t n = x.size(), half = n / 2;
    Vec e = random(d_.nx), Je(n);
    if (d_.traits.canonical) {
      f_->apply_structure(x, e, Je);
      double off = 2 * half == n ? 0 : INFINITY;
      for (size_t i = 0; i < half; ++i)
        off = std::hypot(off, Je[i] - e[half + i], Je[half + i] + e[i]);
      note("canonical", x, relative(off, norm(e)));
    }
    if (!d_.traits.separable) return;
    const Vec y = random_state(), along = random(d_.nx);
    std::vector<Dual> here(n), there(n);
    for (size_t i = 0; i < half; ++i) {
      here[i] = there[i] = Dual(x[i], along[i]);
      here[half + i] = Dual(x[half + i]);
      there[half + i] = Dual(y[half + i]);
    }
    const double a = dual_->hamiltonian(here).d, b = dual_->hamiltonian(there).d;
    f_->gradient(x, e);
    note("separable", x, relative(a - b, norm(e) * norm(along) + std::fabs(a) + std::fabs(b)));
  }

  /// Along momenta, the third difference of a polynomial of degree two is zero.
  void quadratic(Vec x) {
    Vec along(x.size(), 0.0), at_rest = x;
    for (const auto& b : d_.blocks)
      for (int k = b.momentum; k >= 0 && k < b.momentum + b.size; ++k) {
        along[size_t(k)] = o_.spread * normal_(rng_) * size_of(k);
        at_rest[size_t(k)] = 0;
      }
    const double rest = f_->hamiltonian(at_rest);
    double third = 0, sum = 0, rounding = rounding_of_energy(at_rest, rest);
    const Vec at = x;
    for (const double weight : {1.0, -3.0, 3.0, -1.0}) {
      const double H = f_->hamiltonian(x);
      third += weight * H;
      sum += std::fabs(weight * (H - rest));
      rounding += std::fabs(weight) * rounding_of_energy(x, H);
      for (size_t i = 0; i < x.size(); ++i) x[i] += along[i];
    }
    note("quadratic", at, relative(third, sum + rounding / o_.tolerance));
  }
  double rounding_of_energy(const Vec& x, double H) {
    return 100 * (std::fabs(f_->hamiltonian(nudged(x)) - H) + std::fabs(H) * 0x1p-53);
  }
  double size_of(int i) const { return o_.sizes.empty() ? 1 : o_.sizes[size_t(i)]; }

  /// The axioms of the field and of the rate.
  void motion(const Vec& x, const Vec& u, const Vec& e, const Vec& Je, const Vec& Re, const Vec& Gu,
              const Vec& y) {
    const size_t n = x.size();
    Vec structural(n), rate(n), with_input(n), dx(n);
    for (size_t i = 0; i < n; ++i) structural[i] = Je[i] - Re[i];
    f_->rate(0.0, x, e, rate);
    const double terms = norm(Je) + norm(Re) + norm(Gu);
    const Vec sources = sub(rate, structural);
    if (d_.traits.autonomous) note("rate", x, relative(norm(sources), terms));
    f_->field(0.0, x, {}, dx);
    Vec efforts(n);
    f_->efforts(0.0, x, dx, efforts);
    note("efforts", x, relative(norm(sub(efforts, e)), norm(e) + of_effort(dx, e)));
    f_->field(0.0, x, u, dx);
    for (size_t i = 0; i < n; ++i) with_input[i] = rate[i] + Gu[i];
    note("field", x, relative(norm(sub(dx, with_input)), terms + of_effort(sources, e)));
    balance(x, e, dx, y, u, norm(e) * norm(Re));
  }
  /// The norm of a rate over the entries with a nonzero effort. The other entries carry no energy
  /// (an orbit that drives the rest) and may have any size, so they give no scale.
  static double of_effort(Vec rate, const Vec& e) {
    for (size_t i = 0; i < e.size(); ++i)
      if (e[i] == 0) rate[i] = 0;
    return norm(rate);
  }

  /// Σ storages = H.
  void storages(const Vec& x) {
    Vec stored(d_.storages.size());
    f_->stored(x, stored);
    double sum = 0, size = 0;
    for (const double s : stored) {
      sum += s;
      size += std::fabs(s);
    }
    const double H = f_->hamiltonian(x);
    note("storages", x, relative(sum - H, size + std::fabs(H)));
  }

  /// H' = yᵀu + Σ supplied - Σ dissipated.
  void balance(const Vec& x, const Vec& e, const Vec& dx, const Vec& y, const Vec& u, double loss) {
    Vec powers(d_.powers.size());
    f_->powers(0.0, x, e, powers);
    double left = dot(e, dx) - dot(y, u);
    double scale = norm(e) * of_effort(dx, e) + norm(y) * norm(u) + loss;
    for (size_t i = 0; i < powers.size(); ++i) {
      if (d_.powers[i].kind == PowerKind::observed) continue;
      const bool in = d_.powers[i].kind == PowerKind::supplied;
      left -= in ? powers[i] : -powers[i];
      scale += std::fabs(powers[i]);
      if (!in) note("passive " + d_.powers[i].name, x, relative(std::min(0.0, powers[i]), scale));
    }
    note("power balance", x, relative(left, scale));
  }

  /// The smallest eigenvalue of R if below zero, relative to the largest. Random vectors alone
  /// would miss a small negative one.
  double dissipation_defect(const Vec& x) {
    const size_t n = x.size();
    Vec R(n * n);
    Vec unit(n, 0.0), column(n);
    for (size_t j = 0; j < n; ++j) {
      unit[j] = 1;
      f_->apply_dissipation(x, unit, column);
      unit[j] = 0;
      for (size_t i = 0; i < n; ++i) R[i * n + j] = column[i];
    }
    const auto e = symmetric_eigenvalues(n, R);
    if (std::isnan(e.front())) return INFINITY;
    return relative(std::min(0.0, e.front()), std::max(-e.front(), e.back()));
  }

  /// ∂H/∂x by one dual evaluation per coordinate.
  Vec dual_gradient(const Vec& x) {
    std::vector<Dual> xd(x.size());
    Vec g(x.size());
    gradient_by_duals<double>([&](auto y) { return dual_->hamiltonian(y); }, x, xd, g);
    return g;
  }

  /// dI/dt = 0 along the conservative field J e.
  void invariants(const Vec& x) {
    const auto m = static_cast<size_t>(d_.invariant_count());
    if (m == 0) return;
    Vec e(x.size()), Je(x.size());
    f_->gradient(x, e);
    f_->apply_structure(x, e, Je);
    Vec taking_part = x;  // without an orbit that drives the rest
    for (size_t i = 0; i < x.size(); ++i)
      if (e[i] == 0 && Je[i] == 0) taking_part[i] = 0;
    const double terms = norm(taking_part) * norm(Je);
    std::vector<Dual> xd(x.size()), values(m);
    for (size_t i = 0; i < x.size(); ++i) xd[i] = Dual(x[i], Je[i]);
    dual_->invariants(xd, values);
    for (const auto& inv : d_.invariants)
      for (int k = 0; k < inv.size; ++k)
        note("invariant " + inv.name, x,
             relative(values[inv.at + k].d, std::fabs(values[inv.at + k].v) + terms));
  }

  auto find(const std::string& axiom) {
    return std::find_if(report_.axioms.begin(), report_.axioms.end(),
                        [&](const auto& r) { return r.axiom == axiom; });
  }
  void untried(const std::string& axiom, const std::string& why) {
    if (find(axiom) == report_.axioms.end()) report_.axioms.push_back({axiom, 0, 0, {}, why});
  }
  void note(const std::string& axiom, const Vec& x, double violation) {
    auto it = find(axiom);
    if (it == report_.axioms.end())
      it = report_.axioms.insert(report_.axioms.end(), {axiom, -1, o_.tolerance, {}});
    if (violation > it->worst) {
      it->worst = violation;
      it->state = x;
    }
  }

  const Description& d_;
  CheckOptions o_;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
  std::unique_ptr<System<double>> f_;
  std::unique_ptr<System<Dual>> dual_;
  CheckReport report_;
  std::string refusal_;  ///< why the field cannot be evaluated
};

}  // namespace

bool CheckReport::holds() const {
  return std::all_of(axioms.begin(), axioms.end(), [](const auto& a) { return a.holds(); }) &&
         std::any_of(axioms.begin(), axioms.end(), [](const auto& a) { return a.applies(); });
}

std::string CheckReport::text() const {
  std::ostringstream s;
  for (const auto& a : axioms) {
    if (!a.applies()) {
      s << "not applicable " << a.axiom << ": " << a.why_not << "\n";
      continue;
    }
    s << (a.holds() ? "holds    " : "VIOLATED ") << a.axiom << ": worst " << a.worst << ", limit "
      << a.limit;
    if (!a.holds()) {
      s << ", at x = [";
      for (size_t i = 0; i < a.state.size(); ++i) s << (i ? ", " : "") << a.state[i];
      s << "]";
    }
    s << "\n";
  }
  return s.str();
}

CheckReport check(const Model& model, const CheckOptions& options) {
  return Checker(model, options).run();
}

std::optional<std::string> false_trait(const Model& model) {
  for (const AxiomResult& a : Checker(model, {.samples = 3}).run_traits().axioms)
    if (!a.holds() && std::isfinite(a.worst))  // else the state could not be evaluated
      return "system '" + model.description().name + "' says it is " + a.axiom + ", but " +
             (a.axiom == "canonical" ? "its J is not [0 I; -I 0]"
                                     : "its slope over q changes with p: H is not T(p) + V(q)");
  return std::nullopt;
}

std::optional<std::string> falsely_quadratic(const Model& model) try {
  const auto& d = model.description();
  if (!d.traits.quadratic || !(Checker(model, {.samples = 3}).third_difference() > 1e-6)) return {};
  return "system '" + d.name +
         "' says it is quadratic, but H has more than degree two in its momenta";
} catch (const std::exception& e) {  // a state that cannot be evaluated says nothing
  if (dynamic_cast<const std::bad_alloc*>(&e)) throw;
  return std::nullopt;
}

}  // namespace porthos::phs
