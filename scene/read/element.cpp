#include "scene/read/element.h"

#include <fmt/format.h>

#include "mechanics/mechanical_model.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {

phs::FunctionPtr read_signal(const Table& t, const std::string& unit) {
  const int given = t.has("constant") + t.has("sine") + t.has("profile");
  if (given != 1)
    refuse(t.where(), fmt::format("{} has {} of the keys constant, sine and profile, expected one",
                                  t.label(), given));
  if (t.has("constant")) return phs::constant(t.number("constant", unit));
  if (t.has("sine")) {
    const Table s = t.table("sine");
    return phs::sine(s.number("amplitude", unit), s.number("frequency"), s.number("phase"));
  }
  const Table p = t.table("profile");
  return phs::profile(p.list("times"), p.list("values", unit));
}

JointPlace joint_place(const mechanics::MechanicalModel& model, const std::string& where,
                       const std::string& who, const std::string& joint) {
  std::string known;
  for (const auto& c : model.mechanism().coordinates()) {
    if (c.nq != 1 || c.nv != 1) continue;
    add_to_list(known, c.name);
    if (c.name != joint) continue;
    for (const auto& p : model.description().ports)
      if (p.size == 1 && p.name.rfind(c.name + ".", 0) == 0)
        return {"mechanism." + c.name, "mechanism." + p.name, c.q};
  }
  throw InvalidArgument(
      fmt::format("{}: {}: the model has no joint '{}' of one freedom, expected one of: {}", where,
                  who, joint, known.empty() ? "(none)" : known));
}

std::vector<Element> read_elements(const Table& scene) {
  std::vector<Element> list;
  scene.each_of("element", "type", [&](const std::string& word, const Table& t) {
    const auto& types = element_types();
    const auto type = std::find_if(types.begin(), types.end(),
                                   [&](const ElementType& each) { return each.name == word; });
    Element e;
    e.type = word;
    e.where = t.where();
    if (type->place == ElementType::Place::joint) {
      e.joint = t.text("joint", "the name of a joint");
      e.name = t.has("name") ? t.text("name", "text") : e.joint + "." + word;
    } else {
      e.name = t.text("name", "the name of its row in the ledger");
    }
    at_line(e.where, [&] { type->read(t, e); });
    list.push_back(std::move(e));
  });
  return list;
}

void add_elements(phs::Network& n, const mechanics::MechanicalModel& model,
                  const std::vector<Element>& elements) {
  for (const Element& e : elements) {
    if (!e.add) continue;  // on links, or a stop
    const JointPlace at = joint_place(model, e.where, "element '" + e.name + "'", e.joint);
    at_line(e.where, [&] { e.add(e, {n, model, at}); });
  }
}

}  // namespace porthos::scene
