#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Lobatto IIIA-IIIB pairs with s = 3 … 5 stages, order 2s - 2 (s = 2 is Störmer-Verlet):
/// symplectic for H(q, p), with stages at both ends of the step. Not for quaternion blocks, whose
/// norm is a constraint on q alone.
std::vector<Entry> lobatto_entries();

}  // namespace porthos::integrators
