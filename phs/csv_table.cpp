#include "phs/csv_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "phs/error.h"
#include "phs/nearest.h"

namespace porthos {
namespace {

std::string_view without_edges(std::string_view cell) {
  const std::string_view around = " \t\r\"";
  const auto first = cell.find_first_not_of(around);
  if (first == std::string_view::npos) return {};
  return cell.substr(first, cell.find_last_not_of(around) - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  for (std::size_t from = 0;;) {
    const auto to = line.find(separator, from);
    cells.push_back(without_edges(line.substr(from, to - from)));
    if (to == std::string_view::npos) return cells;
    from = to + 1;
  }
}

/// @param decimal  a comma that stands for the point, or 0
std::optional<double> number_in(std::string_view cell, char decimal) {
  if (cell.starts_with('+')) cell.remove_prefix(1);
  if (const auto comma = cell.find(decimal); decimal != 0 && comma != std::string_view::npos) {
    std::string with_point(cell);
    with_point[comma] = '.';
    return as_number(with_point);
  }
  return as_number(cell);
}

/// A name of a column, and how often the unit of Porthos is in that of its numbers.
struct Heading {
  std::string_view name;
  double factor = 1;
};

/// "q [rad]" and "q (rad)" are "q": the unit is what Porthos expects and writes itself. "q [deg]"
/// is "q" with a factor. Other units stay in the name, which nothing asks for then.
Heading without_unit(std::string_view name) {
  if (!name.ends_with(']') && !name.ends_with(')')) return {name};
  const auto open = name.rfind(name.back() == ']' ? " [" : " (");
  if (open == std::string_view::npos || open == 0) return {name};
  constexpr double degree = std::numbers::pi / 180;
  constexpr std::pair<std::string_view, double> units[] = {
      {"1", 1},     {"s", 1},      {"m", 1},       {"rad", 1},     {"kg", 1},
      {"N", 1},     {"J", 1},      {"W", 1},       {"A", 1},       {"V", 1},
      {"T", 1},     {"Nm", 1},     {"Nms", 1},     {"ms", 1e-3},   {"us", 1e-6},
      {"mm", 1e-3}, {"mNm", 1e-3}, {"mrad", 1e-3}, {"deg", degree}};
  constexpr std::string_view between = " /*.\xC2\xB7";  // the last two are a middle dot
  std::string_view unit = name.substr(open + 2, name.size() - open - 3);
  Heading heading{without_edges(name.substr(0, open))};
  bool below = false;  // behind a slash
  while (!unit.empty()) {
    const auto end = std::min(unit.find_first_of(between), unit.size());
    const auto hat = std::min(unit.find('^'), end);
    const auto one = unit.substr(0, hat);
    const auto known = std::find_if(std::begin(units), std::end(units),
                                    [&](const auto& u) { return u.first == one; });
    if (!one.empty() && known == std::end(units)) return {name};
    const auto power = as_number(unit.substr(std::min(hat + 1, end), end - std::min(hat + 1, end)));
    if (!one.empty() && known->second != 1)
      heading.factor *= std::pow(known->second, (below ? -1 : 1) * power.value_or(1));
    below = below || (end < unit.size() && unit[end] == '/');
    unit.remove_prefix(std::min(end + 1, unit.size()));
  }
  return heading;
}

[[noreturn]] void fail(const std::string& where, const std::string& why) {
  throw InvalidArgument(where + ": " + why);
}

/// The separator that is most frequent in the line of names.
char separator_of(std::string_view names) {
  char best = ',';
  for (const char c : {',', ';', '\t'})
    if (std::count(names.begin(), names.end(), c) > std::count(names.begin(), names.end(), best))
      best = c;
  return best;
}

}  // namespace

CsvTable::CsvTable(std::string path, const std::string& text) : path_(std::move(path)) {
  std::vector<std::pair<Column*, double>> order;  // with the factors of their units
  char separator = ',';
  std::size_t line = 0;
  const std::string_view byte_order_mark = "\xEF\xBB\xBF";
  for (std::size_t from = text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
       from < text.size();) {
    const auto to = std::min(text.find('\n', from), text.size());
    const std::string_view all = std::string_view(text).substr(from, to - from);
    from = to + 1;
    ++line;
    if (without_edges(all).empty() || without_edges(all).front() == '#') continue;
    const std::string where = place(line);
    if (order.empty()) {
      separator = separator_of(all);
      names_line_ = line;
      const auto cells = cells_of(all, separator);
      if (std::all_of(cells.begin(), cells.end(),
                      [](const auto cell) { return as_number(cell).has_value(); }))
        fail(where, "the line has numbers, expected the names of the columns in the first line");
      for (const auto name : cells) {
        if (name.empty()) fail(where, "a column has no name, expected names in the first line");
        const Heading heading = without_unit(name);
        auto [at, is_new] = columns_.try_emplace(std::string(heading.name));
        const double factor = is_new ? heading.factor : 1;
        if (!is_new) std::tie(at, is_new) = columns_.try_emplace(std::string(name));
        if (!is_new) fail(where, "two columns are called '" + std::string(name) + "'");
        order.emplace_back(&at->second, factor);
      }
      continue;
    }
    const auto cells = cells_of(all, separator);
    if (cells.size() != order.size())
      fail(where, "the row has " + std::to_string(cells.size()) + " numbers, expected " +
                      std::to_string(order.size()) + ", as many as there are names");
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const double x = number_in(cells[k], separator == ',' ? '\0' : ',').value_or(NAN);
      const auto& [column, factor] = order[k];
      if (!std::isfinite(x)) column->no_number[rows()] = std::string(cells[k]);
      column->values.push_back(x * factor);
    }
    lines_.push_back(line);
  }
}

std::vector<std::string> CsvTable::names() const {
  std::vector<std::string> all;
  for (const auto& [name, column] : columns_) all.push_back(name);
  return all;
}

bool CsvTable::has(const std::string& name) const {
  return columns_.contains(name) || columns_.contains(std::string(without_unit(name).name));
}

std::vector<double> CsvTable::column(const std::string& name) const {
  auto found = columns_.find(name);
  if (found == columns_.end()) found = columns_.find(std::string(without_unit(name).name));
  if (found == columns_.end()) {
    Names known;
    for (const auto& [key, column] : columns_) known.push_back(key);
    fail(header(), "there is no column '" + name + "', the nearest one is '" +
                       std::string(known.empty() ? "" : nearest(name, known)) + "'");
  }
  const Column& c = found->second;
  if (!c.no_number.empty())
    fail(at(c.no_number.begin()->first),
         "'" + name + "' is '" + c.no_number.begin()->second + "', expected a finite number");
  return c.values;
}

std::string CsvTable::place(std::size_t line) const { return path_ + ":" + std::to_string(line); }
std::string CsvTable::header() const { return place(names_line_); }
std::string CsvTable::at(std::size_t row) const { return place(lines_[row]); }

}  // namespace porthos
