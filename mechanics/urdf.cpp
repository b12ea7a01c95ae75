#include "mechanics/urdf.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <span>
#include <string_view>
#include <system_error>

#include "mechanics/joint_list.h"

namespace porthos::mechanics {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

constexpr std::string_view blanks = " \t\r\n";

std::string named(std::string_view s) { return "'" + std::string(s) + "'"; }

/// The file's name and what is noted about it.
class Log {
 public:
  explicit Log(std::string file) : file_(std::move(file)) {}

  const std::string& file() const { return file_; }
  std::string at(int line) const { return file_ + ":" + std::to_string(line); }
  [[noreturn]] void fail(int line, const std::string& text) const {
    throw InvalidArgument(at(line) + ": " + text);
  }
  [[noreturn]] void fail(const std::string& text) const {
    throw InvalidArgument(file_ + ": " + text);
  }
  void note(int line, std::string text) { notes_.push_back({at(line), std::move(text)}); }
  /// For what comes in numbers: one note for all of a kind, at the first of them.
  void count(int line, const std::string& kind, const char* fate) {
    ++tallies_.try_emplace(kind + ": " + fate, Tally{line, 0}).first->second.times;
  }
  std::vector<UrdfNote> notes() const {
    auto all = notes_;
    for (const auto& [text, t] : tallies_)
      all.push_back({at(t.line), std::to_string(t.times) + " x " + text});
    return all;
  }

 private:
  struct Tally {
    int line, times;
  };
  std::string file_;
  std::vector<UrdfNote> notes_;
  std::map<std::string, Tally> tallies_;
};

struct Link {
  std::string name;
  int line;
  std::optional<MassProperties> mass;
};

struct Joint {
  int line = 0;
  std::string parent, child;
  JointSpec spec;
  Pose placement;
};

/// What the file says, before it is known to be a tree.
struct Model {
  std::string name;
  std::vector<Link> links;
  std::vector<Joint> joints;
};

/// "joint 'elbow': " for anything inside that joint.
std::string owner(const XMLElement& inside) {
  for (const XMLElement* e = &inside; e; e = e->Parent() ? e->Parent()->ToElement() : nullptr) {
    const std::string_view tag = e->Name();
    const char* name = e->Attribute("name");
    if (name && (tag == "link" || tag == "joint"))
      return std::string(tag) + " " + named(name) + ": ";
  }
  return "";
}

/// The attribute as the file shows it, cut if long: <origin xyz="0 0">
std::string shown(const XMLElement& e, const XMLAttribute& a) {
  std::string value = a.Value();
  if (value.size() > 60) value = value.substr(0, 57) + "...";
  return "<" + std::string(e.Name()) + " " + a.Name() + "=\"" + value + "\">";
}

std::string tag(const XMLElement& e) { return "<" + std::string(e.Name()) + ">"; }

/// A finite number that is all of `word`, whatever the locale.
std::optional<double> finite_number(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  double x = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), x);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(x)) return {};
  return x;
}

/// XML -> Model.
class Reader {
 public:
  Reader(Log& log, const UrdfOptions& options) : log_(log), options_(options) {}

