#pragma once
#include <memory>
#include <span>
#include <vector>

#include "energy_shaping/laws/potential_loop.h"
#include "energy_shaping/loop/port_law.h"

namespace porthos::energy_shaping {

/// A posture for the degrees of freedom that a task leaves, and the tank that supplies the energy
/// for keeping it out of the task.
struct NullSpacePosture {
  std::vector<double> stiffness;  ///< K_n of each joint [N m/rad | N/m]; one number: all
  std::vector<double> rest;       ///< q_n; need not agree with the task
  double level = 1;               ///< energy in the tank at the start [J]
  double least = 0.1, most = 2;   ///< bounds of its level [J]
  double fill = 0.5;  ///< share of the injected damping's power that goes into the tank, in [0, 1]
};

/// A redundant arm that holds its hand in a pose by a spring, and its posture by another spring
/// that does not act on the hand:
///
///   τ = -∂U_x - Kd q' - (1 - α Jᵀ J̄ᵀ) K_n (q - q_n),   J̄ = M⁻¹Jᵀ (J M⁻¹Jᵀ)⁻¹
///
/// J̄ is the inertia-weighted inverse (Khatib 1987): J M⁻¹ (1 - Jᵀ J̄ᵀ) = 0, so the posture makes
/// no acceleration of the task. Any other inverse, Moore and Penrose's say, leaks into it. The
/// projected force is no gradient and may make energy; an energy tank pays, as in Dietrich, Ott,
/// Stramigioli 2016, with its energy E itself as the state:
///
///   H_d = T + U_x + ½ (q - q_n)ᵀK_n(q - q_n) + E,
///   p' = ... + c,  E' = -cᵀq' - r,   c = α Jᵀ J̄ᵀ K_n (q - q_n) - fill Kd q'
///
/// which is skew, so the loop is port-Hamiltonian and H_d never rises. α is 1 until E comes near
/// `least`, where it goes to 0 and the posture becomes a plain spring. r >= 0 is a valve that
/// releases the energy above `most`. Both bounds hold for every motion that starts within them.
///
/// At rest the hand is at its target for any posture; during the motion the joints' damping
/// displaces it.
///
/// State: (q, p, E). rest() is the posture nearest q_n, in the norm of K_n, that meets the task,
/// and a level at which α is 1. Needs joints of one degree of freedom and a mechanism fixed to the
/// world. At a singularity of J the law is not a number. Cost of a field: that of PotentialLoop,
/// and a mass matrix and its factors.
class NullSpaceLoop : public ClosedLoopFor<NullSpaceLoop> {
 public:
  /// task: one pose, position or attitude or both (the springs > 0 are the task), damping, and a
  /// rest near which to look.
  /// @throws InvalidArgument for a task that leaves no degree of freedom or is not one pose, and as
  /// PotentialLoop
  NullSpaceLoop(std::shared_ptr<const mechanics::MechanicalModel> plant, PotentialShaping task,
                NullSpacePosture posture);

  const phs::Description& description() const override { return description_; }
  const PotentialLoop& task() const { return *task_; }
  const NullSpacePosture& posture() const { return posture_; }
  int task_size() const { return int(rows_.size()); }
  const std::vector<int>& rows() const { return rows_; }  ///< of the body's Jacobian

  /// (1 - Jᵀ J̄ᵀ) τ at q, n numbers.
  std::vector<double> projected(std::span<const double> q, std::span<const double> tau) const;
  /// Acceleration J M⁻¹τ of the task.
  std::vector<double> task_acceleration(std::span<const double> q,
                                        std::span<const double> tau) const;

  template <class T>
  std::unique_ptr<LoopSystem<T>> make_loop() const;

 private:
  void take_task(const PotentialShaping& task, const mechanics::Mechanism& m);
  void describe();
  void certify(const std::string& name);
  void certify_leakage();

  std::shared_ptr<const PotentialLoop> task_;
  NullSpacePosture posture_;
  std::vector<int> rows_;
  phs::Description description_;
};

/// The parts of the law as controllers of the joints' ports, for a network with the plant; dampers
/// and the tank are Network::fill and Network::tank. First what has an energy of its own: the
/// springs of the task and of the posture, with the compensation of the plant's potential.
std::vector<PortLaw> spring_laws(std::shared_ptr<const NullSpaceLoop> loop);
/// The second is what the tank pays for: Jᵀ J̄ᵀ K_n (q - q_n), which takes the posture off the
/// task.
std::vector<PortLaw> projection_laws(std::shared_ptr<const NullSpaceLoop> loop);

}  // namespace porthos::energy_shaping
