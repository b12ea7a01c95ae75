#include "ensemble/held_inputs.h"

#include "phs/tunable.h"

namespace porthos::ensemble {

template <class T>
class HeldInputs::Evaluator final : public phs::System<T>, public phs::Tunable<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit Evaluator(const HeldInputs& m)
      : m_(m),
        plant_(m.plant_->instantiate<T>()),
        u_(size_t(m.plant_->description().nu), T(0.0)),
        y_(u_.size()),
        w_(size_t(m.description_.nx)) {}
  std::span<T> parameters() override { return u_; }
  const phs::Description& description() const override { return m_.description_; }
  std::unique_ptr<phs::System<T>> clone() const override {
    auto other = std::make_unique<Evaluator>(m_);
    other->u_ = u_;
    return other;
  }
  T hamiltonian(In x) override { return plant_->hamiltonian(x); }
  void gradient(In x, Out e) override { plant_->gradient(x, e); }
  void field(T t, In x, In, Out dx) override { plant_->field(t, x, u_, dx); }
  void rate(T t, In x, In e, Out dx) override {
    plant_->rate(t, x, e, dx);
    plant_->apply_input(x, u_, w_);
    for (size_t i = 0; i < dx.size(); ++i) dx[i] = dx[i] + w_[i];
  }
  void apply_structure(In x, In e, Out Je) override { plant_->apply_structure(x, e, Je); }
  void apply_dissipation(In x, In e, Out Re) override { plant_->apply_dissipation(x, e, Re); }
  void apply_input(In, In, Out Gu) override {
    for (T& g : Gu) g = T(0.0);
  }
  void output(In, In, Out) override {}
  void stored(In x, Out values) override { plant_->stored(x, values); }
  void powers(T t, In x, In e, Out values) override {
    const size_t own = values.size() - 1;
    plant_->powers(t, x, e, values.first(own));
    plant_->output(x, e, y_);
    T sum(0.0);
    for (size_t i = 0; i < u_.size(); ++i) sum = sum + u_[i] * y_[i];
    values[own] = sum;
  }
  void invariants(In, Out) override {}
  void set_turn_angles(In turns) override { plant_->set_turn_angles(turns); }
  void sample(std::size_t i, T t, In x, std::span<double> memory) override {
    plant_->sample(i, t, x, memory);
  }

 private:
  const HeldInputs& m_;
  std::unique_ptr<phs::System<T>> plant_;
  std::vector<T> u_, y_, w_;
};

HeldInputs::HeldInputs(std::shared_ptr<const phs::Model> plant)
    : plant_(std::move(plant)), description_(plant_->description()) {
  description_.name += " with held inputs";
  description_.nu = 0, description_.ports.clear(), description_.flows.clear();
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
