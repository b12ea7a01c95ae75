#include "scene/run/columns.h"

#include <algorithm>
#include <cstring>
#include <set>

namespace porthos::scene {
namespace {

/// Makes names unique.
class Links {
 public:
  std::string operator()(const std::string& name) {
    std::string link = link_name(name);
    while (!taken_.insert(link).second) link += "_";
    return link;
  }

 private:
  std::set<std::string> taken_;
};

/// The state or its low words, from a column on.
void add_blocks(std::vector<Column>& all, const phs::Description& d, size_t from,
                const std::string& state, const std::string& momentum) {
  Links link;
  for (const auto& b : d.blocks) {
    const std::string name = link(b.name);
    const auto add = [&](const std::string& group, int at, const std::string& unit) {
      all.push_back({group + name, unit, from + size_t(at), size_t(b.size), b.size > 1});
    };
    add(state, b.at, b.unit);
    if (b.momentum >= 0) add(momentum, b.momentum, b.momentum_unit);
  }
}

void add_state(std::vector<Column>& all, const phs::Description& d, const RecordLayout& l) {
  add_blocks(all, d, l.x(), "state/", "momentum/");
  if (l.turns > 0) all.push_back({"turns", "1", l.turn(), l.turns, true, true});
}

/// Errors of invariants. A momentum or a norm that is none of the system's has no error, and no
/// series.
void add_errors(std::vector<Column>& all, const phs::Description& d, const RecordLayout& l) {
  const auto has = [&](const char* name) {
    return std::ranges::any_of(d.invariants, [&](const auto& i) {
      return i.name == name || (i.name.starts_with(name) && i.name[std::strlen(name)] == '.');
    });
  };
  all.push_back({"energy_error", "J", l.energy()});
  if (has("linear_momentum"))
    all.push_back({"linear_momentum_error", "kg m/s", l.linear(), 3, true});
  if (has("angular_momentum"))
    all.push_back({"angular_momentum_error", "kg m^2/s", l.angular(), 3, true});
  if (has("quaternion_norm")) all.push_back({"quaternion_norm_error", "1", l.quaternion()});
}

/// Adds the ledger. Observed quantities are impulses: N s, N m s.
void add_ledger(std::vector<Column>& all, const phs::Description& d, const RecordLayout& l) {
  Links storage, power;
  for (size_t k = 0; k < d.storages.size(); ++k)
    all.push_back({"stored/" + storage(d.storages[k]), "J", l.stored() + k});
  for (size_t a = 0; a < d.powers.size(); ++a) {
    const auto kind = d.powers[a].kind;
    const bool observed = kind == phs::PowerKind::observed;
    const char* group = observed                           ? "observed/"
                        : kind == phs::PowerKind::supplied ? "supplied/"
                                                           : "dissipated/";
    all.push_back({group + power(d.powers[a].name), observed ? "integral" : "J", l.work() + a});
  }
}

void add_reactions(std::vector<Column>& all, const phs::Description& d, const RecordLayout& l) {
  Links link;
  size_t at = l.reaction();
  for (const auto& c : d.constraints)
    for (const auto& r : c.reactions) {
      all.push_back({"reactions/" + link(r.name), r.unit, at, size_t(r.size), r.size > 1});
      at += size_t(r.size);
    }
}

/// Adds the smallest and the largest values of each watched real series.
void add_extrema(std::vector<Column>& all, const RecordLayout& l) {
  const size_t known = all.size();
  size_t from = l.plain();
  for (const char* side : {"minimum/", "maximum/"}) {
    for (size_t i = 0; i < known; ++i) {
      const auto at = std::find(l.watched.begin(), l.watched.end(), all[i].first);
      if (at == l.watched.end() || all[i].integer) continue;
      Column c = all[i];
      c.name = side + c.name;
      c.first = from + size_t(at - l.watched.begin());
      all.push_back(std::move(c));
    }
    from += l.watched.size();
  }
}

}  // namespace

std::vector<Column> columns_of(const phs::Description& d, const RecordLayout& l) {
  std::vector<Column> all{{"time", "s", l.time()}, {"step", "1", 0, 1, false, true}};
  add_state(all, d, l);
  add_errors(all, d, l);
  add_ledger(all, d, l);
  all.push_back({"sweeps", "1", l.sweeps()});
  add_reactions(all, d, l);
  for (size_t k = 0; k < l.ledgers; ++k)
    all.push_back({std::string("ledgers/") + ledger_columns()[k].name, ledger_columns()[k].unit,
                   l.ledger() + k});
  size_t at = l.output();
  for (const OutputColumn& o : l.outputs) {
    all.push_back({"output/" + o.name, o.unit, at, o.size, o.size > 1});
    at += o.size;
  }
  if (l.low_words) add_blocks(all, d, l.low(), "low_words/", "low_words_momentum/");
  add_extrema(all, l);
  return all;
}

std::vector<std::string> turn_names(const phs::Description& d) {
  std::vector<std::string> names;
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::angle) names.push_back(b.name);
  return names;
}

}  // namespace porthos::scene