  Model read(const std::string& text) {
    tinyxml2::XMLDocument document;
    const XMLElement& robot = parse(document, text);
    expect(robot, {"name", "version"}, {}, {"link", "joint"});
    Model m{required(robot, "name"), {}, {}};
    for (auto* e = robot.FirstChildElement("link"); e; e = e->NextSiblingElement("link"))
      m.links.push_back(link(*e));
    for (auto* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint"))
      m.joints.push_back(joint(*e));
    if (m.links.empty()) fail(robot, "<robot> has no <link>, expected at least one");
    return m;
  }

 private:
  using Names = std::initializer_list<std::string_view>;
  static bool among(Names names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  /// Messages at an element or attribute of it, after the name of the link or joint it is in.
  [[noreturn]] void fail(const XMLElement& e, const std::string& text) const {
    log_.fail(e.GetLineNum(), owner(e) + text);
  }
  [[noreturn]] void fail(const XMLElement& e, const XMLAttribute& a, std::string text) const {
    log_.fail(a.GetLineNum(), owner(e) + shown(e, a) + text);
  }
  void note(const XMLElement& e, const std::string& text) {
    log_.note(e.GetLineNum(), owner(e) + text);
  }

  const XMLElement& parse(tinyxml2::XMLDocument& document, const std::string& text) const {
    if (const auto zero = text.find('\0'); zero != text.npos)  // the parser would stop there
      log_.fail(1 + int(std::count(text.begin(), text.begin() + std::ptrdiff_t(zero), '\n')),
                "has a zero byte, expected XML text in UTF-8");
    if (text.find_first_not_of(blanks) == text.npos) log_.fail("is empty, expected a URDF <robot>");
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
      log_.fail(document.ErrorLineNum(), "broken XML: " + xml_error(document));
    const XMLElement* root = document.RootElement();
    if (!root) log_.fail("has no XML element, expected a URDF <robot>");
    if (std::string_view(root->Name()) != "robot")
      fail(*root, "the top element is " + tag(*root) + ", expected <robot>");
    if (const auto* second = root->NextSiblingElement())
      fail(*second, "there is a second top element " + tag(*second) + ", expected one");
    return *root;
  }

  /// "XML_ERROR_MISMATCHED_ELEMENT" and its details as words: "error mismatched element (...)".
  static std::string xml_error(const tinyxml2::XMLDocument& document) {
    std::string words = document.ErrorName();
    if (words.starts_with("XML_")) words.erase(0, 4);
    for (char& c : words) c = c == '_' ? ' ' : char(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
    const std::string all = document.ErrorStr();
    const auto line = all.find("Line number=");
    const auto detail = line == all.npos ? line : all.find(": ", line);
    return detail == all.npos ? words : words + " (" + all.substr(detail + 2) + ")";
  }

  /// Nothing is ignored in silence: each attribute, child and text of `e` not listed is noted.
  void expect(const XMLElement& e, Names attributes, Names once = {}, Names many = {}) {
    for (auto* a = e.FirstAttribute(); a; a = a->Next()) {
      const std::string_view name = a->Name();
      if (name == "quat_xyzw") fail(e, *a, " is not understood, expected rpy");  // not lost
      if (!among(attributes, name) && !name.starts_with("xmlns"))
        log_.note(a->GetLineNum(), owner(e) + "unknown attribute " + shown(e, *a) + ", ignored");
    }
    for (auto* child = e.FirstChild(); child; child = child->NextSibling()) {
      if (child->ToText())
        log_.note(child->GetLineNum(), owner(e) + "text in " + tag(e) + ", ignored");
      if (child->ToElement()) expect_child(e, *child->ToElement(), once, many);
    }
  }
  void expect_child(const XMLElement& e, const XMLElement& child, Names once, Names many) {
    const std::string_view name = child.Name();
    if (among(many, name)) return;
    if (among(once, name)) {
      if (e.FirstChildElement(child.Name()) != &child)
        fail(child, "there is a second " + tag(child) + ", expected one");
    } else if (among({"visual", "collision", "material", "transmission", "gazebo", "calibration",
                      "safety_controller"},
                     name)) {
      log_.count(child.GetLineNum(), tag(child), "not read");
    } else if (name.starts_with("xacro:")) {
      fail(child, tag(child) + " is a macro, expected plain URDF: expand it with xacro first");
    } else {
      note(child, "unknown tag " + tag(child) + " in " + tag(e) + ", ignored");
    }
  }

  const XMLAttribute& attribute(const XMLElement& e, const char* name) const {
    const XMLAttribute* a = e.FindAttribute(name);
    if (!a) fail(e, tag(e) + " has no attribute " + named(name));
    return *a;
  }
  std::string required(const XMLElement& e, const char* name) const {
    const XMLAttribute& a = attribute(e, name);
    if (!*a.Value()) fail(e, a, " is empty, expected a name");
    return a.Value();
  }
  const XMLElement& child(const XMLElement& e, const char* name) const {
    const XMLElement* c = e.FirstChildElement(name);
    if (!c) fail(e, tag(e) + " has no <" + name + ">");
    return *c;
  }

  void numbers(const XMLElement& e, const XMLAttribute& a, std::span<double> out) const {
    const std::string wanted = out.size() == 1 ? "a finite number" : "3 finite numbers";
    const auto refuse = [&](const std::string& found) {
      fail(e, a, ": expected " + wanted + ", found " + found);
    };
    std::size_t count = 0;
    std::string_view rest = a.Value();
    while (true) {
      rest.remove_prefix(std::min(rest.find_first_not_of(blanks), rest.size()));
      if (rest.empty()) break;
      const std::string_view word = rest.substr(0, rest.find_first_of(blanks));
      rest.remove_prefix(word.size());
      const auto x = finite_number(word);
      if (!x) refuse(named(word.substr(0, 60)));
      if (count < out.size()) out[count] = *x;
      ++count;
    }
    if (count != out.size()) refuse(std::to_string(count));
  }
  double scalar(const XMLElement& e, const char* name) const {
    double x = 0;
    numbers(e, attribute(e, name), {&x, 1});
    return x;
  }
  std::optional<double> optional_scalar(const XMLElement& e, const char* name) const {
    return e.FindAttribute(name) ? std::optional(scalar(e, name)) : std::nullopt;
  }
  Vec3d vector(const XMLElement& e, const char* name) const {
    std::array<double, 3> x{};
    numbers(e, attribute(e, name), x);
    return {x[0], x[1], x[2]};
  }

  Pose origin(const XMLElement& of) {
    const XMLElement* e = of.FirstChildElement("origin");
    if (!e) return {Mat3<double>::identity(), {0, 0, 0}};
    expect(*e, {"xyz", "rpy"});
    const Vec3d none{0, 0, 0}, rpy = e->FindAttribute("rpy") ? vector(*e, "rpy") : none;
    return {rotation_from_rpy(rpy.x, rpy.y, rpy.z),
            e->FindAttribute("xyz") ? vector(*e, "xyz") : none};
  }

  Link link(const XMLElement& e) {
    expect(e, {"name"}, {"inertial"});
    const auto* i = e.FirstChildElement("inertial");
    return {required(e, "name"), e.GetLineNum(), i ? std::optional(inertial(*i)) : std::nullopt};
  }

  MassProperties inertial(const XMLElement& e) {
    expect(e, {}, {"origin", "mass", "inertia"});
    const XMLElement &mass = child(e, "mass"), &inertia = child(e, "inertia");
    expect(mass, {"value"});
    expect(inertia, {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"});
    const auto i = [&](const char* name) { return scalar(inertia, name); };
    const Pose frame = origin(e);
    const Sym3<double> I{i("ixx"), i("ixy"), i("ixz"), i("iyy"), i("iyz"), i("izz")};
    const MassProperties m{scalar(mass, "value"), frame.r, I, frame.R};
    // A gram is not spread over metres: the usual cause is a tensor in kg mm^2.
    const double radius = std::sqrt(std::max({I.xx, I.yy, I.zz, 0.0}) / m.mass);
    if (m.mass > 0 && m.mass < 1 && radius > 1)
      note(inertia, "a mass of " + number(m.mass) + " kg with a radius of gyration of " +
                        number(radius, 2) + " m is implausible, expected kg m^2");
    return m;
  }

  Joint joint(const XMLElement& e) {
    Joint j;
    j.line = e.GetLineNum();
    j.spec.name = required(e, "name");
    j.spec.type = joint_type(e);
    if (const auto r = options_.rotor_inertia.find(j.spec.name); r != options_.rotor_inertia.end())
      j.spec.rotor_inertia = r->second;
    expect(e, {"name", "type"},
           {"origin", "parent", "child", "axis", "axis2", "pitch", "limit", "dynamics", "mimic"});
    j.placement = origin(e);
    j.parent = linked(e, "parent");
    j.child = linked(e, "child");
    axes(e, j.spec);
    limit(e, j.spec);
    dynamics(e, j.spec);
    if (const auto* m = e.FirstChildElement("mimic")) {
      expect(*m, {"joint", "multiplier", "offset"});
      note(*m, "<mimic> ignored: joint moves freely");
    }
    return j;
  }

  std::string joint_type(const XMLElement& e) const {
    const std::string type = required(e, "type");
    if (type == "floating") return "free";
    if (freedoms(type) >= 0) return type;
    std::string known = "floating";
    for (const auto& name : joint_type_names()) known += ", " + name;
    fail(e, attribute(e, "type"), ": unknown type, expected one of " + known);
  }

  std::string linked(const XMLElement& joint, const char* end) {
    const XMLElement& e = child(joint, end);
    expect(e, {"link"});
    return required(e, "link");
  }

  Vec3d direction(const XMLElement& e, bool used) {
    expect(e, {"xyz"});
    const Vec3d d = vector(e, "xyz");
    if (used && d.x == 0 && d.y == 0 && d.z == 0)
      fail(e, attribute(e, "xyz"), " is zero, expected a direction");
    return d;
  }
  void axes(const XMLElement& e, JointSpec& spec) {
    const bool first = !among({"fixed", "spherical", "free"}, spec.type);
    const bool second = among({"universal", "planar"}, spec.type), helical = spec.type == "helical";
    spec.axis = {1, 0, 0};  // URDF's default
    if (auto* axis = e.FirstChildElement("axis")) spec.axis = direction(*axis, first);
    if (auto* axis2 = e.FirstChildElement("axis2"))
      second ? void(spec.second_axis = direction(*axis2, true)) : meaningless(*axis2, spec);
    if (helical) spec.pitch = scalar(child(e, "pitch"), "value");
    if (auto* pitch = e.FirstChildElement("pitch"))
      helical ? expect(*pitch, {"value"}) : meaningless(*pitch, spec);
  }
  void meaningless(const XMLElement& e, const JointSpec& spec) {
    note(e, tag(e) + " means nothing to a " + spec.type + " joint, ignored");
  }

  void limit(const XMLElement& e, JointSpec& spec) {
    const auto* l = e.FirstChildElement("limit");
    if (!l) return;
    expect(*l, {"lower", "upper", "effort", "velocity"});
    const auto effort = optional_scalar(*l, "effort"), velocity = optional_scalar(*l, "velocity");
    const int line = l->GetLineNum();
    if (effort || velocity) log_.count(line, "<limit> effort or velocity", "not enforced");
    const auto lower = optional_scalar(*l, "lower"), upper = optional_scalar(*l, "upper");
    if (freedoms(spec.type) == 1)
      spec.lower = lower, spec.upper = upper;
    else if (lower || upper)
      log_.count(line, "<limit> lower or upper of a " + spec.type + " joint", "ignored");
  }

  void dynamics(const XMLElement& e, JointSpec& spec) {
    const auto* d = e.FirstChildElement("dynamics");
    if (!d) return;
    expect(*d, {"damping", "friction"});
    const double damping = optional_scalar(*d, "damping").value_or(0);
    spec.friction = optional_scalar(*d, "friction").value_or(0);
    const bool damps = options_.use_damping && spec.type != "fixed";
    if (damps) spec.damping = damping;
    const std::string fate = " read but not simulated";
    if (spec.friction > 0) note(*d, "friction " + number(spec.friction) + fate);
    if (damping != 0 && !damps) note(*d, "damping " + number(damping) + fate);
  }

  Log& log_;
  const UrdfOptions& options_;
};

/// Model -> tree of bodies -> Mechanism.
class Assembler {
 public:
  Assembler(const Model& model, Log& log, const UrdfOptions& options)
      : m_(model), log_(log), options_(options) {}

  UrdfResult run() {
    index_links();
    index_joints();
    const std::size_t root = find_root();
    const auto order = depth_first(root);
    settle_masses(order);
    const MechanismBuilder made = parts(order);
    return {build(made), log_.notes(), m_.links[root].name, made};
  }

 private:
  void index_links() {
    for (std::size_t i = 0; i < m_.links.size(); ++i) {
      const Link& l = m_.links[i];
      const auto [first, fresh] = by_name_.emplace(l.name, i);
      if (!fresh) twice("link " + named(l.name), l.line, m_.links[first->second].line);
    }
    for (const auto& [name, mass] : options_.link_inertia) check_given(name);
  }
  void index_joints() {
    for (const Joint& j : m_.joints) {
      const auto [first, fresh] = joint_lines_.emplace(j.spec.name, j.line);
      if (!fresh) twice("joint " + named(j.spec.name), j.line, first->second);
      if (free_base_ && j.spec.name == base_joint_name)
        fail(j, "the joint of the free base has this name, expected another");
      const std::size_t parent = end(j, "parent", j.parent), child = end(j, "child", j.child);
      if (const Joint* other = carrier_[child])
        fail(j, "its child " + named(j.child) + " already hangs on joint " +
                    named(other->spec.name) + " (line " + std::to_string(other->line) +
                    "), expected one parent per link");
      carrier_[child] = &j;
      children_[parent].push_back(child);
    }
    for (const auto& [name, inertia] : options_.rotor_inertia)
      if (!joint_lines_.count(name))
        log_.fail("rotor inertia: " + named(name) + " is not a joint of this file");
  }
  std::size_t end(const Joint& j, const char* what, const std::string& name) const {
    const auto l = by_name_.find(name);
    if (l == by_name_.end())
      fail(j, "its " + std::string(what) + " " + named(name) + " is not a link of this file");
    return l->second;
  }
  void check_given(const std::string& name) const {
    const std::string key = "[model.inertia." + name + "]";
    const auto l = by_name_.find(name);
    if (l == by_name_.end()) log_.fail(key + ": " + named(name) + " is not a link of this file");
    const Link& given = m_.links[l->second];
    if (given.mass) fail(given, "has an <inertial>, expected no " + key + " besides");
  }

  /// Something at `line` is called like the one at the line `first`.
  [[noreturn]] void twice(const std::string& what, int line, int first) const {
    log_.fail(line, what + " stands in line " + std::to_string(first) +
                        " already, expected another name");
  }
  [[noreturn]] void fail(const Link& l, const std::string& text) const {
    log_.fail(l.line, "link " + named(l.name) + " " + text);
  }
  [[noreturn]] void fail(const Joint& j, const std::string& text) const {
    log_.fail(j.line, "joint " + named(j.spec.name) + ": " + text);
  }
  std::size_t parent(std::size_t i) const { return by_name_.at(carrier_[i]->parent); }

  std::size_t find_root() const {
    std::optional<std::size_t> root;
    for (std::size_t i = 0; i < m_.links.size(); ++i) {
      if (carrier_[i]) continue;
      if (root)
        fail(m_.links[i], "and link " + named(m_.links[*root].name) +
                              " are no joint's child, expected one root link");
      root = i;
    }
    return root ? *root : refuse_cycle(0);
  }
  /// `i` has no way up to a root.
  [[noreturn]] std::size_t refuse_cycle(std::size_t i) const {
    std::set<std::size_t> seen;
    while (seen.insert(i).second) i = parent(i);  // ends on the cycle itself
    const Joint& j = *carrier_[i];
    std::string path = named(m_.links[i].name);
    for (std::size_t k = parent(i);; k = parent(k)) {
      path += " on " + named(m_.links[k].name);
      if (k == i) fail(j, "is part of a cycle (" + path + "), expected a tree with one root link");
    }
  }

  /// Children in the file order of their joints.
  std::vector<std::size_t> depth_first(std::size_t root) const {
    std::vector<std::size_t> order, stack{root};
    std::vector<bool> reached(m_.links.size());
    while (!stack.empty()) {
      const std::size_t i = stack.back();
      stack.pop_back();
      order.push_back(i);
      reached[i] = true;
      stack.insert(stack.end(), children_[i].rbegin(), children_[i].rend());
    }
    for (std::size_t i = 0; i < reached.size(); ++i)
      if (!reached[i]) refuse_cycle(i);
    return order;
  }

  /// Gives every link its mass properties. A link that never moves needs none.
  void settle_masses(const std::vector<std::size_t>& order) {
    std::vector<bool> moves(m_.links.size());
    std::vector<std::size_t> missing;
    for (const std::size_t i : order) {
      const Joint* j = carrier_[i];
      moves[i] = j ? moves[parent(i)] || freedoms(j->spec.type) > 0 : free_base_;
      const auto given = options_.link_inertia.find(m_.links[i].name);
      if (m_.links[i].mass)
        masses_[i] = *m_.links[i].mass;
      else if (given != options_.link_inertia.end())
        masses_[i] = given->second;
      else if (moves[i])
        missing.push_back(i);
    }
    if (!missing.empty()) settle_missing(missing);
  }
  void settle_missing(const std::vector<std::size_t>& missing) {
    std::string names;
    for (const std::size_t i : missing)
      names += (names.empty() ? "" : ", ") + named(m_.links[i].name);
    const Link& first = m_.links[missing[0]];
    if (options_.links_without_inertia == UrdfOptions::NoInertia::massless)
      return log_.note(first.line, "links without <inertial>, taken as massless: " + names);
    fail(first, "has no <inertial>; give it mass properties under [model.inertia." + first.name +
                    "] or set links_without_inertia = \"massless\"" +
                    (missing.size() > 1 ? " (the same holds for all of " + names + ")" : ""));
  }

  MechanismBuilder parts(const std::vector<std::size_t>& order) const {
    MechanismBuilder builder(m_.name);
    builder.gravity(options_.gravity);
    builder.accept_unphysical_inertia(options_.accept_unphysical_inertia);
    for (const std::size_t i : order)
      if (carrier_[i] || !is_world(m_.links[i])) builder.add(body(i));
    return builder;
  }
  Mechanism build(const MechanismBuilder& builder) const {
    try {
      return builder.build();
    } catch (const InvalidArgument& e) {  // faults of the whole have no line, but they have a file
      if (std::string_view(e.what()).starts_with(log_.file() + ":")) throw;
      log_.fail(e.what());
    }
  }
  BodySpec body(std::size_t i) const {
    BodySpec b;
    b.name = m_.links[i].name;
    b.mass = masses_[i];
    b.where = log_.at(m_.links[i].line);
    if (const Joint* j = carrier_[i]) {
      b.parent = j->parent, b.joint = j->spec, b.placement = j->placement;
    } else {
      b.parent = "world";
      b.joint.type = free_base_ ? "free" : "fixed";
      b.joint.name = free_base_ ? base_joint_name : "root";
      while (joint_lines_.count(b.joint.name)) b.joint.name += "_";
    }
    return b;
  }
  /// A root link named "world" on a fixed base is the inertial frame itself, as many files mean it.
  bool is_world(const Link& root) const {
    if (root.name != "world") return false;
    if (free_base_)
      fail(root, "is the inertial frame, expected another name for the root of a free base");
    return true;
  }

  const Model& m_;
  Log& log_;
  const UrdfOptions& options_;
  const bool free_base_ = options_.base == UrdfOptions::Base::free;
  const std::size_t n_ = m_.links.size();
  std::map<std::string, std::size_t> by_name_;
  std::map<std::string, int> joint_lines_;
  // per link:
  std::vector<const Joint*> carrier_ = std::vector<const Joint*>(n_);  ///< the joint it hangs on
  std::vector<std::vector<std::size_t>> children_ = std::vector<std::vector<std::size_t>>(n_);
  std::vector<MassProperties> masses_ = std::vector<MassProperties>(n_);
};

}  // namespace

UrdfResult parse_urdf(const std::string& text, const std::string& name,
                      const UrdfOptions& options) {
  Log log(name);
  const Model model = Reader(log, options).read(text);
  return Assembler(model, log, options).run();
}

UrdfResult read_urdf(const std::string& path, const UrdfOptions& options) {
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument("URDF file " + named(path) + " cannot be opened: " + why);
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) refuse("it is a directory");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(std::generic_category().message(errno));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) refuse("it cannot be read");
  return parse_urdf(text, path, options);
}

}  // namespace porthos::mechanics
