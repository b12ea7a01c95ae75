#include "mechanics/aba-inl.h"

namespace porthos::mechanics {

#define PORTHOS_INSTANTIATE(T)                                                                  \
  template void aba<T>(const Mechanism&, Workspace<T>&, std::span<const T>, std::span<const T>, \
                       const Loads<T>&, std::span<T>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
