#include "scene/read/contact.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_joint_stop(const Table& t, Element& e) {
  JointStop s;
  if (t.has("lower")) s.lower = t.number("lower");
  if (t.has("upper")) s.upper = t.number("upper");
  if (s.lower && s.upper && !(*s.lower < *s.upper))
    t.fail("lower", fmt::format("is {}, expected less than upper, {}", *s.lower, *s.upper));
  s.law = read_law(t);
  e.stop = s;
}

}  // namespace

ElementType joint_stop_element() {
  using namespace keys;
  return {"joint_stop", "Stops that bounce, with the law of a contact.", ElementType::Place::joint,
          joined({number("lower", "rad (m)", "the model file's, if any", ""),
                  number("upper", "rad (m)", "the model file's, if any", "")},
                 law_keys({"smooth", "power", "rigid"}, "N m/radⁿ (N/mⁿ)", required, "rad (m)",
                          "s/rad (s/m)", "rad/s (m/s)")),
          read_joint_stop};
}

}  // namespace porthos::scene
