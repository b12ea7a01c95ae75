#include <algorithm>

#include "contact/detail/held_system.h"
#include "contact/detail/sticking_forces.h"
#include "contact/sticking.h"

namespace porthos::contact {

StickingModel::StickingModel(const phs::Model& whole, const ContactModel& contacts)
    : whole_(whole),
      contacts_(contacts),
      description_(whole.description()),
      slides_(std::make_shared<std::vector<int>>(contacts.dry().size(), 0)) {
  for (auto& p : description_.powers)
    if (p.kind == phs::PowerKind::observed && p.name.ends_with(".slips")) p.name += "_so_far";
}

bool StickingModel::holds_any() const {
  return std::find(slides_->begin(), slides_->end(), 0) != slides_->end();
}

template <class T>
void StickingModel::push(std::span<T> dx) const {
  const auto& joints = contacts_.placed_dry();
  const size_t nq = size_t(contacts_.mechanism().nq());
  for (size_t k = 0; k < joints.size(); ++k) {
    const DryFriction& f = contacts_.dry()[k];
    T& v = dx[joints[k].q];
    T force = friction_at(f, v);  // what the field has: 0 is left of it while the sign is the same
    if (const int s = (*slides_)[k]; s != 0)
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
