#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <sstream>

#include "phs/error.h"
#include "report/records.h"

namespace porthos::report {
namespace {

constexpr std::int64_t rows_at_once = 1 << 16;

/// Closes an id of any kind.
class Owned {
 public:
  explicit Owned(hid_t id) : id_(id) {}
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  operator hid_t() const { return id_; }
  bool ok() const { return id_ >= 0; }

 private:
  hid_t id_;
};

std::string string_of(hid_t type, const std::function<bool(hid_t, void*)>& read) {
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) return "";
  std::string text(H5Tget_size(type), '\0');
  if (!read(type, text.data())) return "";
  text.resize(std::min(text.size(), text.find_last_not_of('\0') + 1));
  return text;
}

herr_t collect(hid_t, const char* name, const H5L_info_t*, void* to) {
  static_cast<std::vector<std::string>*>(to)->emplace_back(name);
  return 0;
}

class RunFileRecords : public Records {
 public:
  explicit RunFileRecords(const std::filesystem::path& path)
      : path_(path.string()), file_(open(path)) {
    if (!file_.ok()) throw InvalidArgument(fmt::format("{} cannot be opened as HDF5", path_));
    if (!has("time")) throw InvalidArgument(fmt::format("{} is no run of Porthos", path_));
    count_ = shape("time").first;
  }
  std::int64_t count() const override { return count_; }
  bool has(const std::string& name) const override {
    const auto slash = name.find('/');
    if (slash != name.npos && H5Lexists(file_, name.substr(0, slash).c_str(), H5P_DEFAULT) <= 0)
      return false;
    return H5Lexists(file_, name.c_str(), H5P_DEFAULT) > 0;
  }
  std::vector<std::string> names(const std::string& group) const override {
    std::vector<std::string> list;
    if (!has(group)) return list;
    const Owned g(H5Gopen2(file_, group.c_str(), H5P_DEFAULT));
    if (g.ok()) H5Literate(g, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &list);
    return list;
  }
  std::vector<std::string> turn_names() const override {
    std::vector<std::string> list;
    if (!has("turns")) return list;
    const Owned d(H5Dopen2(file_, "turns", H5P_DEFAULT));
    const Owned a(H5Aopen(d, "columns", H5P_DEFAULT));
    if (!a.ok()) return list;
    const Owned type(H5Aget_type(a));
    std::istringstream words(
        string_of(type, [&](hid_t t, void* to) { return H5Aread(a, t, to) >= 0; }));
    for (std::string line; std::getline(words, line);) list.push_back(line);
    return list;
  }
  std::string text(const std::string& name) const override {
    if (!has(name)) return "";
    const Owned d(H5Dopen2(file_, name.c_str(), H5P_DEFAULT));
    const Owned type(H5Dget_type(d));
    return string_of(type, [&](hid_t t, void* to) {
      return H5Dread(d, t, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) >= 0;
    });
  }
  void read(const std::string& name, const Piece& f) const override {
    const auto [rows, columns] = shape(name);
    if (rows != count_)
      throw InvalidArgument(
          fmt::format("{}: '{}' has {} records, expected {} as 'time'", path_, name, rows, count_));
    const Owned d(H5Dopen2(file_, name.c_str(), H5P_DEFAULT)), all(H5Dget_space(d));
    const int rank = columns > 0 ? 2 : 1, width = std::max(1, columns);
    std::vector<double> values;
    for (std::int64_t first = 0; first < rows; first += rows_at_once) {
      const std::int64_t n = std::min(rows_at_once, rows - first);
      values.resize(size_t(n * width));
      const hsize_t start[2] = {hsize_t(first), 0}, size[2] = {hsize_t(n), hsize_t(width)};
      const Owned part(H5Screate_simple(rank, size, nullptr));
      H5Sselect_hyperslab(all, H5S_SELECT_SET, start, nullptr, size, nullptr);
      if (H5Dread(d, H5T_NATIVE_DOUBLE, part, all, H5P_DEFAULT, values.data()) < 0)
        throw InvalidArgument(
            fmt::format("{} is damaged: '{}' cannot be read from record {}", path_, name, first));
      f(first, n, width, values.data());
    }
  }

 private:
  static hid_t open(const std::filesystem::path& path) {
    static const bool no_exit_handler = H5dont_atexit() >= 0;  // as scene/hdf5_file.cpp
    static_cast<void>(no_exit_handler);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    return H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  }
  /// Rows, and columns or 0.
  std::pair<std::int64_t, int> shape(const std::string& name) const {
    const Owned d(H5Dopen2(file_, name.c_str(), H5P_DEFAULT));
    if (!d.ok()) throw InvalidArgument(fmt::format("{} has no dataset '{}'", path_, name));
    const Owned space(H5Dget_space(d));
    hsize_t size[8] = {0, 0};
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank < 1 || rank > 2 || H5Sget_simple_extent_dims(space, size, nullptr) < 0)
      throw InvalidArgument(fmt::format("{}: '{}' is no series of records", path_, name));
    return {std::int64_t(size[0]), rank == 2 ? int(size[1]) : 0};
  }

  std::string path_;
  Owned file_;
  std::int64_t count_ = 0;
};

}  // namespace

std::unique_ptr<Records> open_run_file(const std::filesystem::path& path) {
  return std::make_unique<RunFileRecords>(path);
}

}  // namespace porthos::report
