#include "scene/session/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include "phs/error.h"
#include "phs/system/state.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"
#include "scene/read/output.h"
#include "scene/session/results.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
constexpr std::int64_t rows_per_read = 1024;

/// A number of each record: a column of a series of run.h5.
struct Number {
  std::string series, name, unit;  ///< "output/tip", "output/tip.x", " [m]"
  std::int64_t at = 0;
  /// Whether a name is that of the number, of its series or of a group; "output/tip.0" too.
  bool is(const std::string& asked) const {
    return series == asked || series.starts_with(asked + "/") || name == asked ||
           fmt::format("{}.{}", series, at) == asked;
  }
  bool operator==(const Number&) const = default;
};

/// The columns of a series in a file.
struct Source {
  std::int64_t columns = 0, turns = -1;  ///< turns: the column with those of this angle
  std::vector<double> now;               ///< of the rows that were read last
};

class PhaseFile {
 public:
  explicit PhaseFile(const fs::path& run) : file_(run) {
    if (!file_.datasets().count("turns")) return;
    turns_ = lines_of(file_.texts("turns")["columns"]);
    const std::vector<std::int64_t> shape{records(), std::int64_t(turns_.size())};
    if (file_.dataset("turns").shape != shape) turns_.clear();  // a damaged file: as recorded
  }
  std::int64_t records() const { return file_.dataset("time").size(); }

  /// Adds the numbers of the series that `wanted` has, if they are not there yet.
  void add_to(std::vector<Number>& all, const std::vector<std::string>& wanted) const {
    const auto add = [&](const std::string* name) {
      for (const auto& [series, d] : file_.datasets())
        if (is_shown(series))
          for (const Number& n : numbers_of(series))
            if ((!name || n.is(*name)) && std::ranges::find(all, n) == all.end()) all.push_back(n);
    };
    const std::string first = "time";
    add(&first);
    for (const auto& name : wanted) add(&name);
    if (wanted.empty()) add(nullptr);
  }

  void read(std::int64_t first, std::int64_t rows, const std::vector<Number>& numbers) {
    for (size_t i = 0; i < numbers.size(); ++i)
      if (i == 0 || numbers[i].series != numbers[i - 1].series)
        read(numbers[i].series, first, rows);
    if (!turns_.empty()) read("turns", first, rows);
  }
  /// In row `row` of those read last; nan: this phase has no such series.
  double value(const Number& n, std::int64_t row) const {
    const auto found = sources_.find(n.series);
    if (found == sources_.end() || n.at >= found->second.columns) return NAN;
    const Source& s = found->second;
    const double x = s.now[size_t(row * s.columns + n.at)];
    if (s.turns < 0) return x;
    return x +
           phs::two_pi_hi * sources_.at("turns").now[size_t(row) * turns_.size() + size_t(s.turns)];
  }

 private:
  /// One row a record, and no text. Turns are in the angles.
  bool is_shown(const std::string& series) const {
    const auto& d = file_.dataset(series);
    return d.kind != Hdf5Reader::Kind::text && !d.shape.empty() && d.shape[0] == records() &&
           series != "turns" && !series.starts_with("provenance/");
  }
  std::vector<Number> numbers_of(const std::string& series) const {
    const auto& d = file_.dataset(series);
    auto texts = file_.texts(series);
    const std::string unit = texts["unit"].empty() ? "" : fmt::format(" [{}]", texts["unit"]);
    if (d.shape.size() < 2) return {{series, series, unit, 0}};
    const size_t n = size_t(d.shape[1]);
    auto names = lines_of(texts["columns"]);
    if (names.size() != n) names = component_suffixes(n);
    std::vector<Number> all;
    for (size_t k = 0; k < n; ++k)
      all.push_back({series,
                     fmt::format("{}.{}", series, names.empty() ? std::to_string(k) : names[k]),
                     unit, std::int64_t(k)});
    return all;
  }
  void read(const std::string& series, std::int64_t first, std::int64_t rows) {
    if (!file_.datasets().count(series) || !(series == "turns" || is_shown(series))) return;
    const auto& d = file_.dataset(series);
    Source& s = sources_[series];
    s.columns = d.shape.size() > 1 ? d.shape[1] : 1;
    if (series.starts_with("state/")) {
      const auto at = std::ranges::find(turns_, series.substr(6));
      s.turns = at == turns_.end() ? -1 : at - turns_.begin();
    }
    s.now.resize(size_t(rows * s.columns));
    file_.read_rows(series, first, rows, s.now.data());
  }

  Hdf5Reader file_;
  std::vector<std::string> turns_;
  std::map<std::string, Source> sources_;
};

void require_names(const std::vector<Number>& there, const std::vector<std::string>& wanted) {
  for (const auto& name : wanted) {
    if (std::ranges::any_of(there, [&](const Number& n) { return n.is(name); })) continue;
    std::string known;
    for (const Number& n : there)
      if (n.at == 0) add_to_list(known, n.series);
    throw InvalidArgument(
        fmt::format("the run has no series '{}', expected one of {}", name, known));
  }
}

}  // namespace

void export_csv(const fs::path& folder, const fs::path& to, const std::vector<std::string>& names) {
  for (const char* other : {".xlsx", ".xls", ".ods", ".h5", ".mat", ".json"})
    if (to.extension() == other)
      throw InvalidArgument(fmt::format(
          "{} is the name of another kind of file, expected .csv, which spreadsheets open",
          to.string()));
  require_finished(folder);
  std::vector<std::unique_ptr<PhaseFile>> phases;
  for (const fs::path& run : series_files(folder))
    phases.push_back(std::make_unique<PhaseFile>(run));
  std::vector<Number> numbers, all;
  for (const auto& p : phases) {
    p->add_to(numbers, names);
    p->add_to(all, {});
  }
  require_names(all, names);
  if (to.has_parent_path()) make_folder(to.parent_path());
  const std::unique_ptr<std::FILE, FileCloser> file(std::fopen(aside(to).c_str(), "wb"));
  if (!file) cannot_write(aside(to));
  const auto write = [&](const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), file.get()) != text.size())
      cannot_write(aside(to));
  };
  const bool several = phases.size() > 1;
  std::string line = several ? "phase" : "";
  for (const Number& n : numbers) {
    const std::string head = n.name + n.unit;
    line += (line.empty() ? "" : ",") +
            (head.find_first_of(",\"") == std::string::npos ? head : '"' + head + '"');
  }
  write(line + "\n");
  for (size_t k = 0; k < phases.size(); ++k) {
    const std::int64_t records = phases[k]->records();
    for (std::int64_t first = 0; first < records; first += rows_per_read) {
      const std::int64_t rows = std::min(rows_per_read, records - first);
      phases[k]->read(first, rows, numbers);
      std::string text;
      const auto out = std::back_inserter(text);
      for (std::int64_t row = 0; row < rows; ++row) {
        if (several) fmt::format_to(out, "{}", k + 1);
        for (size_t i = 0; i < numbers.size(); ++i) {
          if (i > 0 || several) text += ',';
          if (const double x = phases[k]->value(numbers[i], row); !std::isnan(x))
            fmt::format_to(out, "{}", x);
        }
        text += '\n';
      }
      write(text);
    }
  }
  if (std::fflush(file.get()) != 0) cannot_write(aside(to));
  sync_to_disk(aside(to));
  put_in_place(to);
}

}  // namespace porthos::scene
