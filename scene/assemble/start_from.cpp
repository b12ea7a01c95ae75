#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "scene/assemble/detail/start.h"
#include "scene/files/hdf5_file.h"

namespace porthos::scene {

FromRecord numbers_of(const StartFrom& from, const phs::Description& d, int mechanical) {
  FromRecord r;
  r.state = phs::State(d, std::vector<double>(size_t(d.nx), 0.0));
  r.known.assign(size_t(d.nx), false);
  std::vector<std::string> missing;
  size_t angle = 0;
  const auto put = [&](const auto& group, const phs::Block& b, int at) {
    const auto own = group.find(link_name(b.name));
    if (own == group.end() || own->second.x.size() != size_t(b.size)) {
      if (at < mechanical) missing.push_back(b.name);
      return;
    }
    for (int k = 0; k < b.size; ++k) {
      const auto i = size_t(at + k);
      r.state.x[i] = own->second.x[size_t(k)];
      r.state.lo[i] = own->second.low[size_t(k)];
      r.known[i] = true;
    }
  };
  for (const auto& b : d.blocks) {
    put(from.state, b, b.at);
    if (b.momentum >= 0) put(from.momentum, b, b.momentum);
    if (b.kind != phs::BlockKind::angle) continue;
    if (const auto n = from.turns.find(b.name); n != from.turns.end())
      r.state.turns[angle] = n->second;
    ++angle;
  }
  if (!missing.empty())
    throw InvalidArgument(
        fmt::format("{}: the run in {} does not have the states of this model: {} are missing",
                    from.where, from.folder, fmt::join(missing, ", ")));
  return r;
}

void put_exactly(const FromRecord& from, phs::State& s) {
  for (size_t i = 0; i < s.x.size(); ++i) {
    if (!from.known[i]) continue;
    s.x[i] = from.state.x[i];
    s.lo[i] = from.state.lo[i];
  }
  s.turns = from.state.turns;
}

}  // namespace porthos::scene
