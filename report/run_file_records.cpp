#include <fmt/format.h>

#include <algorithm>

#include "phs/error.h"
#include "report/records.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"

namespace porthos::report {
namespace {

constexpr std::int64_t rows_at_once = 1 << 16;

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
  std::vector<std::string> turn_names() const override {
    if (!has("turns")) return {};
    return scene::lines_of(file_.texts("turns")["columns"]);
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
    for (std::int64_t first = 0; first < count_; first += rows_at_once) {
      const std::int64_t rows = std::min(rows_at_once, count_ - first);
      values.resize(size_t(rows * columns));
      file_.read_rows(name, first, rows, values.data());
      f(first, rows, columns, values.data());
    }
  }

 private:
  std::string path_;
  scene::Hdf5Reader file_;
  std::int64_t count_ = 0;
};

}  // namespace

std::unique_ptr<Records> open_run_file(const std::filesystem::path& path) {
  return std::make_unique<RunFileRecords>(path);
}

}  // namespace porthos::report
