#include "scene/ensemble/ensemble_scene.h"

#include <filesystem>
#include <limits>

#include "ensemble/random.h"
#include "scene/compare/auto_method.h"
#include "scene/files/files.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using ensemble::Distribution;

constexpr std::int64_t most_cases = 1'000'000'000;

std::vector<std::string> split(const std::string& line, char by) {
  std::vector<std::string> parts;
  for (size_t begin = 0;;) {
    const size_t end = std::min(line.find(by, begin), line.size());
    std::string part = line.substr(begin, end - begin);
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!part.empty() && blank(part.back())) part.pop_back();
    while (!part.empty() && blank(part.front())) part.erase(part.begin());
    parts.push_back(part);
    if (end == line.size()) return parts;
    begin = end + 1;
  }
}

double number_of(const std::string& text, const std::string& where, const std::string& column) {
  const auto x = as_number(text);
  if (!x || !std::isfinite(*x))
    refuse(where, fmt::format("{} is '{}', expected a finite number", column, text));
  return *x;
}

class EnsembleReader {
 public:
  EnsembleReader(const Scene& scene, const Assembly& assembly)
      : scene_(scene), assembly_(assembly), file_{scene.path} {}

  EnsembleScene read() {
    const toml::table root = parse_toml(scene_.text, file_);
    const toml::node* node = root.get("ensemble");
    if (!node || !node->is_table())
      refuse(file_.path + ":1:1",
             "there is no [ensemble], expected a table with the keys cases, seed, sampling and "
             "vary, or table");
    const Table t(file_, *node->as_table(), "[ensemble]", "", *schema_of("ensemble"));
    if (scene_.method == auto_method)
      refuse(
          t.where(),
          "[ensemble] is given with method = \"auto\", which chooses once for all cases: expected "
          "a scene whose method has been chosen (with_method_kept)");
    if (t.has("table")) {
      for (const char* key : {"cases", "seed", "sampling", "vary"})
        if (t.has(key)) t.fail(key, "is given besides a table of cases, expected one of both");
      read_table(t);
    } else {
      sample(t);
    }
    for (const Quantity& q : e_.quantities) try_out(q);
    return std::move(e_);
  }

 private:
  void sample(const Table& t) {
    t.require("cases", "how many runs there are, or a table of them");
    e_.cases = std::int64_t(t.whole("cases"));
    if (e_.cases < 1 || e_.cases > most_cases)
      t.fail("cases", fmt::format("is {}, expected 1 to {}", e_.cases, most_cases));
    e_.seed = t.whole("seed");
    e_.sobol = t.choice("sampling") == "sobol";
    t.require("vary", "a table of quantities and their distributions");
    const toml::table& vary = t.raw("vary", "a table of quantities and their distributions");
    for (const auto& [key, node] : vary) add(std::string(key.str()), key.source(), node);
    if (e_.quantities.empty()) t.fail("vary", "is empty, expected quantities and distributions");
    int draws = 0;
    for (const Quantity& q : e_.quantities) draws += q.distribution.draws();
    if (e_.sobol && draws > ensemble::Sobol::most_dimensions)
      t.fail("sampling",
             fmt::format("is \"sobol\" for {} numbers a case, expected at most {}, or \"random\"",
                         draws, ensemble::Sobol::most_dimensions));
  }

  const std::vector<mechanics::Driven>& driven() const {
    static const std::vector<mechanics::Driven> none;
    const auto* set = assembly_.mechanical ? assembly_.mechanical->constraint_set() : nullptr;
    return set ? set->spec().driven : none;
  }
  /// Adds a quantity, or one per joint for a '*': of those that no motion drives.
  void add(const std::string& key, const toml::source_region& at, const toml::node& node) {
    Quantity q{key, distribution(key, node), file_.at(at)};
    const size_t star = key.find('*');
    if (star == std::string::npos) {
      for (const auto& d : driven())
        if (key.rfind("initial.joints." + d.coordinate + ".", 0) == 0)
          refuse(q.where, fmt::format("vary.\"{}\": its motion '{}' says where the joint starts, "
                                      "expected another joint",
                                      key, d.name));
      e_.quantities.push_back(std::move(q));
      return;
    }
    if (key.rfind("initial.joints.*.", 0) != 0)
      refuse(q.where,
             fmt::format("vary.\"{}\": * stands for the joints in initial.joints.* alone", key));
    for (const auto& c : assembly_.mechanism->coordinates()) {
      if (c.nq != 1 || c.nv != 1) continue;
      if (std::any_of(driven().begin(), driven().end(),
                      [&](const auto& d) { return d.coordinate == c.name; }))
        continue;
      Quantity each = q;
      each.key.replace(star, 1, c.name);
      e_.quantities.push_back(std::move(each));
    }
  }

  Distribution distribution(const std::string& key, const toml::node& node) const {
    using Kind = Distribution::Kind;
    const std::string label = fmt::format("vary.\"{}\"", key);
    const std::string expected =
        "expected { uniform = [low, high] }, { normal = [mean, deviation] }, "
        "{ log_uniform = [low, high] } or { rotation = \"any\" }";
    if (!node.is_table() || node.as_table()->size() != 1)
      refuse(
          file_.at(node.source()),
          fmt::format("{} is {}, {}", label,
                      node.is_table() ? fmt::format("a table of {} keys", node.as_table()->size())
                                      : found(node),
                      expected));
    const Table t(file_, *node.as_table(), label, label + ".",
                  Names{"uniform", "normal", "log_uniform", "rotation"});
    Distribution d;
    if (t.has("rotation")) {
      (void)t.choice("rotation", {"any"});
      d.kind = Kind::rotation;
      return d;
    }
    const char* name = t.has("uniform") ? "uniform" : t.has("normal") ? "normal" : "log_uniform";
    d.kind = t.has("uniform") ? Kind::uniform : t.has("normal") ? Kind::normal : Kind::log_uniform;
    const auto ab = t.numbers<2>(name, std::string());
    d.a = ab[0];
    d.b = ab[1];
    if (const auto why = d.trouble(); !why.empty())
      t.fail(name, fmt::format("is no distribution: {}", why));
    return d;
  }

