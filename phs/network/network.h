#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "phs/functions/block_potential.h"
#include "phs/functions/gate.h"
#include "phs/linear_algebra/matrix.h"
#include "phs/network/elements.h"
#include "phs/system/instants.h"
#include "phs/system/state.h"
#include "phs/system/system.h"

/// Systems joined through their power ports. The result is again a port-Hamiltonian system.
///
/// Every port has an input u and an output y, and u·y is the power flowing *into* its system. A
/// junction sets inputs from outputs, u = K y with K = -Kᵀ, so it neither generates nor loses power
/// (Van der Schaft, Jeltsema 2014, section 6). Resistive elements add -D y with D + Dᵀ >= 0,
/// sources add v(t). Together
///
///   u = (K - D) y + v,   y = Gᵀe + F u,
///
/// with F the feedthrough of the members that have one. build() solves this algebraic loop once.
namespace porthos::phs {

class NetworkModel;

/// Collects members and junctions, checks each when it is added, and builds the model. Port names
/// are "<member>.<port>", such as "arm.elbow.torque"; "arm.wrist.wrench[2]" is component 2 of a
/// port of several, as a port of its own.
///
/// Every function throws InvalidArgument for an unknown or ambiguous name, for ports whose kinds,
/// sizes or units do not match, and for a port that is already joined.
class Network {
 public:
  explicit Network(std::string name);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  /// Adds a member. Several members of one type can share their model.
  Network& add(const std::string& name, std::shared_ptr<const Model> member);
  /// Makes a member the main one: its blocks, ledger and invariants keep their names without a
  /// prefix.
  Network& main(const std::string& name);

  // --- junctions: each port is part of at most one -----------------------------------------------
  /// The flow of `effort_in` drives `flow_in`, whose effort acts back: u_a = -y_b, u_b = y_a.
  Network& feedback(const std::string& effort_in, const std::string& flow_in);
  /// A gear or a lever: u_b = ratio y_a, u_a = -ratio y_b.
  Network& transformer(const std::string& effort_in, const std::string& flow_in, double ratio);
  /// Two ports of one kind, u_b = r y_a, u_a = -r y_b: a motor constant, a gyroscopic coupling.
  Network& gyrator(const std::string& a, const std::string& b, double r);
  /// One common flow; the efforts sum to zero. Exactly one port is effort_in: it sets the flow. The
  /// sign of a port says whether its flow is the common flow or its opposite.
  struct End {
    std::string port;
    int sign = 1;
  };
  Network& one_junction(const std::string& name, const std::vector<End>& ends);
  /// One common effort; the flows sum to zero. Exactly one port is flow_in: it sets the effort.
  Network& zero_junction(const std::string& name, const std::vector<End>& ends);
  /// u = K y, with the ports' inputs and outputs concatenated. @throws InvalidArgument if K is not
  /// skew
  Network& couple(const std::vector<std::string>& ports, const Matrix& K);

