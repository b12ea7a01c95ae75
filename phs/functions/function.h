#pragma once
#include <memory>
#include <utility>

#include "phs/scalars/scalar.h"

/// Laws of elements: real functions that can be evaluated in every scalar type.
namespace porthos::phs {

/// y = f(x). Immutable, shared between threads (except Held, see elements.h).
class Function {
 public:
  virtual ~Function() = default;
#define PORTHOS_EVALUATE(T) virtual T operator()(const T& x) const = 0;
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE
};
using FunctionPtr = std::shared_ptr<const Function>;

/// A generic callable as a Function, e.g. function([](auto v) { return 0.2 * v; }). It must accept
/// any scalar.
template <class F>
FunctionPtr function(F f) {
  class Callable final : public Function {
   public:
    explicit Callable(F f) : f_(std::move(f)) {}
#define PORTHOS_EVALUATE(T) \
  T operator()(const T& x) const override { return f_(x); }
    PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE

   private:
    F f_;
  };
  return std::make_shared<Callable>(std::move(f));
}

/// An energy U(z) with its slope U'(z): a spring, an end stop, any potential of one coordinate.
struct Potential {
  FunctionPtr energy;  ///< [J]
  FunctionPtr slope;   ///< [N | N m]: the force that resists
};

}  // namespace porthos::phs
