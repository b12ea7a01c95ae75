#pragma once
#include <concepts>

// The headers of Simbody are C++11. In C++20 two of its indices compare in several equally good
// ways (this one is better), and one header, not needed here, has vectors of what is not yet a
// type: its guard keeps it out.
#define SimTK_SIMMATH_MULTIBODY_GRAPH_MAKER_H_
namespace SimTK {
template <class Index>
requires std::same_as<decltype(Index::Invalid()), const Index&>
bool operator==(const Index& a, const Index& b) { return int(a) == int(b); }
}  // namespace SimTK

#include <Simbody.h>
