#pragma once
#include "integrators/core/entry.h"

namespace porthos::integrators {

/// Gauss-Lobatto SPARK methods for systems with constraints: spark2 … spark16.
Entries spark_entries();

}  // namespace porthos::integrators
