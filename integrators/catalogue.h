#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "integrators/integrator.h"

namespace porthos::integrators {

/// A method of the catalogue: what it says of itself and how it is made.
struct Entry {
  Declaration declaration;
  std::function<std::unique_ptr<Integrator>(const Declaration&, const phs::Model&, double h,
                                            const Options&)>
      make;
};

const std::vector<Entry>& entries();

}  // namespace porthos::integrators
