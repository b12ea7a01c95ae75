#include "scene/judge/trajectory_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "phs/error.h"
#include "scene/files/digest.h"
#include "scene/files/files.h"
#include "scene/read/output.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

constexpr std::string_view hdf5_signature = "\x89HDF\r\n\x1a\n";

}  // namespace

TrajectoryTable::TrajectoryTable(const std::filesystem::path& path) : path_(path) {
  const std::string text = read_file(path);
  digest_ = sha256(text);
  if (text.starts_with(hdf5_signature))
    read_hdf5();
  else
    rows_ = csv_.emplace(path_.string(), text).rows();
  if (rows_ < 2)
    refuse(path_.string(), fmt::format("the file has {} row{} of numbers, expected 2 or more",
                                       rows_, rows_ == 1 ? "" : "s"));
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

bool TrajectoryTable::has(const std::string& column) const {
  return csv_ ? csv_->has(column) : columns_.count(column) > 0;
}

std::vector<std::string> TrajectoryTable::spelled(const std::string& name,
                                                  std::size_t numbers) const {
  if (numbers == 1) return {name};
  std::vector<std::string> bracketed, dotted, lettered = component_suffixes(numbers);
  for (std::size_t k = 0; k < numbers; ++k) {
    bracketed.push_back(fmt::format("{}[{}]", name, k));
    dotted.push_back(fmt::format("{}.{}", name, k));
  }
  for (auto& letter : lettered) letter = name + "." + letter;
  for (const auto& spelling : {dotted, lettered})
    if (!spelling.empty() && has(spelling[0])) return spelling;
  return bracketed;
}

std::vector<std::string> TrajectoryTable::names() const {
  if (csv_) return csv_->names();
  std::vector<std::string> all;
  for (const auto& [name, column] : columns_) all.push_back(name);
  return all;
}

std::vector<std::string> TrajectoryTable::unused() const {
  if (!csv_) return {};
  auto all = names();
  std::erase_if(all, [&](const std::string& name) { return used_.contains(name); });
  return all;
}

std::vector<double> TrajectoryTable::column(const std::string& name) const {
  used_.insert(name);
  if (csv_) return csv_->column(name);
  const auto found = columns_.find(name);
  if (found == columns_.end()) {
    Names known;
    for (const auto& [key, column] : columns_) known.push_back(key);
    refuse(path_.string(), fmt::format("there is no column '{}', the nearest one is '{}'", name,
                                       known.empty() ? "" : nearest(name, known)));
  }
  const Column& c = found->second;
  std::vector<double> values, all(std::size_t(hdf5_->dataset(c.dataset).size()));
  hdf5_->read(c.dataset, all.data());
  if (all.size() != rows_ * c.of)
    refuse(path_.string(), fmt::format("'{}' has {} rows, expected {}, as many as the longest",
                                       c.dataset, all.size() / c.of, rows_));
  for (std::size_t i = 0; i < rows_; ++i) {
    values.push_back(all[i * c.of + c.at]);
    if (!std::isfinite(values[i]))
      refuse(at(i), fmt::format("'{}' is '{}', expected a finite number", name, values[i]));
  }
  return values;
}

std::string TrajectoryTable::at(std::size_t row) const {
  return csv_ ? csv_->at(row) : fmt::format("{}: row {}", path_.string(), row);
}

std::string ask_about_degrees(double largest_angle) {
  if (!(largest_angle > 4 * M_PI)) return "";
  return fmt::format(
      "joints turn to {:.4g} rad, more than two turns: are angles and rates in degrees? expected "
      "radians",
      largest_angle);
}

}  // namespace porthos::scene
