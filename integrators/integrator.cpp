#include "integrators/integrator.h"

#include <type_traits>

#include "phs/scalar.h"

namespace porthos::integrators {

template <class T>
Outcome BasicIntegrator<T>::step(State& s) {
  tell_turns(s);
  const Outcome o = advance(s.time(h_), h_, s);
  if (o != Outcome::ok) return o;
  ++s.step, ++cost_.steps;
  if constexpr (std::is_same_v<T, double>)
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
  return o;
}

template <class T>
Outcome BasicIntegrator<T>::step_by(State& s, T h) {
  tell_turns(s);
  const Outcome o = advance(s.time(h_), h, s);
  if (o != Outcome::ok) return o;
  s.step_off_the_grid(phs::to_double(h_), phs::to_double(h)), ++cost_.steps;
  if constexpr (std::is_same_v<T, double>)
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
  return o;
}

#define PORTHOS_INSTANTIATE(T) template class BasicIntegrator<T>;
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)

}  // namespace porthos::integrators
