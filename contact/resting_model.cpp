#include <algorithm>

#include "contact/detail/held_system.h"
#include "contact/detail/resting_forces.h"

namespace porthos::contact {

RestingModel::RestingModel(const phs::Model& whole, const ContactModel& contacts)
    : whole_(whole),
      contacts_(contacts),
      description_(whole.description()),
      closed_(std::make_shared<std::vector<char>>(RigidGaps<double>(contacts).count(), 0)) {
  for (auto& p : description_.powers)
    if (p.kind == phs::PowerKind::observed && p.name.ends_with(".impacts")) p.name += "_so_far";
}

bool RestingModel::holds_any() const {
  return std::find(closed_->begin(), closed_->end(), 1) != closed_->end();
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
