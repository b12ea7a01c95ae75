#include "scene/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// Insertions, deletions, replacements and swaps of neighbours that turn a into b.
size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (size_t i = 1; i <= a.size(); ++i)
    for (size_t j = 1; j <= b.size(); ++j) {
      d[i][j] =
          std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string joined(const Names& names) { return fmt::format("{}", fmt::join(names, ", ")); }

std::string_view nearest(std::string_view name, const Names& known) {
  return *std::min_element(known.begin(), known.end(), [&](auto a, auto b) {
    return edit_distance(name, a) < edit_distance(name, b);
  });
}

std::string found(const toml::node& n) {
  switch (n.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::boolean:
      return "a boolean";
    case toml::node_type::date:
      return "a date";
    case toml::node_type::time:
      return "a time of day";
    case toml::node_type::date_time:
      return "a date and time";
    default:
      return "a number";
  }
}

void refuse(const std::string& where, const std::string& sentence) {
  throw InvalidArgument(where + ": " + sentence);
}

void check_seconds(const char* name, double seconds, const std::string& where) {
  if (!std::isfinite(seconds))
    refuse(where, fmt::format("{} is {}, expected a finite number of seconds", name, seconds));
  if (seconds <= 0) refuse(where, fmt::format("{} is {} s, expected more than 0 s", name, seconds));
}

}  // namespace porthos::scene
