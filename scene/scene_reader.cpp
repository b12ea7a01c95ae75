#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>
#include <string_view>
#include <system_error>
#include <tuple>

#include "integrators/integrator.h"
#include "scene/auto_method.h"
#include "scene/scene.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using mechanics::Vec3d;
using Names = std::vector<std::string_view>;

constexpr double most_steps = 1e15;

// --- words ------------------------------------------------------------------------------------------------------

std::string joined(const Names& names) { return fmt::format("{}", fmt::join(names, ", ")); }

/// Insertions, deletions, replacements and swaps of neighbours that turn a into b.
size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (size_t i = 1; i <= a.size(); ++i)
    for (size_t j = 1; j <= b.size(); ++j) {
      d[i][j] =
          std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

std::string_view nearest(std::string_view name, const Names& known) {
  return *std::min_element(known.begin(), known.end(), [&](auto a, auto b) {
    return edit_distance(name, a) < edit_distance(name, b);
  });
}

/// What stands in the file, for "expected ..." sentences.
std::string found(const toml::node& n) {
  switch (n.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::boolean:
      return "a boolean";
    case toml::node_type::date:
      return "a date";
    case toml::node_type::time:
      return "a time of day";
    case toml::node_type::date_time:
      return "a date and time";
    default:
      return "a number";
  }
}

std::string read_file(const std::string& path, const std::string& what) {
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument(fmt::format("{} '{}' cannot be opened: {}", what, path, why));
  };
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) refuse("it is a directory");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(std::generic_category().message(errno));
  std::ostringstream text;
  text << file.rdbuf();
  if (file.bad()) refuse("it cannot be read");
  return text.str();
}

// --- values both a file and a command line can give: `where` is "file:line:column" or "--step" ---------------------

[[noreturn]] void refuse(const std::string& where, const std::string& sentence) {
  throw InvalidArgument(where + ": " + sentence);
}

void check_method(const std::string& method, const std::string& where) {
  Names known;
  for (const auto& d : integrators::catalogue()) known.push_back(d.name);
  known.push_back(auto_method);
  if (std::find(known.begin(), known.end(), method) == known.end())
    refuse(where, fmt::format("method is '{}', expected one of {}", method, joined(known)));
}

/// What a step control asks of a method, said where the scene says so.
void check_control(const Scene& s, const std::string& where) {
  if (s.step_control == integrators::StepControl::fixed) return;
  const char* control = to_string(s.step_control);
  if (s.method == auto_method)
    refuse(where, fmt::format("step_control is \"{}\", but auto chooses a fixed step, expected "
                              "step_control = \"fixed\"",
                              control));
  const auto& d = integrators::declaration_of(s.method);
  if (d.rival || d.order == 0)
    refuse(where, fmt::format("step_control is \"{}\", but {} chooses its steps itself, expected "
                              "step_control = \"fixed\"",
                              control, s.method));
  if (s.step_control == integrators::StepControl::reversible &&
      d.symmetric != integrators::Claim::holds)
    refuse(where,
           fmt::format("step_control is \"{}\", but {} is not symmetric, expected a symmetric "
                       "method",
                       control, s.method));
}

void check_seconds(const char* name, double seconds, const std::string& where) {
  if (!std::isfinite(seconds))
    refuse(where, fmt::format("{} is {}, expected a finite number of seconds", name, seconds));
  if (seconds <= 0) refuse(where, fmt::format("{} is {} s, expected more than 0 s", name, seconds));
}

void check_step_count(double step, double duration, const std::string& where) {
  if (duration < step)
    refuse(where,
           fmt::format("duration is {} s, expected at least one step of {} s", duration, step));
  if (duration / step > most_steps)
    refuse(where, fmt::format("duration is {} s, {:.3g} steps of {} s, expected at most {:g} steps",
                              duration, duration / step, step, most_steps));
}

/// A thousand records, in whole steps.
double default_record_every(double step, double duration) {
  if (step == 0) return 0;  // auto has not chosen yet
  return std::max(1.0, std::round(duration / 1000 / step)) * step;
}

// --- a table of the file with a closed list of keys ----------------------------------------------------------------

struct File {
  std::string path;
  std::string at(const toml::source_region& r) const {
    return fmt::format("{}:{}:{}", path, std::max(r.begin.line, 1u), std::max(r.begin.column, 1u));
  }
};

