#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "phs/csv_table.h"
#include "scene/files/hdf5_reader.h"

namespace porthos::scene {

/// Columns of numbers by name, from a file of another program: CSV with the names in its first
/// line, or HDF5, whose datasets are columns "name" or, with several numbers per row, "name[0]",
/// "name[1]", ...
class TrajectoryTable {
 public:
  /// @throws InvalidArgument with file and line: no such file, no names, no rows, a row that is too
  /// long or too short
  explicit TrajectoryTable(const std::filesystem::path& path);

  std::size_t rows() const { return rows_; }
  /// SHA-256 of the file as it was read.
  const std::string& digest() const { return digest_; }
  bool has(const std::string& column) const;
  /// The names of the columns of a vector, as the file spells them: "name[0]", "name.0" as
  /// porthos export does, or "name.x" and, of a quaternion, "name.w". Of one number: the name.
  std::vector<std::string> spelled(const std::string& name, std::size_t numbers) const;
  /// The names of its columns, sorted.
  std::vector<std::string> names() const;
  /// @throws InvalidArgument for a missing column (names the nearest one), and with file and line
  /// for a value in it that is not a finite number
  std::vector<double> column(const std::string& name) const;
  /// Columns of a CSV file for which nobody has asked.
  std::vector<std::string> unused() const;
  /// Place of a row: "run.csv:17", or "run.h5: row 16".
  std::string at(std::size_t row) const;

 private:
  struct Column {
    std::string dataset;
    std::size_t at = 0, of = 1;  ///< which number of a row
  };
  void read_hdf5();

  std::filesystem::path path_;
  std::size_t rows_ = 0;
  mutable std::set<std::string> used_;
  std::optional<CsvTable> csv_;
  std::map<std::string, Column> columns_;  ///< of HDF5
  std::unique_ptr<Hdf5Reader> hdf5_;
  std::string digest_;
};

/// What to ask of angles [rad] that disagree with a motion. Empty up to two turns.
std::string ask_about_degrees(double largest_angle);

}  // namespace porthos::scene
