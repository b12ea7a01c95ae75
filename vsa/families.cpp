#include "vsa/families.h"

#include "vsa/elastic-inl.h"

namespace porthos::vsa {
namespace {

struct SeriesElasticEnergy : SeriesElastic {
  template <class T>
  T energy(const T& phi, const T&) const {
    const T square = phi * phi;
    return (T(0.5 * k) + T(0.25 * k3) * square) * square;
  }
};

struct VariableLeverEnergy : VariableLever {
  template <class T>
  T stiffness(const T& s) const {
    return T(k[0]) + s * (T(k[1]) + s * (T(k[2]) + s * T(k[3])));
  }
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    return T(0.5) * stiffness(sigma) * phi * phi;
  }
};

struct AntagonisticQuadraticEnergy : AntagonisticQuadratic {
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    using phs::max;
    const T zero(0.0), one = max(T(sigma + phi), zero), other = max(T(sigma - phi), zero);
    return T(ks * r * r * r / 3) * (one * one * one + other * other * other);
  }
};

struct AntagonisticExponentialEnergy : AntagonisticExponential {
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    using phs::exp;
    const T one = T(b) * (sigma + phi), other = T(b) * (sigma - phi);
    return T(c / b) * ((exp(one) - one - T(1.0)) + (exp(other) - other - T(1.0)));
  }
};

/// cosh x - 1 = ½ (e^{x/2} - e^{-x/2})², which avoids cancellation at small x.
struct CoshEnergy : Cosh {
  template <class T>
  static T one(double slope, double force, const T& d) {
    using phs::exp;
    const T e = exp(T(0.5 * slope) * d), twice_sinh = e - T(1.0) / e;
    return T(0.5 * force / slope) * twice_sinh * twice_sinh;
  }
  template <class T>
  std::array<T, 2> strains(const T& phi, const T& sigma) const {
    return {phi - sigma, phi + sigma};
  }
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    return one(a, k, T(phi - sigma)) + one(a2, k2, T(phi + sigma));
  }
};

template <class T>
T sine(const T& x) {
  using phs::sincos;
  T s, c;
  sincos(x, s, c);
  return s;
}
template <class T>
T cosine(const T& x) {
  using phs::sincos;
  T s, c;
  sincos(x, s, c);
  return c;
}

struct LeverArmEnergy : LeverArm {
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    const T d = sigma * sine(phi);
    return T(ks) * d * d;
  }
};

struct MovingPivotEnergy : MovingPivot {
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    const T d = T(R) * (sigma / (T(L) - sigma)) * sine(phi);
    return T(0.5 * ks) * d * d;
  }
};

struct MaccepaEnergy : Maccepa {
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    using phs::sqrt;
    // B² + C² - 2 B C cos φ = (C - B)² + 4 B C sin²(φ/2), without cancellation at small φ
    const T s = sine(T(T(0.5) * phi)), more = T(4 * B * C) * s * s;
    const T A = sqrt(T(T((C - B) * (C - B)) + more));
    const T d = more / (A + T(C - B)) + T(drum) * sigma;
    return T(0.5 * kappa) * d * d;
  }
};

struct TwoSpringServoEnergy : TwoSpringServo {
  template <class T>
  T energy(const T& q, const T& u1, const T& u2) const {
    using phs::sincos, phs::sqrt;
    T sq, cq, s1, c1, s2, c2;
    sincos(q, sq, cq);
    sincos(u1, s1, c1);
    sincos(u2, s2, c2);
    const T x1 = T(a) * cq - T(L) * s1 - T(h), y1 = T(a) * sq + T(L) * c1 - T(d);
    const T x2 = T(h) + T(L) * s2 - T(a) * cq, y2 = T(L) * c2 - T(a) * sq - T(d);
    const T e1 = sqrt(T(x1 * x1 + y1 * y1)) - T(s0), e2 = sqrt(T(x2 * x2 + y2 * y2)) - T(s0);
    return T(0.5 * kappa) * (e1 * e1 + e2 * e2);
  }
};

}  // namespace

ElasticPtr series_elastic(const SeriesElastic& p, const Limits& l) {
  require(p.k >= 0, "series_elastic", "k", p.k, "0 N m/rad or more");
  require(p.k3 >= 0, "series_elastic", "k3", p.k3, "0 N m/rad^3 or more");
  return make_elastic(SeriesElasticEnergy{p}, {.family = "series_elastic",
                                               .title = "Series elastic",
                                               .sigma = "",
                                               .sigma_unit = "",
                                               .limits = l});
}

ElasticPtr variable_lever(const VariableLever& p, const Limits& l) {
  const char* const name = "variable_lever";
  for (const double k : p.k) require(true, name, "a coefficient of k", k, "a finite number");
  require(l.sigma_lower <= l.sigma_upper, name, "the lower end of sigma", l.sigma_lower,
          "a finite number, no more than the upper end");
  require(true, name, "the upper end of sigma", l.sigma_upper, "a finite number");
  const VariableLeverEnergy e{p};
  constexpr int places = 1000;
  for (int i = 0; i <= places; ++i) {
    const double s = l.sigma_lower + (l.sigma_upper - l.sigma_lower) * i / places;
    if (!(e.stiffness(s) >= 0))
      throw InvalidArgument(fmt::format(
          "{}: k is {} N m/rad at sigma = {}, expected 0 or more over sigma's range {} to {}", name,
          e.stiffness(s), s, l.sigma_lower, l.sigma_upper));
  }
  return make_elastic(e, {.family = name,
                          .title = "Variable lever, any k(sigma)",
                          .sigma = "place of the lever",
                          .sigma_unit = "1",
                          .limits = l});
}

