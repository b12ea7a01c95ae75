#pragma once
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "contact/dry_friction.h"
#include "contact/geometry/pairs.h"
#include "contact/law.h"
#include "integrators/control/switching.h"
#include "mechanics/mechanical_model.h"
#include "phs/system/state.h"

namespace porthos::contact {

/// A shape on a link of the mechanism, or on "world".
struct Surface {
  std::string link;
  Shape shape;
};

/// A contact: every surface of one side against every surface of the other, by one law, with one
/// storage and one loss in the ledger. Surfaces that are on both sides also touch each other: each
/// pair counts once. A pair whose bodies a joint connects is left out (a free joint connects none).
struct Contact {
  std::string name;
  std::vector<Surface> a, b;
  Law law;
};

/// A stop of a joint with one freedom: the law of a contact, with angles [rad] for lengths if it
/// turns, beyond either limit. It has no friction.
struct Stop {
  std::string name, joint;
  double lower = -std::numeric_limits<double>::infinity(),
         upper = std::numeric_limits<double>::infinity();  ///< [rad | m]; infinite: none
  Law law;
};

/// A mechanism with contacts and stops: a port-Hamiltonian system with the mechanism's state.
///
/// H gains U(δ) of every pair of points, the storage "<name>" of each contact or stop. Losses are
/// the powers "<name>.loss" and "<name>.friction", never negative. Forces are opposite and act at
/// one point, so a contact between links keeps the momenta to rounding. Without loss and friction
/// the system stays canonical. Cost beyond the mechanism: one computation of body poses and of the
/// gaps; where something touches, two passes over the tree.
///
/// A rigid contact or stop adds nothing to the field: with_rigid_contacts() makes a run jump
/// where it touches. Its loss is "<name>.impact"; "<name>.impacts" counts (an observed power). What
/// its friction takes, in impacts and while it slides, is "<name>.friction".
/// A dry joint slides in the field, by the sign of its rate: with_dry_friction() makes a run in
/// which it also sticks. Its loss is "<name>"; "<name>.slips" counts.
class ContactModel : public phs::ModelFor<ContactModel> {
 public:
  /// inner: the mechanism with its parts; its state is the mechanism's.
  /// @throws InvalidArgument naming the contact: an unknown link or joint, a pair of shapes without
  ///   a closed form, sizes or numbers of a law out of range; a dry joint beside anything rigid, or
  ///   twice. Surfaces on one body do not touch.
  ContactModel(std::shared_ptr<const phs::Model> inner,
               std::shared_ptr<const mechanics::MechanicalModel> mechanical,
               std::vector<Contact> contacts, std::vector<Stop> stops = {},
               std::vector<DryFriction> dry = {});

  const phs::Description& description() const override { return description_; }
  std::vector<phs::HoldPtr> holds() const override { return inner_->holds(); }
  const mechanics::Mechanism& mechanism() const { return mechanical_->mechanism(); }
  const phs::Model& inner() const { return *inner_; }
  const std::vector<Contact>& contacts() const { return contacts_; }  ///< those that are soft
  const std::vector<Stop>& stops() const { return stops_; }

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  /// The depths of laws that switch, at whose zeros a force or a derivative of it jumps. They read
  /// a state that begins with the mechanism's, refer to this model, and must not outlive it.
  std::unique_ptr<integrators::Switches> depths() const;

  /// @throws InvalidArgument naming the contact: friction of rigid shapes that touch in several
  ///   points, or in several contacts of a link. with_time_stepping() has it; in runs by events the
  ///   forces of several points that stick are not unique.
  void check_friction_of_events() const;

  /// The rigid contact or stop whose shapes overlap most at a state, and by how much [m | rad]; one
  /// whose shapes are near, or "", if none overlap.
  std::pair<std::string, double> deepest_rigid(const phs::State& state) const;

  /// A surface as placed in the mechanism.
  struct Seat {
    int node;     ///< -1: fixed in the world
    Shape shape;  ///< with its frame in the node's frame (in the world for -1)
  };
  /// Two surfaces that a contact names.
  struct Pair {
    size_t contact, a, b;  ///< a, b: seats
    size_t first, points;  ///< of all points that may touch
  };
  /// The seats of a contact's two sides. Every one of `a` may touch every one of `b` that is on
  /// another node; two that are on both sides are one pair, or none if a joint connects them.
  struct Sides {
    size_t contact;
    std::vector<size_t> a, b;
  };
  /// A joint with one freedom as placed in the mechanism.
  struct PlacedJoint {
    size_t q, v;
    int turn;  ///< its angle block, -1: none
  };
  struct PlacedStop : PlacedJoint {
    double lower, upper;
  };
  struct Placed {
    std::vector<Seat> seats;  ///< each surface once, whatever contacts it is in
    std::vector<Pair> pairs;
    std::vector<PlacedStop> stops;
    size_t points = 0;  ///< of all pairs
  };
  /// A rigid contact or, after all contacts, a rigid stop.
  struct Rigid {
    std::string name;
    double restitution;
    Simultaneous simultaneous;
    double friction;  ///< Coulomb's μ, 0 of a stop
  };
  const std::vector<Rigid>& rigid() const { return rigid_; }
  /// Of contacts() and stops().
  const Placed& soft() const { return placed_; }
  /// Their seats and stops; `contact` is an index of rigid(); the stops are its last elements.
  /// n bodies among themselves are n²/2 pairs: those that are near are found by NearPairs.
  const Placed& rigid_seats() const { return placed_rigid_; }
  const std::vector<Sides>& rigid_sides() const { return rigid_sides_; }
  /// Whether a joint, of the tree or of a loop, connects the bodies of two nodes; -1: the world.
  bool connected(int node, int other) const;
  /// The same with all pairs. Cost: O(pairs).
  Placed all_rigid() const;
  const std::vector<DryFriction>& dry() const { return dry_; }
  /// Of each of dry().
  const std::vector<PlacedJoint>& placed_dry() const { return placed_dry_; }

 private:
  std::shared_ptr<const phs::Model> inner_;
  std::shared_ptr<const mechanics::MechanicalModel> mechanical_;
  std::vector<Contact> contacts_;
  std::vector<Stop> stops_;
  std::vector<Rigid> rigid_;
  std::vector<DryFriction> dry_;
  Placed placed_, placed_rigid_;  ///< the latter without its pairs
  std::vector<Sides> rigid_sides_;
  std::vector<std::pair<int, int>> connected_;  ///< nodes that a joint connects, sorted
  std::vector<PlacedJoint> placed_dry_;
  phs::Description description_;
};

}  // namespace porthos::contact
