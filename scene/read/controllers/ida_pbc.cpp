#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "energy_shaping/matching/design_on_model.h"
#include "energy_shaping/matching/vtol_on_model.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/held_law.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using energy_shaping::DesignJoints;
using energy_shaping::ModelPtr;
using DesignGains = std::map<std::string_view, double>;

/// What a scene says of the joints, and of an engine.
struct DesignPlace {
  DesignJoints joints;
  energy_shaping::Engine engine;
};

/// A design, its gains, and its law for a model.
struct DesignWord {
  std::string name;
  Names gains;
  ControllerDesign (*make)(ModelPtr, const DesignPlace&, const DesignGains&);
  bool engine = false;     ///< it has one instead of a joint with an actuator
  bool bandwidth = false;  ///< it takes bandwidth and damping_ratio instead of its gains
};

ControllerDesign of_joint(const energy_shaping::DesignOnModel& made) {
  return {{made.port_law()}, made.certificate()};
}

const std::vector<DesignWord>& design_words() {
  static const std::vector<DesignWord> all{
      {"cart_pole",
       {"k", "m22", "P", "kv"},
       [](ModelPtr model, const DesignPlace& at, const DesignGains& g) {
         return of_joint(
             cart_pole_on(model, at.joints,
                          {.k = g.at("k"), .m22 = g.at("m22"), .P = g.at("P"), .kv = g.at("kv")}));
       }},
      {"acrobot",
       {"a2", "a3", "ku", "kv"},
       [](ModelPtr model, const DesignPlace& at, const DesignGains& g) {
         return of_joint(
             acrobot_on(model, at.joints,
                        {.a2 = g.at("a2"), .a3 = g.at("a3"), .ku = g.at("ku"), .kv = g.at("kv")}));
       }},
      {"inertia_wheel",
       {"a1", "a2", "a3", "k1", "kv"},
       [](ModelPtr model, const DesignPlace& at, const DesignGains& g) {
         if (g.contains("bandwidth"))
           return of_joint(
               inertia_wheel_on(model, at.joints, g.at("bandwidth"), g.at("damping_ratio")));
         return of_joint(inertia_wheel_on(model, at.joints,
                                          {.a1 = g.at("a1"),
                                           .a2 = g.at("a2"),
                                           .a3 = g.at("a3"),
                                           .k1 = g.at("k1"),
                                           .kv = g.at("kv")}));
       },
       false,
       true},
      {"ball_and_beam",
       {"kp", "kv"},
       [](ModelPtr model, const DesignPlace& at, const DesignGains& g) {
         return of_joint(ball_and_beam_on(model, at.joints, {.kp = g.at("kp"), .kv = g.at("kv")}));
       }},
      {"vtol",
       {"k1", "k2", "k3", "P", "kv"},
       [](ModelPtr model, const DesignPlace& at, const DesignGains& g) {
         const energy_shaping::VtolOnModel made(model, at.engine, at.joints.rest,
                                                {.k1 = g.at("k1"),
                                                 .k2 = g.at("k2"),
                                                 .k3 = g.at("k3"),
                                                 .P = g.at("P"),
                                                 .kv = g.at("kv")});
         return ControllerDesign{made.port_laws(), made.certificate()};
       },
       true}};
  return all;
}

struct IdaPbc {
  const DesignWord* design = nullptr;
  DesignGains gains;
  std::string drives;                  ///< empty: an engine
  std::map<std::string, double> rest;  ///< by joint
  energy_shaping::Engine engine;
  double limit = HUGE_VAL;
};

ControllerDesign design_ida_pbc(const Controller& c, const ControllerPlant& plant,
                                const IdaPbc& w) {
  DesignPlace at{.joints = {}, .engine = w.engine};
  if (!w.drives.empty()) at.joints.driven = controlled_joint(*plant.model, c, w.drives).port;
  at.joints.rest = stated_start(plant);
  for (const auto& [joint, target] : w.rest)
    at.joints.rest[controlled_joint(*plant.model, c, joint).q] = target;
  at.joints.limit = w.limit;
  ControllerDesign made = w.design->make(plant.model, at, w.gains);
  made.remark = certify_held(made.certificate, c, plant, made.laws, at.joints.rest);
  return made;
}

/// The joint with the actuator, or the engine.
void read_actuation(const Table& t, IdaPbc& w) {
  const bool engine = w.design->engine;
  const auto only = [&](const char* key, bool other) {
    if (other && t.has(key))
      t.fail(key, fmt::format("is no key of design = \"{}\", expected {}", w.design->name,
                              engine ? "engine" : "drives"));
  };
  only("drives", engine);
  only("limit", engine);
  only("engine", !engine);
  if (!engine) {
    t.require("drives", "the name of the joint with an actuator");
    w.drives = t.text("drives", "the name of the joint with an actuator");
    if (t.has("limit")) w.limit = t.positive("limit");
    return;
  }
  t.require("engine", "a table with the link and the point where it acts");
  const Table own = t.table("engine");
  w.engine = {own.text("link", "the name of a link"), own.vector("point")};
}

