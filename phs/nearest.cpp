#include "phs/nearest.h"

#include <algorithm>
#include <string>

namespace porthos {
namespace {

/// Insertions, deletions, replacements and swaps of neighbours that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] =
          std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

bool near(std::string_view a, std::string_view b) {
  return 3 * edit_distance(a, b) <= std::max(a.size(), b.size());
}
std::string_view by_edits(std::string_view name, const Names& known) {
  return *std::min_element(known.begin(), known.end(), [&](auto a, auto b) {
    return edit_distance(name, a) < edit_distance(name, b);
  });
}
/// Whether words that _ parts are the others, as limit of torque_limit.
bool has_words(std::string_view name, std::string_view words) {
  const auto all = '_' + std::string(name) + '_';
  return all.find('_' + std::string(words) + '_') != std::string::npos;
}

}  // namespace

std::string_view nearest(std::string_view name, const Names& known) {
  const auto meant = by_edits(name, known);
  if (near(name, meant)) return meant;
  std::string_view words;
  for (const auto each : known)
    if (each.size() > words.size() && has_words(name, each)) words = each;
  return words.empty() ? meant : words;
}

std::string_view near_enough(std::string_view name, const Names& known) {
  const auto meant = by_edits(name, known);
  return near(name, meant) ? meant : std::string_view();
}

}  // namespace porthos
