#include "scene/run/run_file.h"

#include <algorithm>
#include <cerrno>
#include <set>
#include <vector>

#include "scene/files/files.h"
#include "scene/files/hdf5_file.h"
#include "scene/run/provenance.h"

namespace porthos::scene {
namespace {

/// A dataset and the columns of the log it is filled from.
struct Series {
  std::string name, unit;
  Hdf5File::Dataset data;
  size_t first, columns;
  Hdf5File::Kind kind;
};

/// A link name of its own for a block.
std::string link_name(std::string name, std::set<std::string>& taken) {
  name = scene::link_name(std::move(name));
  while (!taken.insert(name).second) name += "_";
  return name;
}

class RunFile {
 public:
  RunFile(const std::filesystem::path& path, const RecordLayout& layout, std::int64_t records)
      : file_(path), layout_(layout), records_(records) {}

  void declare(const Assembly& a, const RunReport& r) {
    const phs::Description& d = a.model->description();
    time_.push_back(series("time", 0, 1, Hdf5File::Kind::real, "s"));
    step_.push_back(series("step", 0, 1, Hdf5File::Kind::integer, "1"));
    declare_state(d);
    if (layout_.turns > 0) declare_turns(d);
    declare_errors(r);
    declare_books(d);
    series_.push_back(series("sweeps", layout_.sweeps(), 1, Hdf5File::Kind::real, "1"));
    declare_ledgers();
    if (!layout_.watched.empty()) declare_extrema();
  }

  void fill(const std::filesystem::path& log) {
    RecordReader reader(log, layout_);
    std::vector<double> rows;
    std::int64_t at = 0;
    while (const size_t n = reader.read(rows, 4096)) {
      fill_time(rows, n, at);
      for (auto& s : series_) fill_series(s, rows, n, at);
      at += std::int64_t(n);
    }
  }

  void describe(const Scene& scene) {
    file_.attribute("/", "title", scene.title);
    file_.attribute("/", "method", scene.method);
    file_.attribute("/", "step_s", scene.step);
    if (scene.step_control != integrators::StepControl::fixed)
      file_.attribute("/", "step_control", std::string(to_string(scene.step_control)));
    file_.group("provenance");
    for (const auto& [name, value] : provenance(scene)) file_.attribute("provenance", name, value);
    if (scene.random) file_.attribute("provenance", "seed", std::to_string(scene.random->seed));
    file_.text("provenance/scene", scene.text);
    file_.text("provenance/model", scene.urdf_text);
  }

  void close() {
    time_.clear(), step_.clear(), series_.clear();
    file_.close();
  }

 private:
  Series series(const std::string& name, size_t first, size_t columns, Hdf5File::Kind kind,
                const std::string& unit) {
    Series s{name,
             unit,
             file_.dataset(name, records_, columns > 1 ? std::int64_t(columns) : 0, kind),
             first,
             columns,
             kind};
    s.data.attribute("unit", unit);
    return s;
  }

  void declare_state(const phs::Description& d) {
    using enum Hdf5File::Kind;
    file_.group("state"), file_.group("momentum");
    std::set<std::string> taken;
    for (const auto& b : d.blocks) {
      const std::string name = link_name(b.name, taken);
      series_.push_back(
          series("state/" + name, layout_.x() + size_t(b.at), size_t(b.size), real, b.unit));
      if (b.momentum >= 0)
        series_.push_back(series("momentum/" + name, layout_.x() + size_t(b.momentum),
                                 size_t(b.size), real, b.momentum_unit));
    }
  }

  void declare_turns(const phs::Description& d) {
    std::string names;
    for (const auto& b : d.blocks)
      if (b.kind == phs::BlockKind::angle) names += (names.empty() ? "" : "\n") + b.name;
    Series s{"turns",
             "1",
             file_.dataset("turns", records_, std::int64_t(layout_.turns), Hdf5File::Kind::integer),
             layout_.turn(),
             layout_.turns,
             Hdf5File::Kind::integer};
    s.data.attribute("unit", "1");
    s.data.attribute("columns", names);
    series_.push_back(std::move(s));
  }

  void declare_errors(const RunReport& r) {
    using enum Hdf5File::Kind;
    series_.push_back(series("energy_error", layout_.energy(), 1, real, "J"));
    series_.back().data.attribute("scale_J", r.energy.scale_J);
    series_.push_back(series("linear_momentum_error", layout_.linear(), 3, real, "kg m/s"));
    series_.push_back(series("angular_momentum_error", layout_.angular(), 3, real, "kg m^2/s"));
    series_.push_back(series("quaternion_norm_error", layout_.quaternion(), 1, real, "1"));
  }

