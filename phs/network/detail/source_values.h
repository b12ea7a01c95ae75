#pragma once
#include <array>
#include <span>
#include <vector>

#include "phs/functions/of_time.h"
#include "phs/network/detail/network_plan.h"
#include "phs/scalars/lane.h"

/// The values of a network's sources.
namespace porthos::phs {

/// Keeps the values of the last few times, of sources that depend on time alone: an implicit step
/// asks for those of its stages at every sweep, and a sine takes as long as a joint.
template <class T>
class SourceValues {
 public:
  explicit SourceValues(const std::vector<Network::Plan::Source>& sources) : sources_(sources) {
    for (const auto& s : sources) {
      lasting_.push_back(dynamic_cast<const OfTimeAlone*>(s.v.get()) != nullptr);
      keeps_ = keeps_ || lasting_.back();
    }
    for (Kept& k : kept_) k.values.resize(sources.size());
  }

  /// Adds the sources to their rows of v.
  void add(const T& t, std::vector<T>& v) {
    const auto& values = at(t);
    for (size_t i = 0; i < values.size(); ++i) {
      T& to = v[size_t(sources_[i].row)];
      to = to + values[i];
    }
  }
  /// Writes their powers from powers[k] on. @return the index after the last
  size_t powers(const T& t, const std::vector<T>& y, std::span<T> powers, size_t k) {
    const auto& values = at(t);
    for (size_t i = 0; i < values.size(); ++i) powers[k++] = values[i] * y[size_t(sources_[i].row)];
    return k;
  }

 private:
  struct Kept {
    T t{0.0};
    std::vector<T> values;
    bool known = false;
  };

  const std::vector<T>& at(const T& t) {
    Kept& k = of(t);
    for (size_t i = 0; i < sources_.size(); ++i)
      if (!k.known || !lasting_[i]) k.values[i] = (*sources_[i].v)(t);
    k.t = t;
    k.known = keeps_;
    return k.values;
  }
  /// Where the values of this time are, or the oldest ones, no longer known.
  Kept& of(const T& t) {
    for (Kept& k : kept_)
      if (k.known && identical(k.t, t)) return k;
    Kept& oldest = kept_[next_];
    next_ = (next_ + 1) % kept_.size();
    oldest.known = false;
    return oldest;
  }

  const std::vector<Network::Plan::Source>& sources_;
  std::vector<bool> lasting_;  ///< by source: it depends on time alone
  bool keeps_ = false;
  std::array<Kept, 8> kept_;  ///< stages of a method
  size_t next_ = 0;
};

}  // namespace porthos::phs
