#include <fmt/format.h>

#include <algorithm>

#include "phs/error.h"
#include "report/records.h"
#include "scene/run/record_log.h"
#include "scene/run/run_file.h"

namespace porthos::report {
namespace {

using scene::link_name;

using scene::RecordLayout;

/// Where a dataset stands in a record.
struct Place {
  std::string name;
  size_t first;
  int columns;
  bool integer = false;
};

std::vector<Place> places_of(const phs::Description& d, const RecordLayout& l) {
  std::vector<Place> p{{"time", l.time(), 1},
                       {"step", 0, 1, true},
                       {"energy_error", l.energy(), 1},
                       {"linear_momentum_error", l.linear(), 3},
                       {"angular_momentum_error", l.angular(), 3},
                       {"quaternion_norm_error", l.quaternion(), 1},
                       {"sweeps", l.sweeps(), 1}};
  if (l.turns > 0) p.push_back({"turns", l.turn(), int(l.turns), true});
  for (const auto& b : d.blocks)
    p.push_back({"state/" + link_name(b.name), l.x() + size_t(b.at), b.size});
  for (size_t k = 0; k < d.storages.size(); ++k)
    p.push_back({"stored/" + link_name(d.storages[k]), l.stored() + k, 1});
  for (size_t a = 0; a < d.powers.size(); ++a)
    p.push_back({(d.powers[a].kind == phs::PowerKind::supplied     ? "supplied/"
                  : d.powers[a].kind == phs::PowerKind::dissipated ? "dissipated/"
                                                                   : "observed/") +
                     link_name(d.powers[a].name),
                 l.work() + a, 1});
  return p;
}

class LogRecords : public Records {
 public:
  LogRecords(const std::filesystem::path& path, const phs::Description& d, scene::Extrema extrema)
      : path_(path), layout_(d, extrema), places_(places_of(d, layout_)) {
    for (const auto& b : d.blocks)
      if (b.kind == phs::BlockKind::angle) turns_.push_back(b.name);
    std::error_code e;
    const auto bytes = std::filesystem::file_size(path, e);
    if (e) throw InvalidArgument(fmt::format("{} cannot be read: {}", path.string(), e.message()));
    count_ = std::int64_t(bytes / (layout_.size() * sizeof(double)));
  }
  std::int64_t count() const override { return count_; }
  bool has(const std::string& name) const override { return find(name) != places_.end(); }
  std::vector<std::string> names(const std::string& group) const override {
    std::vector<std::string> list;
    for (const auto& p : places_)
      if (p.name.rfind(group + "/", 0) == 0) list.push_back(p.name.substr(group.size() + 1));
    return list;
  }
  std::vector<std::string> turn_names() const override { return turns_; }
  std::string text(const std::string&) const override { return ""; }
  void read(const std::string& name, const Piece& f) const override {
    const auto p = find(name);
    if (p == places_.end())
      throw InvalidArgument(fmt::format("{} has no series '{}'", path_.string(), name));
    scene::RecordReader reader(path_, layout_);
    std::vector<double> rows, values;
    for (std::int64_t first = 0; first < count_;) {
      const auto n = std::int64_t(reader.read(rows, 4096));
      if (n == 0) break;
      const std::int64_t used = std::min(n, count_ - first);
      values.clear();
      for (std::int64_t i = 0; i < used; ++i)
        for (int c = 0; c < p->columns; ++c) {
          const double v = rows[size_t(i) * layout_.size() + p->first + size_t(c)];
          values.push_back(p->integer ? double(scene::integer(v)) : v);
        }
      f(first, used, p->columns, values.data());
      first += n;
    }
  }

 private:
  std::vector<Place>::const_iterator find(const std::string& name) const {
    return std::find_if(places_.begin(), places_.end(),
                        [&](const Place& p) { return p.name == name; });
  }
  std::filesystem::path path_;
  RecordLayout layout_;
  std::vector<Place> places_;
  std::vector<std::string> turns_;
  std::int64_t count_ = 0;
};

}  // namespace

std::unique_ptr<Records> open_log(const std::filesystem::path& path, const phs::Description& model,
                                  scene::Extrema extrema) {
  return std::make_unique<LogRecords>(path, model, extrema);
}

}  // namespace porthos::report
