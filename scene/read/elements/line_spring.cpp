#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_line_spring(const Table& t, Element& e) {
  space::SoftLatch x;
  x.name = e.name;
  x.link = t.text("link", "the name of a link");
  x.body = t.has("body") ? t.text("body", "the name of a link, or \"world\"") : "world";
  if (x.link == "world")
    t.fail("link", "is \"world\", expected the name of a link; body may be the world");
  x.on_link.r = t.vector("on_link");
  x.on_body.r = t.vector("on_body");
  x.line = {t.not_negative("stiffness"), t.not_negative("rest"), t.not_negative("damping")};
  if (!(x.line.stiffness + x.line.damping > 0))
    refuse(t.where(), t.label() + " does nothing, expected a stiffness or a damping");
  e.latch = x;
}

}  // namespace

ElementType line_spring_element() {
  using namespace keys;
  return {"line_spring",
          "A spring and a damper along the line between two points.",
          ElementType::Place::link,
          {text("link", required, ""),
           text("body", "\"world\"", "another link, a [[body]], or the world"),
           numbers("on_link", 3, "m", "[0, 0, 0]", "its end in the link's frame"),
           numbers("on_body", 3, "m", "[0, 0, 0]", "its other end in the frame of body"),
           number("stiffness", "N/m", "0", "0 or more"),
           number("rest", "m", "0", "its length without force"),
           number("damping", "N s/m", "0", "of the rate of its length")},
          read_line_spring};
}

}  // namespace porthos::scene
