#include "report/detail/pages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "phs/error.h"
#include "report/detail/series.h"
#include "scene/ensemble/case_layout.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"

namespace porthos::report {
namespace {

constexpr std::int64_t cases_at_once = 4096, most_shown = 5000, most_numbers = 500'000;
constexpr std::int64_t most_not_passed = 1000;
constexpr int bins = 48;

/// A column of a dataset.
struct CaseNumber {
  std::string dataset;
  std::int64_t at, width;
  std::string name, group, unit;
  bool log;  ///< errors: a histogram over their logarithms
  double low = std::numeric_limits<double>::infinity(), high = -low;
  std::int64_t largest = -1;  ///< the case with `high`
  std::vector<std::int64_t> passed = std::vector<std::int64_t>(bins, 0), others = passed;
  std::vector<float> shown = {};

  bool counts(double v) const { return std::isfinite(v) && (!log || v > 0); }
  void reach(std::int64_t of_case, double v) {
    if (!counts(v)) return;
    const double place = log ? std::log10(v) : v;
    low = std::min(low, place);
    if (place > high) {
      high = place;
      largest = of_case;
    }
  }
  void count(double v, bool pass) {
    if (!counts(v)) return;
    const double place = high > low ? ((log ? std::log10(v) : v) - low) / (high - low) * bins : 0;
    ++(pass ? passed : others)[size_t(std::clamp(int(place), 0, bins - 1))];
  }
};

class Cases {
 public:
  explicit Cases(const std::filesystem::path& path) : path_(path.string()), file_(path) {
    count_ = file_.dataset("passed").size();
    verdicts_.resize(size_t(count_));
    status_.resize(size_t(count_));
    std::vector<std::pair<const char*, std::vector<std::int64_t>*>> integers{{"passed", &verdicts_},
                                                                             {"status", &status_}};
    if (file_.datasets().count("failed_checks")) {  // not in files of earlier versions
      failed_.resize(size_t(count_));
      integers.emplace_back("failed_checks", &failed_);
      checks_ = scene::lines_of(file_.texts("failed_checks")["names"]);
    }
    for (auto [name, to] : integers) {
      if (file_.dataset(name).size() != count_)
        throw InvalidArgument(fmt::format("{}: '{}' has not one number a case", path_, name));
      file_.read(name, to->data());
    }
    add("inputs", "inputs", "input", false);
    for (const auto& [name, words] : {std::pair{"energy_error", "energy error"},
                                      {"linear_momentum_error", "linear momentum error"},
                                      {"angular_momentum_error", "angular momentum error"}})
      add(name, words, "error", true);
    add("outputs/end", "at the end", "output", false);
    add("outputs/least", "least", "output", false);
    add("outputs/largest", "largest", "output", false);
    add("events/time", "time", "event", false);
    add("end_time", "end of the case", "end", false);
  }

  Json json() {
    each([](CaseNumber& c, std::int64_t i, double v) { c.reach(i, v); });
    choose();
    each([&](CaseNumber& c, std::int64_t i, double v) {
      c.count(v, verdicts_[size_t(i)] == 1);
      if (is_shown(i)) c.shown.push_back(float(v));
    });
    Json columns = Json::array();
    for (const CaseNumber& c : columns_) {
      if (!(c.high >= c.low)) continue;  // no case has a number: a momentum that moves exactly
      columns.push_back({{"name", c.name},
                         {"group", c.group},
                         {"unit", c.unit},
                         {"log", c.log},
                         {"low", c.low},
                         {"high", c.high},
                         {"passed", c.passed},
                         {"others", c.others},
                         {"v", base64(c.shown)}});
    }
    Json verdicts = Json::array(), status = Json::array(), failed = Json::array();
    for (const std::int64_t i : shown_) {
      verdicts.push_back(verdicts_[size_t(i)]);
      const auto s = status_[size_t(i)];
      status.push_back(s == 0 ? "" : scene::case_status(int(s)));
      Json of_case = Json::array();
      for (size_t k = 0; !failed_.empty() && k < checks_.size() && k < 63; ++k)
        if (failed_[size_t(i)] >> k & 1) of_case.push_back(checks_[k]);
      failed.push_back(of_case);
    }
    return {{"count", count_},      {"columns", columns}, {"shown", shown_},
            {"verdicts", verdicts}, {"status", status},   {"failed", failed}};
  }

