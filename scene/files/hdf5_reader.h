#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace porthos::scene {

/// The time series in a results folder: run.h5, or that of each phase in order.
/// @throws InvalidArgument where there are none
std::vector<std::filesystem::path> series_files(const std::filesystem::path& folder);

/// Reads an HDF5 file as written by Hdf5File. Ids are closed by their owners. Threads may have
/// readers of their own.
class Hdf5Reader {
 public:
  /// @throws InvalidArgument "cannot read <path>: ..." as every function here: there is no such
  /// file or dataset, or the file is not HDF5, truncated or damaged
  explicit Hdf5Reader(const std::filesystem::path& path);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  enum class Kind { real, integer, text };
  struct Dataset {
    Kind kind = Kind::real;
    std::vector<std::int64_t> shape;  ///< rows, or rows and columns
    bool filled = true;               ///< false: the file declares more data than it holds
    std::int64_t size() const;
  };
  /// Every dataset by its path ("state/elbow"), ordered by name.
  const std::map<std::string, Dataset>& datasets() const { return datasets_; }
  /// @throws InvalidArgument for an unknown name; the message lists similar names
  const Dataset& dataset(const std::string& name) const;

  /// The whole dataset, row by row. to: dataset(name).size() numbers.
  void read(const std::string& name, double* to) const;
  void read(const std::string& name, std::int64_t* to) const;
  /// Reads some rows only: rows × columns numbers.
  void read_rows(const std::string& name, std::int64_t first, std::int64_t rows, double* to) const;
  std::string text(const std::string& name) const;

  /// Attributes of a dataset or group ("/" is the file).
  std::map<std::string, std::string> texts(const std::string& object) const;
  std::map<std::string, double> numbers(const std::string& object) const;

 private:
  [[noreturn]] void refuse(const std::string& why) const;
  std::filesystem::path path_;
  std::int64_t file_ = -1;  ///< hid_t
  std::map<std::string, Dataset> datasets_;
};

}  // namespace porthos::scene
