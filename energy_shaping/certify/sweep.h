#pragma once
#include <string>
#include <vector>

#include "energy_shaping/laws/potential_loop.h"
#include "energy_shaping/loop/closed_loop.h"

/// Tools for choosing gains.
namespace porthos::energy_shaping {

/// One run of a sweep.
struct SweepResult {
  std::vector<double> gains;
  /// Time after which H_d - H_d(rest) stays below `settled` of its start [s]. inf: never, not
  /// `defined`, or `elsewhere`.
  double settling = 0;
  double peak = 0;           ///< largest |u| [N m | N]
  double residual = 0;       ///< (H_d - H_d(rest)) / its start, at the end
  double max_excursion = 0;  ///< largest |q_i - q_i*|
  bool finite = true;
  bool defined = true;     ///< false: the run left where the law is meant (ClosedLoop::hindrance)
  bool elsewhere = false;  ///< H_d came down at another minimum, as a full turn away
};

/// What a sweep of gains runs, and how the runs are judged.
struct SweepOptions {
  std::vector<double> start;  ///< the state each run starts from
  double duration = 20;
  double step = 0.01;  ///< [s]; taken in parts where the linearised loop is faster
  double settled = 1e-2;
  int threads = 0;                  ///< 0: as many as the machine has
  std::vector<double> limits = {};  ///< as RunOptions: of the torques in each run
};

/// Runs a closed loop with different gains by the Runge-Kutta method of order 4, eight runs in SIMD
/// lanes at a time. The energy H_d of each run is that of its own gains. Results are in the order
/// of `gains` and the same for any number of threads.
/// @throws InvalidArgument for a loop without gains (ClosedLoop::gain_names), rows of the wrong
///   size, limits that do not fit the loop, and gains that would need a thousandth of the step
std::vector<SweepResult> sweep(const ClosedLoop& loop,
                               const std::vector<std::vector<double>>& gains,
                               const SweepOptions& options);

/// All combinations of the values of each gain, the last one fastest.
std::vector<std::vector<double>> grid_of(const std::vector<std::vector<double>>& values);
/// `count` values from low to high, equally spaced in their logarithms.
/// @throws InvalidArgument for bounds that are not both above 0
std::vector<double> logarithmic(double low, double high, int count);

/// The run that settles first among those with peak <= limit, or -1.
int fastest(const std::vector<SweepResult>& results, double limit);

/// The mass or inertia that each joint of one degree of freedom feels while the other joints stand
/// still, by coordinate: M_jj, and where a floating base follows, M_jj - M_jb M_bb⁻¹ M_bj. 0 at
/// other coordinates. Cost: a dense mass matrix, and n solutions with M_bb.
/// @param q  coordinates; @throws InvalidArgument for another number of them
std::vector<double> felt_masses(const mechanics::MechanicalModel& model,
                                const std::vector<double>& q);

/// A joint's stiffness and damping [N m/rad, N m s/rad | N/m, N s/m].
struct BandwidthGains {
  double stiffness, damping;
};
/// m ω² and 2 ζ m ω. @param mass  what the joint moves [kg m² | kg]; bandwidth [rad/s]
inline BandwidthGains bandwidth_gains(double mass, double bandwidth, double damping_ratio) {
  return {mass * bandwidth * bandwidth, 2 * damping_ratio * bandwidth * mass};
}

/// Joint springs and dampers with bandwidth_gains() of felt_masses() at the rest point. For
/// joints of one degree of freedom that are not in `skip`; those have no actuator either. Where
/// gravity or a spring acts at one of them, PotentialLoop takes two settings: `compensate` false,
/// and in `rest` the angle at which that joint hangs, where the force is 0.
/// @param bandwidth [rad/s]
/// @param skip  ports ("elbow.torque") or their joints ("elbow")
/// @throws InvalidArgument for a name in `skip` that is neither, for a rest of the wrong size, and
///   for a bandwidth or damping ratio that is not above 0
PotentialShaping joint_regulation(const mechanics::MechanicalModel& model, std::vector<double> rest,
                                  double bandwidth, double damping_ratio,
                                  const std::vector<std::string>& skip = {});

}  // namespace porthos::energy_shaping