 private:
  void add(const char* dataset, const std::string& words, const char* group, bool log) {
    if (file_.datasets().count(dataset) == 0) return;
    const auto& shape = file_.dataset(dataset).shape;
    if (shape.empty() || shape.size() > 2 || shape[0] != count_)
      throw InvalidArgument(
          fmt::format("{}: '{}' has not one row for each of {} cases", path_, dataset, count_));
    auto about = file_.texts(dataset);
    const std::int64_t width = shape.size() > 1 ? shape[1] : 1;
    const auto names = scene::lines_of(about["columns"]), units = scene::lines_of(about["units"]);
    for (std::int64_t k = 0; k < width; ++k) {
      std::string name = words;
      if (size_t(k) < names.size())
        name = group == std::string("input")    ? names[size_t(k)]
               : group == std::string("output") ? fmt::format("{}, {}", names[size_t(k)], words)
                                                : names[size_t(k)];
      const std::string unit = size_t(k) < units.size() ? units[size_t(k)] : about["unit"];
      columns_.push_back({.dataset = dataset,
                          .at = k,
                          .width = width,
                          .name = name,
                          .group = group,
                          .unit = unit == "1" ? "" : unit,
                          .log = log});
    }
  }

  /// f(column, case, number) for every number of the columns, a case after another in each.
  template <class F>
  void each(F f) {
    std::vector<double> rows;
    for (size_t first = 0; first < columns_.size();) {
      const std::int64_t width = columns_[first].width;
      for (std::int64_t at = 0; at < count_; at += cases_at_once) {
        const std::int64_t n = std::min(cases_at_once, count_ - at);
        rows.resize(size_t(n * width));
        file_.read_rows(columns_[first].dataset, at, n, rows.data());
        for (std::int64_t i = 0; i < n; ++i)
          for (std::int64_t k = 0; k < width; ++k)
            f(columns_[first + size_t(k)], at + i, rows[size_t(i * width + k)]);
      }
      first += size_t(width);
    }
  }

  /// The cases whose numbers the page gets.
  void choose() {
    const auto width = std::max<std::int64_t>(1, std::int64_t(columns_.size()));
    const std::int64_t most =
        std::min(most_shown, std::max<std::int64_t>(200, most_numbers / width));
    std::set<std::int64_t> chosen;
    for (std::int64_t i = 0;
         i < count_ && std::int64_t(chosen.size()) < std::min(most, most_not_passed); ++i)
      if (verdicts_[size_t(i)] != 1) chosen.insert(i);
    for (const CaseNumber& c : columns_)
      if (c.dataset == "energy_error" && c.largest >= 0) chosen.insert(c.largest);
    const auto left = most - std::int64_t(chosen.size());
    for (std::int64_t k = 0; k < left && count_ > 0; ++k) chosen.insert(k * count_ / left);
    shown_.assign(chosen.begin(), chosen.end());
  }
  bool is_shown(std::int64_t i) const {
    return std::binary_search(shown_.begin(), shown_.end(), i);
  }

  std::string path_;
  scene::Hdf5Reader file_;
  std::int64_t count_ = 0;
  std::vector<std::int64_t> verdicts_, status_, failed_, shown_;
  std::vector<std::string> checks_;  ///< names of the bits of failed_
  std::vector<CaseNumber> columns_;
};

}  // namespace

Json ensemble_data(const std::filesystem::path& h5) { return Cases(h5).json(); }

}  // namespace porthos::report
