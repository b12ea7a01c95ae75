#pragma once
#include <memory>
#include <type_traits>
#include <vector>

#include "phs/system/forwarding.h"
#include "phs/system/reactions.h"
#include "phs/system/state.h"

/// The textbook way with constraints, as a negative control: the multipliers are eliminated from
/// the accelerations, and any method runs what is left (index 1). Nothing keeps it on the manifold.
namespace porthos::test {

class EliminatedModel final : public phs::ModelFor<EliminatedModel> {
 public:
  /// model: constrained; it must outlive this object
  explicit EliminatedModel(const phs::Model& model)
      : model_(model), description_(model.description()) {
    description_.constraints.clear();
    description_.powers.clear();
  }
  const phs::Description& description() const override { return description_; }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    if constexpr (std::is_same_v<T, double>)
      return std::make_unique<System>(model_, description_);
    else
      throw InvalidArgument("eliminated constraints work in double only");
  }

 private:
  class System final : public phs::Forwarding<double> {
   public:
    System(const phs::Model& model, const phs::Description& d)
        : Forwarding(model.instantiate<double>(), d),
          model_(model),
          reactions_(model),
          rows_(inner().constraints()),
          g_(size_t(rows_->count())),
          push_(size_t(d.nx)) {}
    std::unique_ptr<phs::System<double>> clone() const override {
      return alike(std::make_unique<System>(model_, description()));
    }
    void field(double t, In x, In u, Out dx) override {
      Forwarding::field(t, x, u, dx);
      const auto lambda = reactions_.at(t, x, turns_);
      rows_->place(x, g_);
      rows_->forces(lambda, push_);
      for (size_t k = 0; k < dx.size(); ++k) dx[k] -= push_[k];
    }
    void set_turn_angles(In angles) override {
      Forwarding::set_turn_angles(angles);
      rows_->set_turn_angles(angles);
      turns_.clear();
      for (const double a : angles) turns_.push_back(std::llround(a / phs::two_pi_hi));
    }
    std::unique_ptr<phs::Constraints<double>> constraints() override { return nullptr; }
    std::unique_ptr<phs::Resolvent> resolvent() override { return nullptr; }

   private:
    const phs::Model& model_;
    phs::Reactions reactions_;
    std::unique_ptr<phs::Constraints<double>> rows_;
    std::vector<double> g_, push_;
    std::vector<std::int64_t> turns_;
  };

  const phs::Model& model_;
  phs::Description description_;
};

}  // namespace porthos::test
