#pragma once
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "energy_shaping/loop/port_law.h"
#include "mechanics/mechanical_model.h"
#include "phs/linear_algebra/matrix.h"
#include "phs/system/system.h"

namespace porthos::energy_shaping {

/// x' = A x + B u about a state.
struct LinearPlant {
  phs::Matrix A, B;  ///< n × n, n × m
};

/// A plant, its springs and dampers included, linearised at (x, u) and at time 0 by duals: exact to
/// rounding. In (q, p) of a mechanism.
/// @param x  as many numbers as the plant's state
/// @param u  of all its inputs; empty: 0
/// @throws InvalidArgument for other numbers, for constraints and sampled laws
LinearPlant linear_plant(const phs::Model& plant, std::span<const double> x,
                         std::span<const double> u = {});

/// The same of a mechanism at rest at q, in (q, q').
/// @param u  of all its inputs; empty: 0
/// @throws InvalidArgument also for joints of several degrees of freedom
LinearPlant linear_plant_in_rates(const mechanics::MechanicalModel& plant,
                                  std::span<const double> q, std::span<const double> u = {});

/// A sentence where a mechanism at rest at q accelerates, by more than 1e-9 of what its terms come
/// to: gravity, springs, and u, of all its inputs; empty: it stays. Of joints as above.
std::string unbalanced(const mechanics::MechanicalModel& plant, std::span<const double> q,
                       std::span<const double> u = {});

/// x' = A x + B u under u = -K x, which a sampled controller holds over its periods.
struct HeldLoop {
  phs::Matrix A, B, K;  ///< n × n, n × m, m × n
};

/// The loop of a plant under laws of its ports, linearised at a state and at time 0 by duals.
/// @param x  as many numbers as the plant's state, with the turns of its angles
HeldLoop held_loop(const phs::Model& plant, const std::vector<PortLaw>& laws,
                   std::span<const double> x);

/// Adds the condition "sampled": the largest |z| of the loop whose u is held over `period` [s] and
/// comes `delay` periods after what it is made from is at most 1, to 1e-6: a motion that grows by
/// less takes a million periods. z are the eigenvalues of one period, exact for the linear loop
/// (Åström, Wittenmark 1997, section 3.2); places without stiffness, z = 1, are left out. Where it
/// fails its text names a rate that would do. Of several calls the largest |z| stays, with its
/// rate. For set-up: some ms
void certify_sampled(Certificate& certificate, const HeldLoop& loop, double period, int delay);

}  // namespace porthos::energy_shaping
