#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "contact/dry_friction.h"
#include "contact/law.h"
#include "phs/network/network.h"
#include "scene/read/joint_place.h"
#include "space/parts.h"

namespace porthos::scene {

class Table;
struct Scene;
struct Element;

/// The network and the place in it to which an element at a joint is added.
struct JointElement {
  phs::Network& network;
  const mechanics::MechanicalModel& model;
  JointPlace place;

  /// @throws InvalidArgument unless the place is a coordinate of one number
  void require_number(const Element& e) const;
  /// @throws InvalidArgument unless the place is one freedom
  void require_freedom(const Element& e) const;
};

/// A stop of a joint that bounces; a limit that is not stated is that of the model file.
struct JointStop {
  std::optional<double> lower = {}, upper = {};  ///< [rad | m]
  contact::Law law = {};
};

/// `Element::add` of soft limits, a force k δ²; a limit that is not stated is as in a JointStop.
struct SoftLimits {
  std::optional<double> lower = {}, upper = {};  ///< [rad | m]
  double stiffness = 0;                          ///< k [N m/rad² | N/m²]

  /// @throws InvalidArgument where neither scene nor model file state a limit
  void operator()(const Element& e, const JointElement& at) const;
};

/// `Element::add` of smoothed friction, force(rate).
struct SmoothedFriction {
  phs::FunctionPtr law;

  /// @throws InvalidArgument unless the place is one freedom
  void operator()(const Element& e, const JointElement& at) const;
};

/// An element that acts at a joint of the model, or on links: an [[element]] of the scene,
/// docs/scene.md. Its types are the files of elements/.
struct Element {
  std::string type, name, joint;  ///< joint: empty for an element on links
  std::string where;              ///< "file:line:column"
  /// Adds the element, passed as first argument, at its joint; empty for an element on links, a
  /// stop and dry friction.
  std::function<void(const Element&, const JointElement&)> add = {};

  std::string remark = {};  ///< what is odd about it, for the notes on the model
  bool table = false;       ///< a spring from a table, whose third derivative jumps

  // Used outside the network.
  double rate = 0;    ///< [Hz], of a sampled controller; 0: continuous
  double period = 0;  ///< [s], of the pieces of a force; 0: it has none
  std::optional<phs::DcMotor> motor;
  std::optional<double> wheel_gain;  ///< [N m s/rad], of a reaction wheel
  std::string turning_wheel;         ///< joint of a wheel whose momentum it moves, or empty
  std::optional<space::Thruster> thruster;
  std::optional<space::Wrench> wrench;
  std::optional<space::Torquer> torquer;
  std::optional<space::SoftLatch> latch;
  std::optional<JointStop> stop;
  std::optional<contact::DryFriction> dry;
  /// Whether it changes the momentum of a free craft, and keeps a ledger of its impulse.
  bool pushes() const { return thruster || wrench || torquer; }
};

/// Reads the [[element]] tables. @throws InvalidArgument as read_scene()
std::vector<Element> read_elements(const Table& scene);

/// A signal in time: one of the keys constant, sine = { amplitude, frequency, phase, offset },
/// profile = { times, values }, file = { path, time, value, between }.
/// @param period  gets the length of the pieces of a held signal [s]; null: such a one is refused
phs::FunctionPtr read_signal(const Table& t, const std::string& unit, double* period = nullptr);

/// Where a profile leaves the range of its values by more than 5 % of it; empty: it does not, or
/// there is no profile.
std::string overshoot(const Table& signal);

/// Puts the elements at the joints of the member "mechanism" of a network.
/// @throws InvalidArgument naming file and line, for an unknown joint, one with more freedoms than
/// the element acts at, or limits without bounds
void add_elements(phs::Network& n, const mechanics::MechanicalModel& model,
                  const std::vector<Element>& elements);

}  // namespace porthos::scene
