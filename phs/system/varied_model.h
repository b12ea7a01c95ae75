#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "phs/scalars/derivative.h"
#include "phs/system/forwarding.h"
#include "phs/system/linearised.h"

/// Parameters of a model that are known by models beside it.
namespace porthos::phs {

/// A central difference of order 6, f' ≈ Σ weight f(at · distance) / distance, wrong by
/// distance⁶ f⁽⁷⁾/140: at a distance of 2⁻⁷ by 2e-13 of a sine of two periods, with 3e-14 of
/// rounding.
struct DifferencePoint {
  int at;
  double weight;
};
inline constexpr DifferencePoint difference_points[] = {{1, 0.75},  {-1, -0.75},   {2, -0.15},
                                                        {-2, 0.15}, {3, 1.0 / 60}, {-3, -1.0 / 60}};
inline constexpr double difference_distance = 0x1p-7;

/// A parameter of a model, by the same model with the parameter changed.
struct Variation {
  std::string name;
  /// At each of difference_points, times difference_distance, in their order.
  std::vector<std::shared_ptr<const Model>> beside;
};

/// The evaluator of a VariedModel.
template <class T>
class VariedSystem final : public Forwarding<T>, public Differentiable<T> {
 public:
  VariedSystem(const Model& inner, const std::vector<Variation>& variations)
      : Forwarding<T>(inner.instantiate<T>(), inner.description()),
        inner_(inner),
        variations_(variations) {}
  std::unique_ptr<System<T>> clone() const override {
    return this->alike(std::make_unique<VariedSystem>(inner_, variations_));
  }
  std::unique_ptr<Linearised<T>> linearised() override {
    if constexpr (has_gradient_by_duals<T>)
      return std::make_unique<Linear>(inner_, variations_);
    else
      return nullptr;
  }

 private:
  /// The derivative of the model, and the further parameters.
  class Linear final : public Linearised<T> {
   public:
    using typename Linearised<T>::In;
    using typename Linearised<T>::Out;
    using typename Linearised<T>::Plain;

    Linear(const Model& inner, const std::vector<Variation>& variations)
        : own_(linearise<T>(inner)),
          names_(own_->parameters()),
          x_(size_t(inner.description().nx)),
          lambda_(x_),
          f_(x_) {
      for (const Variation& v : variations) {
        names_.push_back(v.name);
        for (const auto& model : v.beside) beside_.push_back(model->instantiate<T>());
      }
    }
    void at(const T& t, In x, Out dx) override {
      t_ = t;
      std::copy(x.begin(), x.end(), x_.begin());
      own_->at(t, x, dx);
    }
    void times(In v, Out out) override { own_->times(v, out); }
    void transpose_times(In lambda, Out out) override {
      std::copy(lambda.begin(), lambda.end(), lambda_.begin());
      own_->transpose_times(lambda, out);
    }
    const std::vector<std::string>& parameters() const override { return names_; }
    void add_gradient(const T& weight, Out gradient) override {
      const size_t points = std::size(difference_points),
                   known = names_.size() - beside_.size() / points;
      own_->add_gradient(weight, gradient.first(known));
      for (size_t i = 0; i < beside_.size(); ++i) {
        beside_[i]->field(t_, x_, {}, f_);
        T sum(0.0);
        for (size_t k = 0; k < f_.size(); ++k) sum = fma(lambda_[k], f_[k], sum);
        T& to = gradient[known + i / points];
        to = fma(weight * T(difference_points[i % points].weight / difference_distance), sum, to);
      }
    }
    Plain input(int i) const override { return own_->input(i); }
    void set_turn_angles(In angles) override {
      own_->set_turn_angles(angles);
      for (auto& system : beside_) system->set_turn_angles(angles);
    }

   private:
    std::unique_ptr<Linearised<T>> own_;
    std::vector<std::string> names_;
    std::vector<std::unique_ptr<System<T>>> beside_;
    T t_ = T(0.0);
    std::vector<T> x_, lambda_, f_;
  };

  const Model& inner_;
  const std::vector<Variation>& variations_;
};

/// A model with the parameters of Variations: its own derivative (phs::linearise) has them behind
/// those of the model. Its field, and what else is evaluated, has the bits of the model.
/// A gradient costs six fields for each at each stage.
class VariedModel : public ModelFor<VariedModel> {
 public:
  VariedModel(std::shared_ptr<const Model> model, std::vector<Variation> variations)
      : model_(std::move(model)), variations_(std::move(variations)) {
    for (const Variation& v : variations_)
      require_size(v.name.c_str(), v.beside.size(), std::size(difference_points));
  }
  const Description& description() const override { return model_->description(); }
  std::vector<HoldPtr> holds() const override { return model_->holds(); }
  template <class T>
  std::unique_ptr<System<T>> make_system() const {
    return std::make_unique<VariedSystem<T>>(*model_, variations_);
  }

 private:
  std::shared_ptr<const Model> model_;
  std::vector<Variation> variations_;
};

}  // namespace porthos::phs
