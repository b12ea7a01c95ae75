#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_dc_motor(const Table& t, Element& e) {
  phs::DcMotor m;
  m.inductance = t.number("inductance");
  m.resistance = t.number("resistance");
  m.constant = t.number("constant");
  m.gear = t.number("gear");
  m.rotor_inertia = t.not_negative("rotor_inertia");
  m.friction = t.not_negative("friction");
  e.motor = m;
  t.require("voltage", "a table with one of the keys constant, sine, profile");
  e.add = [m, voltage = read_signal(t.table("voltage"), " of V")](const Element& own,
                                                                  const JointElement& at) {
    at.require_freedom(own);
    phs::Network& n = at.network;
    n.add(own.name, phs::dc_drive(m));
    n.feedback(at.place.port, own.name + ".shaft");
    n.source(own.name + ".voltage", own.name + ".supply", voltage);
    if (m.friction > 0)
      n.resist(own.name + ".rotor_friction", at.place.port,
               phs::viscous(m.friction * m.gear * m.gear));
  };
}

}  // namespace

ElementType dc_motor_element() {
  using namespace keys;
  return {"dc_motor",
          "A geared DC motor.",
          ElementType::Place::joint,
          {number("inductance", "H", required, "more than 0"),
           number("resistance", "Ω", required, "0 or more"),
           number("constant", "N m/A", required, "torque per current"),
           number("gear", "1", "1", "turns of the rotor per turn of the joint"),
           number("rotor_inertia", "kg m²", "0", "on the rotor's side"),
           number("friction", "N m s/rad", "0", "on the rotor's side"),
           signal_table("voltage", required, "[V]")},
          read_dc_motor};
}

}  // namespace porthos::scene
