#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "energy_shaping/design_on_model.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using energy_shaping::DesignJoints;
using energy_shaping::DesignOnModel;
using energy_shaping::ModelPtr;
using DesignGains = std::map<std::string_view, double>;

/// A design, its gains, and its law for a model.
struct DesignWord {
  std::string name;
  Names gains;
  DesignOnModel (*make)(ModelPtr, const DesignJoints&, const DesignGains&);
};

const std::vector<DesignWord>& design_words() {
  static const std::vector<DesignWord> all{
      {"cart_pole",
       {"k", "m22", "P", "kv"},
       [](ModelPtr model, const DesignJoints& joints, const DesignGains& g) {
         return cart_pole_on(
             model, joints, {.k = g.at("k"), .m22 = g.at("m22"), .P = g.at("P"), .kv = g.at("kv")});
       }},
      {"acrobot",
       {"a2", "a3", "ku", "kv"},
       [](ModelPtr model, const DesignJoints& joints, const DesignGains& g) {
         return acrobot_on(
             model, joints,
             {.a2 = g.at("a2"), .a3 = g.at("a3"), .ku = g.at("ku"), .kv = g.at("kv")});
       }},
      {"inertia_wheel",
       {"a1", "a2", "a3", "k1", "kv"},
       [](ModelPtr model, const DesignJoints& joints, const DesignGains& g) {
         return inertia_wheel_on(model, joints,
                                 {.a1 = g.at("a1"),
                                  .a2 = g.at("a2"),
                                  .a3 = g.at("a3"),
                                  .k1 = g.at("k1"),
                                  .kv = g.at("kv")});
       }},
      {"ball_and_beam",
       {"kp", "kv"},
       [](ModelPtr model, const DesignJoints& joints, const DesignGains& g) {
         return ball_and_beam_on(model, joints, {.kp = g.at("kp"), .kv = g.at("kv")});
       }}};
  return all;
}

struct IdaPbc {
  const DesignWord* design = nullptr;
  DesignGains gains;
  std::string drives;
  std::map<std::string, double> rest;  ///< by joint
  double limit = HUGE_VAL;
};

ControllerDesign design_ida_pbc(const Controller& c, const ControllerPlant& plant,
                                const IdaPbc& w) {
  DesignJoints joints;
  joints.driven = controlled_joint(*plant.model, c, w.drives).port;
  joints.rest = stated_start(plant);
  for (const auto& [joint, target] : w.rest)
    joints.rest[controlled_joint(*plant.model, c, joint).q] = target;
  joints.limit = w.limit;
  const auto made = w.design->make(plant.model, joints, w.gains);
  return {{made.port_law()}, made.certificate()};
}

void read_ida_pbc(const Table& t, Controller& c) {
  IdaPbc w;
  const std::string word = t.choice("design");
  w.design = &*std::ranges::find(design_words(), word, &DesignWord::name);
  w.drives = t.text("drives", "the name of the joint with an actuator");
  t.each("joints", [&](const std::string& joint, const std::string&, const Table& own) {
    w.rest[joint] = own.number("target");
  });
  t.require("gains", "a table with " + joined(w.design->gains));
  const Table gains = t.table("gains");
  for (const auto& name : w.design->gains) w.gains[name] = gains.number(name.data());
  for (const auto& other : design_words())
    for (const auto& name : other.gains)
      if (!w.gains.contains(name) && gains.has(name.data()))
        gains.fail(name.data(), fmt::format("is no gain of design = \"{}\", expected {}", word,
                                            joined(w.design->gains)));
  if (t.has("limit")) w.limit = t.positive("limit");
  c.design = [w](const Controller& own, const ControllerPlant& plant) {
    return design_ida_pbc(own, plant, w);
  };
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
          "Interconnection and damping assignment for a mechanism of two joints with one actuator.",
          {word("design", words, required, "whose formulas; its numbers are read off the model"),
           text("drives", required, "the joint with the actuator"),
           table("joints", "controller.ida_pbc.joint", required, "by joint: where it rests",
                 KeyKind::named),
           table("gains", "controller.ida_pbc.gains", required, "those of the design"),
           number("limit", "N m (N)", "none", "largest torque or force")},
          {{"controller.ida_pbc.joint",
            "[controller.joints]",
            "Where a joint is to rest: upright, level, the wanted place.",
            {number("target", "rad (m)", required, "angles count turns")}},
           {"controller.ida_pbc.gains",
            "[controller.gains]",
            "The gains of a design, see energy_shaping/designs.h.",
            {gain("k", "cart_pole"), gain("m22", "cart_pole"), gain("P", "cart_pole"),
             gain("a1", "inertia_wheel"), gain("a2", "acrobot, inertia_wheel"),
             gain("a3", "acrobot, inertia_wheel"), gain("k1", "inertia_wheel"),
             gain("ku", "acrobot"), gain("kp", "ball_and_beam"), gain("kv", "damping, of all")}}},
          read_ida_pbc};
}

}  // namespace porthos::scene
