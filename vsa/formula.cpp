#include "vsa/formula.h"

#include <algorithm>
#include <tuple>

#include "phs/functions/formula.h"
#include "vsa/elastic-inl.h"

namespace porthos::vsa {
namespace {

[[noreturn]] void refuse_formula(const std::string& why) {
  throw InvalidArgument("formula: " + why);
}

struct FormulaEnergy {
  phs::Formula formula;
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    const T variables[] = {phi, sigma};
    return formula.at(std::span<const T>(variables));
  }
};

phs::Formula parsed(const Formula& p) {
  try {
    return {p.energy, {"phi", "sigma"}, p.parameters};
  } catch (const InvalidArgument& e) {
    refuse_formula(std::string("the energy ") + e.what());
  }
}

/// Whether the energy is odd in φ, as torques are and energies seldom.
bool is_odd(const Elastic& e, double most, double sigma) {
  double sum = 0, size = 0;
  for (int i = 1; i <= 20; ++i) {
    const double one = e.energy(most * i / 20, 0.0, sigma),
                 other = e.energy(-most * i / 20, 0.0, sigma);
    sum = std::max(sum, std::fabs(one + other));
    size = std::max(size, std::fabs(one - other));
  }
  return sum <= 1e-12 * size;
}

/// Refuses a place where the energy is not finite or the stiffness is negative.
void check_places(const Elastic& e, bool with_sigma) {
  constexpr int deflections = 201, sigmas = 21;
  const Limits& l = e.traits().limits;
  const double most = std::min(l.deflection, M_PI);
  double softest = HUGE_VAL, stiffest = 0, phi_there = 0, sigma_there = 0;
  for (int j = 0; j < (with_sigma ? sigmas : 1); ++j)
    for (int i = 0; i < deflections; ++i) {
      const double phi = most * (2.0 * i / (deflections - 1) - 1);
      const double sigma =
          with_sigma ? l.sigma_lower + (l.sigma_upper - l.sigma_lower) * j / (sigmas - 1) : 0;
      const auto place = [&] {
        return fmt::format(" at phi = {:.4g} rad{}", phi,
                           with_sigma ? fmt::format(" and sigma = {:.4g}", sigma) : "");
      };
      const char* const expected =
          "expected a finite number over the range of the limits (of phi: ± pi without a limit)";
      const auto finite = [&](const char* what, double x) {
        if (!std::isfinite(x))
          refuse_formula(
              fmt::format("the {} is {}{}, {}", what, std::isnan(x) ? NAN : x, place(), expected));
      };
      const auto s = e.slopes(phi, 0.0, sigma);
      const auto H = e.hessian(phi, 0.0, sigma);
      finite("energy", e.energy(phi, 0.0, sigma));
      finite("torque", s.q);
      finite("effort of sigma", s.sigma);
      finite("stiffness", H[0][0]);
      finite("derivative of the torque by sigma", H[0][2]);
      finite("second derivative by sigma", H[2][2]);
      stiffest = std::max(stiffest, H[0][0]);
      if (H[0][0] < softest) {
        softest = H[0][0];
        phi_there = phi;
        sigma_there = sigma;
      }
    }
  if (!(softest >= -1e-9 * stiffest))  // rounding of sums that cancel
    refuse_formula(fmt::format(
        "the stiffness is {:.6g} N m/rad at phi = {:.4g} rad{}, expected 0 or more over the range "
        "of the limits (of phi: ± pi without a limit): {}",
        softest, phi_there, with_sigma ? fmt::format(" and sigma = {:.4g}", sigma_there) : "",
        is_odd(e, most, sigma_there)
            ? "the energy is odd in phi: is it the torque? state its integral"
            : "the equilibrium would not be unique"));
  if (!(stiffest > 0))
    refuse_formula(
        "the stiffness is 0 everywhere, expected an energy that bends with phi: if "
        "this is the torque, state its integral");
}

/// A place in [a, b] towards which f >= 0 grows without bound; NaN: there is none that stands out.
/// Halving follows the larger end. Towards a pole the middle grows at every halving, by 1.4 or
/// more; where f is smooth, however steep, it does not change in the end.
template <class F>
double pole_between(const F& f, double a, double b, double at_a, double at_b) {
  constexpr int first = 6, half = 20, halvings = 40;
  const double most = std::fmax(at_a, at_b);
  const bool steep = most > 4 * std::fmin(at_a, at_b);
  double middle = 0, there = 0, halfway = 0;
  for (int k = 1; k <= halvings; ++k) {
    middle = 0.5 * (a + b);
    there = f(middle);
    if (!std::isfinite(there)) return middle;
    std::tie(at_a > at_b ? b : a, at_a > at_b ? at_b : at_a) = std::pair{middle, there};
    if (k == first && !steep && std::fmax(at_a, at_b) < 2 * most) return NAN;
    if (k == half) halfway = there;
  }
  return there > 100 * halfway ? middle : NAN;
}

/// The values of σ at which an energy is looked through.
std::vector<double> looked_at(const Limits& l, bool with_sigma) {
  if (!with_sigma) return {0};
  const double range = l.sigma_upper - l.sigma_lower;
  return {l.sigma_lower + 0.5 * range, l.sigma_lower, l.sigma_upper};
}

/// Refuses a stiffness with a pole between the places at which it was checked.
void check_poles(const Elastic& e, bool with_sigma) {
  constexpr int intervals = 200;
  const Limits& l = e.traits().limits;
  const double most = std::min(l.deflection, M_PI);
  for (const double sigma : looked_at(l, with_sigma)) {
    const auto size = [&](double phi) { return std::fabs(e.stiffness(phi, 0.0, sigma)); };
    const auto place = [&](int i) { return most * (2.0 * i / intervals - 1); };
    std::vector<double> at;
    for (int i = 0; i <= intervals; ++i) at.push_back(size(place(i)));
    auto sorted = at;
    std::ranges::nth_element(sorted, sorted.begin() + intervals / 2);
    for (size_t i = 0; i < size_t(intervals); ++i) {
      const double pole = pole_between(size, place(int(i)), place(int(i) + 1), at[i], at[i + 1]);
      if (!std::isfinite(pole) || size(pole) <= sorted[intervals / 2]) continue;  // rounding
      refuse_formula(fmt::format(
          "the stiffness grows without bound towards phi = {:.4g} rad{}, a pole, expected none "
          "over the range of the limits (of phi: ± pi without a limit): limits.deflection below it",
          pole, with_sigma ? fmt::format(" at sigma = {:.4g}", sigma) : ""));
    }
  }
}

/// Where a function of φ jumps most between neighbours of a grid: it changes there by more than
/// `least` and by as much however near the two places are. The grid has no round numbers, at which
/// the branches of abs, min and max meet: a value there alone is no jump.
struct Jump {
  double at = 0, from = 0, to = 0;
};
template <class F>
Jump largest_jump(const F& f, double most, double least) {
  constexpr int intervals = 200, halvings = 45, near = 30;
  const auto place = [&](int i) { return most * std::min((2 * i - 0.74) / intervals - 1, 1.0); };
  Jump largest;
  for (int i = 0; i <= intervals; ++i) {
    double a = std::max(place(i), -most), b = place(i + 1), when_near = 0;
    double at_a = f(a), at_b = f(b);
    for (int k = 0; k < halvings && std::fabs(at_b - at_a) > least; ++k) {
      if (k == near) when_near = at_b - at_a;
      const double middle = 0.5 * (a + b), there = f(middle);
      if (std::fabs(there - at_a) > std::fabs(at_b - there)) {
        b = middle;
        at_b = there;
      } else {
        a = middle;
        at_a = there;
      }
    }
    const double jump = std::fabs(at_b - at_a), largest_yet = std::fabs(largest.to - largest.from);
    if (jump > std::max({least, largest_yet, 0.5 * std::fabs(when_near)}))
      largest = {b, at_a, at_b};
  }
  return largest;
}

/// φ with so many derivatives by it, one in another.
template <int order>
struct Nested {
  using Inner = typename Nested<order - 1>::Number;
  using Number = Jet<Inner, 1>;
  static Number variable(double phi) { return {Nested<order - 1>::variable(phi), 0}; }
  static double derivative(const Number& x) { return Nested<order - 1>::derivative(x.d[0]); }
};
template <>
struct Nested<0> {
  using Number = double;
  static double variable(double phi) { return phi; }
  static double derivative(double x) { return x; }
};

/// Where a derivative of that order by φ jumps by more than rounding.
template <int order>
Jump jump_of_derivative(const FormulaEnergy& energy, double most, double sigma) {
  using N = Nested<order>;
  const auto f = [&](double phi) {
    return N::derivative(energy.energy(N::variable(phi), typename N::Number(sigma)));
  };
  double size = 0;
  for (int i = 0; i <= 200; ++i) size = std::fmax(size, std::fabs(f(most * (i / 100.0 - 1))));
  return largest_jump(f, most, 1e-6 * size);
}

/// ElasticTraits::kink: of a kink to a higher power the first derivatives go on.
double kink_of(const FormulaEnergy& energy, const Limits& l, bool with_sigma) {
  const double most = std::min(l.deflection, M_PI);
  for (const double sigma : looked_at(l, with_sigma))
    for (const Jump& j :
         {jump_of_derivative<3>(energy, most, sigma), jump_of_derivative<4>(energy, most, sigma),
          jump_of_derivative<5>(energy, most, sigma), jump_of_derivative<6>(energy, most, sigma)})
      if (j.to != j.from) return j.at;
  return NAN;
}

/// A remark on a stiffness that jumps; refuses torques that do, which no method can follow.
std::string checked_kinks(const Elastic& e, bool with_sigma) {
  const Limits& l = e.traits().limits;
  const double most = std::min(l.deflection, M_PI);
  for (const double sigma : looked_at(l, with_sigma)) {
    const auto torque = [&](double phi) { return e.slopes(phi, 0.0, sigma).q; };
    const auto stiffness = [&](double phi) { return e.stiffness(phi, 0.0, sigma); };
    const auto size = [&](const auto& f) { return std::fabs(f(most)) + std::fabs(f(-most)); };
    if (const Jump j = largest_jump(torque, most, 1e-6 * size(torque)); j.to != j.from)
      refuse_formula(fmt::format(
          "the torque jumps from {:.4g} to {:.4g} N m at phi = {:.4g} rad, expected one without "
          "jumps: sqrt(x^2 + d^2) with a small d stands for abs(x)",
          j.from, j.to, j.at));
    if (const Jump j = largest_jump(stiffness, most, 1e-6 * size(stiffness)); j.to != j.from)
      return fmt::format(
          "the stiffness jumps from {:.4g} to {:.4g} N m/rad at phi = {:.4g} rad: steps over this "
          "place lose their order, so errors fall as the step, and the implicit equations may fail "
          "there; a rounded corner has neither",
          j.from, j.to, j.at);
  }
  return "";
}

}  // namespace

