#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace porthos {

/// Columns of numbers by name, from a text with the names in its first line. Commas, semicolons or
/// tabs separate cells, whichever is most frequent among the names. Where it is not the comma, a
/// number may have a decimal comma, as a spreadsheet writes it. Lines that begin with # and empty
/// ones are passed over, as is a byte-order mark. A unit behind a name, "q [rad]" or "torque (Nm)",
/// is no part of it; numbers in ms, us, mm, mrad, mNm or deg, "v [deg/s]", become those of Porthos.
class CsvTable {
 public:
  /// @param path  of the text, in messages
  /// @throws InvalidArgument with file and line: a column without a name or two of one name, a row
  /// that is too long or too short
  CsvTable(std::string path, const std::string& text);

  std::size_t rows() const { return lines_.size(); }
  bool has(const std::string& column) const;
  /// The names of its columns, sorted.
  std::vector<std::string> names() const;
  /// @throws InvalidArgument for a missing column (names the nearest one), and with file and line
  /// for a value in it that is not a finite number
  std::vector<double> column(const std::string& name) const;
  /// Place of a row: "run.csv:17".
  std::string at(std::size_t row) const;
  /// Place of the line of names.
  std::string header() const;

 private:
  std::string place(std::size_t line) const;
  struct Column {
    std::vector<double> values;
    std::map<std::size_t, std::string> no_number;  ///< the text there, by row
  };
  std::string path_;
  std::map<std::string, Column> columns_;
  std::size_t names_line_ = 1;
  std::vector<std::size_t> lines_;  ///< of each row
};

}  // namespace porthos
