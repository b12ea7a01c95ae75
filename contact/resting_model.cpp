#include <algorithm>

#include "contact/detail/held_system.h"
#include "contact/detail/resting_forces.h"

namespace porthos::contact {

RestingModel::RestingModel(const phs::Model& whole, const ContactModel& contacts)
    : HeldModel(whole, contacts, RigidGaps<double>(contacts).count(), ".impacts"),
      rubbing_(RigidGaps<double>(contacts).rubbing()) {}

bool RestingModel::holds_any() const {
  return std::any_of(held().begin(), held().end(), [](const Touching& t) { return bool(t); });
}
bool RestingModel::loses_any() const {
  return std::any_of(rubbing_.begin(), rubbing_.end(),
                     [&](size_t k) { return held()[k].slides(); });
}
bool RestingModel::lifts_any() const {
  return std::any_of(held().begin(), held().end(), [](const Touching& t) { return t.lifts(); });
}

template <class T>
std::unique_ptr<phs::System<T>> RestingModel::make_system() const {
  return std::make_unique<HeldSystem<T, RestingModel, RestingForces>>(*this);
}

#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> RestingModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::contact
