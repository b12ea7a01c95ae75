#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "contact/held_model.h"

/// Runs of models with rigid contacts: the instants of their impacts, the jumps, and contacts that
/// stay closed.
namespace porthos::contact {

/// What a gap of a rigid contact does in a run. One that is closed and has no friction slides.
struct Touching {
  /// lifts: it has opened from rest and is at most 1e-12 m (or rad) wide: its rate is rounding.
  enum class State : char { open, slides, sticks, lifts } state = State::open;
  /// With friction: of the slip, across the normal, world axes, when it was last looked at.
  mechanics::Vec3d along{0, 0, 0};
  bool turns = false;     ///< whether friction follows the slip from there, or is along `along`
  bool singular = false;  ///< whether its forces were not unique since the step began

  explicit operator bool() const { return slides() || sticks(); }
  bool slides() const { return state == State::slides; }
  bool sticks() const { return state == State::sticks; }
  bool lifts() const { return state == State::lifts; }
};

/// A model for one run. Where contacts are closed its field has the forces that hold their gaps:
/// 0 <= λ ⊥ g'' >= 0 with g'' = a + W λ, a the acceleration of the gaps without them; and the
/// frictions there, see ClosedForces. They are found from the field itself, in double, for every
/// scalar: a derivative does not see λ move. held(): of every gap of the rigid contacts.
class RestingModel final : public HeldModel<RestingModel, Touching> {
 public:
  /// whole: a model whose state begins with that of the mechanism in `contacts`
  RestingModel(const phs::Model& whole, const ContactModel& contacts);

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  bool holds_any() const;  ///< whether any is closed
  bool loses_any() const;  ///< whether any slides with friction
  bool lifts_any() const;  ///< whether any has just opened
  template <class T>
  void push(std::span<T>) const {}  // contacts that are open do nothing

 private:
  std::vector<size_t> rubbing_;  ///< the gaps with friction
};

/// A method for a model with rigid contacts: its steps consist of parts that end at impacts and
/// where contacts open, and at the switches of the soft ones.
///
/// The instant of an impact is found as an event, by the method itself. The rates then jump as
/// RigidImpact says, computed in 113 bits, for all contacts that touch at that instant. A contact
/// that would jump less than 1e-14 m (or rad) high closes: that impact is plastic, and its gap
/// stays 0 until the force that holds it would pull. Losses are the powers "<name>.impact".
///
/// With friction an impact is RoughImpact's. A closed contact slides or sticks; the instants where
/// the slip ends and where sticking would need more than μ times the normal force are events too.
/// What friction takes is the power "<name>.friction". Where its force has no unique solution
/// (Painlevé) the step ends with Outcome::jammed.
/// @param make  makes the method for the model of its run; called once
/// @throws InvalidArgument as ContactModel::check_friction_of_events(); what make() throws
std::unique_ptr<integrators::Integrator> with_rigid_contacts(
    const phs::Model& whole, const ContactModel& contacts, double h,
    const std::function<std::unique_ptr<integrators::Integrator>(const phs::Model&)>& make);

}  // namespace porthos::contact
