#pragma once
#include <functional>

#include "integrators/core/integrator.h"
#include "integrators/tables/composition_tables.h"

namespace porthos::integrators {

struct Entry;

/// The family of compositions in the catalogue.
inline constexpr const char* compositions = "Compositions";

/// A method whose step is a sequence of steps of another, its base, or of steps of its own.
template <class T>
class ComposedSteps {
 public:
  /// Called after step i of the base, from time t [s] and of size h; the angles of `after` are not
  /// wrapped yet.
  using Watch = std::function<void(size_t i, T t, T h, const phs::BasicState<T>& after)>;
  virtual ~ComposedSteps() = default;
  virtual const BasicIntegrator<T>& base() const = 0;
  virtual size_t count() const = 0;  ///< steps of the base in a step; 0: not always as many
  void watch(Watch w) { watch_ = std::move(w); }

 protected:
  Watch watch_;
};

/// Ψ(γ_s h) ∘ … ∘ Ψ(γ_1 h) of a symmetric method Ψ of the catalogue, the base. It conserves what
/// each base step conserves. The error expansion of a symmetric base has odd powers of h only, so
/// few conditions on γ raise the order.
/// @throws InvalidArgument if the base does not declare itself symmetric and of even order
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_composition(const Declaration&, const CompositionTable&,
                                                     const std::string& base, const phs::Model&,
                                                     T h, const Options&);

std::vector<Entry> composition_entries();

}  // namespace porthos::integrators
