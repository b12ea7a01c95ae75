#include "bench/kernels/counted.h"

#include "mechanics/aba-inl.h"
#include "mechanics/crba-inl.h"
#include "mechanics/hamiltonian_field-inl.h"
#include "mechanics/rnea-inl.h"

namespace porthos::mechanics {

using T = bench::Counted;
template void hamiltonian_field<T>(const Mechanism&, Workspace<T>&, std::span<const T>,
                                   std::span<const T>, const Loads<T>&, std::span<T>, std::span<T>);
template void aba<T>(const Mechanism&, Workspace<T>&, std::span<const T>, std::span<const T>,
                     const Loads<T>&, std::span<T>);
template void rnea<T>(const Mechanism&, Workspace<T>&, std::span<const T>, std::span<const T>,
                      std::span<const T>, std::span<const Force<T>>, std::span<T>);
template void crba<T>(const Mechanism&, Workspace<T>&, std::span<const T>, std::span<T>);

}  // namespace porthos::mechanics
