#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "phs/functions/law.h"
#include "phs/network/network.h"

namespace porthos::energy_shaping {

/// Where plant and controller are joined, and the rest point.
struct InterconnectionOptions {
  struct Join {
    std::string plant, controller;  ///< ports, one that takes an effort and one that takes a flow
    double damping = 0;             ///< injected too, -d y on each number of the plant's port
  };
  std::vector<Join> joins;
  std::vector<double> rest;  ///< x* of the plant
  double tolerance = 1e-9;
  bool refuse = true;  ///< throw if a condition fails
};

/// Control by interconnection (Ortega, van der Schaft, Maschke, Escobar 2002; van der Schaft,
/// Jeltsema 2014): plant and dynamic controller in feedback through their ports. Casimirs of the
/// two tie the controller's state to the
/// plant's, ξ = F x + κ, and on each leaf κ the energy is a function of the plant's state alone,
///   H_d(x) = H(x) + H_c(F x + κ).
/// The constructor finds the ξ* that holds x* and the ties, and checks H_d on the leaf of (x*, ξ*).
///
/// The dissipation obstacle: ties exist only along directions without damping, R Fᵀ = 0. A plant
/// that loses power at x* would have to be supplied for ever, which a passive controller of finite
/// energy cannot do. Both are in the certificate.
class Interconnection {
 public:
  /// @throws InvalidArgument for ports that cannot be joined, and with the first condition that
  /// fails and its number
  Interconnection(std::shared_ptr<const phs::Model> plant,
                  std::shared_ptr<const phs::Model> controller, InterconnectionOptions options);

  /// Members "plant" and "controller".
  const std::shared_ptr<const phs::NetworkModel>& loop() const { return loop_; }
  const Certificate& certificate() const { return certificate_; }
  /// F, controller states × plant states.
  const phs::Matrix& ties() const { return F_; }
  /// The loop's state on the leaf of the rest point with the plant at x: start the controller from
  /// it.
  std::vector<double> start(std::span<const double> x) const;
  /// H_d(x) [J].
  double energy(std::span<const double> x) const;
  const std::vector<double>& rest() const { return rest_; }  ///< (x*, ξ*)

 private:
  /// Energy of the loop at the rest point: its gradient and Hessian, and the size of them.
  struct RestEnergy {
    std::vector<double> gradient, hessian;
    double scale;
  };
  void check_obstacle(const InterconnectionOptions& options);
  /// Finds ξ*.
  RestEnergy find_rest(const InterconnectionOptions& options);
  /// Finds F. Returns how many of the controller's states it ties.
  int tie();
  void check_leaf(const RestEnergy& rest, double tolerance);
  std::shared_ptr<const phs::Model> plant_, controller_;
  std::shared_ptr<const phs::NetworkModel> loop_;
  std::vector<double> rest_;
  phs::Matrix F_;
  Certificate certificate_;
};

/// A tank of energy between bounds, and its supply.
struct TankOptions {
  double level = 1;              ///< at the start [J]
  double least = 0.1, most = 2;  ///< bounds of its level [J]
  double damping = 0;            ///< d of -d y at the port
  double fill = 1;  ///< share of that damping's power that goes into the tank, in [0, 1]
};

/// A plant with any law κ at one of its ports, paid from an energy tank: a port-Hamiltonian system
/// whatever κ is, with the ports of the plant, a member for any Network. State (x, E), energy H +
/// E,
///   u = α(E) κ(t, x, y) - d y,   E' = -α κᵀy + fill d yᵀy - valve,
/// the coupling skew (after Duindam, Stramigioli 2004; Franken et al. 2011, with E itself as the
/// state). α goes to 0 at `least` and the valve lets out what would pass `most`, each over a tenth
/// of the way between them; both bounds hold for every motion that starts within them. Powers: the
/// plant's, "port damping", "valve". Angles are kept whole (no wrapping), as κ need not be
/// periodic.
/// @throws InvalidArgument for an unknown port or numbers out of range
std::shared_ptr<const phs::Model> with_tank(std::shared_ptr<const phs::Model> plant,
                                            const std::string& port, phs::LawPtr law,
                                            const TankOptions& tank);

}  // namespace porthos::energy_shaping
