#include "scene/run/run_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <set>
#include <vector>

#include "scene/files/files.h"
#include "scene/files/hdf5_file.h"
#include "scene/run/columns.h"
#include "scene/run/provenance.h"

namespace porthos::scene {
namespace {

/// A dataset and the columns of the log from which it is filled.
struct Series {
  Column column;
  Hdf5File::Dataset data;
};

class RunFile {
 public:
  RunFile(const std::filesystem::path& path, const RecordLayout& layout, std::int64_t records)
      : file_(path), layout_(layout), records_(records) {}

  void declare(const Assembly& a, const RunReport& r) {
    const phs::Description& d = a.model->description();
    if (!d.powers.empty()) {
      file_.group("supplied");
      file_.group("dissipated");
    }
    for (Column& c : columns_of(d, layout_)) add(std::move(c));
    for (Series& s : series_) {
      s.data.attribute("unit", s.column.unit);
      if (s.column.name == "energy_error") s.data.attribute("scale_J", r.energy.scale_J);
      if (s.column.name == "turns")
        s.data.attribute("columns", fmt::format("{}", fmt::join(turn_names(d), "\n")));
    }
    for (const char* side : {"minimum", "maximum"})
      if (groups_.count(side))
        file_.attribute(side, "window",
                        std::string("all steps after the record before, up to this one"));
  }

  void fill(const std::filesystem::path& log) {
    RecordReader reader(log, layout_);
    std::vector<double> rows;
    std::int64_t at = 0;
    while (const size_t n = reader.read(rows, 4096)) {
      for (auto& s : series_) fill_series(s, rows, n, at);
      at += std::int64_t(n);
    }
  }

  /// An attribute of lines of a name, a tab and numbers; none without a name.
  void numbers(const std::string& name, const std::map<std::string, std::vector<double>>& of) {
    std::string text;
    for (const auto& [key, list] : of) text += fmt::format("{}\t{}\n", key, fmt::join(list, " "));
    if (!text.empty()) file_.attribute("/", name, text);
  }

  void describe(const Scene& scene, const Joined& joined) {
    file_.attribute("/", "title", scene.title);
    file_.attribute("/", "method", scene.method);
    file_.attribute("/", "step_s", scene.step);
    if (scene.orbit) {
      file_.attribute("/", "epoch", scene.orbit->epoch);
      file_.attribute(
          "/", "forces",
          fmt::format("{}", fmt::join(space::forces_of(scene.orbit->environment), "\n")));
      std::map<std::string, std::vector<double>> longitudes;
      for (const auto& [key, rad] : scene.orbit->longitudes) longitudes[key] = {rad};
      numbers("longitudes", longitudes);
    }
    numbers("locked_at", locked_places(scene));
    if (scene.orbit && scene.start_from)
      file_.attribute("/", "elapsed_s", scene.start_from->elapsed);
    if (scene.step_control != integrators::StepControl::fixed)
      file_.attribute("/", "step_control", std::string(to_string(scene.step_control)));
    file_.group("provenance");
    for (const auto& [name, value] : provenance(scene)) file_.attribute("provenance", name, value);
    if (scene.random) file_.attribute("provenance", "seed", std::to_string(scene.random->seed));
    if (!joined.empty()) file_.text("joined", to_text(joined));
    file_.text("provenance/scene", scene.text);
    file_.text("provenance/model", scene.urdf_text);
    if (!scene.files.empty()) file_.text("provenance/files", to_text(scene.files));
  }

  void close() {
    series_.clear();
    file_.close();
  }

 private:
  void add(Column c) {
    for (size_t at = c.name.find('/'); at != std::string::npos; at = c.name.find('/', at + 1)) {
      const std::string group = c.name.substr(0, at);
      if (groups_.insert(group).second) file_.group(group);
    }
    const auto kind = c.integer ? Hdf5File::Kind::integer : Hdf5File::Kind::real;
    auto data = file_.dataset(c.name, records_, c.matrix ? std::int64_t(c.columns) : 0, kind);
    series_.push_back({std::move(c), std::move(data)});
  }

  void fill_series(Series& s, const std::vector<double>& rows, size_t n, std::int64_t at) {
    const Column& c = s.column;
    reals_.clear();
    for (size_t i = 0; i < n; ++i) {
      const double* row = rows.data() + i * layout_.size() + c.first;
      reals_.insert(reals_.end(), row, row + c.columns);
    }
    if (!c.integer) return s.data.write(at, std::span<const double>(reals_));
    integers_.resize(reals_.size());
    std::transform(reals_.begin(), reals_.end(), integers_.begin(), integer);
    s.data.write(at, std::span<const std::int64_t>(integers_));
  }

  Hdf5File file_;  // closed last
  RecordLayout layout_;
  std::int64_t records_;
  std::set<std::string> groups_{"supplied", "dissipated"};  ///< that exist
  std::vector<Series> series_;
  std::vector<double> reals_;
  std::vector<std::int64_t> integers_;
};

}  // namespace

void write_run_file(const std::filesystem::path& path, const Scene& scene, const Assembly& assembly,
                    const RunReport& report, const std::filesystem::path& log) {
  errno = 0;
  RunFile file(aside(path), RecordLayout(scene, assembly), report.records);
  file.declare(assembly, report);
  file.describe(scene, assembly.joined);
  file.fill(log);
  file.close();
}

}  // namespace porthos::scene
