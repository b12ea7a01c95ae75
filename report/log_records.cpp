#include <fmt/format.h>

#include <algorithm>

#include "phs/error.h"
#include "report/records.h"
#include "scene/run/columns.h"

namespace porthos::report {
namespace {

using scene::Column;
using scene::RecordLayout;

class LogRecords : public Records {
 public:
  LogRecords(const std::filesystem::path& path, const phs::Description& d, RecordLayout layout)
      : path_(path),
        layout_(std::move(layout)),
        columns_(scene::columns_of(d, layout_)),
        turns_(scene::turn_names(d)) {
    scene::RecordReader reader(path_, layout_);
    trouble_ = reader.read_sound();
    count_ = reader.mark().records;
  }
  std::string trouble() const override { return trouble_; }
  std::int64_t count() const override { return count_; }
  bool has(const std::string& name) const override { return find(name) != columns_.end(); }
  std::vector<std::string> names(const std::string& group) const override {
    std::vector<std::string> list;
    for (const auto& p : columns_)
      if (p.name.rfind(group + "/", 0) == 0) list.push_back(p.name.substr(group.size() + 1));
    return list;
  }
  std::string unit(const std::string& name) const override {
    const auto c = find(name);
    return c == columns_.end() ? "" : c->unit;
  }
  std::vector<std::string> turn_names() const override { return turns_; }
  std::string text(const std::string&) const override { return ""; }
  void read(const std::string& name, const Piece& f) const override {
    const auto p = find(name);
    if (p == columns_.end())
      throw InvalidArgument(fmt::format("{} has no series '{}'", path_.string(), name));
    scene::RecordReader reader(path_, layout_);
    std::vector<double> rows, values;
    for (std::int64_t first = 0; first < count_;) {
      const auto n =
          std::int64_t(reader.read(rows, size_t(std::min<std::int64_t>(4096, count_ - first))));
      if (n == 0) break;
      values.clear();
      for (std::int64_t i = 0; i < n; ++i)
        for (size_t c = 0; c < p->columns; ++c) {
          const double v = rows[size_t(i) * layout_.size() + p->first + c];
          values.push_back(p->integer ? double(scene::integer(v)) : v);
        }
      f(first, n, int(p->columns), values.data());
      first += n;
    }
  }

 private:
  std::vector<Column>::const_iterator find(const std::string& name) const {
    return std::find_if(columns_.begin(), columns_.end(),
                        [&](const Column& p) { return p.name == name; });
  }
  std::filesystem::path path_;
  RecordLayout layout_;
  std::vector<Column> columns_;
  std::vector<std::string> turns_;
  std::int64_t count_ = 0;
  std::string trouble_;
};

}  // namespace

std::unique_ptr<Records> open_log(const std::filesystem::path& path, const phs::Description& model,
                                  const scene::RecordLayout& layout) {
  return std::make_unique<LogRecords>(path, model, layout);
}

}  // namespace porthos::report
