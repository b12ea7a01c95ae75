#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "scene/read/scene_texts.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

/// The time series of a run, by their names in docs/results.md, from any source.
class Records {
 public:
  virtual ~Records() = default;
  virtual std::int64_t count() const = 0;
  /// Names of the datasets below a group ("stored"), in the order of the file; empty: no such
  /// group.
  virtual std::vector<std::string> names(const std::string& group) const = 0;
  /// The unit of a series; empty if it has none.
  virtual std::string unit(const std::string& name) const = 0;
  virtual bool has(const std::string& name) const = 0;
  /// What is damaged behind the records; "" if nothing is.
  virtual std::string trouble() const { return {}; }
  /// The names behind the columns of a series, as of "turns"; empty if it has none.
  virtual std::vector<std::string> columns(const std::string& name) const = 0;
  /// Whole texts of scene file and model; empty if not known.
  virtual std::string text(const std::string& name) const = 0;
  /// The texts of the scene, empty if they are not known.
  SceneTexts scene() const;
  /// Calls f(first row, rows, columns per row, values) for consecutive pieces of a dataset, in
  /// order; integers as double.
  /// @throws InvalidArgument naming file and dataset where it cannot be read
  using Piece =
      std::function<void(std::int64_t first, std::int64_t rows, int columns, const double* values)>;
  virtual void read(const std::string& name, const Piece& f) const = 0;

  /// A series at rows in order, one row after another; empty: there is no such series.
  /// @throws InvalidArgument as read()
  std::vector<double> at(const std::string& name, const std::vector<std::int64_t>& rows) const;
  /// A series of one number a record. @throws InvalidArgument as read(), and if it has more
  std::vector<double> column(const std::string& name) const;
};

/// Records of a finished run. @throws InvalidArgument if the file cannot be opened or is no run of
/// Porthos
std::unique_ptr<Records> open_run_file(const std::filesystem::path& path);

/// Records of a run that is in progress or was interrupted: its log, as far as it was written, with
/// its model.
/// @param rows  those alone, in order, kept in memory; empty: all
/// @throws InvalidArgument if it cannot be read
std::unique_ptr<Records> open_log(const std::filesystem::path& path, const phs::Description& model,
                                  const RecordLayout& layout,
                                  const std::vector<std::int64_t>& rows = {});

}  // namespace porthos::scene
