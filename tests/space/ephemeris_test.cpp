#include "space/ephemeris.h"

#include <numbers>

#include "space/gravity.h"
#include "tests/space/support.h"

// Sun and Moon by date: against the canon of eclipses, and against the mean ellipses.
namespace porthos::space::ephemeris_test {
namespace {

using test::breaks;
using test::keeps;

constexpr double day = 86400;

TEST(Ephemeris, ShadowsOfTheCanonOfEclipses) {
  if (!has_ephemerides()) GTEST_SKIP() << "built without ERFA";
  // Instant (TD) and distance of the shadow's axis from the Earth's centre in equatorial radii at
  // greatest eclipse. Source: Espenak, Meeus 2006, Five Millennium Canon of Solar Eclipses,
  // NASA/TP-2006-214141.
  struct Eclipse {
    const char* day;
    double hour, minute, second, gamma;
  };
  for (const Eclipse& e : {Eclipse{"2017-08-21T00:00:00", 18, 26, 40, 0.4367},
                           {"2024-04-08T00:00:00", 18, 18, 29, 0.3431},
                           {"2026-08-12T00:00:00", 17, 47, 6, 0.8977},
                           {"2027-08-02T00:00:00", 10, 7, 50, 0.1421}}) {
    const JulianDate midnight = date_of(e.day);
    const double offset = midnight.fraction * day;  // TT of that midnight of UTC, past TT's own
    const double tt = 3600 * e.hour + 60 * e.minute + e.second - std::fmod(offset, day);
    const auto axis = [&](double t) {  // where the light was that arrives now
      const Vec3d s = luminary_position(Luminary::sun, midnight, t - 499.0),
                  m = luminary_position(Luminary::moon, midnight, t - 1.28);
      const Vec3d u = (1 / mechanics::norm(m - s)) * (m - s);
      return mechanics::norm(m - dot(m, u) * u);
    };
    double best = tt;
    for (double t = tt - 1200; t < tt + 1200; t += 4)
      if (axis(t) < axis(best)) best = t;
    const double gamma = axis(best) / 6378137.0;
    std::printf("  %.10s: gamma %.4f (canon %.4f), %+.0f s\n", e.day, gamma, e.gamma, best - tt);
    keeps("distance of the axis, in radii of the Earth", std::fabs(gamma - e.gamma), 0.001);
    keeps("instant [s]", std::fabs(best - tt), 30);
    const double late = axis(best + 3600) / 6378137.0;
    breaks("an hour later", std::fabs(late - e.gamma), 0.02);
  }
}

/// Mean sidereal time at the epoch J2000: 18 h 41 min 50.548 s at 0 h of 2000-01-01 is 6 h 39 min
/// 52.271 s (Explanatory Supplement 2013, 6.9); noon is 12 h and 118.28 s of sidereal time later.
TEST(Ephemeris, GreenwichStandsAtItsSiderealTime) {
  if (!has_ephemerides()) GTEST_SKIP() << "built without ERFA";
  const auto hours = [](const char* utc) {
    return greenwich_angle(date_of(utc)) * 12 / std::numbers::pi;
  };
  EXPECT_NEAR(hours("2000-01-01T00:00:00"), 6 + 39.0 / 60 + 52.271 / 3600, 0.1 / 15);
  EXPECT_NEAR(hours("2000-01-01T12:00:00"), 18 + 41.0 / 60 + 50.548 / 3600, 0.1 / 15);
}

TEST(Ephemeris, PolynomialsAreTheSeries) {
  if (!has_ephemerides()) GTEST_SKIP() << "built without ERFA";
  const char* epoch = "2026-01-01T00:00:00";
  const JulianDate date = date_of(epoch);
  for (const auto& [which, name, bound] :
       {std::tuple{Luminary::sun, "Sun", 1e-2}, {Luminary::moon, "Moon", 1e-2}}) {
    const DatedEphemeris table(which, epoch);
    double worst = 0;
    for (int i = 0; i < 400; ++i) {
      const double t = (0.123 + 0.917 * i) * day;
      worst =
          std::max(worst, mechanics::norm(table.position(t) - luminary_position(which, date, t)));
    }
    keeps(std::string(name) + ": interpolation, a year [m]", worst, bound);
    // Across the edge of a piece, and the same again after a look elsewhere.
    const double edge = 16 * day;
    keeps("step at the edge of a piece [m]",
          mechanics::norm(table.position(edge) - table.position(std::nextafter(edge, 0.0))), 1e-2);
    const Vec3d once = table.position(3.3 * day);
    table.position(200 * day);
    const Vec3d again = table.position(3.3 * day);
    EXPECT_TRUE(once.x == again.x && once.y == again.y && once.z == again.z);
  }
}

// At the start of a run, the mean ellipses against ERFA at six dates. The control is the longitude
// taken as if it were true.
TEST(Ephemeris, MeanEllipsesStartWhereTheyShould) {
  if (!has_ephemerides()) GTEST_SKIP() << "built without ERFA";
  const double degree = 3.14159265358979 / 180;
  double sun = 0, moon = 0, moon_j2000 = 0, naive = 0;
  for (const char* date : {"2026-01-01T00:00:00", "2026-11-05T12:00:00", "2027-07-20T00:00:00",
                           "2028-04-01T06:00:00", "2029-02-14T00:00:00", "2030-10-10T18:00:00"}) {
    const JulianDate d = date_of(date);
    // Mean longitudes, perigee and node of the date. Source: Meeus 1998, 25.2, 47.1, 47.7 and
    // chapter 22.
    const double T = ((d.day - 2451545.0) + d.fraction) / 36525;
    const double precession = 1.3970 * T;  // from the equinox of date to that of J2000
    const double L_sun = 280.46646 + 36000.76983 * T - precession,
                 L_moon = 218.3164477 + 481267.88123421 * T - precession,
                 perigee = 83.3532465 + 4069.0137287 * T - precession,
                 node = 125.0445479 - 1934.1362891 * T - precession;
    const auto off = [&](const ThirdBody& mean, Luminary which) {
      const Vec3d a = mean.start.r, b = luminary_position(which, d, 0);
      return std::acos(dot(a, b) / mechanics::norm(a) / mechanics::norm(b)) / degree;
    };
    sun = std::max(sun, off(mean_sun(L_sun * degree), Luminary::sun));
    moon = std::max(
        moon, off(mean_moon(L_moon * degree, perigee * degree, node * degree), Luminary::moon));
    moon_j2000 = std::max(moon_j2000, off(mean_moon(L_moon * degree), Luminary::moon));
    // As if the true anomaly were the mean one: the equation of the centre, 2e, is missing.
    const double missing = 1.915 * std::sin((L_sun - 283.3) * degree);
    naive = std::max(naive, off(mean_sun((L_sun - missing) * degree), Luminary::sun));
  }
  keeps("mean Sun at six dates [degrees]", sun, 0.05);
  keeps("mean Moon with perigee and node of the date [degrees]", moon, 3);
  keeps("mean Moon with those of J2000 [degrees]", moon_j2000, 16);
  breaks("a Sun without the equation of the centre [degrees]", naive, 1);
}

TEST(Ephemeris, MeanEllipsesAreGoodToTheirDegrees) {
  if (!has_ephemerides()) GTEST_SKIP() << "built without ERFA";
  // Mean longitudes at 2026-01-01T00:00 UTC. Source: Meeus 1998, formulae 25.2 and 47.1.
  const double T = (2461041.5 - 2451545.0) / 36525, degree = 3.14159265358979 / 180;
  const double sun = (280.46646 + 36000.76983 * T) * degree,
               moon = (218.3164477 + 481267.88123421 * T) * degree;
  const auto off = [&](const ThirdBody& mean, Luminary which, double& worst) {
    const DatedEphemeris table(which, "2026-01-01T00:00:00");
    worst = 0;
    for (int k = 0; k < 180; ++k) {
      const Vec3d a = kepler_flow(mean.total_mu, mean.start, 2.0 * k * day).r,
                  b = table.position(2.0 * k * day);
      worst = std::max(worst, std::acos(dot(a, b) / mechanics::norm(a) / mechanics::norm(b)));
    }
    worst /= degree;
  };
  double worst;
  off(mean_sun(sun), Luminary::sun, worst);
  keeps("mean Sun, a year [degrees]", worst, 1);
  off(mean_moon(moon), Luminary::moon, worst);
  keeps("mean Moon, a year, node and perigee at rest [degrees]", worst, 25);
  off(mean_sun(sun + 0.1), Luminary::sun, worst);
  breaks("mean Sun started 0.1 rad late", worst, 4);
}

TEST(Ephemeris, DatesAreRefusedInOneSentence) {
  if (!has_ephemerides()) GTEST_SKIP() << "built without ERFA";
  for (const char* wrong : {"2026-13-01T00:00:00", "yesterday", "2026-01-01", "1500-01-01T00:00:00",
                            "2026-01-01T00:00:00+01:00"})
    EXPECT_NE(test::refusal([&] { date_of(wrong); }).find("expected a date and time of UTC"),
              std::string::npos)
        << wrong;
  // 2026-01-01 0 h UTC is 69.184 s before TT: 37 leap seconds and 32.184 s.
  const auto d = date_of("2026-01-01T00:00:00");
  EXPECT_NEAR(((d.day - 2461041.5) + d.fraction) * day, 69.184, 1e-4);
  EXPECT_EQ(date_of("2026-01-01T00:00:00Z").fraction, d.fraction);  // ISO 8601's sign of UTC
}

TEST(Ephemeris, ThirdBodiesCancelNothing) {
  // Battin's form against the difference it stands for, in 113 bits, and that difference in
  // doubles.
  const Vec3d r{6.1e6, -2.2e6, 2.7e6}, s{-2.5e10, 1.32e11, 5.7e10};
  const double mu = 1.327e20;
  using Q = phs::Quad;
  const Vec3<Q> rq(r), sq(s), d = rq - sq;
  const Q d2 = dot(d, d), s2 = dot(sq, sq);
  const Vec3<Q> exact = (Q(-mu) / (d2 * phs::sqrt(d2))) * d - (Q(mu) / (s2 * phs::sqrt(s2))) * sq;
  const auto off = [&](const Vec3d& a) {
    return double(mechanics::norm(Vec3<Q>(a) - exact) / mechanics::norm(exact));
  };
  keeps("third_body_acceleration in double", off(third_body_acceleration(mu, s, r)), 1e-15);
  const Vec3d e = r - s;
  const double e2 = dot(e, e), t2 = dot(s, s);
  breaks("the plain difference in double",
         off((-mu / (e2 * std::sqrt(e2))) * e - (mu / (t2 * std::sqrt(t2))) * s), 1e-13);
}

}  // namespace
}  // namespace porthos::space::ephemeris_test
