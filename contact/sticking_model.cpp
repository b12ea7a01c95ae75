#include <algorithm>

#include "contact/detail/held_system.h"
#include "contact/detail/sticking_forces.h"
#include "contact/sticking.h"

namespace porthos::contact {

StickingModel::StickingModel(const phs::Model& whole, const ContactModel& contacts)
    : HeldModel(whole, contacts, contacts.dry().size(), ".slips") {}

bool StickingModel::holds_any() const {
  return std::find(held().begin(), held().end(), 0) != held().end();
}

template <class T>
void StickingModel::push(std::span<T> dx) const {
  const auto& joints = contacts().placed_dry();
  const size_t nq = size_t(contacts().mechanism().nq());
  for (size_t k = 0; k < joints.size(); ++k) {
    const DryFriction& f = contacts().dry()[k];
    T& v = dx[joints[k].q];
    T force = friction_at(f, v);  // what the field has: 0 is left of it while the sign is the same
    if (const int s = held()[k]; s != 0)
      force = force - T(double(s)) * sliding_force(f, T(T(double(s)) * v));
    else
      v = T(0.0);
    dx[nq + joints[k].q] = dx[nq + joints[k].q] + force;
  }
}

template <class T>
std::unique_ptr<phs::System<T>> StickingModel::make_system() const {
  return std::make_unique<HeldSystem<T, StickingModel, StickingForces>>(*this);
}

#define PORTHOS_INSTANTIATE(T)                           \
  template void StickingModel::push(std::span<T>) const; \
  template std::unique_ptr<phs::System<T>> StickingModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::contact