  // --- elements on a port in addition to its junction: any number --------------------------------
  /// u -= law(y) for a port of size 1, or for one component of a larger one.
  Network& resist(const std::string& name, const std::string& port, FunctionPtr law,
                  int component = 0);
  /// Rayleigh damping u -= D y, with the ports concatenated.
  /// @throws InvalidArgument if D + Dᵀ is not >= 0
  Network& resist(const std::string& name, const std::vector<std::string>& ports, const Matrix& D);
  /// Friction with a bend: a member `name` with the state "<name>.elongation" and the storage
  /// "<name>.energy" rubs at an effort_in port of size 1, or at one component of a larger one. The
  /// ledger lists the loss "<name>.loss". The port stays free for a junction.
  /// @throws InvalidArgument as check(f), and for a port that takes a flow
  Network& lugre(const std::string& name, const std::string& port, const LuGre& f,
                 int component = 0);
  /// u += v(t).
  Network& source(const std::string& name, const std::string& port, FunctionPtr v,
                  int component = 0);
  /// Sampling and sensors of a controller.
  struct Control {
    double period = 0;  ///< [s], a whole number of steps; 0: continuously
    /// Coordinates "<member>.<block>", one per component of the port, for a sampled controller. It
    /// then sees the mean flow of the last period: the change of these coordinates divided by the
    /// period, as an encoder gives it. The energy supplied is then exactly period · Σ held·mean,
    /// for any motion between the instants (Stramigioli, Secchi, Van der Schaft, Fantuzzi 2005,
    /// IEEE T. Robotics 21). Empty: it sees the flow at the instant. A passive κ may then generate
    /// energy that the sampled values do not show.
    std::vector<std::string> encoder = {};
    std::vector<std::string> sensors =
        {};                  ///< more ports whose outputs κ sees: y = [its own, theirs ...]
    GatePtr gate = nullptr;  ///< lets a sampled controller act or not; null: it always acts
    std::string tank = {};   ///< that pays for it; empty: the outside does
    bool whole = false;      ///< κ sees x of the whole network, at offset() of each member
  };
  /// A controller on a port of any size: u += κ(t, x, y), x the state of the port's member. The
  /// ledger lists its power as `name`; it need not be passive. A sampled controller is held between
  /// the instants k·period. `name` is then the power of a continuous κ, and `name`.hold is the
  /// difference due to the hold, (held - κ)·y.
  Network& control(const std::string& name, const std::string& port, LawPtr law,
                   const Control& how);
  /// Where the state of a member begins in that of the network. @throws InvalidArgument for an
  /// unknown name
  int offset(const std::string& member) const;
  /// Numbers of inputs of a port, and of states of its member.
  struct PortSizes {
    int inputs, states;
  };
  /// @throws InvalidArgument for an unknown port
  PortSizes sizes(const std::string& port) const;
  Network& control(const std::string& name, const std::string& port, LawPtr law) {
    return control(name, port, std::move(law), Control{});
  }
  /// A controller on several ports of one member whose law has a memory: u += what it gave at the
  /// last instant k·period, 0 before the first one. The ledger lists the power of all its ports as
  /// `name`.
  Network& control(const std::string& name, const std::vector<std::string>& ports,
                   SampledLawPtr law, double period, const std::string& tank = {});
  /// Bounds of the energy in a tank [J].
  struct Tank {
    double least = 0.1, most = 2;
  };
  /// A store of energy that pays for controllers: a member whose state is its energy E, a part of
  /// H. A controller with this tank acts as u += α(E) κ and takes what it supplies, E' = -α κ·y -
  /// r. That exchange is skew, so no law makes energy. α falls from 1 to 0 over the last tenth of
  /// the way down to `least`; of a sampled controller κ is held and α is not. r >= 0 is a valve
  /// that lets out what would pass `most`. Both bounds hold for every motion that starts within.
  /// Ledger: the storage `name`, the loss `name`.valve; the power of the controller is only
  /// observed. After Duindam, Stramigioli 2004; Franken et al. 2011, with E itself as the state.
  /// @throws InvalidArgument unless 0 <= least < most
  Network& tank(const std::string& name, const Tank& bounds);
  /// Damping u -= d y of which the share `fill` of the power flows into a tank; the rest is the
  /// loss `name`. d: of each component of the ports, concatenated [N m s/rad | N s/m].
  /// @throws InvalidArgument for d < 0 or fill outside [0, 1]
  Network& fill(const std::string& name, const std::vector<std::string>& ports,
                const std::vector<double>& d, double fill, const std::string& tank);
  /// H += U(z), where z "<member>.<block>" is a coordinate with a conjugate momentum.
  Network& potential(const std::string& name, const std::string& coordinate, Potential U);
  /// The same for a coordinate of several numbers: the attitude of a ball joint, a place in space.
  Network& potential(const std::string& name, const std::string& coordinate, BlockPotentialPtr U);
  /// Declares the feedthrough F of a member over all its inputs: y = Gᵀe + F u. Example: S - N in
  /// linear_system.h. @throws InvalidArgument if F + Fᵀ is not >= 0
  Network& feedthrough(const std::string& member, const Matrix& F);

  /// Builds the system. Ports of which no component is joined stay open, for the user's inputs.
  /// @throws InvalidArgument for a required port that is not joined, an open port with feedthrough,
  ///   or an algebraic loop without a solution (I - (K - D) F singular)
  std::shared_ptr<const NetworkModel> build() const;

  struct Plan;

 private:
  std::shared_ptr<Plan> plan_;
};

/// A weighted sum of numbers of the state that keeps its value whatever H is.
struct Casimir {
  std::string text;                           ///< "spring.elongation - arm.elbow"
  std::vector<std::pair<int, double>> terms;  ///< number of the state, weight
};

/// The system that a Network builds. State: the members' states concatenated. With one member,
/// blocks keep their names; with several they get the prefix "<member>.". Cost beyond its members:
/// tens of nanoseconds per element.
///
/// Storages and powers are those of the members, potentials, resistive elements and sources, by
/// name. Invariants: the members' invariants that no joined port changes, and the linear Casimirs
/// of the composition, cᵀ(J - R) = 0, found numerically.
class NetworkModel : public ModelFor<NetworkModel>, public WithInstants {
 public:
  explicit NetworkModel(std::shared_ptr<const Network::Plan> plan);
  const Description& description() const override;
  std::vector<HoldPtr> holds() const override;
  /// Without sampled controllers null.
  std::unique_ptr<Instants> instants() const override;

  template <class T>
  std::unique_ptr<System<T>> make_system() const;

  /// The offset of a member's state. @throws InvalidArgument for an unknown name
  int offset(const std::string& member) const;
  const Model& member(const std::string& name) const;
  bool has(const std::string& member) const;
  /// What the gates of sampled controllers did after the time `since` [s], and what laws with a
  /// memory tell, a sentence each.
  /// memory: of all holds, in the order of holds()
  std::vector<std::string> stories(std::span<const double> memory, double since) const;
  /// Why a law is not meant for a state, with the controller's name; empty: all are.
  std::string hindrance(const State& state) const;
  /// A law that keeps a limit, and the part of the network's state that it sees.
  struct Limited {
    std::string controller;
    LawPtr law;
    double limit;  ///< |u| at most
    size_t at, size;
  };
  /// Of the laws that know their limit (WithLimit), but for those with a gate, which are made to be
  /// at it.
  std::vector<Limited> limited() const;
  /// How many gates wait for what they are there for; nothing: there are no gates.
  std::optional<int> waiting(std::span<const double> memory) const;
  /// The Casimirs.
  const std::vector<Casimir>& casimirs() const;

 private:
  std::shared_ptr<const Network::Plan> plan_;
};

}  // namespace porthos::phs
