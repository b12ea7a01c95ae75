#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>
#include <string_view>

#include "mechanics/joint_list.h"
#include "mechanics/urdf_file-inl.h"

namespace porthos::mechanics::urdf {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

constexpr std::string_view blanks = " \t\r\n";

/// "joint 'elbow': " for an element inside that joint.
std::string owner(const XMLElement& inside) {
  for (const XMLElement* e = &inside; e; e = e->Parent() ? e->Parent()->ToElement() : nullptr) {
    const std::string_view tag = e->Name();
    const char* name = e->Attribute("name");
    if (name && (tag == "link" || tag == "joint"))
      return std::string(tag) + " " + named(name) + ": ";
  }
  return "";
}

/// The attribute as in the file, shortened if long: <origin xyz="0 0">
std::string shown(const XMLElement& e, const XMLAttribute& a) {
  std::string value = a.Value();
  if (value.size() > 60) value = value.substr(0, 57) + "...";
  return "<" + std::string(e.Name()) + " " + a.Name() + "=\"" + value + "\">";
}

std::string tag(const XMLElement& e) { return "<" + std::string(e.Name()) + ">"; }

/// The finite number that all of `word` spells, in any locale.
std::optional<double> finite_number(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto x = as_number(word);
  return x && std::isfinite(*x) ? x : std::nullopt;
}

/// XML -> File.
class FileReader {
 public:
  FileReader(Log& log, const UrdfOptions& options) : log_(log), options_(options) {}

  File read(const std::string& text) {
    tinyxml2::XMLDocument document;
    const XMLElement& robot = parse(document, text);
    expect(robot, {"name", "version"}, {}, {"link", "joint"});
    File m{name_of(robot), {}, {}, {}};
    for (auto* e = robot.FirstChildElement("link"); e; e = e->NextSiblingElement("link"))
      m.links.push_back(link(*e));
    for (auto* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint"))
      m.joints.push_back(joint(*e));
    m.mimics = std::move(mimics_);
    if (m.links.empty()) fail(robot, "<robot> has no <link>, expected at least one");
    declare_world(m);
    return m;
  }

 private:
  using Names = std::initializer_list<std::string_view>;
  static bool among(Names names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  /// Messages at an element or its attribute, after the name of the link or joint that contains it.
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
    const auto detail = all.find(": ", all.find("Line number="));  // from npos: npos
    return detail == all.npos ? words : words + " (" + all.substr(detail + 2) + ")";
  }

  /// Ignores nothing silently: notes each attribute, child and text of `e` that is not listed.
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
      const bool drawn = name == "visual" || name == "material", shape = name == "collision";
      const char* use = drawn ? "only drawn" : shape ? "only for a [[contact]]" : "not read";
      log_.count(child.GetLineNum(), tag(child), use);
    } else if (name.starts_with("xacro:")) {
      fail(child, tag(child) + " is a macro, expected plain URDF: expand it with xacro first");
    } else {
      note(child, "unknown tag " + tag(child) + " in " + tag(e) + ", ignored");
    }
  }

  /// The robot's name; without one, the file's name.
  std::string name_of(const XMLElement& robot) {
    if (const char* name = robot.Attribute("name"); name && *name) return name;
    std::string stem = std::filesystem::path(log_.file()).stem().string();
    note(robot, "<robot> has no name, called like its file: " + named(stem));
    return stem;
  }
  /// An undeclared parent "world" is the inertial frame.
  void declare_world(File& m) {
    const auto is_world = [](const Link& l) { return l.name == "world"; };
    if (std::any_of(m.links.begin(), m.links.end(), is_world)) return;
    for (const Joint& j : m.joints) {
      if (j.parent != "world") continue;
      m.links.push_back({"world", j.line, {}});
      log_.note(j.line, "joint " + named(j.spec.name) +
                            ": its parent 'world' is not a link of this file, taken as the "
                            "inertial frame");
      return;
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
    const Sym3<double> I{i("ixx"), i("ixy"), i("ixz"), i("iyy"), i("iyz"), i("izz")};
    const Pose at = origin(e);
    const MassProperties m{scalar(mass, "value"), at.r, I, at.R};
    // A gram does not extend over metres: a tensor in kg mm^2.
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
    if (const auto* m = e.FirstChildElement("mimic")) mimic(*m, j.spec.name);
    return j;
  }

  void mimic(const XMLElement& e, const std::string& own) {
    expect(e, {"joint", "multiplier", "offset"});
    const std::string other = required(e, "joint");
    if (!options_.couple_mimics)
      return note(e, "<mimic> ignored without mimic = \"couple\": joint " + named(other));
    const auto by = [&](const char* key, double d) { return optional_scalar(e, key).value_or(d); };
    mimics_.push_back({own + ".mimic", {{own, 1}, {other, -by("multiplier", 1)}}, by("offset", 0)});
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
    if (freedoms(spec.type) == 1) std::tie(spec.effort, spec.rate) = std::tie(effort, velocity);
    const auto lower = optional_scalar(*l, "lower"), upper = optional_scalar(*l, "upper");
    if (lower && upper && *lower > *upper)  // Bullet writes this for "none"
      note(*l, "its lower limit " + number(*lower) + " is above the upper one, " + number(*upper) +
                   ": taken as no limit");
    else if (freedoms(spec.type) == 1) {
      std::tie(spec.lower, spec.upper) = std::tie(lower, upper);
    } else if (lower || upper)
      log_.count(line, "<limit> lower or upper of a " + spec.type + " joint", "ignored");
  }

  void dynamics(const XMLElement& e, JointSpec& spec) {
    const auto* d = e.FirstChildElement("dynamics");
    if (!d) return;
    expect(*d, {"damping", "friction"});
    const double damping = optional_scalar(*d, "damping").value_or(0);
    spec.friction = optional_scalar(*d, "friction").value_or(0);
    if (options_.use_damping && spec.type != "fixed") spec.damping = damping;
    const std::string fate = " read but not simulated";
    if (spec.friction > 0 && !options_.use_friction)
      note(*d, "friction " + number(spec.friction) + fate);
    if (damping != spec.damping) note(*d, "damping " + number(damping) + fate);
  }

  Log& log_;
  const UrdfOptions& options_;
  std::vector<Coupling> mimics_;
};
}  // namespace

File read_file(Log& log, const std::string& text, const UrdfOptions& options) {
  return FileReader(log, options).read(text);
}

}  // namespace porthos::mechanics::urdf
