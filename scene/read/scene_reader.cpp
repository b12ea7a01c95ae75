#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>

#include "scene/read/element.h"
#include "scene/read/panel.h"
#include "scene/read/run_reader-inl.h"
#include "scene/read/scene.h"
#include "scene/read/scene_texts.h"
#include "scene/read/toml_table-inl.h"
#include "scene/read/urdf_friction.h"
#include "scene/read/variation.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using mechanics::Vec3d;

std::string read_file(const std::string& path, const std::string& what) {
  const auto refuse = [&](const std::string& why) {
    throw_unreadable(fmt::format("{} '{}' cannot be opened: {}", what, path, why), errno);
  };
  std::error_code ignored;
  errno = 0;
  if (fs::is_directory(path, ignored)) refuse("it is a directory");
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(std::generic_category().message(errno));
  std::string text(std::istreambuf_iterator<char>(file), {});
  if (file.bad()) refuse("it cannot be read");
  return text;
}

class Reader {
 public:
  explicit Reader(std::string path, const SceneTexts* kept = nullptr,
                  const StartFrom* kept_from = nullptr, bool of_results = false)
      : file_{std::move(path), kept ? &kept->files : nullptr, &s_.files, of_results},
        kept_(kept),
        kept_from_(kept_from) {}

  Scene read(std::span<const Replacement> replacements = {}) {
    s_.text = kept_ ? kept_->scene : read_file(file_.path, "scene file");
    s_.path = file_.path;
    root_ = kept_ && !file_.of_results ? parse_again() : parse_toml(s_.text, file_);
    for (const Replacement& r : replacements) replace(root_, r.key, r.values);
    const Table top(file_, root_, "the scene", "", *schema_of("scene"));
    s_.title = top.has("title") ? top.text("title", "text") : scene_name();
    // Keys that determine a run must be stated; all others have a default.
    model(top.section("model"));
    if (top.has("environment")) environment(top.section("environment"));
    if (top.has("initial")) initial(top.section("initial"));
    s_.robots =
        read_robots(top, fs::path(s_.path).parent_path().string(), kept_ != nullptr, s_.urdf_text);
    s_.bodies = read_bodies(top);
    s_.panels = read_panels(top);
    s_.elements = read_elements(top);
    if (s_.urdf.use_friction) add_urdf_friction(s_);
    s_.events = read_events(top);
    if (s_.start_from) {
      const auto carried = carried_events(*s_.start_from);
      if (file_.of_results) leave_out(s_.events, carried);
      s_.events.insert(s_.events.begin(), carried.begin(), carried.end());
    }
    s_.actuators = read_actuators(top);
    for (const auto& e : s_.elements)  // a rotor behind a rigid gear belongs to its joint
      if (e.motor && e.motor->rotor_inertia > 0)
        s_.urdf.rotor_inertia[e.joint] = e.motor->gear * e.motor->gear * e.motor->rotor_inertia;
    s_.constraints = read_constraints(top, s_.events);
    s_.contacts = read_contacts(top);
    s_.controllers = read_controllers(top, fs::path(s_.path).parent_path().string());
    s_.outputs = read_outputs(top);
    s_.stops = read_stops(top, s_.outputs);
    s_.orbit = read_orbit(top);
    if (s_.orbit && s_.start_from) go_on_in_orbit(*s_.start_from, *s_.orbit);
    const Table method = top.section("integrator");
    read_integrator(method, s_);
    if (top.has("monitor")) read_monitor(top.section("monitor"), s_);
    if (s_.is_constrained()) check_constrained_scene(method);
    read_run(top.section("run"), s_);
    check_pieces(s_);
    if (top.has("verify"))
      read_verify(top.section("verify"), s_);
    else
      s_.verify = default_limits(s_.orbit.has_value());
    if (s_.orbit) check_orbit_scene();
    if (s_.start_from && !s_.constraints.spec.driven.empty())
      refuse(s_.start_from->where,
             "[initial] from cannot be combined with [[motion]], whose time begins anew, expected "
             "one of both");
    check_coordinates();
    return std::move(s_);
  }

 private:
  /// A text that has been read before. The stream operators by which toml++ reads numbers hide
  /// that memory is missing: what is broken now is broken by that.
  toml::table parse_again() const {
    try {
      return parse_toml(s_.text, file_);
    } catch (const InvalidArgument&) {
      throw std::bad_alloc();
    }
  }

  std::string scene_name() const {
    const fs::path path(s_.path);
    return path.stem().string();
  }