/// Reads typed values; every refusal names file, line, column, key, what was found and what was expected.
class Table {
 public:
  /// @param label   how people call it: "[run]"
  /// @param prefix  goes before the keys in messages: "base."
  Table(const File& file, const toml::table& t, std::string label, std::string prefix, Names known)
      : file_(file),
        t_(t),
        label_(std::move(label)),
        prefix_(std::move(prefix)),
        known_(std::move(known)) {
    for (const auto& [key, value] : t_) check_known(key);
  }

  bool has(const char* key) const { return t_.contains(key); }
  std::string at(const char* key) const { return file_.at(t_.get(key)->source()); }
  std::string at_key(const char* key) const { return file_.at(t_.find(key)->first.source()); }
  [[noreturn]] void fail(const char* key, const std::string& sentence) const {
    refuse(at(key), prefix_ + key + " " + sentence);
  }
  [[noreturn]] void missing(const char* key, const std::string& expected) const {
    refuse(file_.at(t_.source()),
           fmt::format("{} has no key '{}', expected {}", label_, key, expected));
  }
  void require(const char* key, const std::string& expected) const {
    if (!has(key)) missing(key, expected);
  }

  std::string text(const char* key, const std::string& expected) const {
    const toml::node& n = *t_.get(key);
    if (!n.is_string()) fail(key, fmt::format("is {}, expected {}", found(n), expected));
    return **n.as_string();
  }
  bool boolean(const char* key) const {
    const toml::node& n = *t_.get(key);
    if (!n.is_boolean()) fail(key, fmt::format("is {}, expected true or false", found(n)));
    return **n.as_boolean();
  }
  /// One of some words.
  std::string choice(const char* key, const Names& words) const {
    const std::string expected = fmt::format("\"{}\"", fmt::join(words, "\" or \""));
    const std::string word = text(key, expected);
    if (std::find(words.begin(), words.end(), word) == words.end())
      fail(key, fmt::format("is \"{}\", expected {}", word, expected));
    return word;
  }
  /// @param unit  " of seconds", or empty
  double number(const char* key, const char* unit) const {
    return finite(*t_.get(key), prefix_ + key, unit);
  }
  double number_or(const char* key, const char* unit, double otherwise) const {
    return has(key) ? number(key, unit) : otherwise;
  }
  double not_negative_or(const char* key, const char* unit, double otherwise) const {
    const double x = number_or(key, unit, otherwise);
    if (x < 0) fail(key, fmt::format("is {}, expected a number{}, 0 or more", x, unit));
    return x;
  }
  double seconds(const char* key) const {
    const double x = number(key, " of seconds");
    check_seconds((prefix_ + key).c_str(), x, at(key));
    return x;
  }
  std::uint64_t whole(const char* key) const {
    const toml::node& n = *t_.get(key);
    const std::string expected = "expected a whole number, 0 or more";
    if (!n.is_number()) fail(key, fmt::format("is {}, {}", found(n), expected));
    if (!n.is_integer() || **n.as_integer() < 0)
      fail(key, fmt::format("is {}, {}", *n.value<double>(), expected));
    return static_cast<std::uint64_t>(**n.as_integer());
  }
  template <size_t count>
  std::array<double, count> numbers(const char* key, const char* unit) const {
    const toml::node& n = *t_.get(key);
    const std::string expected = fmt::format("expected {} numbers{}", count, unit);
    if (!n.is_array()) fail(key, fmt::format("is {}, {}", found(n), expected));
    const toml::array& a = *n.as_array();
    if (a.size() != count)
      fail(key,
           fmt::format("has {} {}, {}", a.size(), a.size() == 1 ? "entry" : "entries", expected));
    std::array<double, count> x{};
    for (size_t i = 0; i < count; ++i)
      x[i] = finite(a[i], fmt::format("{}{}[{}]", prefix_, key, i), unit);
    return x;
  }
  Vec3d vector_or_zero(const char* key, const char* unit) const {
    if (!has(key)) return {0, 0, 0};
    const auto x = numbers<3>(key, unit);
    return {x[0], x[1], x[2]};
  }

