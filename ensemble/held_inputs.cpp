#include "ensemble/held_inputs.h"

#include "phs/system/forwarding.h"

namespace porthos::ensemble {

template <class T>
class HeldInputs::Evaluator final : public phs::Driven<T> {
  using In = std::span<const T>;

 public:
  explicit Evaluator(const HeldInputs& m)
      : phs::Driven<T>(m.plant_->instantiate<T>(), m.description_),
        m_(m),
        u_(size_t(m.plant_->description().nu), T(0.0)) {}
  std::span<T> parameters() override { return u_; }
  std::unique_ptr<phs::System<T>> clone() const override {
    auto copy = std::make_unique<Evaluator>(m_);
    copy->u_ = u_;
    return this->alike(std::move(copy));
  }

 private:
  In inputs(T, In) override { return u_; }

  const HeldInputs& m_;
  std::vector<T> u_;
};

HeldInputs::HeldInputs(std::shared_ptr<const phs::Model> plant)
    : plant_(std::move(plant)), description_(plant_->description()) {
  description_.name += " with held inputs";
  description_.nu = 0;
  description_.ports.clear();
  description_.flows.clear();
  description_.invariants.clear();
  description_.traits.separable = false;
  description_.powers.push_back({"inputs", phs::PowerKind::supplied});
}

template <class T>
std::unique_ptr<phs::System<T>> HeldInputs::make_system() const {
  return std::make_unique<Evaluator<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> HeldInputs::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::ensemble