  void declare_books(const phs::Description& d) {
    using enum Hdf5File::Kind;
    file_.group("stored");
    std::set<std::string> taken;
    for (size_t k = 0; k < d.storages.size(); ++k)
      series_.push_back(
          series("stored/" + link_name(d.storages[k], taken), layout_.stored() + k, 1, real, "J"));
    if (d.powers.empty()) return;
    file_.group("supplied"), file_.group("dissipated");
    if (std::any_of(d.powers.begin(), d.powers.end(),
                    [](const auto& p) { return p.kind == phs::PowerKind::observed; }))
      file_.group("observed");  // impulses of thrusters and torquers: N s, N m s
    taken.clear();
    for (size_t a = 0; a < d.powers.size(); ++a) {
      if (d.powers[a].kind == phs::PowerKind::observed) {
        series_.push_back(series("observed/" + link_name(d.powers[a].name, taken),
                                 layout_.work() + a, 1, real, "integral"));
        continue;
      }
      const bool in = d.powers[a].kind == phs::PowerKind::supplied;
      series_.push_back(
          series((in ? "supplied/" : "dissipated/") + link_name(d.powers[a].name, taken),
                 layout_.work() + a, 1, real, "J"));
    }
  }

  void declare_ledgers() {
    if (layout_.ledgers == 0) return;
    file_.group("ledgers");
    for (size_t k = 0; k < layout_.ledgers; ++k) {
      const LedgerColumn& c = ledger_columns()[k];
      series_.push_back(series(std::string("ledgers/") + c.name, layout_.ledger() + k, 1,
                               Hdf5File::Kind::real, c.unit));
    }
  }

  /// For each series that is watched its smallest and largest values, under minimum/ and maximum/.
  void declare_extrema() {
    const auto& watched = layout_.watched;
    size_t from = layout_.plain();
    const size_t known = series_.size();
    for (const char* side : {"minimum", "maximum"}) {
      std::set<std::string> groups;
      file_.group(side);
      file_.attribute(side, "window",
                      std::string("all steps after the record before, up to this one"));
      for (size_t i = 0; i < known; ++i) {
        const auto at = std::find(watched.begin(), watched.end(), series_[i].first);
        if (at == watched.end() || series_[i].kind != Hdf5File::Kind::real) continue;
        const std::string name = std::string(side) + "/" + series_[i].name;
        if (const std::string group = name.substr(0, name.rfind('/'));
            group != side && groups.insert(group).second)
          file_.group(group);
        series_.push_back(series(name, from + size_t(at - watched.begin()), series_[i].columns,
                                 Hdf5File::Kind::real, series_[i].unit));
      }
      from += watched.size();
    }
  }

  void fill_time(const std::vector<double>& rows, size_t n, std::int64_t at) {
    integers_.resize(n), reals_.resize(n);
    for (size_t i = 0; i < n; ++i) {
      integers_[i] = integer(rows[i * layout_.size()]);
      reals_[i] = rows[i * layout_.size() + layout_.time()];
    }
    time_.front().data.write(at, std::span<const double>(reals_));
    step_.front().data.write(at, std::span<const std::int64_t>(integers_));
  }

  void fill_series(Series& s, const std::vector<double>& rows, size_t n, std::int64_t at) {
    reals_.clear(), integers_.clear();
    for (size_t i = 0; i < n; ++i) {
      const double* row = rows.data() + i * layout_.size() + s.first;
      if (s.kind == Hdf5File::Kind::real)
        reals_.insert(reals_.end(), row, row + s.columns);
      else
        for (size_t c = 0; c < s.columns; ++c) integers_.push_back(integer(row[c]));
    }
    if (s.kind == Hdf5File::Kind::real)
      s.data.write(at, std::span<const double>(reals_));
    else
      s.data.write(at, std::span<const std::int64_t>(integers_));
  }

  Hdf5File file_;  // closed last
  RecordLayout layout_;
  std::int64_t records_;
  std::vector<Series> time_, step_, series_;
  std::vector<double> reals_;
  std::vector<std::int64_t> integers_;
};

}  // namespace

void write_run_file(const std::filesystem::path& path, const Scene& scene, const Assembly& assembly,
                    const RunReport& report, const std::filesystem::path& log) {
  errno = 0;
  RunFile file(aside(path), RecordLayout(assembly.model->description(), scene.extrema),
               report.records);
  file.declare(assembly, report);
  file.describe(scene);
  file.fill(log);
  file.close();
}

}  // namespace porthos::scene
