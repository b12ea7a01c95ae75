#include <cmath>

#include "space/orbit.h"
#include "space/split_scheme.h"
#include "tests/support/bounds.h"
#include "tests/support/reference.h"

// The orbit alone.
namespace porthos::space::orbit_test {
namespace {

using test::breaks;
using test::keeps;
using L = long double;

template <class T>
T energy(T mu, const PointState<T>& s) {
  return dot(s.v, s.v) / T(2.0) - mu / mechanics::norm(s.r);
}
template <class T>
double distance(const Vec3<T>& a, const Vec3<T>& b) {
  return phs::to_double(mechanics::norm(a - b));
}
/// At the pericentre q = 1 - e of an ellipse with a = mu = 1.
template <class T>
PointState<T> pericentre(T e) {
  return {{T(1.0) - e, T(0.0), T(0.0)}, {T(0.0), phs::sqrt((T(1.0) + e) / (T(1.0) - e)), T(0.0)}};
}

phs::Quad decimal(const nlohmann::json& j) {
  return phs::strtoflt128(j.get<std::string>().c_str(), nullptr);
}

TEST(Kepler, OneStepToAnyTimeOfTheReference) {
  const auto file = test::read_json(test::data_file("reference/h_kepler_e0.6.json"));
  const PointState<phs::Quad> start{{decimal("0.4"), 0.0, 0.0}, {0.0, 2.0, 0.0}};
  double worst_quad = 0, worst = 0;
  for (const auto& o : file["outputs"]) {
    const auto& g = o["group0"];
    const Vec3<phs::Quad> r{decimal(g[0]), decimal(g[1]), decimal(g[2])};
    const phs::Quad t = decimal(o["t"]);
    worst_quad = std::max(worst_quad, distance(kepler_flow(phs::Quad(1.0), start, t).r, r));
    const PointState<double> s{Vec3<double>(start.r), Vec3<double>(start.v)};
    const double here = distance(kepler_flow(1.0, s, double(t)).r, Vec3<double>(r));
    worst = std::max(worst, here / (1 + double(t)));
  }
  keeps("e = 0.6, up to 1000 periods in one step, Quad", worst_quad, 1e-28);
  keeps("the same in double, per unit of time", worst, 1e-15);
}

TEST(Kepler, AllEccentricitiesThereAndBack) {
  for (const double e : {0.0, 1e-9, 0.3, 0.9, 0.999, 1.0, 1.0 + 1e-9, 1.5, 10.0})
    for (const double t : {1e-6, 0.1, 3.0, 40.0, -1e3}) {
      // pericentre 1, so that a parabola has a scale
      const PointState<L> s{{1, 0, 0}, {0, std::sqrt(1 + L(e)), 0}};
      const auto there = kepler_flow(L(1), s, L(t));
      const auto back = kepler_flow(L(1), there, -L(t));
      const auto half = kepler_flow(L(1), kepler_flow(L(1), s, L(t) / 2), L(t) / 2);
      const double growth = 1 + std::fabs(t) * std::fabs(t);
      EXPECT_LT(distance(back.r, s.r), 1e-17 * growth) << "e " << e << " t " << t;
      EXPECT_LT(distance(half.r, there.r), 1e-17 * growth) << "e " << e << " t " << t;
      EXPECT_LT(std::fabs(double(energy(L(1), there) - energy(L(1), s))), 3e-18) << e << " " << t;
    }
  // Straight up and down, no angular momentum; and past the turning point.
  const PointState<L> up{{1, 0, 0}, {1, 0, 0}};
  EXPECT_LT(std::fabs(double(energy(L(1), kepler_flow(L(1), up, L(2))) - energy(L(1), up))), 1e-18);
  EXPECT_THROW(kepler_flow(1.0, PointState<double>{{0, 0, 0}, {1, 0, 0}}, 1.0), InvalidArgument);
}

/// Error of energy and angular momentum after 1e5 orbits of e = 0.9 in 16 steps each, and of the
/// phase.
template <class T, bool low_words>
void long_ellipse(double& worst_energy, double& worst_momentum, double& phase) {
  const double e = 0.9, two_pi = 6.283185307179586;
  const int steps = 16;
  const PointState<L> s0 = pericentre(L(e));
  std::array<double, 6> x{}, lo{};
  store_point(s0, x, lo);
  const L E0 = energy(L(1), load_point(x, lo)), h0 = s0.r.x * s0.v.y;
  const T h = T(two_pi / steps);
  worst_energy = worst_momentum = 0;
  const int orbits = 100000;
  for (int n = 1; n <= orbits; ++n) {
    for (int k = 0; k < steps; ++k) {
      const OrbitPoint p = load_point(x, lo);
      const PointState<T> q{Vec3<T>(p.r), Vec3<T>(p.v)};
      const auto moved = kepler_flow(T(1.0), q, h);
      store_point({Vec3<L>(moved.r), Vec3<L>(moved.v)}, x, lo);
      if (!low_words) lo.fill(0);
    }
    const OrbitPoint p = load_point(x, lo);
    const double root = std::sqrt(double(n));
    worst_energy = std::max(worst_energy, std::fabs(double((energy(L(1), p) - E0) / E0)) / root);
    worst_momentum = std::max(worst_momentum,
                              std::fabs(double(mechanics::norm(cross(p.r, p.v)) / h0 - 1)) / root);
  }
  // Against one step in Quad from the same start to the same time, as a time: distance over speed
  // at the end.
  PointState<phs::Quad> q0{Vec3<phs::Quad>(s0.r), Vec3<phs::Quad>(s0.v)};
  const auto exact =
      kepler_flow(phs::Quad(1.0), q0, phs::Quad(double(h)) * phs::Quad(double(steps) * orbits));
  const OrbitPoint p = load_point(x, lo);
  phase = distance(p.r, Vec3<L>(exact.r)) / double(mechanics::norm(p.v));
}

TEST(Kepler, HundredThousandOrbitsOfAnEllipse) {
  double energy_error, momentum, phase;
  long_ellipse<L, true>(energy_error, momentum, phase);
  keeps("e = 0.9, 1e5 orbits: energy error / sqrt(orbits)", energy_error, 2e-16);
  keeps("angular momentum error / sqrt(orbits)", momentum, 1e-17);
  keeps("phase error, as time over the 6e5 of the run", phase / 6.28e5, 5e-14);
  long_ellipse<double, false>(energy_error, momentum, phase);
  breaks("in plain double: energy error / sqrt(orbits)", energy_error, 1e-14);
}

TEST(Gravity, HarmonicsAreTheGradientOfTheirPotential) {
  const Zonals J = earth_zonals();
  const phs::Quad mu(3.986e14), a(6378136.3);
  const Vec3<phs::Quad> k{0.36, 0.48, 0.8};
  double worst = 0;
  for (const Vec3<double> r :
       {Vec3<double>{7e6, 1e6, -2e6}, {-1e6, 3e6, 6.5e6}, {3.6e6, 4.8e6, 8e6}}) {
    const Vec3<phs::Quad> at(r);
    Vec3<phs::Quad> g, ignored;
    zonal_field(mu, a, k, J, at, g);
    for (int i = 0; i < 3; ++i) {
      Vec3<phs::Quad> up = at, down = at;
      up[i] = up[i] + phs::Quad(1e-2);
      down[i] = down[i] - phs::Quad(1e-2);
      const phs::Quad slope =
          (zonal_field(mu, a, k, J, up, ignored) - zonal_field(mu, a, k, J, down, ignored)) /
          phs::Quad(2e-2);
      worst = std::max(worst, std::fabs(double(slope + g[i])) / double(mechanics::norm(g)));
    }
  }
  keeps("J2 to J6: acceleration against the potential's slope", worst, 1e-15);
}

TEST(Gravity, ThirdBodyWithoutCancellation) {
  const Vec3<double> r{7e6, -3e5, 1e6}, s{1.4e11, 5e10, 2e9};
  const auto plain = [](auto mu, auto body, auto at) {
    using T = decltype(mu);
    const auto cube = [](const Vec3<T>& v) { return dot(v, v) * mechanics::norm(v); };
    const Vec3<T> d = at - body;
    return -mu / cube(d) * d - mu / cube(body) * body;
  };
  const double mu = 1.327e20;
  const auto exact = plain(phs::Quad(mu), Vec3<phs::Quad>(s), Vec3<phs::Quad>(r));
  const double size = double(mechanics::norm(exact));
  keeps("the Sun on a low orbit, Battin's form",
        distance(third_body_acceleration(mu, s, r), Vec3<double>(exact)) / size, 1e-15);
  breaks("the difference of two accelerations",
         distance(plain(mu, s, r), Vec3<double>(exact)) / size, 1e-13);
}

TEST(Orbit, NodeOfAnOblatePlanetDrifts) {
  // The analytic rate is of first order in J2: at a J2 a hundred times smaller it must fit a
  // hundred times better.
  const double inclination = 0.6, a = 7e6;
  double miss[2];
  for (const int small : {0, 1}) {
    Environment env;
    env.planet.J[0] = small ? 1.0826e-5 : 1.0826e-3;
    const auto start = from_elements(env.planet.mu, a, 0.01, inclination, 0.4, 0.3, 0.0);
    OrbitPropagator orbit(env, 1000, start, 60, "aba864");
    // mean of the node over whole orbits at both ends of a day's run, the mean of the semi-major
    // axis for the rate
    const double n = std::sqrt(env.planet.mu / (a * a * a));
    const int per_orbit = int(6.283185307179586 / n / 60), orbits = 150;
    double node[2] = {0, 0}, mean_a = 0, mean_e = 0, mean_i = 0;
    const int last = per_orbit * orbits;
    for (int k = 0; k < last + per_orbit; ++k) {
      const OrbitPoint p = orbit.point();
      const auto o = elements_of(env.planet.mu, {Vec3<double>(p.r), Vec3<double>(p.v)});
      mean_a += o.semi_major_axis;
      mean_e += o.eccentricity;
      mean_i += o.inclination;
      if (k < per_orbit) node[0] += o.node / per_orbit;
      if (k >= last) node[1] += o.node / per_orbit;
      orbit.step();
    }
    const double N = last + per_orbit;
    mean_a /= N;
    mean_e /= N;
    mean_i /= N;
    const double p = mean_a * (1 - mean_e * mean_e),
                 mean_n = std::sqrt(env.planet.mu / mean_a) / mean_a;
    const double q = env.planet.radius / p;
    const double rate = -1.5 * mean_n * env.planet.J[0] * q * q * std::cos(mean_i);
    miss[small] = std::fabs((node[1] - node[0]) / (60.0 * last) / rate - 1);
  }
  keeps("nodal drift by J2 against the analytic rate", miss[0], 3e-3);
  keeps("the same with a J2 a hundred times smaller", miss[1], 1e-4);
}

TEST(Orbit, BooksOfHarmonicsSunMoonDragAndSunlight) {
  Environment env;
  env.planet.J = earth_zonals();
  env.planet.rotation_rate = 7.2921158553e-5;
  env.third_bodies = {mean_sun(1.0), mean_moon(2.0)};
  env.atmosphere = Atmosphere{5e-13, 500e3, 60e3, 20.0};
  env.solar_pressure = SolarPressure{12.0};
  const auto start = from_elements(env.planet.mu, 6.928e6, 0.001, 0.61, 0, 0, 0);
  OrbitPropagator orbit(env, 2692, start, 30, "lobatto4");
  const double E = double(orbit.motion().energy(orbit.point()));
  double worst = 0;
  for (int k = 0; k < 20000; ++k) {
    orbit.step();
    worst = std::max(worst, std::fabs(orbit.energy_defect() / E));
  }
  for (size_t s = 0; s < orbit_sources; ++s)
    std::printf("  %-20s %+.6e J\n", to_string(OrbitSource(s)), orbit.work(OrbitSource(s)));
  // The books are in long double: 5.4e-20 of each of some 40 roundings in 20 000 steps, at random.
  keeps("orbital ledger over a week: defect / |E|", worst, 5.4e-20 * std::sqrt(40 * 20000.0));
  EXPECT_LT(orbit.work(OrbitSource::drag), 0);
  breaks("drag's work / |E|, so that the ledger had something to book",
         -orbit.work(OrbitSource::drag) / std::fabs(E), 1e-6);
}

TEST(Orbit, ZonalLedgerShowsTheOrderOfTheSplitting) {
  Environment env;
  env.planet.J = earth_zonals();
  const auto start = from_elements(env.planet.mu, 7.2e6, 0.05, 1.1, 0, 0, 0);
  const auto defect = [&](const char* scheme, double h) {
    OrbitPropagator orbit(env, 1, start, h, scheme);
    double worst = 0;
    for (int k = 0; k < int(60000 / h); ++k) {
      orbit.step();
      worst = std::max(worst, std::fabs(orbit.zonal_defect()));
    }
    return worst / double(-orbit.motion().energy(orbit.point()));
  };
  for (const auto& [scheme, order] : {std::pair{"strang", 2.0}, {"lobatto4", 4.0}}) {
    const double coarse = defect(scheme, 240), fine = defect(scheme, 120);
    std::printf("  %-10s %.2e at 240 s, %.2e at 120 s, order %.2f\n", scheme, coarse, fine,
                std::log2(coarse / fine));
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.4) << scheme;
  }
  // Beyond, the error in ε² h² is what is left: 1e-6 of that of strang, J2 being 1e-3.
  keeps("lobatto6 at 240 s", defect("lobatto6", 240), 3e-9);
  keeps("aba864 at 240 s", defect("aba864", 240), 2e-12);
}

// The corrected kick takes the term in ε² h² away, which the harmonics make and lobatto8 alone
// keeps.
TEST(Orbit, ACorrectedSplittingIsOfOrderFourUnderHarmonics) {
  Environment env;
  env.planet.J[0] = earth_zonals()[0];
  const auto start = from_elements(env.planet.mu, 7.2e6, 0.05, 1.1, 0, 0, 0);
  const auto after_a_day = [&](const char* scheme, double h) {
    OrbitPropagator orbit(env, 1, start, h, scheme);
    for (int k = 0; k < int(86400 / h); ++k) orbit.step();
    return orbit.point().r;
  };
  const auto exact = after_a_day("aba864", 10);
  const auto order = [&](const char* scheme, double& fine) {
    const double coarse = distance(after_a_day(scheme, 80), exact);
    fine = distance(after_a_day(scheme, 40), exact);
    std::printf("  %-10s %.2e m at 80 s, %.2e m at 40 s, order %.2f\n", scheme, coarse, fine,
                std::log2(coarse / fine));
    return std::log2(coarse / fine);
  };
  double plain, corrected;
  EXPECT_NEAR(order("lobatto8", plain), 2, 0.3) << "the control: not corrected";
  EXPECT_NEAR(order("lobatto8c", corrected), 4, 0.4);
  EXPECT_LT(corrected, 0.01 * plain);
}

TEST(Orbit, NescCheckCase10APosition) {
  const auto file = test::read_json(test::data_file("reference/nesc_exo_10A.json"));
  const auto vec = [](const nlohmann::json& j) { return Vec3<double>{j[0], j[1], j[2]}; };
  Environment env;
  env.planet.mu = file["mu_m3_s2"];
  OrbitPropagator orbit(env, file["mass_kg"],
                        {vec(file["initial"]["r_m"]), vec(file["initial"]["v_m_s"])}, 100);
  for (int k = 0; k < 288; ++k) orbit.step();
  keeps("NESC 10A after 8 h, point mass alone [m]",
        distance(Vec3<double>(orbit.point().r), vec(file["final"]["r_m"])), 1e-3);
}

TEST(Orbit, RefusesWhatItCannotFly) {
  Environment env;
  const auto low = from_elements(env.planet.mu, 6.3e6, 0.0, 0.1, 0, 0, 0);
  const auto hit = from_elements(env.planet.mu, 7.5e6, 0.2, 0.1, 0, 0, 3.0);
  const PointState<double> fast{{7e6, 0, 0}, {0, 11e3, 0}};
  const auto says = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  says(test::refusal([&] { check_orbit(env.planet, low, true); }), "below the surface");
  says(test::refusal([&] { check_orbit(env.planet, hit, true); }), "pericentre");
  says(test::refusal([&] { check_orbit(env.planet, fast, true); }), "hyperbolic");
  EXPECT_EQ(test::refusal([&] { check_orbit(env.planet, fast, false); }), "");
  env.atmosphere = Atmosphere{1e-12, 400e3, 60e3, 10};
  says(test::refusal([&] { OrbitMotion(env, 1); }), "rotation is not given");
  env.atmosphere.reset();
  env.solar_pressure = SolarPressure{10};
  says(test::refusal([&] { OrbitMotion(env, 1); }), "without a sun");
  says(test::refusal([] { split_scheme("leapfrog"); }), "lobatto4");
}

}  // namespace
}  // namespace porthos::space::orbit_test
