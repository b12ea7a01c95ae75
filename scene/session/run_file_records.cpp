#include <fmt/format.h>

#include <algorithm>

#include "phs/error.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"
#include "scene/session/records.h"

namespace porthos::scene {
namespace {

constexpr std::int64_t rows_in_a_piece = 1 << 16;

class RunFileRecords : public Records {
 public:
  explicit RunFileRecords(const std::filesystem::path& path) : path_(path.string()), file_(path) {
    if (!has("time")) throw InvalidArgument(fmt::format("{} is no run of Porthos", path_));
    count_ = file_.dataset("time").size();
  }
  std::int64_t count() const override { return count_; }
  bool has(const std::string& name) const override { return file_.datasets().count(name) > 0; }
  std::vector<std::string> names(const std::string& group) const override {
    std::vector<std::string> list;
    for (const auto& [name, what] : file_.datasets())
      if (name.rfind(group + "/", 0) == 0) list.push_back(name.substr(group.size() + 1));
    return list;
  }
  std::string unit(const std::string& name) const override {
    return has(name) ? file_.texts(name)["unit"] : "";
  }
  std::vector<std::string> columns(const std::string& name) const override {
    return has(name) ? lines_of(file_.texts(name)["columns"]) : std::vector<std::string>();
  }
  std::string text(const std::string& name) const override {
    return has(name) ? file_.text(name) : "";
  }
  void read(const std::string& name, const Piece& f) const override {
    const auto& shape = file_.dataset(name).shape;
    if (shape.empty() || shape[0] != count_)
      throw InvalidArgument(
          fmt::format("{}: '{}' is no series of {} records as 'time'", path_, name, count_));
    const int columns = shape.size() > 1 ? int(shape[1]) : 1;
    std::vector<double> values;
    for (std::int64_t first = 0; first < count_; first += rows_in_a_piece) {
      const std::int64_t rows = std::min(rows_in_a_piece, count_ - first);
      values.resize(size_t(rows * columns));
      file_.read_rows(name, first, rows, values.data());
      f(first, rows, columns, values.data());
    }
  }

 private:
  std::string path_;
  Hdf5Reader file_;
  std::int64_t count_ = 0;
};

}  // namespace

SceneTexts Records::scene() const {
  return {text("provenance/scene"), text("provenance/model"),
          input_files(text("provenance/files"))};
}

std::vector<double> Records::at(const std::string& name,
                                const std::vector<std::int64_t>& rows) const {
  std::vector<double> some;
  if (!has(name)) return some;
  size_t k = 0;
  read(name, [&](std::int64_t first, std::int64_t n, int columns, const double* v) {
    for (; k < rows.size() && rows[k] < first + n; ++k) {
      const double* row = v + (rows[k] - first) * columns;
      some.insert(some.end(), row, row + columns);
    }
  });
  return some;
}

std::vector<double> Records::column(const std::string& name) const {
  std::vector<double> all;
  read(name, [&](std::int64_t, std::int64_t n, int columns, const double* v) {
    if (columns != 1)
      throw InvalidArgument(fmt::format(
          "run.h5 is damaged: {} has {} numbers a record, expected one", name, columns));
    all.insert(all.end(), v, v + n);
  });
  return all;
}

std::unique_ptr<Records> open_run_file(const std::filesystem::path& path) {
  return std::make_unique<RunFileRecords>(path);
}

}  // namespace porthos::scene