ElasticPtr antagonistic_quadratic(const AntagonisticQuadratic& p, const Limits& l) {
  const char* const name = "antagonistic_quadratic";
  require(p.ks > 0, name, "ks", p.ks, "more than 0 N/m^2");
  require(p.r > 0, name, "r", p.r, "more than 0 m");
  return make_elastic(AntagonisticQuadraticEnergy{p},
                      {.family = name,
                       .title = "Antagonistic tendons with quadratic springs",
                       .sigma = "half the angle between the motors",
                       .sigma_unit = "rad",
                       .limits = l});
}

ElasticPtr antagonistic_exponential(const AntagonisticExponential& p, const Limits& l) {
  const char* const name = "antagonistic_exponential";
  require(p.c > 0, name, "c", p.c, "more than 0 N m");
  require(p.b > 0, name, "b", p.b, "more than 0 1/rad");
  return make_elastic(AntagonisticExponentialEnergy{p},
                      {.family = name,
                       .title = "Antagonistic exponential springs",
                       .sigma = "half the angle between the motors",
                       .sigma_unit = "rad",
                       .limits = l});
}

ElasticPtr cosh_springs(const Cosh& p, const Limits& l) {
  const char* const name = "cosh";
  require(p.a > 0, name, "a", p.a, "more than 0 1/rad");
  require(p.k > 0, name, "k", p.k, "more than 0 N m");
  require((p.a2 == 0) == (p.k2 == 0), name, "k2", p.k2,
          "both numbers of the second spring or none");
  CoshEnergy e{p};
  if (p.a2 == 0) {
    e.a2 = p.a;
    e.k2 = p.k;
  }
  require(e.a2 > 0, name, "a2", e.a2, "more than 0 1/rad");
  require(e.k2 > 0, name, "k2", e.k2, "more than 0 N m");
  return make_elastic(e, {.family = name,
                          .title = "Antagonistic springs of sinh force (qbmove, VSA-Cube)",
                          .sigma = "half the angle between the motors",
                          .sigma_unit = "rad",
                          .limits = l});
}

ElasticPtr lever_arm(const LeverArm& p, const Limits& l) {
  require(p.ks > 0, "lever_arm", "ks", p.ks, "more than 0 N/m");
  return make_elastic(LeverArmEnergy{p}, {.family = "lever_arm",
                                          .title = "Springs at a lever of variable length (AwAS)",
                                          .sigma = "length of the lever",
                                          .sigma_unit = "m",
                                          .limits = l});
}

ElasticPtr moving_pivot(const MovingPivot& p, const Limits& l) {
  const char* const name = "moving_pivot";
  require(p.ks > 0, name, "ks", p.ks, "more than 0 N/m");
  require(p.R > 0, name, "R", p.R, "more than 0 m");
  require(p.L > 0, name, "L", p.L, "more than 0 m");
  require(l.sigma_upper < p.L, name, "the upper end of sigma", l.sigma_upper,
          "less than the lever's length L: the stiffness has no bound there");
  return make_elastic(MovingPivotEnergy{p},
                      {.family = name,
                       .title = "Lever with a moving pivot (AwAS-II, CompAct, vsaUT-II; generic)",
                       .sigma = "place of the pivot",
                       .sigma_unit = "m",
                       .limits = l});
}

ElasticPtr maccepa(const Maccepa& p, const Limits& l) {
  const char* const name = "maccepa";
  require(p.kappa > 0, name, "kappa", p.kappa, "more than 0 N/m");
  require(p.B > 0, name, "B", p.B, "more than 0 m");
  require(p.C > p.B, name, "C", p.C, "more than B");
  require(p.drum > 0, name, "drum", p.drum, "more than 0 m");
  return make_elastic(MaccepaEnergy{p}, {.family = name,
                                         .title = "MACCEPA",
                                         .sigma = "angle of the pretension drum",
                                         .sigma_unit = "rad",
                                         .limits = l});
}

ElasticPtr two_spring_servo(const TwoSpringServo& p, const Limits& l) {
  const char* const name = "two_spring_servo";
  require(p.kappa > 0, name, "kappa", p.kappa, "more than 0 N/m");
  require(p.s0 > 0, name, "s0", p.s0, "more than 0 m");
  require(p.a > 0, name, "a", p.a, "more than 0 m");
  require(p.L > 0, name, "L", p.L, "more than 0 m");
  for (const double x : {p.h, p.d}) require(true, name, "h or d", x, "a finite number");
  return make_elastic(TwoSpringServoEnergy{p},
                      {.family = name,
                       .title = "Two springs on the levers of two servos (Edinburgh)",
                       .sigma = "angle of the second servo",
                       .sigma_unit = "rad",
                       .limits = l});
}

}  // namespace porthos::vsa
