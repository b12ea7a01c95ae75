#include "scene/read/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "phs/error.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
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
  std::vector<Column*> order;
  char separator = ',';
  std::size_t line = 0;
  for (std::size_t from = 0; from < text.size();) {
    const auto to = std::min(text.find('\n', from), text.size());
    const std::string_view all = std::string_view(text).substr(from, to - from);
    from = to + 1;
    ++line;
    if (without_edges(all).empty() || without_edges(all).front() == '#') continue;
    const std::string where = fmt::format("{}:{}", path_, line);
    if (order.empty()) {
      separator = separator_of(all);
      for (const auto name : cells_of(all, separator)) {
        if (name.empty()) refuse(where, "a column has no name, expected names in the first line");
        const auto [at, is_new] = columns_.try_emplace(std::string(name));
        if (!is_new) refuse(where, fmt::format("two columns are called '{}'", name));
        order.push_back(&at->second);
      }
      continue;
    }
    const auto cells = cells_of(all, separator);
    if (cells.size() != order.size())
      refuse(where, fmt::format("the row has {} numbers, expected {}, as many as there are names",
                                cells.size(), order.size()));
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const double x = as_number(cells[k]).value_or(NAN);
      if (!std::isfinite(x)) order[k]->no_number[rows()] = std::string(cells[k]);
      order[k]->values.push_back(x);
    }
    lines_.push_back(line);
  }
}

std::vector<std::string> CsvTable::names() const {
  std::vector<std::string> all;
  for (const auto& [name, column] : columns_) all.push_back(name);
  return all;
}

std::vector<double> CsvTable::column(const std::string& name) const {
  const auto found = columns_.find(name);
  if (found == columns_.end()) {
    Names known;
    for (const auto& [key, column] : columns_) known.push_back(key);
    refuse(path_ + ":1", fmt::format("there is no column '{}', the nearest one is '{}'", name,
                                     known.empty() ? "" : nearest(name, known)));
  }
  const Column& c = found->second;
  if (!c.no_number.empty())
    refuse(at(c.no_number.begin()->first), fmt::format("'{}' is '{}', expected a finite number",
                                                       name, c.no_number.begin()->second));
  return c.values;
}

std::string CsvTable::at(std::size_t row) const { return fmt::format("{}:{}", path_, lines_[row]); }

}  // namespace porthos::scene
