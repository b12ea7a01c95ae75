#include "integrators/tables/collocation_table.h"
#include "phs/functions/pieces.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_force(const Table& t, Element& e) {
  phs::FunctionPtr force;
  if (t.has("pieces")) {
    for (const char* key : {"constant", "sine", "profile", "file"})
      if (t.has(key)) t.fail(key, "is given besides pieces, expected one of both");
    const Table p = t.table("pieces");
    e.period = p.positive("period");
    const auto nodes = p.whole("nodes");
    if (nodes < 1 || nodes > 8) p.fail("nodes", fmt::format("is {}, expected 1 to 8", nodes));
    force = phs::pieces(e.period, integrators::gauss_table<double>(int(nodes)).c,
                        p.list("values", " of N m or N"));
  } else {
    force = read_signal(t, " of N m or N", &e.period);
  }
  e.add = [source = std::move(force)](const Element& own, const JointElement& at) {
    at.require_freedom(own);
    at.network.source(own.name, at.place.port, source);
  };
}

}  // namespace

ElementType force_element() {
  using namespace keys;
  return {"force", "A torque or force of time.", ElementType::Place::joint,
          joined(signal_keys("N m (N)"), {table("pieces", "pieces", "instead of the four",
                                                "{ period, nodes, values }, as porthos plan "
                                                "writes them")}),
          read_force};
}

}  // namespace porthos::scene
