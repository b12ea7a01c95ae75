#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "phs/linear_algebra/matrix.h"
#include "phs/network/elements.h"
#include "phs/system/system.h"

/// Systems joined through their power ports. The result is a port-Hamiltonian system again.
///
/// Every port has an input u and an output y, and u·y is the power that flows *into* its system. A
/// junction sets inputs by outputs, u = K y with K = -Kᵀ: no power is made or lost in it (Van der
/// Schaft, Jeltsema 2014, section 6). Resistive elements add -D y with D + Dᵀ >= 0, sources add
/// v(t). In all
///
///   u = (K - D) y + v,   y = Gᵀe + F u,
///
/// with F the feedthrough of members that have one. Its algebraic loop is solved once, in build().
namespace porthos::phs {

class NetworkModel;

/// Collects members and junctions, checks each as it comes, and builds the model. Ports are named
/// "<member>.<port>", as "arm.elbow.torque".
///
/// Every function throws InvalidArgument with one sentence for an unknown or ambiguous name, ports
/// whose kinds, sizes or units do not match, and a port that is joined already.
class Network {
 public:
  explicit Network(std::string name);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  /// A member. Several members of one type share their model.
  Network& add(const std::string& name, std::shared_ptr<const Model> member);
  /// The member the others are elements of: its blocks, ledger and invariants keep their names.
  Network& main(const std::string& name);

  // --- junctions: each port takes part in one of them --------------------------------------------
  /// The flow of `effort_in` drives `flow_in`, whose effort acts back: u_a = -y_b, u_b = y_a.
  Network& feedback(const std::string& effort_in, const std::string& flow_in);
  /// A gear, a lever: u_b = ratio y_a, u_a = -ratio y_b.
  Network& transformer(const std::string& effort_in, const std::string& flow_in, double ratio);
  /// A motor constant, a precession: of two ports of one kind, u_b = r y_a, u_a = -r y_b.
  Network& gyrator(const std::string& a, const std::string& b, double r);
  /// One flow, efforts sum to zero. Exactly one effort_in port: it sets the flow. The sign of a
  /// port says whether its flow is the common one or the opposite.
  struct End {
    std::string port;
    int sign = 1;
  };
  Network& one_junction(const std::string& name, const std::vector<End>& ends);
  /// One effort, flows sum to zero. Exactly one flow_in port: it sets the effort.
  Network& zero_junction(const std::string& name, const std::vector<End>& ends);
  /// u = K y over the ports one after another. @throws InvalidArgument if K is not skew
  Network& couple(const std::vector<std::string>& ports, const Matrix& K);

  // --- what acts on a port besides its junction: any number of them ------------------------------
  /// u -= law(y) of a port of size 1, or of one component of a larger one.
  Network& resist(const std::string& name, const std::string& port, FunctionPtr law,
                  int component = 0);
  /// Rayleigh damping u -= D y over the ports one after another. @throws InvalidArgument if D + Dᵀ
  /// is not >= 0
  Network& resist(const std::string& name, const std::vector<std::string>& ports, const Matrix& D);
  /// u += v(t).
  Network& source(const std::string& name, const std::string& port, FunctionPtr v,
                  int component = 0);
  /// How a controller is run.
  struct Control {
    double period = 0;  ///< [s], a whole number of steps; 0: continuously
    /// Of a sampled one: it sees the mean flow of the last period, the difference of these
    /// coordinates ("<member>.<block>", one per component of its port) over the period, as an
    /// encoder gives it: period · Σ held·mean is then the energy that went in, exactly, for any
    /// motion between the instants (Stramigioli, Secchi, Van der Schaft, Fantuzzi 2005, IEEE T.
    /// Robotics 21). None: the flow at the instant, with which a passive κ may make energy without
    /// the sampled numbers telling.
    std::vector<std::string> encoder = {};
    std::vector<std::string> sensors =
        {};  ///< ports whose outputs κ sees too: y = [its port's, theirs ...]
  };
  /// A controller on a port of any size: u += κ(t, x, y), x the state of the port's member. Its
  /// power is in the ledger as `name`, and nothing asks it to be passive. A sampled one is held
  /// between the instants k·period; `name` is then what κ would have supplied all the time, and
  /// `name`.hold what the hold adds to that, (held - κ)·y.
  Network& control(const std::string& name, const std::string& port, LawPtr law,
                   const Control& how);
  Network& control(const std::string& name, const std::string& port, LawPtr law) {
    return control(name, port, std::move(law), Control{});
  }
  /// H += U(z), z a coordinate with a conjugate momentum: "<member>.<block>".
  Network& potential(const std::string& name, const std::string& coordinate, Potential U);
  /// Declares that a member's outputs have a part F u, y = Gᵀe + F u, over all its inputs
  /// (linear_system.h hands such an F over). @throws InvalidArgument if F + Fᵀ is not >= 0
  Network& feedthrough(const std::string& member, const Matrix& F);

  /// The system. Ports that nothing was joined to stay its ports, for inputs of the user.
  /// @throws InvalidArgument for a required port that is not joined, an open port with feedthrough,
  ///   or an algebraic loop without a solution (I - (K - D) F singular)
  std::shared_ptr<const NetworkModel> build() const;

  struct Plan;

 private:
  std::shared_ptr<Plan> plan_;
};

/// The system a Network builds. State: the members' states one after another; with one member its
/// blocks keep their names, with several they are prefixed "<member>.". Cost over its members: tens
/// of nanoseconds per element.
///
/// Storages and powers are those of the members, potentials, resistive elements and sources by
/// name. Invariants: those of the members that no joined port changes, and the linear Casimirs of
/// the composition, cᵀ(J - R) = 0, found numerically.
class NetworkModel : public ModelFor<NetworkModel> {
 public:
  explicit NetworkModel(std::shared_ptr<const Network::Plan> plan);
  const Description& description() const override;
  std::vector<HoldPtr> holds() const override;

  template <class T>
  std::unique_ptr<System<T>> make_system() const;

  /// Where the state of a member begins. @throws InvalidArgument for an unknown name
  int offset(const std::string& member) const;
  const Model& member(const std::string& name) const;
  /// The Casimirs as sentences, "spring.elongation - arm.elbow".
  const std::vector<std::string>& casimirs() const;

 private:
  std::shared_ptr<const Network::Plan> plan_;
};

}  // namespace porthos::phs
