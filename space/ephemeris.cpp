#include "space/ephemeris.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#ifdef PORTHOS_HAVE_ERFA
#include <erfa.h>
#include <erfam.h>
#endif

namespace porthos::space {
namespace {

constexpr double day = 86400.0, pi = 3.141592653589793238462643383280;

[[noreturn, maybe_unused]] void refuse_date(const std::string& utc, const char* why) {
  throw InvalidArgument(
      fmt::format("the epoch is \"{}\", {}, expected a date and time of UTC as "
                  "\"2026-01-01T00:00:00\"",
                  utc, why));
}

}  // namespace

#ifdef PORTHOS_HAVE_ERFA

bool has_ephemerides() { return true; }

JulianDate date_of(const std::string& utc) {
  int year, month, d, hour, minute, used = 0;
  double second;
  if (std::sscanf(utc.c_str(), "%d-%d-%dT%d:%d:%lf%n", &year, &month, &d, &hour, &minute, &second,
                  &used) != 6 ||
      (size_t(used) != utc.size() && utc.substr(size_t(used)) != "Z"))
    refuse_date(utc, "which is no date");
  double u1, u2, a1, a2;
  JulianDate tt;
  // Positive: a year too far ahead for known leap seconds; the date is accepted nevertheless.
  if (eraDtf2d("UTC", year, month, d, hour, minute, second, &u1, &u2) < 0 ||
      eraUtctai(u1, u2, &a1, &a2) < 0 || eraTaitt(a1, a2, &tt.day, &tt.fraction) != 0)
    refuse_date(utc, "which the calendar does not have");
  if (year < 1900 || year > 2100)
    refuse_date(utc, "outside 1900 to 2100, for which the series hold");
  return tt;
}

double greenwich_angle(const JulianDate& tt) {
  return eraGmst06(tt.day, tt.fraction - 69 / day, tt.day, tt.fraction);
}

Vec3d luminary_position(Luminary which, const JulianDate& epoch, double t) {
  double pv[2][3], about_barycentre[2][3];
  const double fraction = epoch.fraction + t / day;
  if (which == Luminary::moon)
    eraMoon98(epoch.day, fraction, pv);
  else
    eraEpv00(epoch.day, fraction, pv, about_barycentre);
  const double scale = which == Luminary::moon ? ERFA_DAU : -ERFA_DAU;
  return {scale * pv[0][0], scale * pv[0][1], scale * pv[0][2]};
}

#else

namespace {
[[noreturn]] void refuse_build() {
  throw InvalidArgument(
      "Sun and Moon by date are asked for and this Porthos was built without ERFA (liberfa-dev), "
      "expected sun_longitude and moon_longitude");
}
}  // namespace

bool has_ephemerides() { return false; }
JulianDate date_of(const std::string&) { refuse_build(); }
double greenwich_angle(const JulianDate&) { refuse_build(); }
Vec3d luminary_position(Luminary, const JulianDate&, double) { refuse_build(); }

#endif

DatedEphemeris::DatedEphemeris(Luminary which, const std::string& utc)
    : which_(which),
      epoch_(date_of(utc)),
      length_((which == Luminary::moon ? 2 : 8) * day),
      piece_(NAN) {}

void DatedEphemeris::fit(double piece) const {
  std::array<Vec3d, terms> f;
  const auto angle = [](size_t j) { return pi * (double(j) + 0.5) / double(terms); };
  for (size_t j = 0; j < terms; ++j)
    f[j] = luminary_position(which_, epoch_, (piece + 0.5 * (1 + std::cos(angle(j)))) * length_);
  for (size_t k = 0; k < terms; ++k) {
    c_[k] = {0, 0, 0};
    for (size_t j = 0; j < terms; ++j) c_[k] += std::cos(double(k) * angle(j)) * f[j];
    c_[k] = ((k == 0 ? 1.0 : 2.0) / double(terms)) * c_[k];
  }
  piece_ = piece;
}

Vec3d DatedEphemeris::position(double t) const {
  const std::lock_guard lock(guard_);
  const double piece = std::floor(t / length_);
  if (piece != piece_) fit(piece);
  const double x = 2 * (t / length_ - piece) - 1;
  Vec3d b1{0, 0, 0}, b2 = b1;  // Clenshaw
  for (size_t k = terms; k-- > 1;) {
    const Vec3d b = c_[k] + 2 * x * b1 - b2;
    b2 = b1;
    b1 = b;
  }
  return c_[0] + x * b1 - b2;
}

ThirdBody dated_body(Luminary which, const std::string& utc) {
  const bool moon = which == Luminary::moon;
  ThirdBody b = moon ? mean_moon(0) : mean_sun(0);
  const auto table = std::make_shared<const DatedEphemeris>(which, utc);
  const double dt = 60;
  b.start.r = table->position(0);
  b.start.v = (1 / (2 * dt)) * (table->position(dt) - table->position(-dt));
  b.ephemeris = table;
  return b;
}

}  // namespace porthos::space
