#pragma once
#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "phs/system/archive.h"
#include "space/orbit.h"

/// The energy balance of a spacecraft in orbit. Energy is stored in three places, each with its own
/// ledger; none of them is a total.
///
///   orbital    E = m (v²/2 - μ/r)            defect = E - E(0) - Σ works on the orbit
///   internal   H of the mechanism            defect = H - H(0) - Σ its own works
///                                            - work of the gradient   (the run's ledger)
///   coupling   V of the gravity gradient     defect = V - V(0) + its work on the orbit
///                                            + its work on the internal motion
/// and, if the planet is not a point mass,
///   harmonics  V of the zonal harmonics      defect = V - V(0) + its work on the orbit
///
/// A kick changes momenta at fixed positions, so its work on both sides is known to rounding. The
/// first two defects thus show only the errors of the Kepler flow and of the internal integrator.
/// The others show the error of the splitting. The angular momentum about the centre of mass has a
/// ledger too: L - L(0) - Σ torque impulses.
namespace porthos::space {

/// A sum of double length that fits into checkpoints.
struct LongSum {
  double value = 0, low = 0;
  void add(double x);
  OrbitReal total() const { return OrbitReal(value) + low; }
};

/// One ledger as reported [J].
struct LedgerReport {
  std::string name;
  double initial = 0, change = 0, defect = 0, largest_defect = 0;
  double scale = 0;        ///< the scale of relative defects
  double turned_over = 0;  ///< Σ of the magnitudes of the works, kick by kick; 0: not computed
  std::vector<std::pair<std::string, double>> works;
  double relative() const { return scale > 0 ? largest_defect / scale : largest_defect; }
};

/// Appends a following ledger: works and changes add up, the largest values cover both.
void append(LedgerReport& to, const LedgerReport& next);

/// The report of a run in orbit besides its energy.
struct SpaceReport {
  LedgerReport orbital, coupling, harmonics;
  double gradient_work = 0;     ///< on the internal motion [J]
  double plates_work = 0;       ///< on the internal motion, by drag and sunlight on plates [J]
  double angular_momentum = 0;  ///< about the centre of mass, largest size [kg m²/s]
  double angular_impulse = 0;   ///< of the gradient's torque, size [kg m²/s]
  double angular_defect = 0;    ///< largest |L - L(0) - Σ impulses| over the largest |L|
  double reach = 0;             ///< largest GravityGradient::reach() [m]
  double next_order = 0;        ///< largest 3/2 reach/|R|: of accelerations, what is neglected
};

/// The ledger of a run whose mechanism changed in between: the ledgers continue.
void append(SpaceReport& to, const SpaceReport& next);

/// The split integrator updates it step by step, in constant memory.
class SpaceLedgers {
 public:
  /// The values at a state.
  struct Reading {
    OrbitReal orbital;
    double gradient, zonal;          ///< potential energies
    Vec3<OrbitReal> L;               ///< angular momentum about the centre of mass
    double reach = 0, distance = 1;  ///< GravityGradient::reach() and |R| [m]
  };
  /// Before the first step.
  void start(const Reading& r);
  bool started() const { return data_.started != 0; }
  /// Adds a kick. on_orbit: works on the orbit [J], one of each OrbitSource; on_internal: work of
  /// the gravity gradient on the mechanism [J]; impulse: on the angular momentum about the centre
  /// of mass [N m s], inertial axes; by_plates: work of forces on plates on the mechanism [J]
  void kick(const OrbitWorks& on_orbit, double on_internal, const Vec3<double>& impulse,
            double by_plates = 0);
  /// Call it at the end of a step.
  void look(const Reading& r);
  SpaceReport report() const;
  /// The current ledger: energy and defect of the orbital ledger, the coupling, the harmonics [J],
  /// and the magnitude of the defect of the angular momentum [kg m²/s].
  static constexpr size_t reading_size = 7;
  std::array<double, reading_size> now() const;

  void carry(Archive& archive);

 private:
  struct Balance {
    double first = 0, last = 0, defect = 0, worst = 0, scale = 0;
    void look(OrbitReal value, OrbitReal off);
    LedgerReport report(const char* name) const;
  };
  struct Data {
    double started = 0;
    LongSum orbital_0, L_0[3];
    LongSum orbit[orbit_sources], internal, impulse[3];
    Balance orbital, gradient, zonal;
    double L_largest = 0, L_worst = 0, L_last = 0;
    double turned_over = 0, plates = 0;  ///< by the gradient; of the plates on the internal motion
  };
  Data data_;
  double reach_ = 0, next_order_ = 0;
};

}  // namespace porthos::space
