#include "mechanics/hamiltonian_field-inl.h"

namespace porthos::mechanics {

#define PORTHOS_INSTANTIATE(T)                                                             \
  template void hamiltonian_field<T>(const Mechanism&, Workspace<T>&, std::span<const T>,  \
                                     std::span<const T>, const Loads<T>&, std::span<T>,    \
                                     std::span<T>);                                        \
  template void rates_from_momenta<T>(const Mechanism&, Workspace<T>&, std::span<const T>, \
                                      std::span<const T>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
PORTHOS_INSTANTIATE(phs::BasicDual<phs::Pack4>)  // of second derivatives
PORTHOS_INSTANTIATE(phs::BasicDual<phs::Pack8>)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
