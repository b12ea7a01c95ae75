#include <fmt/format.h>

#include <algorithm>

#include "phs/error.h"
#include "scene/run/columns.h"
#include "scene/session/records.h"

namespace porthos::scene {
namespace {

class LogRecords : public Records {
 public:
  LogRecords(const std::filesystem::path& path, const phs::Description& d, RecordLayout layout,
             const std::vector<std::int64_t>& shown)
      : path_(path),
        layout_(std::move(layout)),
        columns_(columns_of(d, layout_)),
        turns_(turn_names(d)) {
    if (shown.empty()) {
      RecordReader reader(path_, layout_);
      trouble_ = reader.read_sound();
      count_ = reader.mark().records;
      return;
    }
    std::int64_t at = 0;
    each_record(path_, layout_, [&](std::span<const double> row) {
      if (size_t(count_) == shown.size() || shown[size_t(count_)] != at++) return;
      kept_.insert(kept_.end(), row.begin(), row.end());
      ++count_;
    });
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
  std::vector<std::string> columns(const std::string& name) const override {
    return name == "turns" ? turns_ : std::vector<std::string>();
  }
  std::string text(const std::string&) const override { return ""; }
  void read(const std::string& name, const Piece& f) const override {
    const auto p = find(name);
    if (p == columns_.end())
      throw InvalidArgument(fmt::format("{} has no series '{}'", path_.string(), name));
    if (!kept_.empty()) return give(*p, kept_, 0, count_, f);
    RecordReader reader(path_, layout_);
    std::vector<double> rows;
    for (std::int64_t first = 0; first < count_;) {
      const auto n =
          std::int64_t(reader.read(rows, size_t(std::min<std::int64_t>(4096, count_ - first))));
      if (n == 0) break;
      give(*p, rows, first, n, f);
      first += n;
    }
  }

 private:
  void give(const Column& c, const std::vector<double>& rows, std::int64_t first, std::int64_t n,
            const Piece& f) const {
    std::vector<double> values;
    for (size_t i = 0; i < size_t(n); ++i)
      for (size_t k = 0; k < c.columns; ++k) {
        const double v = rows[i * layout_.size() + c.first + k];
        values.push_back(c.integer ? double(integer(v)) : v);
      }
    f(first, n, int(c.columns), values.data());
  }
  std::vector<Column>::const_iterator find(const std::string& name) const {
    return std::find_if(columns_.begin(), columns_.end(),
                        [&](const Column& p) { return p.name == name; });
  }
  std::filesystem::path path_;
  RecordLayout layout_;
  std::vector<Column> columns_;
  std::vector<std::string> turns_;
  std::vector<double> kept_;  ///< rows in place of those of the log
  std::int64_t count_ = 0;
  std::string trouble_;
};

}  // namespace

std::unique_ptr<Records> open_log(const std::filesystem::path& path, const phs::Description& model,
                                  const RecordLayout& layout,
                                  const std::vector<std::int64_t>& rows) {
  return std::make_unique<LogRecords>(path, model, layout, rows);
}

}  // namespace porthos::scene
