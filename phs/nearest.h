#pragma once
#include <string_view>
#include <vector>

namespace porthos {

using Names = std::vector<std::string_view>;

/// The known name that takes the fewest edits from `name`: insertions, deletions, replacements and
/// swaps of neighbours (Damerau 1964). Where that is more than a third of the longer name, the
/// longest one that is whole words of it: limit for torque_limit. @param known  at least one
std::string_view nearest(std::string_view name, const Names& known);
/// That name if it can be meant: with edits to at most a third of the longer name. Else empty.
std::string_view near_enough(std::string_view name, const Names& known);

}  // namespace porthos
