#pragma once
#include <string_view>
#include <vector>

namespace porthos {

using Names = std::vector<std::string_view>;

/// The known name that takes the fewest edits from `name`: insertions, deletions, replacements and
/// swaps of neighbours (Damerau 1964). @param known  at least one
std::string_view nearest(std::string_view name, const Names& known);

}  // namespace porthos
