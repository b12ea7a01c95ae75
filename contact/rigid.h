#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "contact/held_model.h"

/// Runs of models with rigid contacts: the instants of their impacts, the jumps, and contacts that
/// stay closed.
namespace porthos::contact {

/// A model for one run. Where contacts are closed its field has the forces that hold their gaps:
/// 0 <= λ ⊥ g'' >= 0 with g'' = a + W λ, a the acceleration of the gaps without them. They are
/// found from the field itself, in double, for every scalar: a derivative does not see λ move.
/// held(): for every gap of the rigid contacts, whether it is closed in this run.
class RestingModel final : public HeldModel<RestingModel, char> {
 public:
  /// whole: a model whose state begins with that of the mechanism in `contacts`
  RestingModel(const phs::Model& whole, const ContactModel& contacts);

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  bool holds_any() const;  ///< whether any is closed
  template <class T>
  void push(std::span<T>) const {}  // contacts that are open do nothing
};

/// A method for a model with rigid contacts: its steps consist of parts that end at impacts and
/// where contacts open, and at the switches of the soft ones.
///
/// The instant of an impact is found as an event, by the method itself. The rates then jump as
/// RigidImpact says, computed in 113 bits, for all contacts that touch at that instant. A contact
/// that would jump less than 1e-14 m (or rad) high closes: that impact is plastic, and its gap
/// stays 0 until the force that holds it would pull. Losses are the powers "<name>.impact".
/// @param make  makes the method for the model of its run; called once
/// @throws what make() throws
std::unique_ptr<integrators::Integrator> with_rigid_contacts(
    const phs::Model& whole, const ContactModel& contacts, double h,
    const std::function<std::unique_ptr<integrators::Integrator>(const phs::Model&)>& make);

}  // namespace porthos::contact