  void model(const Table& t) {
    using Options = mechanics::UrdfOptions;
    if (!kept_) t.require("urdf", "the name of a URDF file");
    s_.urdf.base = t.choice("base") == "free" ? Options::Base::free : Options::Base::fixed;
    if (t.choice("links_without_inertia") == "massless")
      s_.urdf.links_without_inertia = Options::NoInertia::massless;
    s_.urdf.accept_unphysical_inertia = t.choice("unphysical_inertia") == "accept";
    if (t.has("lock")) s_.urdf.locked = t.texts("lock", "names of joints");
    s_.urdf.use_damping = t.boolean("use_damping");
    s_.urdf.use_friction = t.boolean("use_friction");
    s_.urdf.couple_mimics = t.choice("mimic") == "couple";
    const auto coordinates = t.choice("coordinates");
    s_.coordinates = coordinates == "maximal" ? Coordinates::maximal
                     : coordinates == "auto"  ? Coordinates::faster
                                              : Coordinates::reduced;
    coordinates_at_ = t.at("coordinates");
    t.each("inertia", [&](const std::string& link, const std::string&, const Table& given) {
      s_.urdf.link_inertia[link] = read_mass_properties(given);
      if (given.boolean("instead")) s_.urdf.replaced_inertia.insert(link);
    });
    if (t.has("mass_factor")) mass_factors(t);
    urdf(t);
  }

  void mass_factors(const Table& t) {
    Names links;
    for (const auto& [link, factor] : t.raw("mass_factor", "a table of links and their factors"))
      links.push_back(link.str());
    const Table factors = t.table("mass_factor", links);
    for (const auto link : links) {
      const std::string name(link);
      const double factor = factors.number(name.c_str(), std::string());
      if (!(factor > 0))
        factors.fail(name.c_str(), fmt::format("is {}, expected more than 0", factor));
      s_.mass_factor[name] = factor;
    }
  }

  void urdf(const Table& t) {
    const std::string name =
        t.has("urdf") ? t.text("urdf", "the name of a URDF file") : "model.urdf";
    if (name.empty()) t.fail("urdf", "is empty, expected the name of a URDF file");
    s_.urdf_path = (fs::path(s_.path).parent_path() / name).string();
    if (kept_) {
      s_.urdf_text = kept_->urdf;
      return;
    }
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
    if (t.has("magnetic_field")) s_.magnetic_field = t.vector("magnetic_field");
    if (kind == "none") return;
    t.require("vector", "3 numbers of m/s^2, because gravity is \"uniform\"");
    s_.urdf.gravity = t.vector("vector");
  }

  void initial(const Table& t) {
    t.each("joints", [&](const std::string& joint, const std::string& where, const Table& start) {
      s_.joints[joint] = joint_start(start);
      s_.joints[joint].where = where;
    });
    if (t.has("from")) {
      const auto moves = [&](const auto& j) {  // a locked one has no place in the record
        return std::ranges::count(s_.urdf.locked, j.first) == 0;
      };
      for (const char* other : {"base", "joints", "random"})
        if (other == std::string("joints") ? std::ranges::any_of(s_.joints, moves) : t.has(other))
          t.fail(other,
                 "is given besides from, which states the whole start, expected one of both");
      s_.start_from = kept_from_ && kept_from_->folder == t.text("from", "a folder")
                          ? *kept_from_
                          : read_start_from(t, fs::path(s_.path).parent_path().string());
      return;
    }
    if (t.has("at")) t.fail("at", "is given without from, expected both or neither");
    if (t.has("base")) base(t);
    if (!t.has("random")) return;
    const Table r = t.table("random");
    RandomStart random;
    random.seed = r.whole("seed");
    random.joint_position = r.not_negative("joint_position");
    random.joint_velocity = r.not_negative("joint_velocity");
    s_.random = random;
  }

  /// Start of a joint. A joint of one degree of freedom has position and velocity; a ball or a free
  /// joint has the keys of a base.
  static JointStart joint_start(const Table& t) {
    JointStart start;
    if (t.has("attitude_wxyz") || t.has("angular_velocity") || t.has("linear_velocity") ||
        t.is_array("position")) {
      if (t.has("velocity"))
        t.fail("velocity",
               "is given to a joint of several degrees of freedom, expected linear_velocity or "
               "angular_velocity");
      start.motion = read_base_start(t);
      start.translates = t.has("position") || t.has("linear_velocity");
      return start;
    }
    if (t.has("position") && !t.is_number("position"))
      t.fail("position", "is " + t.found_at("position") +
                             ", expected a number of rad or m, or 3 numbers of metres");
    start.position = t.number("position");
    start.velocity = t.number("velocity");
    start.states_velocity = t.has("velocity");
    return start;
  }

  void base(const Table& initial) {
    const Table t = initial.table("base");
    s_.base = read_base_start(t);
    s_.base.where = initial.at_key("base");
  }

