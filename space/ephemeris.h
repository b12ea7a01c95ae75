#pragma once
#include <array>
#include <mutex>
#include <string>

#include "space/environment.h"

/// Sun and Moon by date, from ERFA (the free edition of the IAU's SOFA), if Porthos was built with
/// it.
namespace porthos::space {

/// Whether this build has ERFA.
bool has_ephemerides();

/// TT as a two-part Julian date.
struct JulianDate {
  double day = 0, fraction = 0;
};
/// Converts "2026-01-01T00:00:00" from UTC to TT. @throws InvalidArgument for any other format, or
/// in a build without ERFA
JulianDate date_of(const std::string& utc);

/// Greenwich's angle from the x axis [rad] (mean sidereal time, eraGmst06), to 0.1 degrees: UT1 is
/// taken 69 s behind TT.
double greenwich_angle(const JulianDate& tt);

/// The bodies with an ephemeris.
enum class Luminary { sun, moon };

/// Position relative to the Earth's centre, GCRS axes [m], directly from ERFA: the Sun by eraEpv00
/// (VSOP2000, about 10 km), the Moon by eraMoon98 (Meeus 1998, about 10 arc seconds). TT is used
/// for TDB, which differs by 2 ms.
Vec3d luminary_position(Luminary which, const JulianDate& epoch, double t);

/// The same by Chebyshev polynomials over days, fitted when a time first falls into a piece. A kick
/// of the splitting needs the position at every node, and ERFA's series has thousands of terms. The
/// result depends on t alone, so a resumed run has the same bits.
class DatedEphemeris final : public Ephemeris {
 public:
  /// @throws InvalidArgument as date_of()
  DatedEphemeris(Luminary which, const std::string& utc);
  Vec3d position(double t) const override;

 private:
  static constexpr size_t terms = 18;
  void fit(double piece) const;
  Luminary which_;
  JulianDate epoch_;
  double length_;  ///< of a piece [s]
  mutable std::mutex guard_;
  mutable double piece_;  ///< NaN: none yet
  mutable std::array<Vec3d, terms> c_;
};

/// A third body with this ephemeris. @throws InvalidArgument as date_of()
ThirdBody dated_body(Luminary which, const std::string& utc);

}  // namespace porthos::space
