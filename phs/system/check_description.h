#pragma once
#include "phs/system/description.h"

namespace porthos::phs {

/// Checks that every slice of a description lies in its vector and overlaps no other one: blocks
/// and their momenta in x, ports in u, invariants in the vector of all invariants. A block has the
/// size of its kind; with Traits::canonical its momentum is nx / 2 behind it. Cost: O(n log n) for
/// n slices.
/// @throws InvalidArgument with the name of the block, port or invariant and the range
void check_description(const Description& d);

}  // namespace porthos::phs