  /// The default method of loops; refuses what cannot be combined with them.
  void check_constrained_scene(const Table& method) {
    if (!method.has("method")) s_.method = s_.rolls() ? "pgauss16" : "spark16";
    const auto& spec = s_.constraints.spec;
    const std::string name = s_.rolls()             ? spec.rollings.front().name
                             : !spec.driven.empty() ? spec.driven.front().name
                                                    : "";
    if (s_.step_control == integrators::StepControl::time_transformed && !name.empty())
      refuse(method.at("step_control"),
             fmt::format("step_control = \"time_transformed\" cannot be combined with the {} '{}', "
                         "expected one of both",
                         s_.rolls() ? "rolling body" : "motion", name));
  }

  /// Refuses maximal coordinates with what needs those of joints; a free choice is reduced ones
  /// then.
  void check_coordinates() {
    const std::string other = needs_joint_coordinates();
    if (other.empty() || s_.coordinates == Coordinates::reduced) return;
    if (s_.coordinates == Coordinates::maximal)
      refuse(coordinates_at_, "coordinates = \"maximal\" cannot be combined with " + other +
                                  ", which needs joints with coordinates of their own, expected "
                                  "coordinates = \"reduced\"");
    s_.coordinates = Coordinates::reduced;
    s_.why_coordinates = other + " needs them";
  }
  std::string needs_joint_coordinates() const {
    const auto first = [](const auto& all, const auto& is) -> std::string {
      const auto found = std::find_if(all.begin(), all.end(), is);
      return found == all.end() ? "" : " '" + found->name + "'";
    };
    const auto locks = [](const Event& e) {
      return e.type == Event::Type::lock || e.type == Event::Type::unlock;
    };
    const auto at_joint = [](const Element& e) { return !e.latch && !e.thruster && !e.wrench; };
    const auto of_joint = [](const Output& o) { return o.of_joint(); };
    const auto is_rigid = [](const SceneContact& c) { return c.law.rigid(); };
    const std::string event = first(s_.events, locks);
    const std::string element = first(s_.elements, at_joint);
    const std::string output = first(s_.outputs, of_joint);
    const std::string rigid = first(s_.contacts, is_rigid);
    return !event.empty()            ? "the [[event]] of" + event
           : !s_.actuators.empty()   ? "[[actuator]]"
           : !element.empty()        ? "[[element]]" + element
           : !s_.panels.empty()      ? "[[panel]]"
           : !rigid.empty()          ? "the rigid [[contact]]" + rigid
           : !s_.controllers.empty() ? "[[controller]] '" + s_.controllers.front().name + "'"
           : !output.empty()         ? "[[output]]" + output
           : s_.urdf.couple_mimics   ? "mimic = \"couple\""
                                     : "";
  }

  /// Refuses features that cannot be combined with an orbit.
  void check_orbit_scene() const {
    const std::string& where = s_.orbit->where;
    const auto& b = s_.base;
    if (s_.urdf.base != mechanics::UrdfOptions::Base::free)
      refuse(where,
             "[orbit] is given, but the base is \"fixed\", expected [model] base = \"free\"");
    for (const Robot& r : s_.robots)
      if (!r.free)
        refuse(r.where, "robot '" + r.name +
                            "' is fixed to the world and the scene has an [orbit], "
                            "expected base = \"free\"");
    if (mechanics::norm(s_.urdf.gravity) != 0)
      refuse(where, "[orbit] is given with uniform gravity, expected one of both");
    if (mechanics::norm(s_.magnetic_field) != 0)
      refuse(where,
             "[orbit] is given with a constant magnetic_field, expected that of the [planet]");
    if (mechanics::norm(b.position) != 0 || mechanics::norm(b.linear_velocity) != 0)
      refuse(b.where,
             "the base has a position or a linear velocity besides the [orbit] of the "
             "centre of mass, expected attitude and angular velocity alone");
    if (s_.step_control != integrators::StepControl::fixed)
      refuse(
          where,
          "[orbit] is given with a step_control, which goes by the joint rates and would vary the "
          "kicks of the splitting too, expected a fixed step");
  }

  Scene s_;
  File file_;  ///< it leaves what it reads in s_
  const SceneTexts* kept_;
  const StartFrom* kept_from_;  ///< read already
  toml::table root_;
  std::string coordinates_at_;  ///< "file:line:column" of [model] coordinates
};

}  // namespace

Scene read_scene(const std::string& path) { return Reader(path).read(); }

Scene read_variation(const Scene& scene, std::span<const Replacement> replacements) {
  for (const Replacement& r : replacements) require_free(scene.robots, r.key);
  const SceneTexts kept{scene.text, scene.urdf_text, scene.files};
  const StartFrom* from = scene.start_from ? &*scene.start_from : nullptr;
  Scene varied = Reader(scene.path, &kept, from).read(replacements);
  varied.centre_stays = scene.centre_stays;
  return varied;
}

Scene read_scene_again(const std::string& path, const SceneTexts& kept) {
  return Reader(path, &kept, nullptr, true).read();
}

}  // namespace porthos::scene
