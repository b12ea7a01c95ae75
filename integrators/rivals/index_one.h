#pragma once
#include <cmath>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "integrators/core/entry.h"
#include "phs/system/forwarding.h"
#include "phs/system/reactions.h"

/// Constraints as most programs take them: the multipliers are eliminated from the accelerations,
/// and any method runs what is left (index 1). Nothing keeps it on the manifold.
namespace porthos::integrators {

/// A constrained model as an ordinary differential equation, x' = field - B(x) λ(t, x). In double
/// only. Dependent rows are left out by pivoting at every evaluation.
class IndexOneModel : public phs::ModelFor<IndexOneModel> {
 public:
  /// @param model  with constraints; it must outlive this object
  /// @param stabilisation  a [1/s] of Baumgarte, g'' + 2a g' + a² g = 0; 0: g'' = 0
  explicit IndexOneModel(const phs::Model& model, double stabilisation = 0)
      : model_(model), description_(model.description()), stabilisation_(stabilisation) {
    description_.constraints.clear();
  }
  const phs::Description& description() const override { return description_; }
  std::vector<phs::HoldPtr> holds() const override { return model_.holds(); }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    if constexpr (std::is_same_v<T, double>)
      return std::make_unique<System>(*this);
    else
      throw InvalidArgument("eliminated constraints work in double only");
  }

 private:
  class System final : public phs::Forwarding<double> {
   public:
    explicit System(const IndexOneModel& m)
        : Forwarding(m.model_.instantiate<double>(), m.description_),
          of_(m),
          reactions_(m.model_),
          push_(size_t(m.description_.nx)) {}
    std::unique_ptr<phs::System<double>> clone() const override {
      return alike(std::make_unique<System>(of_));
    }
    void field(double t, In x, In u, Out dx) override {
      Forwarding::field(t, x, u, dx);
      push(t, x, dx);
    }
    void rate(double t, In x, In e, Out dx) override {
      Forwarding::rate(t, x, e, dx);
      push(t, x, dx);
    }
    void efforts(double, In x, In, Out e) override { gradient(x, e); }
    void set_turn_angles(In angles) override {
      Forwarding::set_turn_angles(angles);
      reactions_.set_turn_angles(angles);
    }
    std::unique_ptr<phs::Constraints<double>> constraints() override { return nullptr; }
    std::unique_ptr<phs::Resolvent> resolvent() override { return nullptr; }

   private:
    /// Adds the forces of the constraints to the rates dx without them.
    void push(double t, In x, Out dx) {
      reactions_.along(t, x, dx, of_.stabilisation_);
      reactions_.forces(push_);
      for (size_t k = 0; k < dx.size(); ++k) dx[k] -= push_[k];
    }

    const IndexOneModel& of_;
    phs::Reactions reactions_;
    std::vector<double> push_;
  };

  const phs::Model& model_;
  phs::Description description_;
  double stabilisation_;
};

/// A method of another library on the index-1 form of a constrained model.
/// stabilised: by Baumgarte's terms with a = 1/h, so a gap decays within a step h of the outputs.
template <class Method, bool stabilised = false>
class OnIndexOne final : private IndexOneModel, public Method {
 public:
  /// The arguments of a maker (integrators/core/entry.h), and what Method takes besides.
  template <class... Extra>
  OnIndexOne(const Declaration& d, const phs::Model& model, double h, const Options& o,
             Extra... extra)
      : IndexOneModel(model, stabilised ? 1 / std::fabs(h) : 0),
        Method(d, static_cast<const IndexOneModel&>(*this), h, o, extra...) {}
};

}  // namespace porthos::integrators
