#pragma once
#include <memory>
#include <utility>

#include "phs/functions/function.h"

/// Functions that give the same value whenever they are asked for the same argument.
namespace porthos::phs {

/// Marks them: who asks for the same time again may keep the value. A Held signal, or a function of
/// a user who may change what it reads, has no such mark.
class OfTimeAlone {
 public:
  virtual ~OfTimeAlone() = default;
};

/// f, which depends on its argument alone.
inline FunctionPtr of_time_alone(FunctionPtr f) {
  class Marked final : public Function, public OfTimeAlone {
   public:
    explicit Marked(FunctionPtr f) : f_(std::move(f)) {}
#define PORTHOS_EVALUATE(T) \
  T operator()(const T& t) const override { return (*f_)(t); }
    PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE

   private:
    FunctionPtr f_;
  };
  return std::make_shared<Marked>(std::move(f));
}

}  // namespace porthos::phs