  void read_table(const Table& t) {
    const std::string name = t.text("table", "the name of a CSV file");
    e_.table_path = (fs::path(scene_.path).parent_path() / name).string();
    try {
      e_.table_text = read_file(e_.table_path);
    } catch (const InvalidArgument& error) {
      refuse(t.at("table"), error.what());
    }
    std::int64_t number = 0;
    for (const std::string& line : split(e_.table_text, '\n')) {
      ++number;
      if (line.empty() || line.front() == '#') continue;
      const std::string where = fmt::format("{}:{}", e_.table_path, number);
      const auto cells = split(line, ',');
      if (e_.quantities.empty()) {
        for (const auto& key : cells) e_.quantities.push_back({.key = key, .where = where});
        continue;
      }
      if (cells.size() != e_.quantities.size())
        refuse(where, fmt::format("there are {} numbers, expected {}, one for each quantity of the "
                                  "first line",
                                  cells.size(), e_.quantities.size()));
      auto& row = e_.rows.emplace_back();
      for (size_t i = 0; i < cells.size(); ++i)
        row.push_back(number_of(cells[i], where, e_.quantities[i].key));
    }
    if (e_.rows.empty())
      refuse(e_.table_path, "there are no cases, expected a line of quantities and one per case");
    e_.cases = std::int64_t(e_.rows.size());
  }

  bool first_case_is_taken() const {
    try {
      const CaseSampler sampler(e_);
      (void)assemble(read_variation(scene_, sampler.replacements(sampler.values(0))));
      return true;
    } catch (const InvalidArgument&) {
      return false;
    }
  }
  /// Refuses a quantity that has no place in the scene, with the message of the reader that refuses
  /// it.
  void try_out(const Quantity& q) const {
    static const Names first = {"initial",    "environment", "model", "element", "actuator",
                                "controller", "body",        "robot", "planet",  "orbit"};
    const std::string table = q.key.substr(0, q.key.find_first_of(".["));
    if (std::find(first.begin(), first.end(), table) == first.end())
      refuse(q.where, fmt::format("\"{}\" cannot differ from case to case, expected a key of {}",
                                  q.key, joined(first)));
    Replacement r{q.key, {}};
    if (!e_.rows.empty())
      r.values = {e_.rows[0][size_t(&q - e_.quantities.data())]};
    else
      r.values.resize(size_t(q.size()));
    const double middle[3] = {0.5, 0.5, 0.5};
    if (e_.rows.empty()) q.distribution.at(middle, r.values.data());
    try {
      const Scene s = read_variation(scene_, std::span(&r, 1));
      is_of_start(q.key) && s.controllers.empty() ? (void)start_of(s, assembly_)
                                                  : (void)assemble(s);
    } catch (const InvalidArgument& error) {
      if (first_case_is_taken()) return;  // the middle is no case, nor is one quantity alone
      std::string why = error.what();     // a replaced number has no place in the file
      if (const std::string nowhere = scene_.path + ":1:1: "; why.starts_with(nowhere))
        why.erase(0, nowhere.size());
      refuse(q.where, fmt::format("\"{}\" with {:g}: {}", q.key, r.values[0], why));
    }
  }

  const Scene& scene_;
  const Assembly& assembly_;
  File file_;
  EnsembleScene e_;
};

}  // namespace

int EnsembleScene::columns() const {
  int n = 0;
  for (const Quantity& q : quantities) n += q.size();
  return n;
}

std::vector<std::string> EnsembleScene::column_names() const {
  std::vector<std::string> names;
  for (const Quantity& q : quantities)
    for (int i = 0; i < q.size(); ++i)
      names.push_back(q.size() == 1 ? q.key : fmt::format("{}[{}]", q.key, i));
  return names;
}

EnsembleScene read_ensemble(const Scene& scene, const Assembly& assembly) {
  return EnsembleReader(scene, assembly).read();
}

CaseSampler::CaseSampler(const EnsembleScene& e) : e_(e) {
  int draws = 0;
  for (const Quantity& q : e.quantities) draws += q.distribution.draws();
  if (e.sobol) sobol_.emplace(draws, e.seed);
}

std::vector<double> CaseSampler::values(std::int64_t index) const {
  if (!e_.rows.empty()) return e_.rows[size_t(index)];
  std::vector<double> values(size_t(e_.columns()));
  int dimension = 0;
  double* to = values.data();
  for (const Quantity& q : e_.quantities) {
    double u[3] = {};
    // By name: a quantity keeps its numbers when others are added.
    ensemble::Stream stream(e_.seed, std::uint64_t(index), ensemble::name_bits(q.key));
    for (int i = 0; i < q.distribution.draws(); ++i, ++dimension)
      u[i] = sobol_ ? (*sobol_)(std::uint64_t(index), dimension) : stream.uniform();
    q.distribution.at(u, to);
    to += q.size();
  }
  return values;
}

std::vector<Replacement> CaseSampler::replacements(std::span<const double> values) const {
  std::vector<Replacement> list;
  for (const Quantity& q : e_.quantities) {
    list.push_back({q.key, {values.begin(), values.begin() + q.size()}});
    values = values.subspan(size_t(q.size()));
  }
  return list;
}

}  // namespace porthos::scene