void read_design_gains(const Table& t, IdaPbc& w) {
  std::string expected = joined(w.design->gains);
  if (w.design->bandwidth) expected += ", or bandwidth and damping_ratio";
  if (w.design->bandwidth && t.has("bandwidth")) {
    w.gains["bandwidth"] = t.positive("bandwidth");
    w.gains["damping_ratio"] = t.has("damping_ratio") ? t.positive("damping_ratio") : 1;
    expected = "damping_ratio beside bandwidth";
  } else {
    if (t.has("bandwidth") && !w.design->bandwidth)
      t.fail("bandwidth", fmt::format("is of design = \"inertia_wheel\" alone, expected {} of "
                                      "design = \"{}\" (docs/controllers.md, gains of a design)",
                                      expected, w.design->name));
    for (const auto& name : w.design->gains) {
      t.require(name.data(), "one of the gains " + expected);
      w.gains[name] = t.number(name.data());
    }
  }
  const auto refuse_others = [&](const Names& names) {
    for (const auto& name : names)
      if (!w.gains.contains(name) && t.has(name.data()))
        t.fail(name.data(),
               fmt::format("is no gain of design = \"{}\", expected {}", w.design->name, expected));
  };
  for (const auto& design : design_words()) refuse_others(design.gains);
  refuse_others({"bandwidth", "damping_ratio"});
}

void read_ida_pbc(const Table& t, Controller& c) {
  IdaPbc w;
  const std::string word = t.choice("design");
  w.design = &*std::ranges::find(design_words(), word, &DesignWord::name);
  read_actuation(t, w);
  t.each("joints", [&](const std::string& joint, const std::string&, const Table& own) {
    w.rest[joint] = own.number("target");
  });
  t.require("gains", "a table with " + joined(w.design->gains));
  const Table gains = t.table("gains");
  read_design_gains(gains, w);
  c.design = made_of(design_ida_pbc, w);
}

}  // namespace

ControllerType ida_pbc_controller() {
  using namespace keys;
  std::vector<std::string> words;
  for (const auto& d : design_words()) words.push_back(d.name);
  const auto gain = [](const char* name, const char* of) {
    return number(name, "of the design", "required by its design", of);
  };
  return {"ida_pbc",
          "Interconnection and damping assignment for a mechanism of two joints with one actuator, "
          "or a planar vehicle with an engine.",
          {word("design", words, required, "whose formulas; its numbers are read off the model"),
           text("drives", "required but by vtol", "the joint with the actuator"),
           table("engine", "controller.ida_pbc.engine", "required by vtol", "of a vehicle"),
           table("joints", "controller.ida_pbc.joint", required, "by joint: where it rests",
                 KeyKind::named),
           table("gains", "controller.ida_pbc.gains", required, "those of the design"),
           number("limit", "N m (N)", "none", "largest torque or force")},
          {{"controller.ida_pbc.engine",
            "[controller.engine]",
            "Two forces in the plane of a vehicle, through one point below its centre of mass.",
            {text("link", required, "that the engine pushes"),
             numbers("point", 3, "m", "[0, 0, 0]", "where it acts, in the link's frame")}},
           {"controller.ida_pbc.joint",
            "[controller.joints]",
            "Where a joint is to rest: upright, level, the wanted place.",
            {number("target", "rad (m)", required, "angles count turns")}},
           {"controller.ida_pbc.gains",
            "[controller.gains]",
            "The gains of a design, see energy_shaping/matching/designs.h.",
            {gain("k", "cart_pole"), gain("m22", "cart_pole"), gain("P", "cart_pole, vtol"),
             gain("a1", "inertia_wheel"), gain("a2", "acrobot, inertia_wheel"),
             gain("a3", "acrobot, inertia_wheel"), gain("k1", "inertia_wheel, vtol"),
             gain("k2", "vtol"), gain("k3", "vtol"), gain("ku", "acrobot"),
             gain("kp", "ball_and_beam"), gain("kv", "damping, of all"),
             number("bandwidth", "rad/s", "none",
                    "ω of inertia_wheel, instead of its gains: poles of (s² + 2ζω s + ω²)²"),
             number("damping_ratio", "1", "1", "ζ beside bandwidth")}}},
          read_ida_pbc};
}

}  // namespace porthos::scene