ElasticPtr formula(const Formula& p, const Limits& l) {
  FormulaEnergy energy{parsed(p)};
  const bool with_sigma = energy.formula.depends_on(1);
  if (!energy.formula.depends_on(0))
    refuse_formula(
        fmt::format("the energy \"{}\" does not depend on phi, expected one that does", p.energy));
  if (with_sigma && !(std::isfinite(l.sigma_lower) && std::isfinite(l.sigma_upper)))
    refuse_formula(
        "the energy depends on sigma, expected its range in the limits (a scene: limits.sigma = "
        "[lower, upper]; Python: limits=Limits(sigma_lower=..., sigma_upper=...)): over it the "
        "energy is checked");
  ElasticTraits traits{.family = "formula",
                       .title = p.energy,
                       .sigma = with_sigma ? "as in the formula" : "",
                       .sigma_unit = with_sigma ? "1" : "",
                       .limits = l};
  const auto e = make_elastic(energy, traits);
  check_places(*e, with_sigma);
  check_poles(*e, with_sigma);
  if (!energy.formula.has_kinks()) return e;
  traits.remark = checked_kinks(*e, with_sigma);
  traits.kink = kink_of(energy, traits.limits, with_sigma);
  return make_elastic(std::move(energy), std::move(traits));
}

}  // namespace porthos::vsa
