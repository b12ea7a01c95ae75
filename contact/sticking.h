#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "contact/held_model.h"

/// Runs of models whose joints have dry friction: what sticks, what slides, and when that changes.
namespace porthos::contact {

/// A model for one run. The friction of a dry joint that slides has its sign frozen until it stops;
/// of one that sticks it is the force λ that keeps v' = 0, from 0 = a + W λ over all that stick, a
/// the accelerations without them. λ is found from the field, in double, for every scalar: a
/// derivative does not see it move. held(): for every dry joint 0 if it sticks, else the sign of
/// the rate with which it slides.
class StickingModel final : public HeldModel<StickingModel, int> {
 public:
  /// whole: a model whose state begins with that of the mechanism in `contacts`
  StickingModel(const phs::Model& whole, const ContactModel& contacts);

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  bool holds_any() const;  ///< whether any sticks
  /// Gives the friction in the field dx the sign of each joint that slides. Of those that stick it
  /// takes it off, with the rounding of their rates.
  template <class T>
  void push(std::span<T> dx) const;
};

/// A method for a model with dry friction: its steps consist of parts that end where a joint stops
/// or breaks away, and at the switches of soft contacts, so the method keeps its order.
///
/// The instants v = 0 and |λ| = breakaway are found as events, by the method itself. Which of
/// several joints at rest slide then, and where to, is decided for all at once (StickSlip). The
/// angle of a joint that sticks does not change by a bit. Losses are the powers "<name>".
/// @param make  makes the method for the model of its run; called once
/// @throws what make() throws
std::unique_ptr<integrators::Integrator> with_dry_friction(
    const phs::Model& whole, const ContactModel& contacts, double h,
    const std::function<std::unique_ptr<integrators::Integrator>(const phs::Model&)>& make);

}  // namespace porthos::contact
