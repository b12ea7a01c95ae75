#pragma once
#include <string>

#include "tests/combinations/features.h"

/// docs/combinations.md. All of it is known from the tables of this folder but the sentences of the
/// refusals, which are seen.
namespace porthos::test::combinations {

struct Count {
  int pairs = 0, refused = 0, by_method = 0;
};
Count count();

/// The row of a feature: a mark for each feature before it.
std::string row_of(size_t i);
/// The line that quotes a refusal.
std::string line_of(const Feature& a, const Feature& b, const std::string& sentence);
bool is_quote(const std::string& line);

/// The page with the quotes in it, of each refusal in their order.
std::string page(const std::vector<std::pair<int, std::string>>& quotes);

}  // namespace porthos::test::combinations
