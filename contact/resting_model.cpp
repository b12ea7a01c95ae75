#include "contact/detail/resting_forces.h"
#include "phs/system/forwarding.h"

namespace porthos::contact {
namespace {

template <class T>
class RestingSystem final : public phs::Forwarding<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;
  using Base = phs::Forwarding<T>;

 public:
  explicit RestingSystem(const RestingModel& model)
      : Base(model.whole().template instantiate<T>(), model.description()),
        model_(model),
        n_(2 * size_t(model.contacts().mechanism().nq())),
        x_(n_),
        dx_(n_) {
    forces_.reserve(size_t(phs::lanes<T>));  // a copy would lose the capacities
    for (int l = 0; l < phs::lanes<T>; ++l) forces_.emplace_back(model.contacts());
  }
  std::unique_ptr<phs::System<T>> clone() const override {
    return this->alike(std::make_unique<RestingSystem>(model_));
  }
  void field(T t, In x, In u, Out dx) override {
    Base::field(t, x, u, dx);
    hold(x, dx);
  }
  void rate(T t, In x, In e, Out dx) override {
    Base::rate(t, x, e, dx);
    hold(x, dx);
  }
  void set_turn_angles(In angles) override {
    Base::set_turn_angles(angles);
    const size_t own = size_t(model_.contacts().mechanism().angle_count());
    std::vector<double> lane(own);
    for (int l = 0; l < phs::lanes<T>; ++l) {
      for (size_t i = 0; i < own; ++i) lane[i] = in_lane(angles[i], l);
      forces_[size_t(l)].set_turn_angles(lane);
    }
  }

 private:
  static double in_lane(const T& x, int l) {
    if constexpr (phs::is_pack<T>)
      return x[l];
    else
      return phs::to_double(x);
  }
  void hold(In x, Out dx) {
    const auto& closed = model_.closed();
    if (std::find(closed.begin(), closed.end(), 1) == closed.end()) return;
    for (int l = 0; l < phs::lanes<T>; ++l) {
      for (size_t i = 0; i < n_; ++i) {
        x_[i] = in_lane(x[i], l);
        dx_[i] = in_lane(dx[i], l);
      }
      forces_[size_t(l)].hold(x_, dx_, closed);
      for (size_t i = n_ / 2; i < n_; ++i)
        if (const double added = dx_[i] - in_lane(dx[i], l); added != 0) add(dx[i], l, added);
    }
  }
  static void add(T& x, int l, double y) {
    if constexpr (phs::is_pack<T>)
      x.set(l, x[l] + y);
    else
      x = x + T(y);
  }

  const RestingModel& model_;
  std::vector<RestingForces> forces_;  ///< by lane: they know its turns
  size_t n_;
  std::vector<double> x_, dx_;
};

}  // namespace

RestingModel::RestingModel(const phs::Model& whole, const ContactModel& contacts)
    : whole_(whole),
      contacts_(contacts),
      description_(whole.description()),
      closed_(std::make_shared<std::vector<char>>(RigidGaps<double>(contacts).count(), 0)) {
  for (auto& p : description_.powers)
    if (p.kind == phs::PowerKind::observed && p.name.ends_with(".impacts")) p.name += "_so_far";
}

template <class T>
std::unique_ptr<phs::System<T>> RestingModel::make_system() const {
  return std::make_unique<RestingSystem<T>>(*this);
}

#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> RestingModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::contact
