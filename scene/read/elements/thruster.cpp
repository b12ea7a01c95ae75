#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

space::Schedule schedule(const Table& t) {
  if (t.has("switches") && t.has("pulses"))
    t.fail("pulses", "is given with switches, expected one of both");
  if (t.has("switches")) return space::Schedule(t.list("switches"));
  if (!t.has("pulses")) return {};
  const Table p = t.table("pulses");
  return space::Schedule::pulses(p.number("start"), p.positive("period"), p.positive("width"),
                                 long(p.whole("count")));
}

void read_thruster(const Table& t, Element& e) {
  space::Thruster x;
  x.name = e.name;
  x.link = t.text("link", "the name of a link");
  x.position = t.vector("at");
  x.direction = t.direction("direction");
  x.thrust = t.positive("thrust");
  x.schedule = schedule(t);
  if (t.has("specific_impulse")) x.specific_impulse = t.positive("specific_impulse");
  e.thruster = x;
}

}  // namespace

ElementType thruster_element() {
  using namespace keys;
  return {"thruster",
          "A force fixed to a link.",
          ElementType::Place::link,
          {text("link", required, ""), numbers("at", 3, "m", "[0, 0, 0]", "in the link's frame"),
           numbers("direction", 3, "1", required, "of the force, in the link's axes"),
           number("thrust", "N", required, "more than 0"),
           list("switches", "s", "always on", "on, off, on, off …: whole steps"),
           table("pulses", "pulses", "always on", "instead: even pulses"),
           number("specific_impulse", "s", "not given", "propellant is reported then")},
          read_thruster};
}

}  // namespace porthos::scene
