#include "scene/judge/trajectory_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

constexpr std::string_view hdf5_signature = "\x89HDF\r\n\x1a\n";

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

TrajectoryTable::TrajectoryTable(const std::filesystem::path& path) : path_(path) {
  const std::string text = read_file(path);
  text.starts_with(hdf5_signature) ? read_hdf5() : read_csv(text);
  if (rows_ < 2)
    refuse(path_.string(), fmt::format("the file has {} row{} of numbers, expected 2 or more",
                                       rows_, rows_ == 1 ? "" : "s"));
}

void TrajectoryTable::read_csv(const std::string& text) {
  std::vector<Column*> order;
  char separator = ',';
  std::size_t line = 0;
  for (std::size_t from = 0; from < text.size();) {
    const auto to = std::min(text.find('\n', from), text.size());
    const std::string_view all = std::string_view(text).substr(from, to - from);
    from = to + 1;
    ++line;
    if (without_edges(all).empty() || without_edges(all).front() == '#') continue;
    const std::string where = fmt::format("{}:{}", path_.string(), line);
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
      if (!std::isfinite(x)) order[k]->no_number[rows_] = std::string(cells[k]);
      order[k]->values.push_back(x);
    }
    lines_.push_back(line);
    ++rows_;
  }
}

void TrajectoryTable::read_hdf5() {
  hdf5_ = std::make_unique<Hdf5Reader>(path_);
  for (const auto& [name, d] : hdf5_->datasets()) {
    if (d.kind == Hdf5Reader::Kind::text || d.shape.empty() || d.shape.size() > 2) continue;
    const auto rows = std::size_t(d.shape[0]),
               of = d.shape.size() == 2 ? std::size_t(d.shape[1]) : 1;
    rows_ = std::max(rows_, rows);
    for (std::size_t k = 0; k < of; ++k)
      columns_[d.shape.size() == 2 ? fmt::format("{}[{}]", name, k) : name] = {name, k, of};
  }
}

std::vector<double> TrajectoryTable::column(const std::string& name) const {
  const auto found = columns_.find(name);
  if (found == columns_.end()) {
    Names known;
    for (const auto& [key, column] : columns_) known.push_back(key);
    refuse(path_.string() + (hdf5_ ? "" : ":1"),
           fmt::format("there is no column '{}', the nearest one is '{}'", name,
                       known.empty() ? "" : nearest(name, known)));
  }
  const Column& c = found->second;
  std::vector<double> values = c.values;
  std::map<std::size_t, std::string> wrong = c.no_number;
  if (hdf5_) {
    std::vector<double> all(std::size_t(hdf5_->dataset(c.dataset).size()));
    hdf5_->read(c.dataset, all.data());
    if (all.size() != rows_ * c.of)
      refuse(path_.string(), fmt::format("'{}' has {} rows, expected {}, as many as the longest",
                                         c.dataset, all.size() / c.of, rows_));
    for (std::size_t i = 0; i < rows_; ++i) {
      values.push_back(all[i * c.of + c.at]);
      if (!std::isfinite(values[i])) wrong.try_emplace(i, fmt::format("{}", values[i]));
    }
  }
  if (!wrong.empty())
    refuse(at(wrong.begin()->first),
           fmt::format("'{}' is '{}', expected a finite number", name, wrong.begin()->second));
  return values;
}

std::string TrajectoryTable::at(std::size_t row) const {
  return hdf5_ ? fmt::format("{}: row {}", path_.string(), row)
               : fmt::format("{}:{}", path_.string(), lines_[row]);
}

}  // namespace porthos::scene