  const toml::table& raw(const char* key, const std::string& expected) const {
    const toml::node& n = *t_.get(key);
    if (!n.is_table()) fail(key, fmt::format("is {}, expected {}", found(n), expected));
    return *n.as_table();
  }
  /// A table inside this one: [initial] base -> keys are called base.position, ...
  Table table(const char* key, Names known) const {
    const auto& inner = raw(key, "a table with the keys " + joined(known));
    return {file_, inner, prefix_ + key, prefix_ + key + ".", std::move(known)};
  }
  /// Calls f(name, where, table) for each of the user's own names in the table `key`.
  template <class F>
  void each(const char* key, const Names& known, F f) const {
    if (!has(key)) return;
    for (const auto& [name, node] : raw(key, "a table of tables by name")) {
      const std::string full = fmt::format("{}{}.{}", prefix_, key, name.str());
      const std::string where = file_.at(name.source());
      if (!node.is_table())
        refuse(file_.at(node.source()), fmt::format("{} is {}, expected a table with the keys {}",
                                                    full, found(node), joined(known)));
      f(std::string(name.str()), where, Table(file_, *node.as_table(), full, full + ".", known));
    }
  }

 private:
  void check_known(const toml::key& key) const {
    if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) return;
    refuse(file_.at(key.source()),
           fmt::format("unknown key '{}' in {}, the nearest known one is '{}' (known: {})",
                       key.str(), label_, nearest(key.str(), known_), joined(known_)));
  }
  double finite(const toml::node& n, const std::string& name, const char* unit) const {
    if (!n.is_number())
      refuse(file_.at(n.source()),
             fmt::format("{} is {}, expected a number{}", name, found(n), unit));
    const double x = *n.value<double>();
    if (!std::isfinite(x))
      refuse(file_.at(n.source()),
             fmt::format("{} is {}, expected a finite number{}", name, x, unit));
    return x;
  }

  const File& file_;
  const toml::table& t_;
  std::string label_, prefix_;
  Names known_;
};

// --- the tables of a scene -----------------------------------------------------------------------------------------

class Reader {
 public:
  explicit Reader(std::string path) : file_{std::move(path)} {}

  Scene read() {
    s_.path = file_.path;
    s_.text = read_file(s_.path, "scene file");
    parse();
    const Table top(file_, root_, "the scene", "",
                    {"title", "model", "environment", "initial", "integrator", "run", "verify"});
    s_.title = top.has("title") ? top.text("title", "text") : scene_name();
    // What decides a run must be stated; everything else has a default.
    model(section(
        top, "model",
        {"urdf", "base", "links_without_inertia", "unphysical_inertia", "use_damping", "inertia"}));
    if (top.has("environment")) environment(section(top, "environment", {"gravity", "vector"}));
    if (top.has("initial")) initial(section(top, "initial", {"base", "joints", "random"}));
    const Table method =
        section(top, "integrator",
                {"method", "step", "target_energy_error", "rtol", "iteration_tolerance",
                 "step_control", "step_control_rate", "step_control_length"});
    integrator(method);
    run(section(top, "run", {"duration", "record_every", "checkpoint_every"}));
    verify(top);
    return std::move(s_);
  }

 private:
  void parse() {
    try {
      root_ = toml::parse(std::string_view(s_.text), std::string_view(file_.path));
    } catch (const toml::parse_error& e) {
      std::string why(e.description());
      if (why.starts_with("Error ")) why.erase(0, 6);
      refuse(file_.at(e.source()), "broken TOML " + why);
    }
  }

  std::string scene_name() const {
    const fs::path path(s_.path);
    return path.stem().string();
  }

  Table section(const Table& top, const char* key, Names known) const {
    if (!top.has(key))
      refuse(file_.path + ":1:1", fmt::format("there is no [{}], expected a table with the keys {}",
                                              key, joined(known)));
    return {file_, top.raw(key, "a table with the keys " + joined(known)), fmt::format("[{}]", key),
            "", std::move(known)};
  }

  void model(const Table& t) {
    using Options = mechanics::UrdfOptions;
    t.require("urdf", "the name of a URDF file");
    t.require("base", "\"free\" or \"fixed\"");
    s_.urdf.base =
        t.choice("base", {"free", "fixed"}) == "free" ? Options::Base::free : Options::Base::fixed;
    if (t.has("links_without_inertia") &&
        t.choice("links_without_inertia", {"error", "massless"}) == "massless")
      s_.urdf.links_without_inertia = Options::NoInertia::massless;
    s_.urdf.accept_unphysical_inertia =
        t.has("unphysical_inertia") &&
        t.choice("unphysical_inertia", {"error", "accept"}) == "accept";
    if (t.has("use_damping")) s_.urdf.use_damping = t.boolean("use_damping");
    t.each("inertia", {"mass", "com", "inertia"},
           [&](const std::string& link, const std::string&, const Table& given) {
             s_.urdf.link_inertia[link] = mass_properties(given);
           });
    urdf(t);
  }

