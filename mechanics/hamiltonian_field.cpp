#include "mechanics/hamiltonian_field-inl.h"

#include "phs/system/linearised.h"

namespace porthos::mechanics {

#define PORTHOS_INSTANTIATE(T)                                                             \
  template void hamiltonian_field<T>(const Mechanism&, Workspace<T>&, std::span<const T>,  \
                                     std::span<const T>, const Loads<T>&, std::span<T>,    \
                                     std::span<T>);                                        \
  template void rates_from_momenta<T>(const Mechanism&, Workspace<T>&, std::span<const T>, \
                                      std::span<const T>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
PORTHOS_INSTANTIATE(phs::WideDual)  // of second derivatives
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
