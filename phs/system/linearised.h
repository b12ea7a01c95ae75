#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "phs/system/system.h"

/// The derivative of a system's field as a part of the contract.
namespace porthos::phs {

/// The field f(t, x) of a system without inputs and its derivative at one point, as products with
/// vectors. It works at the point that at() was called for last. Vectors have nx numbers, and no
/// output may be an input. One object per thread; nothing allocates. T: double or lanes; or duals
/// over lanes, with the products' own derivative along a direction in the second part.
template <class T>
class Linearised {
 public:
  using In = std::span<const T>;
  using Out = std::span<T>;

  virtual ~Linearised() = default;
  /// Moves to (t, x) and writes f there.
  virtual void at(const T& t, In x, Out dx) = 0;
  /// out = Df v
  virtual void times(In v, Out out) = 0;
  /// out = Dfᵀ λ
  virtual void transpose_times(In lambda, Out out) = 0;

  /// The parameters whose derivatives it knows: names such as "arm.mass"; empty: none.
  virtual const std::vector<std::string>& parameters() const { return none_; }
  /// gradient += weight · ∂(λᵀf)/∂θ, with λ of the last transpose_times(). Size of parameters().
  virtual void add_gradient(const T& weight, Out gradient) {
    (void)weight;
    (void)gradient;
  }

  /// An input that adds to one momentum, and whose output is the rate of one coordinate.
  struct Plain {
    int rate = -1, momentum = -1;  ///< offsets in x; -1: it is no such input
  };
  /// What input number `i` of the system is.
  virtual Plain input(int i) const {
    (void)i;
    return {};
  }
  /// As System::set_turn_angles, before at().
  virtual void set_turn_angles(In angles) = 0;

  /// In duals: from the next at() on the parameters change along the second part too, so that of f
  /// is ∂f/∂θ θ' besides. Size of parameters().
  /// @throws InvalidArgument along a rotor's inertia that is 0
  virtual void along_parameters(std::span<const double> change) { (void)change; }

  /// How many of the last parameters are the values that the sampled controllers of a run hold
  /// (Hold::values), one after another.
  virtual size_t held() const { return 0; }
  /// out += ∂f/∂w change, by those values w.
  virtual void add_held(std::span<const double> change, Out out) {
    (void)change;
    (void)out;
  }
  /// gradient += weights · ∂y/∂θ, with y the outputs that the law of that hold sees
  /// (Instants::flows), at the point of the last at(). It ends what transpose_times() prepared.
  virtual void add_flow_gradient(size_t hold, std::span<const double> weights, Out gradient) {
    (void)hold;
    (void)weights;
    (void)gradient;
  }

 private:
  std::vector<std::string> none_;
};

/// Duals over as many lanes as a machine register holds, of four or eight: the scalar of second
/// derivatives.
using WideDual = BasicDual<Pack<double, (native_lanes >= 8 ? 8 : 4)>>;

/// The scalars of Linearised.
template <class T>
inline constexpr bool has_linearised =
    std::is_same_v<T, double> || is_pack<T> || std::is_same_v<T, WideDual>;

/// A second base class of an evaluator (System<T>) with a derivative that is cheaper than duals.
template <class T>
class Differentiable {
 public:
  virtual ~Differentiable() = default;
  /// The derivative, or null if this system has none of its own. It refers to the model alone.
  virtual std::unique_ptr<Linearised<T>> linearised() = 0;
  /// The same in duals, likewise; of lanes only.
  virtual std::unique_ptr<Linearised<BasicDual<T>>> linearised_in_duals() { return nullptr; }
};

/// The derivative of a model's field: the system's own, else by duals (nx evaluations at each
/// point). T: double, Pack4 or Pack8. The model must outlive it.
/// @throws InvalidArgument for a model with constraints, or with sampled controllers, whose values
///   depend on an earlier state
template <class T>
std::unique_ptr<Linearised<T>> linearise(const Model& model);
/// The same of the model of a run, whose evaluators read what its sampled controllers hold. These
/// values are constants and parameters (Linearised::held).
/// @param held  the memories of the run, one for each of Model::holds()
/// @throws InvalidArgument for a model with constraints, and for another number of memories
template <class T>
std::unique_ptr<Linearised<T>> linearise(const Model& model, std::vector<HeldPtr> held);

/// The derivative of a model's field in duals over lanes, for second derivatives: at x + ε δ the
/// second part of Dfᵀλ is (D²f δ)ᵀ λ. The model must outlive it.
/// @throws InvalidArgument as linearise(); for a system that has no derivative of its own
std::unique_ptr<Linearised<WideDual>> linearise_in_duals(const Model& model);

/// The derivative of a model's field by duals, whatever the system offers.
template <class T>
std::unique_ptr<Linearised<T>> linearise_by_duals(const Model& model);

}  // namespace porthos::phs