  static mechanics::MassProperties mass_properties(const Table& t) {
    t.require("mass", "a number of kg");
    mechanics::MassProperties m;
    m.mass = t.not_negative_or("mass", " of kg", 0);
    m.com = t.vector_or_zero("com", " of metres");
    if (!t.has("inertia")) return m;
    const auto i = t.numbers<6>("inertia", " of kg m^2 (ixx, iyy, izz, ixy, ixz, iyz)");
    m.inertia.xx = i[0], m.inertia.yy = i[1], m.inertia.zz = i[2];
    m.inertia.xy = i[3], m.inertia.xz = i[4], m.inertia.yz = i[5];
    return m;
  }

  void urdf(const Table& t) {
    const std::string name = t.text("urdf", "the name of a URDF file");
    if (name.empty()) t.fail("urdf", "is empty, expected the name of a URDF file");
    s_.urdf_path = (fs::path(s_.path).parent_path() / name).string();
    try {
      s_.urdf_text = read_file(s_.urdf_path, "URDF file");
    } catch (const InvalidArgument& e) {
      refuse(t.at("urdf"), e.what());
    }
  }

  void environment(const Table& t) {
    const std::string expected = "expected \"none\" or \"uniform\"";
    const std::string kind =
        t.has("gravity") ? t.text("gravity", "\"none\" or \"uniform\"") : "none";
    if (kind == "central") t.fail("gravity", "\"central\" is not available yet: " + expected);
    if (kind != "none" && kind != "uniform")
      t.fail("gravity", fmt::format("is \"{}\", {}", kind, expected));
    if (kind == "none" && t.has("vector"))
      t.fail("vector", "is given without gravity = \"uniform\", expected both or neither");
    if (kind == "none") return;
    t.require("vector", "3 numbers of m/s^2, because gravity is \"uniform\"");
    s_.urdf.gravity = t.vector_or_zero("vector", " of m/s^2");
  }

  void initial(const Table& t) {
    if (t.has("base")) base(t);
    t.each("joints", {"position", "velocity"},
           [&](const std::string& joint, std::string where, const Table& start) {
             s_.joints[joint] = {start.number_or("position", " of rad or m", 0),
                                 start.number_or("velocity", " of rad/s or m/s", 0),
                                 std::move(where)};
           });
    if (!t.has("random")) return;
    const Table r = t.table("random", {"seed", "joint_position", "joint_velocity"});
    RandomStart random;
    if (r.has("seed")) random.seed = r.whole("seed");
    random.joint_position = r.not_negative_or("joint_position", " of rad or m", 0);
    random.joint_velocity = r.not_negative_or("joint_velocity", " of rad/s or m/s", 0);
    s_.random = random;
  }

  void base(const Table& initial) {
    const Table t =
        initial.table("base", {"position", "attitude_wxyz", "linear_velocity", "angular_velocity"});
    BaseStart& b = s_.base;
    b.where = initial.at_key("base");
    b.position = t.vector_or_zero("position", " of metres");
    b.linear_velocity = t.vector_or_zero("linear_velocity", " of m/s");
    b.angular_velocity = t.vector_or_zero("angular_velocity", " of rad/s");
    if (!t.has("attitude_wxyz")) return;
    auto xi = t.numbers<4>("attitude_wxyz", "");
    double largest = 0;
    for (const double x : xi) largest = std::max(largest, std::fabs(x));
    if (largest == 0) t.fail("attitude_wxyz", "has length 0, expected a quaternion of length 1");
    for (double& x : xi) x /= largest;  // so that no square overflows or vanishes
    const double length = std::sqrt(std::inner_product(xi.begin(), xi.end(), xi.begin(), 0.0));
    for (size_t i = 0; i < 4; ++i) b.attitude_wxyz[i] = xi[i] / length;
  }

