#include "integrators/core/integrator.h"

#include <type_traits>

#include "phs/scalars/scalar.h"

namespace porthos::integrators {

template <class T>
Outcome BasicIntegrator<T>::advance_with_port_work(T t, T h, State& s) {
  tell_turns(s);
  const bool aside = port_work_.any() && !integrates_power();
  if (aside) port_work_.before(*system_, t, h, s.x, s.lo);
  const Outcome o = advance(t, h, s);
  if (aside && o == Outcome::ok) {
    port_work_.after(*system_, t, h, s.x, s.lo);
    cost_.evaluations += 3;
  }
  return o;
}

template <class T>
Outcome BasicIntegrator<T>::step(State& s) {
  if (sampler_.any()) sampler_.renew(*system_, turns_, s.time(h_), s);
  const Outcome o = advance_with_port_work(s.time(h_), h_, s);
  if (o != Outcome::ok) return taken_back_unless_ok(o);
  ++s.step;
  ++cost_.steps;
  if constexpr (std::is_same_v<T, double>)
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
  return o;
}

template <class T>
Outcome BasicIntegrator<T>::step_by(State& s, T h) {
  if (sampler_.any()) sampler_.renew(*system_, turns_, s.time(h_), s);
  return taken_back_unless_ok(step_off_the_grid(s, h));
}

template <class T>
Outcome BasicIntegrator<T>::step_off_the_grid(State& s, T h) {
  const Outcome o = advance_with_port_work(s.time(h_), h, s);
  if (o != Outcome::ok) return o;
  s.step_off_the_grid(phs::to_double(h_), phs::to_double(h));
  ++cost_.steps;
  if constexpr (std::is_same_v<T, double>)
    if (options_.wrap) phs::wrap_angles(system_->description(), s);
  return o;
}

#define PORTHOS_INSTANTIATE(T) template class BasicIntegrator<T>;
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::integrators
