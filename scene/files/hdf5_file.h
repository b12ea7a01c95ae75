#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace porthos::scene {

/// A new HDF5 file, by the serial C API. Ids are closed by their owners. Object times are not
/// stored: equal content gives equal files. All of it has checksums.
/// Threads may have files of their own.
class Hdf5File {
 public:
  using Id = std::int64_t;  ///< hid_t
  /// @throws IoError "cannot write <path>: ...", as every function here
  explicit Hdf5File(const std::filesystem::path& path);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  void group(const std::string& name);

  /// A chunked, shuffled, deflated dataset with checksums, of rows × columns; columns = 0 makes a
  /// vector of `rows` numbers.
  enum class Kind { real, integer };
  class Dataset {
   public:
    Dataset(Dataset&& other) noexcept
        : file_(other.file_), id_(other.id_), columns_(other.columns_) {
      other.id_ = -1;
    }
    Dataset(const Dataset&) = delete;
    ~Dataset();
    void write(std::int64_t first_row, std::span<const double> values);
    void write(std::int64_t first_row, std::span<const std::int64_t> values);
    void attribute(const std::string& name, const std::string& text);
    void attribute(const std::string& name, double value);

   private:
    friend class Hdf5File;
    Dataset(const Hdf5File* file, Id id, std::int64_t columns)
        : file_(file), id_(id), columns_(columns) {}
    void write_rows(std::int64_t first_row, std::size_t count, const void* values, Id type);
    const Hdf5File* file_;
    Id id_;
    std::int64_t columns_;
  };
  Dataset dataset(const std::string& name, std::int64_t rows, std::int64_t columns, Kind kind);

  /// A dataset of one string, of any length, with its SHA-256 as an attribute.
  void text(const std::string& name, const std::string& content);
  void attribute(const std::string& object, const std::string& name, const std::string& text);
  void attribute(const std::string& object, const std::string& name, double value);

  /// Completes the file and flushes it to the disk.
  void close();

 private:
  void require(bool ok) const;
  std::filesystem::path path_;
  Id file_ = -1;
  /// A dataset may write its last piece when it is closed: close() throws if that failed.
  mutable int failed_ = 0;  ///< errno, -1 if there is none; 0: nothing failed
};

/// The name of an object in a file for a name: '/' is replaced, because it would open a group.
std::string link_name(std::string name);

}  // namespace porthos::scene