  void integrator(const Table& t) {
    if (t.has("method")) {
      s_.method = t.text("method", "the name of a method");
      check_method(s_.method, t.at("method"));
    }
    if (s_.method != auto_method) t.require("step", "a number of seconds");
    if (t.has("step")) s_.step = t.seconds("step");
    s_.rtol = t.number_or("rtol", "", s_.rtol);
    if (!(s_.rtol > 0 && s_.rtol < 1))
      t.fail("rtol", fmt::format("is {}, expected a number between 0 and 1", s_.rtol));
    s_.iteration_tolerance = t.number_or("iteration_tolerance", "", 0);
    if (!(s_.iteration_tolerance >= 0 && s_.iteration_tolerance < 1))
      t.fail("iteration_tolerance",
             fmt::format("is {}, expected 0 (iterate to rounding) or a number below 1",
                         s_.iteration_tolerance));
    if (s_.iteration_tolerance > 0 && s_.method == auto_method)
      t.fail("iteration_tolerance", "is given with method = \"auto\", expected one of both");
    target(t);
    step_control(t);
  }

  void target(const Table& t) {
    if (!t.has("target_energy_error")) return;
    if (s_.method != auto_method)
      t.fail("target_energy_error", "is given without method = \"auto\", expected both or neither");
    const double error = t.number("target_energy_error", "");
    if (!(error > 0 && error < 1))
      t.fail("target_energy_error", fmt::format("is {}, expected a number between 0 and 1", error));
    s_.target_energy_error = error;
  }

  void step_control(const Table& t) {
    if (t.has("step_control")) {
      s_.step_control = integrators::step_control_of(
          t.choice("step_control", {"fixed", "time_transformed", "reversible"}));
      check_control(s_, t.at("step_control"));
    }
    for (const auto& [key, unit, to] :
         {std::tuple{"step_control_rate", " of rad/s", &s_.control_rate},
          {"step_control_length", " of metres", &s_.control_length}}) {
      if (!t.has(key)) continue;
      if (s_.step_control == integrators::StepControl::fixed)
        t.fail(key, "is given without a step_control, expected both or neither");
      *to = t.number(key, unit);
      if (*to <= 0) t.fail(key, fmt::format("is {}, expected a number{} above 0", *to, unit));
    }
  }

  void run(const Table& t) {
    t.require("duration", "a number of seconds");
    s_.duration = t.seconds("duration");
    if (s_.step > 0) check_step_count(s_.step, s_.duration, t.at("duration"));
    s_.record_every_given = t.has("record_every");
    s_.record_every = s_.record_every_given ? t.seconds("record_every")
                                            : default_record_every(s_.step, s_.duration);
    if (t.has("checkpoint_every")) s_.checkpoint_every = t.seconds("checkpoint_every");
  }

  void verify(const Table& top) {
    Limits& l = s_.verify;
    if (!top.has("verify")) {
      l.energy = 1e-9, l.linear_momentum = l.angular_momentum = 1e-10, l.quaternion_norm = 1e-12;
      return;
    }
    const Table t = section(top, "verify",
                            {"energy", "linear_momentum", "angular_momentum", "quaternion_norm",
                             "balance", "symmetry"});
    const auto limit = [&](const char* key, std::optional<double>& to) {
      if (t.has(key)) to = t.not_negative_or(key, "", 0);
    };
    limit("energy", l.energy), limit("linear_momentum", l.linear_momentum);
    limit("angular_momentum", l.angular_momentum), limit("quaternion_norm", l.quaternion_norm);
    limit("balance", l.balance), limit("symmetry", l.symmetry);
  }

  File file_;
  toml::table root_;
  Scene s_;
};

}  // namespace

Scene read_scene(const std::string& path) { return Reader(path).read(); }

void apply(Scene& scene, const Overrides& overrides) {
  Scene s = scene;  // all or nothing
  if (overrides.method) {
    check_method(s.method = *overrides.method, "--method");
    check_control(s, "--method");
  }
  if (overrides.step) check_seconds("step", s.step = *overrides.step, "--step");
  if (overrides.duration) check_seconds("duration", s.duration = *overrides.duration, "--duration");
  if (s.step == 0 && s.method != auto_method)
    refuse("--method",
           fmt::format("the scene states no step for {}, expected --step too", s.method));
  if (s.step > 0 && (overrides.step || overrides.duration)) {
    check_step_count(s.step, s.duration, overrides.duration ? "--duration" : "--step");
    if (!s.record_every_given) s.record_every = default_record_every(s.step, s.duration);
  }
  scene = std::move(s);
}

}  // namespace porthos::scene
