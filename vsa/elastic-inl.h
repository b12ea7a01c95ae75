#pragma once
#include <fmt/format.h>

#include "phs/error.h"
#include "vsa/elastic.h"
#include "vsa/jet.h"

/// Makes an Elastic from a plain struct that has one of
///
///   template <class T> T energy(const T& phi, const T& sigma) const;
///       with φ = q - θ: translation invariant
///   template <class T> T energy(const T& q, const T& theta, const T& sigma) const;
///
/// and, if its deflection limit does not apply to φ itself,
///
///   template <class T> std::array<T, n> strains(const T& phi, const T& sigma) const;
///
/// which must work for every scalar and for Jets of it.
namespace porthos::vsa {

template <class F>
inline constexpr bool by_deflection = requires(const F& f, double x) {
  f.energy(x, x);
};

/// E += ⅓ k depth³ outside [lower, upper]. If no lane is outside, nothing is computed; the bits are
/// the same, because the term would be 0.
template <class T>
void add_stop(T& E, const T& x, double lower, double upper, double k) {
  using phs::any, phs::max;
  if (!any((T(upper) < x) | (x < T(lower)))) return;
  const T zero(0.0), above = max(T(x - T(upper)), zero), below = max(T(T(lower) - x), zero);
  E = E + T(k / 3) * (above * above * above + below * below * below);
}

template <class F>
class ElasticOf : public Elastic {
 public:
  ElasticOf(F family, ElasticTraits t) : Elastic(std::move(t)), f_(std::move(family)) {
    traits_.translation_invariant = by_deflection<F>;
    const Limits& l = traits_.limits;
    stops_ = l.deflection < HUGE_VAL;
    sigma_stops_ = l.sigma_stop_stiffness > 0;
    const auto refuse = [&](const char* what, double value, const char* expected) {
      throw InvalidArgument(
          fmt::format("{}: {} is {}, expected {}", traits_.family, what, value, expected));
    };
    if (!(l.deflection > 0)) refuse("the deflection limit", l.deflection, "more than 0 rad");
    if (stops_ && !(l.stop_stiffness > 0 && l.stop_stiffness < HUGE_VAL))
      refuse("stop_stiffness, of the stop at the deflection limit,", l.stop_stiffness,
             "more than 0 N m/rad^2");
    if (!(l.sigma_lower <= l.sigma_upper))
      refuse("the lower end of sigma", l.sigma_lower, "no more than the upper end");
    if (!(l.sigma_stop_stiffness >= 0 && l.sigma_stop_stiffness < HUGE_VAL))
      refuse("the stiffness of the stops of sigma", l.sigma_stop_stiffness, "0 or more");
  }

#define PORTHOS_ELASTIC(T)                                                      \
  T energy(const T& q, const T& theta, const T& sigma) const override {         \
    return whole(q, theta, sigma);                                              \
  }                                                                             \
  Slopes<T> slopes(const T& q, const T& theta, const T& sigma) const override { \
    return slopes_of(q, theta, sigma);                                          \
  }
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_ELASTIC)
#undef PORTHOS_ELASTIC

  Hessian hessian(double q, double theta, double sigma) const override {
    using J = Jet<double, 3>;
    const auto s = slopes_of(J(q, 0), J(theta, 1), J(sigma, 2));
    return {s.q.d, s.theta.d, s.sigma.d};
  }
  std::vector<double> strains(double q, double theta, double sigma) const override {
    if (!stops_) return {};
    const auto s = strains_of(q, theta, sigma);
    return {s.begin(), s.end()};
  }

 private:
  template <class T>
  auto strains_of(const T& q, const T& theta, const T& sigma) const {
    if constexpr (requires { f_.strains(q, sigma); })
      return f_.strains(T(q - theta), sigma);
    else
      return std::array<T, 1>{q - theta};
  }
  template <class T>
  T with_stops(T E, const T& q, const T& theta, const T& sigma) const {
    const Limits& l = traits_.limits;
    if (stops_)
      for (const T& s : strains_of(q, theta, sigma))
        add_stop(E, s, -l.deflection, l.deflection, l.stop_stiffness);
    if (sigma_stops_) add_stop(E, sigma, l.sigma_lower, l.sigma_upper, l.sigma_stop_stiffness);
    return E;
  }
  template <class T>
  T whole(const T& q, const T& theta, const T& sigma) const {
    if constexpr (by_deflection<F>)
      return with_stops(f_.energy(T(q - theta), sigma), q, theta, sigma);
    else
      return with_stops(f_.energy(q, theta, sigma), q, theta, sigma);
  }
  template <class T>
  Slopes<T> slopes_of(const T& q, const T& theta, const T& sigma) const {
    if constexpr (by_deflection<F>) {
      using J = Jet<T, 2>;
      const J E = whole(J(T(q - theta), 0), J(0.0), J(sigma, 1));
      return {E.d[0], -E.d[0], E.d[1]};
    } else {
      using J = Jet<T, 3>;
      const J E = whole(J(q, 0), J(theta, 1), J(sigma, 2));
      return {E.d[0], E.d[1], E.d[2]};
    }
  }
  F f_;
  bool stops_ = false, sigma_stops_ = false;
};

template <class F>
ElasticPtr make_elastic(F family, ElasticTraits traits) {
  return std::make_shared<ElasticOf<F>>(std::move(family), std::move(traits));
}

/// Checks a parameter of a family. @throws InvalidArgument unless the condition holds and the value
/// is finite
inline void require(bool condition, const char* family, const char* what, double value,
                    const char* expected) {
  if (!condition || !(std::fabs(value) < HUGE_VAL))
    throw InvalidArgument(fmt::format("{}: {} is {}, expected {}", family, what, value, expected));
}

}  // namespace porthos::vsa
